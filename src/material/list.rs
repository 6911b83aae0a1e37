//! The list of materials.

use super::program::Described;
use super::row::Row;
use crate::parameter::family;

family! {
    /// The kind of a material with its parameters, as a scene describes it.
    pub enum MaterialKind {
        Matte(matte::MatteParameters),
        Mirror(mirror::MirrorParameters),
        Glass(glass::GlassParameters),
        Checkerboard(checkerboard::CheckerboardParameters),
        #[cfg(feature = "broken-material")]
        Broken(broken::BrokenParameters),
    }

    /// The row in which the material's program finds its parameters.
    pub fn row(&self) -> Row = material => material.row();
}
