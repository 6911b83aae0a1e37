//! Every light of a scene: the table from which each lane can look up another one, and the choice among them.

use super::area::AreaLight;
use super::bounds::LightBounds;
use super::columns::{Columns, LaneLights};
use super::contract::{LightList, Listed};
use super::distant_picture::{DistantPicture, Surroundings};
use super::environment::Environment;
use super::kinds::{self, LightKind};
use super::lamps::{self, Lamp, MeshLamp};
use super::sample::{EmittedRay, LightSample};
use super::textured_quad::TexturedQuad;
use super::tree::LightTree;
use super::triangle::Triangle;
use crate::math::{BELOW_ONE, Bounds, ColumnReader, Float, Mask, Rgb, Uint, Vec3};
use crate::sampling::Grids;
use crate::shape::{Piece, Rare};
use crate::texture::TextureTable;
use std::ops::Range;
use std::sync::Arc;

/// The index of a surface that is not sampled as a light.
pub const NO_LIGHT: u32 = u32::MAX;

/// All lights, one column for each property, and the tree that chooses among those that have a place.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    columns: Columns,
    bounds: Vec<LightBounds>,
    tree: LightTree,
    /// The delta lights.
    delta: Vec<u32>,
    /// How many there are.
    delta_count: u32,
    /// The lights at infinity, which are not in the tree.
    infinite: Vec<u32>,
    groups: Groups,
    /// The environment behind all lights.
    environment: Environment,
    /// The lights of each mesh that emits.
    meshes: Vec<Range<u32>>,
    /// Meshes of which [`LightTable::lamps`] gives one light.
    mesh_lamps: Vec<MeshLamp>,
    has_bulging_mesh: bool,
}

/// The equally likely groups that [`LightTable::choose`] chooses among first: each light at infinity is one, and all
/// lights of the tree together are one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Groups {
    /// How many lights are at infinity.
    pub infinite: u32,
    /// How many groups there are.
    pub count: u32,
    /// The chance of each.
    pub share: f32,
}

impl Groups {
    fn new(infinite: u32, lights: u32) -> Groups {
        let count = infinite + u32::from(infinite < lights);
        Groups { infinite, count, share: 1.0 / count as f32 }
    }
}

impl LightList for LightTable {
    fn add<L: Listed>(&mut self, light: L) -> u32 {
        self.push(light)
    }
}

impl LightTable {
    /// Adds a light and returns its index.
    pub fn push<L: Listed>(&mut self, light: L) -> u32 {
        let index = self.len() as u32;
        let bounds = light.bounds();
        assert_eq!(bounds.is_none(), L::INFINITE, "lights at infinity have no bounds, and others have");
        self.columns.push(L::KIND, &light.row());
        self.bounds.push(bounds.unwrap_or_default());
        if L::DELTA {
            self.delta.push(index);
            self.delta_count += 1;
        }
        if L::INFINITE {
            self.infinite.push(index);
        }
        self.groups = Groups::new(self.infinite.len() as u32, self.len() as u32);
        index
    }

    /// Adds a piece of a shape that emits on its outward side, or on the other if it is `flipped`. Returns its index,
    /// or [`NO_LIGHT`] for planes and other pieces that are not sampled, which paths find by chance.
    pub fn push_piece(&mut self, piece: &Piece, flipped: bool, emission: [f32; 3]) -> u32 {
        match *piece {
            Piece::Sphere(shape) => self.push(AreaLight { shape, flipped, emission }),
            Piece::Quad(shape) => self.push(AreaLight { shape, flipped, emission }),
            Piece::Rare(Rare::Disk(shape)) => self.push(AreaLight { shape, flipped, emission }),
            Piece::Rare(Rare::Cylinder(shape)) => self.push(AreaLight { shape, flipped, emission }),
            #[allow(unreachable_patterns, reason = "a rare shape that is not sampled need not be listed")]
            Piece::Plane(_) | Piece::Rare(_) => NO_LIGHT,
        }
    }

