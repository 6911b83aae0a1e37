//! Every light of a scene: the table from which each lane can look up another one, and the choice among them.

use super::area::AreaLight;
use super::bounds::LightBounds;
use super::columns::{Columns, LaneLights, LightRow};
use super::environment::Environment;
use super::kinds::{self, LightKind, Listed};
use super::lamps::{self, Lamp, MeshLamp};
use super::sample::{EmittedRay, LightSample};
use super::tree::LightTree;
use super::triangle::Triangle;
use crate::math::{BELOW_ONE, Bounds, Float, Mask, Rgb, Uint, Vec3};
use crate::shape::{Piece, Rare};
use std::ops::Range;

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
    /// The lights at infinity, which the tree leaves out.
    infinite: Vec<u32>,
    /// What rays see behind all of them.
    environment: Environment,
    /// Which lights are those of meshes that emit, by mesh.
    meshes: Vec<Range<u32>>,
    /// Meshes of which [`LightTable::lamps`] gives one light.
    mesh_lamps: Vec<MeshLamp>,
    has_bulging_mesh: bool,
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
        }
        if L::INFINITE {
            self.infinite.push(index);
        }
        index
    }

    /// Adds a piece of a shape whose outward side emits, or if `flipped` the other. Returns its index;
    /// [`NO_LIGHT`] for planes and others that are not sampled, which paths find by chance.
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

    /// Sets what rays see that leave the scene, behind all lights at infinity.
    pub fn set_environment(&mut self, environment: Environment) {
        self.environment = environment;
    }

    /// What rays see that leave the scene, behind all lights at infinity.
    pub fn environment(&self) -> Environment {
        self.environment
    }

    /// Says how far the scene reaches: lights at infinity send rays to all of a box (see [`LaneLights::extent`]).
    pub fn set_extent(&mut self, around: Bounds) {
        self.columns.set_extent(around);
    }

    /// The lights that have a place.
    fn bounded(&self) -> Vec<u32> {
        (0..self.len() as u32).filter(|light| !self.infinite.contains(light)).collect()
    }

    /// Builds the tree that chooses among the lights, once all are there.
    pub fn build_tree(&mut self) {
        self.tree = LightTree::of(&self.bounds, self.bounded());
    }

    /// Makes one lamp of each mesh that emits and has many triangles, once all lights are there (see
    /// [`super::LEAST_TRIANGLES`]).
    pub fn build_lamps(&mut self) {
        let lamps = self.meshes.iter().filter_map(|lights| MeshLamp::new(lights.clone(), &self.bounds));
        self.mesh_lamps = lamps.collect();
    }

    /// The lamps, in the order of their lights: each light by itself, but of meshes that are lamps all together.
    pub fn lamps(&self) -> impl Iterator<Item = Lamp<'_>> {
        lamps::lamps(self.len() as u32, &self.mesh_lamps)
    }

    /// The meshes that are lamps.
    pub fn mesh_lamps(&self) -> &[MeshLamp] {
        &self.mesh_lamps
    }

    /// Builds a tree that chooses every light with the same chance, wherever it is asked from: what the other one
    /// is measured against.
    pub fn build_uniform_tree(&mut self) {
        // Of equal powers, and spread so far that every place is among them: nothing tells them apart.
        let everywhere =
            LightBounds { lo: [-1e6; 3], hi: [1e6; 3], spread: 1e12, power: 1.0, ..LightBounds::default() };
        self.tree = LightTree::of(&vec![everywhere; self.len()], self.bounded());
    }

    /// Says whether all triangles in the scene are lights of one mesh that bulges: seen from before any of them, all
    /// others lie behind.
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

    /// The lights and the numbers of their kinds (see [`LightKind`]), in the order in which they were added.
    pub fn rows(&self) -> impl Iterator<Item = (u32, LightRow)> + '_ {
        self.columns.kinds().iter().enumerate().map(|(light, &kind)| (kind, self.columns.row(light)))
    }

    /// The tree that chooses among the lights.
    pub fn tree(&self) -> &LightTree {
        &self.tree
    }

    /// The delta lights (see [`Light::DELTA`](super::Light::DELTA)).
    pub fn delta_lights(&self) -> &[u32] {
        &self.delta
    }

    /// The lights at infinity (see [`Light::INFINITE`](super::Light::INFINITE)).
    pub fn infinite_lights(&self) -> &[u32] {
        &self.infinite
    }

    /// The lanes whose light no triangle can hide from where it shines: it is one of those of a mesh that bulges, and
    /// there are no others. To ask them all the same would cost more than all else that a shadow ray asks.
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

    /// Among how many [`LightTable::choose`] chooses first, each as likely as the others: the lights at infinity, and
    /// those of the tree as one.
    #[inline(always)]
    fn groups(&self) -> usize {
        self.infinite.len() + usize::from(self.infinite.len() < self.len())
    }

    /// Chooses a light for a point `p` on a surface with normal `n`, with `u` in [0, 1): its index and the
    /// probability of the choice; where no light can matter, it is any of them. Lanes that do not ask hold nonsense.
    ///
    /// Each light at infinity has the same chance as all others together, among which the tree chooses (Pharr, Jakob
    /// and Humphreys 2023, §12.6.3).
    #[inline(always)]
    pub fn choose<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, u: F, asks: F::Mask) -> (F::Uint, F) {
        let (mut in_tree, mut rest, mut group) = (asks, u, F::Uint::splat(0));
        if self.has_infinite() {
            let scaled = u * self.groups() as f32;
            // A product that rounds up to the number of groups still means the last one.
            let last = F::Uint::splat(self.groups() as u32 - 1);
            group = scaled.to_uint();
            group = F::Uint::select(group.lt(last), group, last);
            rest = (scaled - group.to_float()).min(F::splat(BELOW_ONE));
            in_tree = asks & !group.lt(F::Uint::splat(self.infinite.len() as u32));
        }
        let (light, chance) = self.tree.choose(p, n, rest, in_tree);
        if !self.has_infinite() {
            return (light, chance);
        }
        let share = F::splat(1.0 / self.groups() as f32);
        let one = F::Uint::gather(&self.infinite, group);
        (F::Uint::select(in_tree, light, one), F::select(in_tree, chance * share, share))
    }

    /// The probability with which [`LightTable::choose`] chooses a light. Lanes that do not ask hold nonsense.
    #[inline(always)]
    pub fn chance<F: Float>(&self, p: Vec3<F>, n: Vec3<F>, light: F::Uint, asks: F::Mask) -> F {
        let mut in_tree = asks;
        if self.has_infinite() {
            for &one in &self.infinite {
                in_tree = in_tree & !light.eq(F::Uint::splat(one));
            }
        }
        let chance = self.tree.chance(p, n, light, in_tree);
        if !self.has_infinite() {
            return chance;
        }
        let share = F::splat(1.0 / self.groups() as f32);
        F::select(in_tree, chance * share, share)
    }

    /// A direction from `p` to a light, drawn with `u` in [0, 1)².
    #[inline(always)]
    pub fn sample<F: Float>(&self, light: F::Uint, p: Vec3<F>, u: [F; 2]) -> LightSample<F> {
        let lights = LaneLights::new(&self.columns, light);
        let emission = lights.emission();
        kinds::sample::<F, false>(&lights, p, emission, u)
    }

    /// A direction from `p` to a delta light, each as likely as the others and weighted for it, chosen with `choice`
    /// in [0, 1). There is one at least (see [`LightTable::delta_lights`]).
    #[inline(always)]
    pub fn sample_delta<F: Float>(&self, p: Vec3<F>, choice: F) -> LightSample<F> {
        let count = self.delta.len() as f32;
        let index = (choice * count).to_uint();
        // A product that rounds up to `count` still means the last light.
        let last = F::Uint::splat(self.delta.len() as u32 - 1);
        let index = F::Uint::select(index.lt(last), index, last);
        let lights = LaneLights::new(&self.columns, F::Uint::gather(&self.delta, index));
        let emission = lights.emission() * F::splat(count);
        kinds::sample::<F, true>(&lights, p, emission, [F::zero(); 2])
    }

    /// Density by solid angle with which [`LightTable::sample`] from `p` would have drawn the direction
    /// `wi`, given that a ray along it met the light at distance `t`, on the side that emits, with the
    /// cosine `cos_light` between the outward normal there and the way back. Delta lights are never met, nor those at
    /// infinity.
    #[inline(always)]
    pub fn pdf<F: Float>(&self, light: F::Uint, p: Vec3<F>, t: F, cos_light: F) -> F {
        let lights = LaneLights::new(&self.columns, light);
        let by_area = t * t / (cos_light * lights.area());
        kinds::pdf(&lights, p, t, cos_light, by_area)
    }

    /// Radiance that a ray sees that leaves the scene in the direction `d`. That of each light at infinity counts with
    /// the weight of its density: the one with which [`LightTable::choose`] and [`LightTable::sample`] together would
    /// have drawn the direction by way of that light. What is never drawn counts in full.
    #[inline(always)]
    pub fn escaped<F: Float>(&self, d: Vec3<F>, weight: impl Fn(F) -> F) -> Rgb<F> {
        let mut radiance = Rgb::splat(self.environment.radiance);
        if self.has_infinite() {
            let share = 1.0 / self.groups() as f32;
            for &light in &self.infinite {
                let lights = LaneLights::new(&self.columns, F::Uint::splat(light));
                let escaped = kinds::escaped(&lights, lights.emission(), d);
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
