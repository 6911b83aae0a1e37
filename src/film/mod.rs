//! The film: exact sums of samples, reconstruction filters, and the pictures made of them.

pub mod picture;

pub use picture::Picture;
