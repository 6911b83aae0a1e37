//! The film: exact sums of samples, reconstruction filters, and the pictures made of them.

pub mod adaptive;
pub mod compare;
pub mod cryptomatte;
pub mod develop;
pub mod file;
pub mod filter;
pub mod fixed;
pub mod flip;
pub mod holding;
pub mod identity;
pub mod layers;
mod layout;
mod metrics;
pub mod noise;
pub mod picture;
mod plane;
pub mod snapshot;
pub mod splat;
mod spread;
pub mod sums;
pub mod tone;
pub mod weights;

pub use adaptive::Plan;
pub use filter::film_offset;
pub use holding::{Holding, Ranges};
pub use identity::Identity;
pub use layers::{Channel, Layer};
pub use layout::{Layout, Rectangle};
pub use noise::Milestone;
pub use picture::Picture;
pub use snapshot::{Snapshot, Statistics};
pub use splat::{Band, Made, Splatter};
pub use sums::{Film, MemoryError, PixelSums, Reject, WideSums};
pub use tone::{ToneMap, ViewTransform};
pub use weights::Weights;
