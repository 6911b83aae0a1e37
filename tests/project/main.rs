//! The project: documents, examples, the order of modules, and the public library.

mod docs;
mod examples;
mod inlined;
mod library;
mod rooms;
mod scene_schema;
