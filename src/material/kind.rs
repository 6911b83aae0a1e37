//! The kinds of materials.

/// What a material is; the numbers are those of the GPU's `switch`. Kinds with a lobe that is not a delta come first.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Kind {
    /// [`super::Lambertian`].
    Matte = 0,
    /// [`super::Mirror`].
    Mirror = 1,
    /// [`super::Dielectric`].
    Glass = 2,
    /// Chooses one of two other materials.
    Checkerboard = 3,
    /// Returns values that no sample may have.
    #[cfg(feature = "broken-material")]
    Broken = 4,
}

impl Kind {
    /// The first kind all of whose lobes are deltas.
    pub(super) const FIRST_DELTA: u32 = Kind::Mirror as u32;
}
