//! Declarations of shapes, textures, materials and lights: each parameter is declared once, with its name, limits,
//! default and description.
//!
//! | file | what is in it |
//! |---|---|
//! | `value` | the values of parameters, and the types of the fields that hold them |
//! | `kind` | the types of values, and their limits |
//! | [`limits`] | common limits of parameters |
//! | `declaration` | declarations, and the macros `parameters!` and `family!` |
//!
//! The reader of scene files, the JSON Schema, the fingerprint and `stride info` are derived from the declarations.

mod declaration;
mod kind;
pub mod limits;
mod value;

pub use declaration::{Absence, Declaration, Declared, Family, Parameter, Problem};
pub(crate) use declaration::{family, parameters};
pub use kind::{Number, ParameterKind, unit};
pub(crate) use value::words;
pub use value::{Colour, Field, ImageIndex, Named, Value, Varying, Word};
