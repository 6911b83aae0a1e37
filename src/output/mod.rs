//! Output: everything that shows or keeps what was rendered, one sink per file.
//!
//! | sink | takes | is for |
//! |---|---|---|
//! | [`picture`]: [`png`], [`exr`], [`hdr`] | a finished [`Picture`](crate::film::Picture) | keeping and showing |
//! | [`npy`] | every sample | studying them in NumPy |
//! | [`film`] | the film's own words | going on, and merging |
//! | [`window`] | snapshots | watching |
//! | [`tev`] | snapshots | watching in tev |
//! | [`plot`] | measurements | charts |
//!
//! [`atomic`] puts files in place whole, `unfinished` knows those that are not, [`patience`] insists, [`progress`] is how far a run has come, [`human`] turns numbers into words, [`overlay`]
//! colours pixels by worker, [`read`] gets pictures back from files.

pub mod atomic;
pub mod error;
pub mod exr;
pub mod film;
pub mod hdr;
pub mod human;
pub mod npy;
pub mod options;
pub mod overlay;
pub mod patience;
pub mod picture;
pub mod plot;
pub mod png;
pub mod progress;
pub mod read;
pub mod tev;
mod unfinished;
pub mod window;

pub use error::OutputError;
pub use film::{FilmError, FilmFile, FilmSink, open_film, write_film};
pub use npy::SampleDump;
pub use options::{Crop, PictureOptions};
pub use overlay::{owner_overlay, write_owner_overlay};
pub use patience::Patience;
pub use picture::{Format, check_writable, numbered_path, suffixed_path, write_picture};
pub use progress::Progress;
pub use read::{ReadError, read_picture};
pub use tev::{Tev, TevError};
pub use unfinished::remove_unfinished;
