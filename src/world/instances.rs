//! Meshes and groups of surfaces that stand at several places, and are kept once.
//!
//! A ray is taken to the own space of what is shared instead of that to the ray's. Its direction changes length there,
//! so that distances do not.

use crate::math::lanes::Device;
use crate::math::{Bounds, Float, LaneFloat, Ray, Uint, Vec3, value};
use crate::scene::placement::{is_placeable, magnification};
use crate::shape::{BOUNDS_ERROR, POSITION_ERROR, Quad, Rare, Sphere};
use glam::DAffine3;
use std::ops::Range;

/// The value of [`super::Hit::instance`] for a hit in world space.
pub const NO_INSTANCE: u32 = 0;

/// The row of an instance of a group, whose surfaces have rows of their own.
const OWN_ROWS: u32 = u32::MAX;

/// Numbers of a place in the table.
const NUMBERS: usize = 32;

/// Where a mesh or a group stands: X in its own space is at A·X + c in the world's.
#[derive(Clone, Copy, Debug)]
pub struct Place<F> {
    /// The rows of A.
    pub to_world: [Vec3<F>; 3],
    /// The rows of A's inverse.
    pub to_mesh: [Vec3<F>; 3],
    /// c.
    pub origin: Vec3<F>,
    /// The greatest factor by which A lengthens.
    pub stretch: F,
    /// The condition number of A for errors: ‖|A|·|A⁻¹|‖ in the maximum norm.
    pub condition: F,
    /// −1 for a group that A mirrors, which turns the order of its triangles' corners; else 1. Of a mesh its row says it.
    pub side: F,
}

value!(Place { to_world, to_mesh, origin, stretch, condition, side });

/// Numbers in the order in which the table has them, nine of each matrix by rows; none if nothing can stand there.
fn numbers(transform: &DAffine3, side: f64) -> Option<[f32; NUMBERS]> {
    let (a, inverse) = (transform.matrix3, transform.matrix3.inverse());
    let mut all = [0.0; NUMBERS];
    let rows = [a, inverse].into_iter().flat_map(|m| (0..3).flat_map(move |i| m.row(i).to_array()));
    let given = rows.chain(transform.translation.to_array()).chain(magnification(a)).chain([side]);
    for (number, given) in all.iter_mut().zip(given) {
        *number = given as f32;
    }
    is_placeable(transform).then_some(all)
}

/// Three numbers of a table, from the `i`th on.
#[inline(always)]
fn row<F: Float>(number: &impl Fn(usize) -> F, i: usize) -> Vec3<F> {
    Vec3::new(number(i), number(i + 1), number(i + 2))
}

impl<F: Float> Place<F> {
    /// From a table's numbers, which `number` looks up.
    #[inline(always)]
    fn new(number: impl Fn(usize) -> F) -> Self {
        Place {
            to_world: [row(&number, 0), row(&number, 3), row(&number, 6)],
            to_mesh: [row(&number, 9), row(&number, 12), row(&number, 15)],
            origin: row(&number, 18),
            stretch: number(21),
            condition: number(22),
            side: number(23),
        }
    }

    /// A ray in the mesh's own space. Its direction is of another length.
    #[inline(always)]
    pub(super) fn ray(&self, ray: &Ray<F>) -> Ray<F> {
        let [x, y, z] = &self.to_mesh;
        let o = ray.o - self.origin;
        Ray {
            o: Vec3::new(x.dot(o), y.dot(o), z.dot(o)),
            d: Vec3::new(x.dot(ray.d), y.dot(ray.d), z.dot(ray.d)),
            time: ray.time,
        }
    }

    /// A point of the mesh in the world.
    #[inline(always)]
    pub(super) fn point(&self, p: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = &self.to_world;
        Vec3::new(x.dot(p), y.dot(p), z.dot(p)) + self.origin
    }

    /// A direction of the mesh in the world, of another length.
    #[inline(always)]
    pub(super) fn vector(&self, v: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = &self.to_world;
        Vec3::new(x.dot(v), y.dot(v), z.dot(v))
    }