    /// Sets the textures that lights emit.
    pub fn set_textures(&mut self, textures: Arc<TextureTable>) {
        self.columns.textures = textures;
    }

    /// Adds a piece of a shape that emits one of the textures. Returns its index, or [`NO_LIGHT`] for those that are dark
    /// and for all but quads, which paths find by chance.
    pub fn push_textured(&mut self, piece: &Piece, flipped: bool, texture: u32) -> u32 {
        let Piece::Quad(quad) = *piece else { return NO_LIGHT };
        let textures = Arc::clone(&self.columns.textures);
        let light = TexturedQuad::new(quad, flipped, texture, &textures, &mut self.columns.grids);
        light.map_or(NO_LIGHT, |light| self.push(light))
    }

    /// Adds a picture of what is all around, one of the textures. Returns its index, or [`NO_LIGHT`] if it is dark.
    ///
    /// # Panics
    ///
    /// If the texture is no image, or there is such a picture already.
    pub fn push_surroundings(&mut self, around: &Surroundings) -> u32 {
        let textures = Arc::clone(&self.columns.textures);
        let light = DistantPicture::new(around, &textures, &mut self.columns.grids);
        light.map_or(NO_LIGHT, |light| self.push(light))
    }

    /// The grids by which points of textures are drawn.
    pub fn grids(&self) -> &Grids {
        &self.columns.grids
    }

    /// Adds the triangles of a mesh whose outward side emits `emission` and returns the first one's index.
    pub fn push_mesh(
        &mut self,
        triangles: impl Iterator<Item = [[f32; 3]; 3]>,
        flipped: bool,
        emission: [f32; 3],
    ) -> u32 {
        let first = self.len() as u32;
        for corners in triangles {
            let light = self.push(AreaLight { shape: Triangle(corners), flipped, emission });
            self.bounds[light as usize].mesh = Some(first);
        }
        self.meshes.push(first..self.len() as u32);
        first
    }

    /// Sets the environment, which rays that leave the scene see behind all lights at infinity.
    pub fn set_environment(&mut self, environment: Environment) {
        self.environment = environment;
    }

    /// The environment, which rays that leave the scene see behind all lights at infinity.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Says how far the scene reaches: lights at infinity send rays to all of a box (see [`LaneLights::extent`]).
    pub fn set_extent(&mut self, around: Bounds) {
        self.columns.set_extent(around);
    }

    /// The lights that have a place.
    fn bounded(&self) -> Vec<u32> {
        (0..self.len() as u32).filter(|light| !self.infinite.contains(light)).collect()
    }

    /// Builds the tree that chooses among the lights, once all have been added.
    pub fn build_tree(&mut self) {
        self.tree = LightTree::of(&self.bounds, self.bounded());
    }

    /// Makes one lamp of each mesh that emits and has many triangles, once all lights have been added (see
    /// [`super::LEAST_TRIANGLES`]).
    pub fn build_lamps(&mut self) {
        let lamps = self.meshes.iter().filter_map(|lights| MeshLamp::new(lights.clone(), &self.bounds));
        self.mesh_lamps = lamps.collect();
    }

