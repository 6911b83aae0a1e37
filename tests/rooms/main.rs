//! Rules that the sources keep: which modules import which, and where rays are made.

mod circles;
mod order;
mod paths;
mod rays;
mod sources;
mod tokens;
