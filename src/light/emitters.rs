//! Emitters: the units of an integrator that samples all lights at each vertex.

use super::{LightBounds, LightTree};
use crate::math::Vec3;
use std::ops::Range;

/// A light-emitting mesh with at least this many triangles is one emitter, of which one triangle is sampled.
///
/// In smaller meshes every triangle is sampled, which gives less noise. A vertex then needs at most 255 shadow rays for
/// a mesh, and about half as many for a closed one. With more triangles, the time per vertex would grow with detail
/// that the image does not show.
pub const LEAST_TRIANGLES: usize = 256;

/// A light-emitting mesh of many triangles, as one emitter.
#[derive(Clone, Debug)]
pub struct MeshEmitter {
    /// Its triangles in the light table.
    pub lights: Range<u32>,
    /// The tree that chooses among them; it numbers them from zero.
    pub tree: LightTree,
}

impl MeshEmitter {
    /// The emitter of a mesh with these triangles, if there are enough of them.
    pub(super) fn new(lights: Range<u32>, bounds: &[LightBounds]) -> Option<MeshEmitter> {
        let bounds = &bounds[lights.start as usize..lights.end as usize];
        (bounds.len() >= LEAST_TRIANGLES).then(|| MeshEmitter { lights, tree: LightTree::new(bounds) })
    }

    /// Chooses a triangle for a point `p` on a surface with normal `n`, with `u` in [0, 1). Returns its light and the
    /// pmf of the choice.
    fn choose(&self, p: Vec3<f32>, n: Vec3<f32>, u: f32) -> (u32, f32) {
        let (light, pmf) = self.tree.choose(p, n, u, true);
        (self.lights.start + light.0, pmf)
    }
}

/// An emitter: a single light, or all triangles of a mesh with many.
#[derive(Clone, Copy, Debug)]
pub enum Emitter<'a> {
    /// A light.
    Light(u32),
    /// A mesh.
    Mesh(&'a MeshEmitter),
}

impl Emitter<'_> {
    /// The light to sample from a point `p` on a surface with normal `n`, and the pmf of that choice. Only a mesh calls
    /// `draw`, which returns a number in [0, 1).
    pub fn choose(&self, p: Vec3<f32>, n: Vec3<f32>, draw: impl FnOnce() -> f32) -> (u32, f32) {
        match self {
            Emitter::Light(light) => (*light, 1.0),
            Emitter::Mesh(mesh) => mesh.choose(p, n, draw()),
        }
    }
}

/// The emitters of `lights` lights, some of which belong to `meshes`, in the order of the lights.
pub(super) fn emitters(lights: u32, meshes: &[MeshEmitter]) -> impl Iterator<Item = Emitter<'_>> {
    let (mut next, mut meshes) = (0, meshes.iter().peekable());
    std::iter::from_fn(move || {
        if let Some(mesh) = meshes.next_if(|mesh| mesh.lights.start == next) {
            next = mesh.lights.end;
            return Some(Emitter::Mesh(mesh));
        }
        let light = next;
        next += 1;
        (light < lights).then_some(Emitter::Light(light))
    })
}
