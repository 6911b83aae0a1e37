//! All lights of a scene: the table in which each lane can look up a different one, and the choice among them.

use super::area::AreaLight;
use super::bounds::LightBounds;
use super::columns::{Columns, LaneLights};
use super::contract::{LightList, ListedLight};
use super::corner_uv::{CornerUv, UvTriangle};
use super::emitters::{self, Emitter, MeshEmitter};
use super::environment::Environment;
use super::environment_map::{EnvironmentMap, EnvironmentMapParameters};
use super::kinds::{self, LightKind};
use super::sample::{EmittedRay, LightSample};
use super::textured_quad::TexturedQuad;
use super::textured_round::TexturedRound;
use super::textured_triangle::textured_mesh;
use super::tree::LightTree;
use super::triangle::Triangle;
use crate::math::{BELOW_ONE, Bounds, ColumnReader, Float, Mask, Rgb, Uint, Vec3};
use crate::sampling::Grids;
use crate::shape::{CustomShape, Piece};
use crate::texture::TextureTable;
use std::ops::Range;
use std::sync::Arc;

/// The index of a surface that is not sampled as a light.
pub const NO_LIGHT: u32 = u32::MAX;

/// All lights, one column for each property, and the tree that chooses among the bounded ones.
#[derive(Clone, Debug, Default)]
pub struct LightTable {
    columns: Columns,
    bounds: Vec<LightBounds>,
    tree: LightTree,
    /// The delta lights.
    delta: Vec<u32>,
    /// Their number.
    delta_count: u32,
    /// The lights at infinity, which are not in the tree.
    infinite: Vec<u32>,
    groups: LightGroups,
    /// The environment behind all lights.
    environment: Environment,
    /// The lights of each mesh that emits.
    meshes: Vec<Range<u32>>,
    /// The meshes that [`LightTable::emitters`] returns as one emitter each.
    mesh_emitters: Vec<MeshEmitter>,
    has_convex_emitter: bool,
}

/// The equally likely groups among which [`LightTable::choose`] chooses first: each light at infinity is one, and all
/// lights of the tree together are one.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LightGroups {
    /// The number of lights at infinity.
    pub infinite: u32,
    /// The number of groups.
    pub count: u32,
}

impl LightGroups {
    fn new(infinite: u32, lights: u32) -> LightGroups {
        LightGroups { infinite, count: infinite + u32::from(infinite < lights) }
    }
}

impl LightList for LightTable {
    fn add<L: ListedLight>(&mut self, light: L) -> u32 {
        self.push(light)
    }
}

impl LightTable {
    /// Adds a light and returns its index.
    pub fn push<L: ListedLight>(&mut self, light: L) -> u32 {
        let index = self.len() as u32;
        let bounds = light.bounds();
        assert_eq!(bounds.is_none(), L::INFINITE, "exactly lights at infinity have no bounds");
        self.columns.push(L::KIND, &light.row());
        self.bounds.push(bounds.unwrap_or_default());
        if L::DELTA {
            self.delta.push(index);
            self.delta_count += 1;
        }
        if L::INFINITE {
            self.infinite.push(index);
        }
        self.groups = LightGroups::new(self.infinite.len() as u32, self.len() as u32);
        index
    }

    /// Adds a piece of a shape that emits on its outward side, or on the other one if it is `flipped`. Returns its
    /// index, or [`NO_LIGHT`] for planes and other pieces that are not sampled, which paths only hit by chance.
    pub fn push_piece(&mut self, piece: &Piece, flipped: bool, emission: [f32; 3]) -> u32 {
        match *piece {
            Piece::Sphere(shape) => self.push(AreaLight { shape, flipped, emission }),
            Piece::Quad(shape) => self.push(AreaLight { shape, flipped, emission }),
            Piece::Custom(CustomShape::Disk(shape)) => self.push(AreaLight { shape, flipped, emission }),
            Piece::Custom(CustomShape::Cylinder(shape)) => self.push(AreaLight { shape, flipped, emission }),
            #[allow(unreachable_patterns, reason = "custom shapes that are not sampled need not be listed")]
            Piece::Plane(_) | Piece::Custom(_) => NO_LIGHT,
        }
    }

    /// Sets the textures that lights emit.
    pub fn set_textures(&mut self, textures: Arc<TextureTable>) {
        self.columns.textures = textures;
    }

