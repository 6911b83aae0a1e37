//! Image files and their tiles.

use super::decode::read;
use super::fault::PictureError;
use super::picture::Picture;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use thiserror::Error;

/// What stands for the numbers of tiles in the name of a file.
pub const UDIM: &str = "<UDIM>";

/// The number of the first tile.
const FIRST: u32 = 1001;

/// Tiles for each unit of v.
const ACROSS: u32 = 10;

/// An image file, or the tiles of one name.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFile {
    /// The path, as the scene names it.
    pub name: String,
    /// Whether the name stands for tiles.
    pub is_tiled: bool,
    /// The tiles, in the order of their numbers; of an image that is none of tiles one.
    pub tiles: Vec<Tile>,
}

/// A tile of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// From 1001 on: one more for each unit of u, ten more for each unit of v.
    pub number: u32,
    /// What is on it.
    pub picture: Arc<Picture>,
}

/// Where there is no tile.
static BLACK: LazyLock<Arc<Picture>> = LazyLock::new(|| Arc::new(Picture::black()));

impl ImageFile {
    /// An image that is one picture.
    pub fn of(name: String, picture: Arc<Picture>) -> ImageFile {
        ImageFile { name, is_tiled: false, tiles: vec![Tile { number: FIRST, picture }] }
    }

    /// The places that tiles may have: ten for each unit of v.
    pub(super) fn places(&self) -> usize {
        if !self.is_tiled {
            return 1;
        }
        let last = self.tiles.iter().map(|tile| tile.number).max().unwrap_or(FIRST);
        (((last - FIRST) / ACROSS + 1) * ACROSS) as usize
    }

    /// The picture at a place.
    pub(super) fn picture(&self, place: usize) -> &Arc<Picture> {
        let tile = self.tiles.iter().find(|tile| tile.number as usize == FIRST as usize + place);
        tile.map_or(&BLACK, |tile| &tile.picture)
    }
}

/// An image that could not be read.
#[derive(Debug, Error)]
pub enum FilesError {
    /// One of its files.
    #[error("{}: {error}", .path.display())]
    Picture {
        /// Which.
        path: PathBuf,
        /// Why.
        error: PictureError,
    },
    /// No file has the name of a tile.
    #[error("{}: there is no tile from 1001 to 1999 of this name", .path.display())]
    NoTile {
        /// The name.
        path: PathBuf,
    },
}

/// Reads the image that a scene calls `name`, relative to a folder.
pub fn read_files(folder: &Path, name: &str) -> Result<ImageFile, FilesError> {
    let one = |path: PathBuf| read(&path).map(Arc::new).map_err(|error| FilesError::Picture { path, error });
    if !name.contains(UDIM) {
        return Ok(ImageFile::of(name.to_owned(), one(folder.join(name))?));
    }
    let tiles = (FIRST..2000).map(|number| (number, folder.join(name.replace(UDIM, &number.to_string()))));
    let tiles = tiles.filter(|(_, path)| path.exists());
    let tiles: Result<Vec<_>, _> =
        tiles.map(|(number, path)| Ok(Tile { number, picture: one(path)? })).collect();
    let tiles = tiles?;
    if tiles.is_empty() {
        return Err(FilesError::NoTile { path: folder.join(name) });
    }
    Ok(ImageFile { name: name.to_owned(), is_tiled: true, tiles })
}
