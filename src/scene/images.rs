//! The image files of a scene, each of which is read once.

use crate::texture::{FilesError, ImageFile, MOST_BYTES_IN_ALL, read_files};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Images by path. Textures of one file share its pictures.
#[derive(Debug)]
pub(super) struct ImageCache {
    /// The folder that paths are relative to.
    folder: PathBuf,
    /// The index of each image that was read; `None` for unreadable ones.
    known: HashMap<PathBuf, Option<usize>>,
    images: Vec<ImageFile>,
    /// The remaining memory for pictures, in bytes.
    room: u64,
}

/// An image that cannot be read.
#[derive(Debug)]
pub(super) enum Unreadable {
    /// The reason, at the first attempt.
    First(FilesError),
    /// The same reason, which has been reported.
    Again,
}

impl ImageCache {
    /// An empty cache for paths relative to `folder`.
    pub(super) fn new(folder: &Path) -> ImageCache {
        ImageCache {
            folder: folder.into(),
            known: HashMap::new(),
            images: Vec::new(),
            room: MOST_BYTES_IN_ALL,
        }
    }

    /// The folder that paths are relative to.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// The index of an image file, which is read if it is new.
    pub(super) fn get(&mut self, file: &str) -> Result<usize, Unreadable> {
        let path = self.folder.join(file);
        if let Some(known) = self.known.get(&path) {
            return known.ok_or(Unreadable::Again);
        }
        let read = read_files(&self.folder, file, &mut self.room);
        let index = read.map(|image| {
            self.images.push(image);
            self.images.len() - 1
        });
        self.known.insert(path, index.as_ref().ok().copied());
        index.map_err(Unreadable::First)
    }

    /// The number of negative values in the pictures of an image, and of those that were not finite in the file.
    pub(super) fn odd_numbers(&self, image: usize) -> (u64, u64) {
        let pictures = self.images[image].tiles.iter().map(|tile| &tile.picture);
        pictures.fold((0, 0), |(negative, not_finite), picture| {
            (negative + picture.negative_numbers(), not_finite + picture.repaired_numbers())
        })
    }

    /// All images, in the order of their indices.
    pub(super) fn take(&mut self) -> Vec<ImageFile> {
        std::mem::take(&mut self.images)
    }
}
