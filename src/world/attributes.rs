//! Attributes of a surface other than its geometry.

/// The attributes of a surface other than its geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceAttributes {
    /// Row in the material table.
    pub material: u32,
    /// Radiance emitted on the outward side, W·m⁻²·sr⁻¹.
    pub emission: [f32; 3],
    /// Index of the texture of the emission, or [`NO_TEXTURE`](crate::texture::NO_TEXTURE).
    pub emission_texture: u32,
    /// Whether the outward side is the opposite of the shape's own.
    pub flip_normal: bool,
    /// Index of the entity in the scene.
    pub entity: u32,
    /// Index in the light table, or [`NO_LIGHT`](crate::light::NO_LIGHT).
    pub light: u32,
}

impl SurfaceAttributes {
    /// Whether it emits a constant radiance.
    pub(super) fn emits(&self) -> bool {
        self.emission.iter().any(|&e| e > 0.0)
    }
}
