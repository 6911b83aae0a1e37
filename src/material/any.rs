//! The list of materials.

#[cfg(feature = "broken-material")]
use super::broken::BrokenParameters;
use super::checkerboard::CheckerboardParameters;
use super::glass::GlassParameters;
use super::matte::MatteParameters;
use super::mirror::MirrorParameters;
use crate::parameter::family;

family! {
    /// What a material does with light, as a scene describes it.
    pub enum MaterialKind {
        Matte(MatteParameters),
        Mirror(MirrorParameters),
        Glass(GlassParameters),
        Checkerboard(CheckerboardParameters),
        #[cfg(feature = "broken-material")]
        Broken(BrokenParameters),
    }
}
