//! Output: the sinks and viewers of a render, one per file.
//!
//! | sink | input | purpose |
//! |---|---|---|
//! | [`picture`]: [`png`], [`exr`], [`hdr`] | a finished [`Picture`](crate::film::Picture) | picture files |
//! | [`npy`] | every sample | analysis in NumPy |
//! | [`film`] | the film's words | resuming and merging |
//! | [`window`] | snapshots | viewing |
//! | [`tev`] | snapshots | viewing in tev |
//! | [`plot`] | measurements | charts |
//!
//! [`atomic`] writes files completely or not at all, `unfinished` keeps a list of temporary files, [`retry`] retries
//! failed writes, [`progress`] is the progress of a run, [`human`] formats numbers, [`overlay`] colours pixels by
//! worker, and [`read`] reads picture files.

pub mod atomic;
pub mod error;
pub mod exr;
pub mod film;
pub mod hdr;
pub mod human;
pub mod npy;
pub mod options;
pub mod overlay;
pub mod picture;
pub mod plot;
pub mod png;
pub mod progress;
pub mod read;
pub mod retry;
pub mod tev;
mod unfinished;
pub mod window;

pub use error::OutputError;
pub use film::{FilmError, FilmFile, FilmSink, open_film, write_film};
pub use npy::SampleDump;
pub use options::{Crop, PictureOptions};
pub use overlay::{owner_overlay, write_owner_overlay};
pub use picture::{Format, check_writable, numbered_path, suffixed_path, write_picture};
pub use progress::Progress;
pub use read::{ReadError, read_picture};
pub use retry::RetryPolicy;
pub use tev::{Tev, TevError};
pub use unfinished::remove_unfinished;
