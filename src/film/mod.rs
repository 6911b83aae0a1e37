//! The film: exact sums of samples, reconstruction filters, and the pictures made of them.

pub mod picture;
pub mod snapshot;
pub mod tone;

pub use picture::Picture;
pub use snapshot::Snapshot;
pub use tone::ToneMap;