    /// Adds a piece of a shape that emits one of the textures. Returns its index, or [`NO_LIGHT`] if it is black, or a
    /// plane or another piece that is not sampled, which paths only hit by chance.
    pub fn push_textured(&mut self, piece: &Piece, flipped: bool, texture: u32) -> u32 {
        let textures = Arc::clone(&self.columns.textures);
        let grids = &mut self.columns.grids;
        let round = match *piece {
            Piece::Quad(quad) => {
                let light = TexturedQuad::new(quad, flipped, texture, &textures, grids);
                return light.map_or(NO_LIGHT, |light| self.push(light));
            }
            Piece::Sphere(sphere) => TexturedRound::sphere(sphere, flipped, texture, &textures, grids),
            Piece::Custom(CustomShape::Disk(disk)) => {
                TexturedRound::disk(disk, flipped, texture, &textures, grids)
            }
            Piece::Custom(CustomShape::Cylinder(cylinder)) => {
                TexturedRound::cylinder(cylinder, flipped, texture, &textures, grids)
            }
            #[allow(unreachable_patterns, reason = "custom shapes that are not sampled need not be listed")]
            Piece::Plane(_) | Piece::Custom(_) => None,
        };
        round.map_or(NO_LIGHT, |light| self.push(light))
    }

    /// Adds an environment map with one of the textures. Returns its index, or [`NO_LIGHT`] if it is black.
    ///
    /// # Panics
    ///
    /// If the texture is not an image, or there is an environment map already.
    pub fn push_environment_map(&mut self, around: &EnvironmentMapParameters) -> u32 {
        let textures = Arc::clone(&self.columns.textures);
        let light = EnvironmentMap::new(around, &textures, &mut self.columns.grids);
        light.map_or(NO_LIGHT, |light| self.push(light))
    }

    /// The grids by which points of textures are sampled.
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

    /// Adds the triangles of a mesh whose outward side emits one of the textures. Returns the index of the first one, or
    /// [`NO_LIGHT`] if all are black.
    pub fn push_textured_mesh(&mut self, triangles: &[UvTriangle], flipped: bool, texture: u32) -> u32 {
        let textures = Arc::clone(&self.columns.textures);
        let lights = textured_mesh(triangles, flipped, texture, &textures, &mut self.columns.corner_uv);
        if lights.is_empty() {
            return NO_LIGHT;
        }
        let first = self.len() as u32;
        for light in lights {
            let index = self.push(light);
            self.bounds[index as usize].mesh = Some(first);
        }
        self.meshes.push(first..self.len() as u32);
        first
    }

    /// The uv of the corners of textured triangles.
    pub fn corner_uv(&self) -> &CornerUv {
        &self.columns.corner_uv
    }

    /// Sets the environment, which rays that leave the scene see behind all lights at infinity.
    pub fn set_environment(&mut self, environment: Environment) {
        self.environment = environment;
    }

    /// The environment, which rays that leave the scene see behind all lights at infinity.
    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    /// Sets the extent of the scene: lights at infinity send rays to the whole of a box (see [`LaneLights::extent`]).
    pub fn set_extent(&mut self, around: Bounds) {
        self.columns.set_extent(around);
    }

    /// The bounded lights.
    fn bounded(&self) -> Vec<u32> {
        (0..self.len() as u32).filter(|light| !self.infinite.contains(light)).collect()
    }

    /// Builds the tree that chooses among the lights, once all have been added.
    pub fn build_tree(&mut self) {
        self.tree = LightTree::of(&self.bounds, self.bounded());
    }

    /// Makes one emitter of each light-emitting mesh with many triangles, once all lights have been added (see
    /// [`super::LEAST_TRIANGLES`]).
    pub fn build_emitters(&mut self) {
        let emitters = self.meshes.iter().filter_map(|lights| MeshEmitter::new(lights.clone(), &self.bounds));
        self.mesh_emitters = emitters.collect();
    }