    /// A normal of the world in the mesh's own space, Aᵀn. Of a normal of length one its length is one over that of
    /// [`Self::long_normal`].
    #[inline(always)]
    pub(super) fn normal_within(&self, n: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = self.to_world;
        x * n.x + y * n.y + z * n.z
    }

    /// The point of the mesh at which a point of the world is.
    #[inline(always)]
    pub(super) fn point_within(&self, p: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = &self.to_mesh;
        let p = p - self.origin;
        Vec3::new(x.dot(p), y.dot(p), z.dot(p))
    }

    /// The volume in the world for each volume of the mesh's own space.
    #[inline(always)]
    pub(super) fn volume(&self) -> F {
        let [x, y, z] = self.to_world;
        x.dot(y.cross(z)).abs()
    }

    /// A normal of the mesh in the world, A⁻ᵀn, not of length one yet.
    #[inline(always)]
    pub(super) fn long_normal(&self, n: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = self.to_mesh;
        x * n.x + y * n.y + z * n.z
    }

    /// A normal of the mesh in the world, of length one; zero stays zero.
    #[inline(always)]
    pub(super) fn normal(&self, n: Vec3<F>) -> Vec3<F> {
        let n = self.long_normal(n);
        let length = n.length();
        let per_length = F::select(length.gt(F::zero()), F::splat(1.0) / length, F::zero());
        n * per_length
    }

    /// The increase of a hit's error bound: of a point `p` on a triangle whose own bound, in the mesh's
    /// space, is `error`.
    ///
    /// A ray that is transformed to the mesh's space is off by some 5 roundings of its distance from the mesh's origin
    /// there; in the world that is as much times the condition number.
    #[inline(always)]
    pub(super) fn error(&self, p: Vec3<F>, error: F) -> F {
        let away = (p - self.origin).max_abs() + self.origin.max_abs() * ROUNDING;
        error * self.stretch + away * self.condition * RAY_ERROR
    }

    /// The error bound of a hit at a point `p` of the world on a surface of a group, other than a triangle, whose own
    /// bound in the group's space is `error`; `length` is that of its normal's image, [`Self::long_normal`].
    ///
    /// What is off by some length along the normal there is off by that over `length` along the normal here: a plane
    /// X·n = d of the group is (X − c)·A⁻ᵀn = d of the world. The point is rounded once more here, as are rays on their
    /// way to the group.
    #[inline(always)]
    pub(super) fn error_along(&self, p: Vec3<F>, length: F, error: F) -> F {
        let away = (p - self.origin).max_abs() + self.origin.max_abs() * ROUNDING;
        p.max_abs() * POSITION_ERROR + error / length + away * self.condition * RAY_ERROR
    }
}

/// Error of a ray that is taken to a mesh for each unit of its distance from the mesh's origin: as in
/// [`BOUNDS_ERROR`], with room for what the sum of coordinates is larger than the largest.
pub const RAY_ERROR: f32 = BOUNDS_ERROR / 2.0;

const ROUNDING: f32 = crate::shape::UNIT_ROUNDOFF;

/// The surfaces of a group that are no triangles, in the group's space, each with its row in the surface table, in ascending
/// order of rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    /// The spheres.
    pub spheres: Vec<(Sphere, u32)>,
    /// The quads.
    pub quads: Vec<(Quad, u32)>,
    /// The shapes of which most scenes have none.
    pub rare: Vec<(Rare, u32)>,
}

/// The groups, the shared meshes, and where they stand. Groups are numbered before shared meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instances {
    /// What there is of each group beside triangles.
    pub groups: Vec<Members>,
    /// The triangles of each group and each shared mesh, as indices in [`super::Triangles`].
    pub meshes: Vec<Range<usize>>,
    /// The group or the shared mesh of each instance.
    pub mesh: Vec<u32>,
    /// Of a mesh its row in the surface table, of a group none.
    pub rows: Vec<u32>,
    /// Its [`Place`], so many numbers each.
    numbers: Vec<f32>,
}

impl Instances {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Whether a mesh can be shared that stands where a transform takes it: it may shear and squeeze obliquely only so much.
    pub fn can_place(transform: &DAffine3) -> bool {
        is_placeable(transform)
    }

