//! The processes of a render: workers that make samples, and the accumulator that owns the film.
//!
//! They share only the read-only scene and communicate over bounded channels. A full channel is back-pressure; a closed
//! one is the request to stop, in both directions. Workers also receive that request as a message, which they check in
//! the middle of a path: see [`worker::Worker::run_until`].

pub mod accumulator;
pub mod assignment;
pub mod batch;
mod channels;
pub mod faint;
pub mod layers;
mod outcome;
pub mod schedule;
pub mod stride;
pub mod worker;

pub use accumulator::{Accumulator, Barrier, Change, Configuration, Port};
pub use assignment::Assignment;
pub use batch::{FirstHits, Payload, SampleBatch, Traced};
pub use faint::Faint;
pub use layers::{FirstHitTracer, preview};
pub use schedule::{Dispatch, Order, Schedule};
pub use stride::Stride;
