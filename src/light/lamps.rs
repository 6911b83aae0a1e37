//! Lamps: the lights of an integrator that samples all of them at each vertex.

use super::{LightBounds, LightTree};
use crate::math::Vec3;
use std::ops::Range;

/// A mesh that emits and has at least this many triangles is one lamp, of which one triangle is sampled.
///
/// Of smaller meshes every triangle is sampled, which leaves less noise: a vertex then takes 255 shadow rays for a mesh
/// at most, and about half as many if it is closed. With more triangles the time for a vertex would grow with detail
/// that the picture does not show.
pub const LEAST_TRIANGLES: usize = 256;

/// A mesh of many triangles that emits, as one lamp.
#[derive(Clone, Debug)]
pub struct MeshLamp {
    /// Its triangles in the light table.
    pub lights: Range<u32>,
    /// The tree that chooses among them, which counts them from zero.
    pub tree: LightTree,
}

impl MeshLamp {
    /// The lamp of a mesh of which these are the triangles, if it has enough of them.
    pub(super) fn new(lights: Range<u32>, bounds: &[LightBounds]) -> Option<MeshLamp> {
        let bounds = &bounds[lights.start as usize..lights.end as usize];
        (bounds.len() >= LEAST_TRIANGLES).then(|| MeshLamp { lights, tree: LightTree::new(bounds) })
    }

    /// Chooses a triangle for a point `p` on a surface with normal `n`, with `u` in [0, 1): its light and the
    /// probability of the choice.
    fn choose(&self, p: Vec3<f32>, n: Vec3<f32>, u: f32) -> (u32, f32) {
        let (light, chance) = self.tree.choose(p, n, u, true);
        (self.lights.start + light.0, chance)
    }
}

/// One lamp: a light of its own, or all triangles of a mesh that has many.
#[derive(Clone, Copy, Debug)]
pub enum Lamp<'a> {
    /// A light.
    Light(u32),
    /// A mesh.
    Mesh(&'a MeshLamp),
}

impl Lamp<'_> {
    /// The light to sample from a point `p` on a surface with normal `n`, and the probability of that choice. Only a
    /// mesh calls `draw`, which gives a number in [0, 1).
    pub fn choose(&self, p: Vec3<f32>, n: Vec3<f32>, draw: impl FnOnce() -> f32) -> (u32, f32) {
        match self {
            Lamp::Light(light) => (*light, 1.0),
            Lamp::Mesh(mesh) => mesh.choose(p, n, draw()),
        }
    }
}

/// The lamps of `lights` lights, some of which belong to `meshes`, in the order of the lights.
pub(super) fn lamps(lights: u32, meshes: &[MeshLamp]) -> impl Iterator<Item = Lamp<'_>> {
    let (mut next, mut meshes) = (0, meshes.iter().peekable());
    std::iter::from_fn(move || {
        if let Some(mesh) = meshes.next_if(|mesh| mesh.lights.start == next) {
            next = mesh.lights.end;
            return Some(Lamp::Mesh(mesh));
        }
        let light = next;
        next += 1;
        (light < lights).then_some(Lamp::Light(light))
    })
}
