//! Image files and their tiles.

use super::access;
use super::decode::read;
use super::fault::PictureError;
use super::picture::Picture;
use std::path::{Path, PathBuf};
use std::sync::{Arc, LazyLock};
use thiserror::Error;

/// The placeholder for the numbers of tiles in the name of a file.
pub const UDIM: &str = "<UDIM>";

/// The numbers of the first tile and of the last.
const FIRST: u32 = 1001;
const LAST: u32 = 1999;

/// The number of tiles per unit of v.
const ACROSS: u32 = 10;

/// An image file, or the tiles with one name.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFile {
    /// The path, as named in the scene.
    pub name: String,
    /// Whether the name stands for tiles.
    pub is_tiled: bool,
    /// The tiles, in the order of their numbers; an image without tiles has one, with the number 1001.
    pub tiles: Vec<Tile>,
}

/// A tile of an image.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// From 1001 to 1999: one more per unit of u, ten more per unit of v.
    pub number: u32,
    /// Its picture.
    pub picture: Arc<Picture>,
}

/// The error of a set of tiles.
static BLACK: LazyLock<Arc<Picture>> = LazyLock::new(|| Arc::new(Picture::black()));

impl ImageFile {
    /// An image that is one picture.
    pub fn of(name: String, picture: Arc<Picture>) -> ImageFile {
        ImageFile { name, is_tiled: false, tiles: vec![Tile { number: FIRST, picture }] }
    }

    /// The error of the tiles, if there is one.
    pub(crate) fn objection(&self) -> Option<String> {
        let numbers: Vec<u32> = self.tiles.iter().map(|tile| tile.number).collect();
        if !self.is_tiled {
            let message = || format!("an image without tiles has one picture, with the number {FIRST}");
            return (numbers != [FIRST]).then(message);
        }
        if numbers.is_empty() {
            return Some("an image has no tiles".to_owned());
        }
        for (i, number) in numbers.iter().enumerate() {
            if !(FIRST..=LAST).contains(number) {
                return Some(format!("the number of a tile must be from {FIRST} to {LAST}, not {number}"));
            }
            if numbers[..i].contains(number) {
                return Some(format!("an image has two tiles with the number {number}"));
            }
        }
        None
    }

    /// The number of possible tiles: ten per unit of v.
    pub(super) fn places(&self) -> usize {
        if !self.is_tiled {
            return 1;
        }
        let last = self.tiles.iter().map(|tile| tile.number).max().unwrap_or(FIRST);
        (((last - FIRST) / ACROSS + 1) * ACROSS) as usize
    }

    /// The picture at a position.
    pub(super) fn picture(&self, place: usize) -> &Arc<Picture> {
        let tile = self.tiles.iter().find(|tile| tile.number as usize == FIRST as usize + place);
        tile.map_or(&BLACK, |tile| &tile.picture)
    }
}

/// An image that could not be read.
#[derive(Debug, Error)]
pub enum FilesError {
    /// One of its files could not be read.
    #[error("{}: {error}", .path.display())]
    Picture {
        /// The path of the file.
        path: PathBuf,
        /// The error.
        error: PictureError,
    },
    /// There is no file for any tile of this name.
    #[error("{}: there are no tiles from {first} to {last} with this name", .path.display(), first = FIRST, last = LAST)]
    NoTile {
        /// The name.
        path: PathBuf,
    },
}

/// Reads the image called `name` in a scene, relative to a directory, into at most `room` bytes, which it decreases by
/// those used.
///
/// # Errors
///
/// If a file cannot be read, has no picture, or needs more memory than is left.
pub fn read_files(folder: &Path, name: &str, room: &mut u64) -> Result<ImageFile, FilesError> {
    let mut one = |path: PathBuf| match read(&path, *room) {
        Ok(picture) => {
            *room = room.saturating_sub(picture.bytes() as u64);
            Ok(Arc::new(picture))
        }
        Err(error) => Err(FilesError::Picture { path, error }),
    };
    if !name.contains(UDIM) {
        return Ok(ImageFile::of(name.to_owned(), one(access::named(folder, name))?));
    }
    let of = |number: u32| access::named(folder, &name.replace(UDIM, &number.to_string()));
    let tiles = (FIRST..=LAST).map(|number| (number, of(number)));
    let tiles = tiles.filter(|(_, path)| path.exists());
    let tiles: Result<Vec<_>, _> =
        tiles.map(|(number, path)| Ok(Tile { number, picture: one(path)? })).collect();
    let tiles = tiles?;
    if tiles.is_empty() {
        return Err(FilesError::NoTile { path: folder.join(name) });
    }
    Ok(ImageFile { name: name.to_owned(), is_tiled: true, tiles })
}
