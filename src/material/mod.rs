//! Materials, and their scattering functions at a point.
//!
//! A material is a program in a file of its own. A [`Leaf`] makes a lobe of its row's numbers; a [`Chooser`] leads to
//! another row. `modifiers.rs` has the parameters that all materials share, `walk.rs` follows rows to the one that
//! scatters light, and `maps.rs` evaluates normal and bump maps. A new material needs a new file, a `mod` line here,
//! and a line in `kind.rs`, which lists all of them. `lobes/` has a file for each scattering function. `bindings.rs`
//! replaces parameters by textures, independently of the material. [`Bxdf`] is the interface that integrators use;
//! [`MaterialTable`] finds the [`Bsdf`] of a hit.

mod bindings;
#[cfg(feature = "broken-material")]
mod broken;
mod bsdf;
mod bxdf;
mod checkerboard;
mod conductor;
mod dielectric;
mod glass;
mod kind;
pub(crate) mod list;
mod lobes;
mod maps;
mod matte;
mod media;
mod metals;
mod mirror;
mod mix;
mod modifiers;
mod program;
mod row;
mod table;
mod walk;

pub use bindings::{Binding, Bindings, ParameterSlot, Slot, with_placeholders};
pub use bsdf::{Bsdf, Local};
pub use bxdf::{Branch, Bxdf, BxdfSample, TransportMode};
pub use kind::{Kind, Kinds};
pub use list::*;
pub use lobes::{
    Ggx, LEAST_ALPHA, Lambertian, Metal, OrenNayar, RoughDielectric, RoughMetal, RoughSheet, Sheet,
    SmoothDielectric, SmoothMetal, SmoothSheet, SpecularReflection, Sum, fresnel_conductor,
    fresnel_dielectric,
};
pub use maps::UvBasis;
pub use media::{MOST_INTERIORS, MOST_MEDIA, Media};
pub use modifiers::{ModifierColumns, Modifiers, RowModifiers, is_evaluated_directly};
pub use program::{Chooser, Leaf, MaterialParameters};
pub use row::{CHOICES, Columns, Medium, NUMBERS, Numbers, Row, Site};
pub use table::MaterialTable;
pub use walk::Walked;

macro_rules! export {
    (
        {}
        leaves { $($(#[$leaf_cfg:meta])* $leaf_module:ident::$Leaf:ident $(($leaf_parameters:ident))?,)* }
        choosers { $($(#[$chooser_cfg:meta])* $chooser_module:ident::$Chooser:ident($chooser_parameters:ident),)* }
    ) => {
        $($(#[$leaf_cfg])* pub use $leaf_module::$Leaf;)*
        $($(#[$chooser_cfg])* pub use $chooser_module::$Chooser;)*
    };
}
kind::materials!(export);