    /// The emitters in the order of their lights. Each light is one, but all triangles of a mesh with many are one
    /// together.
    pub fn emitters(&self) -> impl Iterator<Item = Emitter<'_>> {
        emitters::emitters(self.len() as u32, &self.mesh_emitters)
    }

    /// The meshes that are one emitter each.
    pub fn mesh_emitters(&self) -> &[MeshEmitter] {
        &self.mesh_emitters
    }

    /// Builds a tree that chooses every light with the same probability from everywhere, for comparison with the other
    /// one.
    pub fn build_uniform_tree(&mut self) {
        // With equal powers and a spread so large that all points are among the lights, all have the same importance.
        let everywhere =
            LightBounds { lo: [-1e6; 3], hi: [1e6; 3], spread: 1e12, power: 1.0, ..LightBounds::default() };
        self.tree = LightTree::of(&vec![everywhere; self.len()], self.bounded());
    }

    /// Sets whether all triangles of the scene are lights of a single convex mesh: no triangle can then occlude another
    /// from a point in front of it.
    pub fn set_convex_emitter(&mut self, has_convex_emitter: bool) {
        self.has_convex_emitter = has_convex_emitter;
    }

    /// The number of lights.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.columns.len() == 0
    }

    /// The kinds of its lights.
    pub fn kinds(&self) -> impl Iterator<Item = LightKind> + '_ {
        LightKind::ALL.iter().copied().filter(|&kind| self.columns.has(kind as u32))
    }

    /// Visits the columns of all lights. Whether a light emits inwards, and whether a quad is a rectangle, is 1 for yes
    /// and 0 for no.
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

    /// The groups of lights among which the first choice is made. By reference, like [`LightTable::extent`].
    pub fn groups(&self) -> &LightGroups {
        &self.groups
    }

    /// The centre and radius of a ball around the scene (see [`LaneLights::extent`]). By reference, because recorded
    /// programs identify a number by its address.
    pub fn extent(&self) -> &([f32; 3], f32) {
        self.columns.extent()
    }

    /// The number of delta lights. By reference, because recorded programs identify a number by its address.
    pub fn delta_count(&self) -> &u32 {
        &self.delta_count
    }

    /// The lights at infinity (see [`Light::INFINITE`](super::Light::INFINITE)).
    pub fn infinite_lights(&self) -> &[u32] {
        &self.infinite
    }

    /// The lanes whose light cannot be occluded by triangles: the light is a triangle of a convex mesh, and the scene
    /// has no other mesh. Shadow rays to it need not be tested against triangles, which would be most of their cost.
    #[inline(always)]
    pub fn is_convex_emitter<F: Float>(&self, light: F::Uint) -> F::Mask {
        if !self.has_convex_emitter {
            return F::Mask::splat(false);
        }
        self.columns.are::<F>(light, LightKind::Triangle as u32)
    }

    /// Whether some light is at infinity.
    #[inline(always)]
    fn has_infinite(&self) -> bool {
        kinds::ANY_INFINITE && !self.infinite.is_empty()
    }

    /// The number of groups among which the first choice is made for a point: the lights of the tree are not one of
    /// them, if none can illuminate the point.
    #[inline(always)]
    fn groups_at<F: Float>(&self, p: Vec3<F>) -> F::Uint {
        let LightGroups { infinite, count } = &self.groups;
        F::Uint::select(self.tree.reaches(p), F::Uint::given(count), F::Uint::given(infinite))
    }

    /// Chooses a light for a point `p` on a surface with normal `n`, with `u` in [0, 1). Returns its index and the pmf
    /// of the choice. If no light can contribute, it is any of them. Lanes outside `active` are unspecified.
    ///
    /// Each light at infinity has the same probability as all others together, among which the tree chooses (Pharr,
    /// Jakob and Humphreys 2023, §12.6.3). If none of these can illuminate the point, lights at infinity share theirs.
    #[inline(always)]
    pub fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, active: F::Mask) -> (F::Uint, F) {
        let (mut in_tree, mut rest, mut infinite) = (active, u, F::Uint::splat(0));
        let has_infinite = self.has_infinite();
        let mut share = F::splat(1.0);
        if has_infinite {
            let count = self.groups_at(p);
            share = share / count.to_float();
            let scaled = u * count.to_float();
            // A product that is rounded up to the number of groups means the last one. Adding all bits subtracts one.
            let last = count + F::Uint::splat(u32::MAX);
            let group = scaled.to_uint();
            let group = F::Uint::select(group.lt(last), group, last);
            rest = (scaled - group.to_float()).min(F::splat(BELOW_ONE));
            in_tree = active & !group.lt(F::Uint::given(&self.groups.infinite));
            infinite = F::Uint::gather(&self.infinite, group);
        }
        // A single call, because its code is long. A tree without lights has no root, which the GPU would read in any
        // case.
        let (light, pmf) = F::guard(
            in_tree,
            (F::Uint::splat(0), F::zero()),
            #[inline(always)]
            || self.tree.choose(p, n, rest, in_tree),
        );
        if !has_infinite {
            return (light, pmf);
        }
        (F::Uint::select(in_tree, light, infinite), F::select(in_tree, pmf * share, share))
    }

    /// The probability mass function of [`LightTable::choose`]: the probability with which it chooses a light. Lanes
    /// outside `active` are unspecified.
    #[inline(always)]
    pub fn pmf<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, active: F::Mask) -> F {
        let has_infinite = self.has_infinite();
        let (mut in_tree, mut is_infinite) = (active, F::Mask::splat(false));
        if has_infinite {
            is_infinite = kinds::are_infinite::<F>(&self.columns, light);
            in_tree = active & !is_infinite & self.tree.reaches(p);
        }
        let pmf = F::guard(
            in_tree,
            F::zero(),
            #[inline(always)]
            || self.tree.pmf(p, n, light, in_tree),
        );
        if !has_infinite {
            return pmf;
        }
        let share = self.pmf_of_infinite(p);
        F::select(is_infinite, share, (pmf * share).only(in_tree))
    }

    /// The probability with which [`LightTable::choose`] chooses each light at infinity for a point.
    #[inline(always)]
    pub fn pmf_of_infinite<F: Float>(&self, p: Vec3<F>) -> F {
        F::splat(1.0) / self.groups_at(p).to_float()
    }

    /// A direction from `p` to a light, sampled with `u` in [0, 1)².
    #[inline(always)]
    pub fn sample<F: Float>(&self, light: F::Uint, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        let lights = LaneLights::new(&self.columns, light);
        let emission = lights.emission();
        kinds::sample::<F, false>(&lights, p, emission, u)
    }

    /// A direction from `p` to a delta light, chosen uniformly with `choice` in [0, 1), with its radiance multiplied by
    /// the number of delta lights. There must be at least one (see [`LightTable::delta_lights`]).
    #[inline(always)]
    pub fn sample_delta<F: Float>(&self, p: Vec3<F>, choice: F) -> LightSample<F> {
        let count = F::Uint::given(&self.delta_count);
        let index = (choice * count.to_float()).to_uint();
        // A product that is rounded up to `count` means the last light. Adding all bits subtracts one.
        let last = count + F::Uint::splat(u32::MAX);
        let index = F::Uint::select(index.lt(last), index, last);
        let lights = LaneLights::new(&self.columns, F::Uint::gather(&self.delta, index));
        let emission = lights.emission() * count.to_float();
        kinds::sample::<F, true>(&lights, p, emission, [F::zero(); 2])
    }

    /// The density by solid angle with which [`LightTable::sample`] from `p` would have sampled the direction of a ray
    /// that hit the light. The hit is at the point `on` at distance `t`, on the emitting side, and `cos_light` is the
    /// cosine between the outward normal there and the reverse direction. Rays never hit delta lights or lights at
    /// infinity.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, light: F::Uint, p: Vec3<F>, on: Vec3<F>, t: F, cos_light: F) -> F {
        let lights = LaneLights::new(&self.columns, light);
        let by_area = t * t / (cos_light * lights.area());
        kinds::pdf(&lights, p, on, t, cos_light, by_area)
    }

    /// The radiance along a ray that leaves the scene in the direction `d`. The radiance of each light at infinity is
    /// multiplied by `weight` of its density, with which [`LightTable::sample`] would have sampled the direction from
    /// that light (see [`LightTable::pmf_of_infinite`] for the choice of the light). Lights that are never sampled, and
    /// the environment, count in full.
    #[inline(always)]
    pub fn escaped<F: Float>(&self, d: Vec3<F>, weight: impl Fn(F) -> F) -> Rgb<F> {
        let mut radiance = Rgb::given(&self.environment.radiance);
        if self.has_infinite() {
            for &light in &self.infinite {
                let kind = self.columns.kinds()[light as usize];
                if !kinds::are_visible(kind) {
                    continue;
                }
                let lights = LaneLights::new(&self.columns, F::Uint::splat(light));
                let escaped = kinds::escaped(kind, &lights, lights.emission(), d);
                let drawn = escaped.pdf.gt(F::zero());
                let weight = F::select(drawn, weight(escaped.pdf), F::splat(1.0));
                radiance = radiance + escaped.radiance * weight;
            }
        }
        radiance
    }

    /// A ray that leaves a light, sampled with `u` in [0, 1)⁴.
    #[inline(always)]
    pub fn emit<F: Float>(&self, light: F::Uint, u: [F; 4]) -> EmittedRay<F> {
        let lights = LaneLights::new(&self.columns, light);
        kinds::emit(&lights, lights.emission(), u)
    }
}

#[cfg(test)]
mod one;
#[cfg(test)]
mod tests;
