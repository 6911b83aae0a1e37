//! The list of materials.

use crate::parameter::family;

family! {
    /// What a material does with light, as a scene describes it.
    pub enum MaterialKind as dyn super::Described {
        Matte(matte::MatteParameters),
        Mirror(mirror::MirrorParameters),
        Glass(glass::GlassParameters),
        Checkerboard(checkerboard::CheckerboardParameters),
        #[cfg(feature = "broken-material")]
        Broken(broken::BrokenParameters),
    }
}