    /// The lamps, in the order of their lights: each light is one, but all triangles of a mesh with many are one lamp.
    pub fn lamps(&self) -> impl Iterator<Item = Lamp<'_>> {
        lamps::lamps(self.len() as u32, &self.mesh_lamps)
    }

    /// The meshes that are lamps.
    pub fn mesh_lamps(&self) -> &[MeshLamp] {
        &self.mesh_lamps
    }

    /// Builds a tree that chooses every light with the same probability from everywhere, to compare the other one with.
    pub fn build_uniform_tree(&mut self) {
        // Equal powers, and a spread so large that every point is among the lights: all have the same importance.
        let everywhere =
            LightBounds { lo: [-1e6; 3], hi: [1e6; 3], spread: 1e12, power: 1.0, ..LightBounds::default() };
        self.tree = LightTree::of(&vec![everywhere; self.len()], self.bounded());
    }

    /// Sets whether all triangles in the scene are lights of one mesh that bulges: no point in front of a triangle is
    /// hidden from it by another.
    pub fn set_bulging_mesh(&mut self, has_bulging_mesh: bool) {
        self.has_bulging_mesh = has_bulging_mesh;
    }

    /// How many lights there are.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.columns.len() == 0
    }

    /// The kinds of its lights.
    pub fn kinds(&self) -> impl Iterator<Item = LightKind> + '_ {
        LightKind::ALL.iter().copied().filter(|&kind| self.columns.has(kind as u32))
    }

    /// Gives the columns of all lights to a reader; whether a light shines inwards, and whether a quad is square, is 1
    /// for yes and 0 for no.
    pub fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        self.columns.columns(reader);
    }

    /// The tree that chooses among the lights.
    pub fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// The delta lights (see [`Light::DELTA`](super::Light::DELTA)).
    pub fn delta_lights(&self) -> &[u32] {
        &self.delta
    }

    /// The groups of lights that are chosen among first. By reference, likewise.
    pub fn groups(&self) -> &Groups {
        &self.groups
    }

    /// Centre and radius of a ball around the scene (see [`LaneLights::extent`]). By reference: recorded programs know a
    /// number by its address.
    pub fn extent(&self) -> &([f32; 3], f32) {
        self.columns.extent()
    }

    /// How many delta lights there are. By reference: recorded programs know a number by its address.
    pub fn delta_count(&self) -> &u32 {
        &self.delta_count
    }

    /// The lights at infinity (see [`Light::INFINITE`](super::Light::INFINITE)).
    pub fn infinite_lights(&self) -> &[u32] {
        &self.infinite
    }

    /// The lanes whose light cannot be hidden by triangles: the light is a triangle of a mesh that bulges, and the
    /// scene has no other mesh. Shadow rays to it need not be tested against triangles, which would be most of their
    /// cost.
    #[inline(always)]
    pub fn is_past_triangles<F: Float>(&self, light: F::Uint) -> F::Mask {
        if !self.has_bulging_mesh {
            return F::Mask::splat(false);
        }
        self.columns.are::<F>(light, LightKind::Triangle as u32)
    }

    /// Whether some light is at infinity.
    #[inline(always)]
    fn has_infinite(&self) -> bool {
        kinds::ANY_INFINITE && !self.infinite.is_empty()
    }

    /// Chooses a light for a point `p` on a surface with normal `n`, with `u` in [0, 1): its index and the
    /// probability of the choice. Where no light can contribute, it is any of them. Lanes outside `asks` are
    /// unspecified.
    ///
    /// Each light at infinity has the same chance as all others together, among which the tree chooses (Pharr, Jakob
    /// and Humphreys 2023, §12.6.3).
    #[inline(always)]
    pub fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, asks: F::Mask) -> (F::Uint, F) {
        let (mut in_tree, mut rest, mut infinite) = (asks, u, F::Uint::splat(0));
        let has_infinite = self.has_infinite();
        if has_infinite {
            let count = F::Uint::given(&self.groups.count);
            let scaled = u * count.to_float();
            // A product that rounds up to the number of groups still means the last one. Adding all bits subtracts one.
            let last = count + F::Uint::splat(u32::MAX);
            let group = scaled.to_uint();
            let group = F::Uint::select(group.lt(last), group, last);
            rest = (scaled - group.to_float()).min(F::splat(BELOW_ONE));
            in_tree = asks & !group.lt(F::Uint::given(&self.groups.infinite));
            infinite = F::Uint::gather(&self.infinite, group);
        }
        // Once in the code, as it is long. A tree without lights has no root, which the GPU would look for in any case.
        let (light, chance) = F::guard(
            in_tree,
            (F::Uint::splat(0), F::zero()),
            #[inline(always)]
            || self.tree.choose(p, n, rest, in_tree),
        );
        if !has_infinite {
            return (light, chance);
        }
        let share = F::given(&self.groups.share);
        (F::Uint::select(in_tree, light, infinite), F::select(in_tree, chance * share, share))
    }

    /// The probability with which [`LightTable::choose`] chooses a light. Lanes outside `asks` are unspecified.
    #[inline(always)]
    pub fn chance<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, asks: F::Mask) -> F {
        let has_infinite = self.has_infinite();
        let mut in_tree = asks;
        if has_infinite {
            in_tree = asks & !kinds::are_infinite::<F>(&self.columns, light);
        }
        let chance = F::guard(
            in_tree,
            F::zero(),
            #[inline(always)]
            || self.tree.chance(p, n, light, in_tree),
        );
        if !has_infinite {
            return chance;
        }
        let share = F::given(&self.groups.share);
        F::select(in_tree, chance * share, share)
    }

    /// A direction from `p` to a light, drawn with `u` in [0, 1)².
    #[inline(always)]
    pub fn sample<F: Float>(&self, light: F::Uint, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        let lights = LaneLights::new(&self.columns, light);
        let emission = lights.emission();
        kinds::sample::<F, false>(&lights, p, emission, u)
    }

    /// A direction from `p` to a delta light, drawn uniformly among them with `choice` in [0, 1), its radiance
    /// multiplied by their number. There must be one (see [`LightTable::delta_lights`]).
    #[inline(always)]
    pub fn sample_delta<F: Float>(&self, p: Vec3<F>, choice: F) -> LightSample<F> {
        let count = F::Uint::given(&self.delta_count);
        let index = (choice * count.to_float()).to_uint();
        // A product that rounds up to `count` still means the last light. Adding all bits subtracts one.
        let last = count + F::Uint::splat(u32::MAX);
        let index = F::Uint::select(index.lt(last), index, last);
        let lights = LaneLights::new(&self.columns, F::Uint::gather(&self.delta, index));
        let emission = lights.emission() * count.to_float();
        kinds::sample::<F, true>(&lights, p, emission, [F::zero(); 2])
    }

    /// Density by solid angle with which [`LightTable::sample`] from `p` would have drawn the direction
    /// `wi`, given that a ray along it met the light at the point `on` at distance `t`, on the side that emits, with the
    /// cosine `cos_light` between the outward normal there and the way back. Delta lights are never met, nor those at
    /// infinity.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, light: F::Uint, p: Vec3<F>, on: Vec3<F>, t: F, cos_light: F) -> F {
        let lights = LaneLights::new(&self.columns, light);
        let by_area = t * t / (cos_light * lights.area());
        kinds::pdf(&lights, p, on, t, cos_light, by_area)
    }

    /// Radiance along a ray that leaves the scene in the direction `d`. The radiance of each light at infinity is
    /// multiplied by `weight` of its density, with which [`LightTable::choose`] and [`LightTable::sample`] together
    /// would have drawn the direction from that light. Lights that are never drawn, and the environment, count in full.
    #[inline(always)]
    pub fn escaped<F: Float>(&self, d: Vec3<F>, weight: impl Fn(F) -> F) -> Rgb<F> {
        let mut radiance = Rgb::given(&self.environment.radiance);
        if self.has_infinite() {
            let share = F::given(&self.groups.share);
            for &light in &self.infinite {
                let kind = self.columns.kinds()[light as usize];
                if !kinds::are_seen(kind) {
                    continue;
                }
                let lights = LaneLights::new(&self.columns, F::Uint::splat(light));
                let escaped = kinds::escaped(kind, &lights, lights.emission(), d);
                let drawn = escaped.pdf.gt(F::zero());
                let weight = F::select(drawn, weight(escaped.pdf * share), F::splat(1.0));
                radiance = radiance + escaped.radiance * weight;
            }
        }
        radiance
    }

    /// A ray that leaves a light, drawn with `u` in [0, 1)⁴.
    #[inline(always)]
    pub fn emit<F: Float>(&self, light: F::Uint, u: [F; 4]) -> EmittedRay<F> {
        let lights = LaneLights::new(&self.columns, light);
        kinds::emit(&lights, lights.emission(), u)
    }
}

#[cfg(test)]
mod tests;