    /// Whether there are groups.
    #[inline(always)]
    pub fn has_groups(&self) -> bool {
        !self.groups.is_empty()
    }

    /// How many instances are of groups.
    pub fn of_groups(&self) -> usize {
        self.mesh.iter().filter(|&&thing| (thing as usize) < self.groups.len()).count()
    }

    /// How many surfaces a ray is tested against that is tested against all instances of groups, one by one.
    pub fn tests_of_groups(&self) -> usize {
        let tests = |thing: usize| {
            let Members { spheres, quads, rare } = &self.groups[thing];
            spheres.len() + quads.len() + rare.len() + self.meshes[thing].len()
        };
        let of_group: Vec<usize> = (0..self.groups.len()).map(tests).collect();
        self.mesh.iter().filter_map(|&thing| of_group.get(thing as usize)).sum()
    }

    /// The share of a ray's origin by which it is moved beside the boxes within what is shared, as in [`BOUNDS_ERROR`].
    /// Directions are not of length one there: what that takes of roundings on spheres is as much again, at most.
    pub fn share_within(&self) -> f32 {
        if self.has_groups() { 2.0 * BOUNDS_ERROR } else { BOUNDS_ERROR }
    }

    /// Adds an instance of a shared mesh, as the surface of a row. The transform is one that can place it.
    pub fn push(&mut self, mesh: usize, transform: &DAffine3, row: u32) {
        self.add(mesh, transform, row, 1.0);
    }

    /// Adds an instance of a group, likewise.
    pub fn push_group(&mut self, group: usize, transform: &DAffine3) {
        let side = if transform.matrix3.determinant() < 0.0 { -1.0 } else { 1.0 };
        self.add(group, transform, OWN_ROWS, side);
    }

    fn add(&mut self, thing: usize, transform: &DAffine3, row: u32, side: f64) {
        let numbers = numbers(transform, side);
        debug_assert!(numbers.is_some());
        self.numbers.extend(numbers.unwrap_or_default());
        self.mesh.push(thing as u32);
        self.rows.push(row);
    }

    /// The row of an instance of a mesh; of a group there is none.
    pub fn row_of(&self, instance: usize) -> Option<u32> {
        Some(self.rows[instance]).filter(|&row| row != OWN_ROWS)
    }

    /// Where one instance stands.
    #[inline(always)]
    pub fn place(&self, instance: usize) -> Place<f32> {
        let numbers = &self.numbers[instance * NUMBERS..(instance + 1) * NUMBERS];
        Place::new(
            #[inline(always)]
            |i| numbers[i],
        )
    }

    /// The same for every lane.
    #[inline(always)]
    pub(super) fn splat<F: Float>(&self, instance: usize) -> Place<F> {
        let numbers = &self.numbers[instance * NUMBERS..(instance + 1) * NUMBERS];
        Place::new(
            #[inline(always)]
            |i| F::splat(numbers[i]),
        )
    }

    /// The places of hits' instances. Lanes without one are unspecified.
    #[inline(always)]
    pub(super) fn gather<F: Float>(&self, instance: F::Uint) -> Place<F> {
        F::device(&PlaceOf(self), instance)
    }

    /// The rows of hits on triangles of instances, likewise: `own` of those in groups.
    #[inline(always)]
    pub(super) fn row<F: Float>(&self, instance: F::Uint, own: F::Uint) -> F::Uint {
        let row = F::Uint::gather(&self.rows, index_of::<F>(instance));
        if !self.has_groups() {
            return row;
        }
        F::Uint::select(row.eq(F::Uint::splat(OWN_ROWS)), own, row)
    }

