//! Rules for the sources: the imports of modules, and the construction of rays.

mod circles;
mod order;
mod paths;
mod rays;
mod sources;
mod tokens;
