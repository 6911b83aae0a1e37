//! What a surface is but for its form.

/// The properties of a surface other than its form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// Row in the material table.
    pub material: u32,
    /// Radiance that leaves the outward side.
    pub emission: [f32; 3],
    /// The texture that this radiance is, or [`NO_TEXTURE`](crate::texture::NO_TEXTURE).
    pub emission_texture: u32,
    /// Whether outward is the other side.
    pub flip_normal: bool,
    /// Index of the entity in the scene.
    pub entity: u32,
    /// Index in the light table, or [`NO_LIGHT`](crate::light::NO_LIGHT).
    pub light: u32,
}

impl Look {
    /// Whether it emits light that is no texture.
    pub(super) fn emits(&self) -> bool {
        self.emission.iter().any(|&e| e > 0.0)
    }
}