    /// A box around an instance of what some boxes in the mesh's own space hold, grown by what the rounding of
    /// rays that are taken there can do; and the share of a ray's origin by which such a ray has to be moved beside
    /// it, as in [`BOUNDS_ERROR`].
    pub(super) fn bounds(&self, instance: usize, boxes: &[Bounds]) -> (Bounds, f32) {
        let place = self.place(instance);
        let mut around = Bounds::NOTHING;
        let mut farthest = 0.0_f32;
        for Bounds { low, high } in boxes.iter().filter(|bounds| bounds.low[0] <= bounds.high[0]) {
            for corner in 0..8 {
                let p = [0, 1, 2].map(|axis| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] });
                let p = Vec3::<f32>::splat(p);
                farthest = farthest.max(p.max_abs());
                let p = place.point(p);
                around = around.with(&Bounds::of([[p.x, p.y, p.z]]));
            }
        }
        // The mesh's own boxes are right to BOUNDS_ERROR of the ray's and their coordinates there, and the ray to
        // RAY_ERROR of its distance from the mesh's origin: in the world as much times the condition.
        let share = (self.share_within() + BOUNDS_ERROR) * place.condition;
        let reach = farthest * place.stretch + place.origin.max_abs();
        let margin = reach * share;
        let Bounds { low, high } = around.grown(BOUNDS_ERROR);
        (Bounds { low: low.map(|x| x - margin), high: high.map(|x| x + margin) }, share)
    }

    /// Their memory, in bytes.
    pub fn bytes(&self) -> usize {
        let members = |Members { spheres, quads, rare }: &Members| {
            size_of_val(&spheres[..]) + size_of_val(&quads[..]) + size_of_val(&rare[..])
        };
        let groups: usize = self.groups.iter().map(members).sum();
        groups + size_of_val(&self.numbers[..]) + size_of_val(&self.rows[..]) + size_of_val(&self.mesh[..])
    }
}

/// The indices of hits' instances.
#[inline(always)]
fn index_of<F: Float>(instance: F::Uint) -> F::Uint {
    instance + F::Uint::splat(u32::MAX)
}

/// [`Instances::gather`]: devices read a place as a whole.
struct PlaceOf<'a>(&'a Instances);

impl Device for PlaceOf<'_> {
    const NAME: &'static str = "place_of";
    type Arguments<F: Float> = F::Uint;
    type Output<F: Float> = Place<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, instance: F::Uint) -> Place<F> {
        let first = index_of::<F>(instance) * F::Uint::splat(NUMBERS as u32);
        Place::new(
            #[inline(always)]
            |i| F::gather(&self.0.numbers, first + F::Uint::splat(i as u32)),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DQuat, DVec3};

    #[test]
    fn rays_go_to_the_mesh_and_points_come_back() {
        let turn = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 0.7);
        let transform = DAffine3::from_scale_rotation_translation(
            DVec3::new(2.0, -0.5, 7.0),
            turn,
            DVec3::new(100.0, -20.0, 3.0),
        );
        let mut all = Instances::default();
        all.push(0, &transform, 5);
        let place = all.place(0);
        let ray = Ray::new(Vec3::splat([101.0, -17.0, 4.0]), Vec3::splat([0.6, 0.0, -0.8]));
        let seen = place.ray(&ray);
        for t in [0.0, 1.0, 20.0] {
            // Distances stay.
            let (p, back) = (ray.at(t), place.point(seen.at(t)));
            assert!((p - back).max_abs() < 1e-4, "{p:?} is not {back:?}");
        }
        // A normal stays normal to what it was normal to.
        let (along, normal) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(3.0, 0.0, -1.0));
        let narrow = |v: DVec3| Vec3::<f32>::splat(v.to_array().map(|x| x as f32));
        let n = place.normal(narrow(normal));
        assert!((n.length() - 1.0).abs() < 1e-6);
        assert!(n.dot(narrow(transform.transform_vector3(along)).normalized()).abs() < 1e-6);
        assert_eq!(place.normal(Vec3::zero()), Vec3::zero());
    }

    #[test]
    fn what_shears_too_much_is_not_shared() {
        let scale = |x, y, z| Instances::can_place(&DAffine3::from_scale(DVec3::new(x, y, z)));
        assert!(scale(1e-6, 1e-6, 1e-6) && scale(1e6, -1e6, 1e6) && scale(1.0, 100.0, 0.01));
        assert!(!scale(1e-40, 1e-40, 1e-40) && !scale(0.0, 1.0, 1.0));
        let shear = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(999.0, 1.0, 0.0), DVec3::Z));
        assert!(!Instances::can_place(&shear));
    }
}
