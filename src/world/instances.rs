//! Instances of meshes and groups, which are stored once.
//!
//! A ray is transformed to the space of the shared geometry. The length of its direction changes there, so that
//! distances along it do not.

use crate::math::lanes::Device;
use crate::math::{Bounds, Float, LaneFloat, Ray, Uint, Vec3, value};
use crate::scene::placement::{is_placeable, magnification};
use crate::shape::{BOUNDS_ERROR, CustomShape, POSITION_ERROR, Quad, Sphere};
use glam::DAffine3;
use std::ops::Range;

/// The value of [`super::Hit::instance`] for a hit in world space.
pub const NO_INSTANCE: u32 = 0;

/// The row of an instance of a group, whose surfaces have their own rows.
const OWN_ROWS: u32 = u32::MAX;

/// The number of floats of a transform in the table.
const NUMBERS: usize = 32;

/// The transform X ↦ A·X + c of an instance, from its own space to the world.
#[derive(Clone, Copy, Debug)]
pub struct InstanceTransform<F> {
    /// The rows of A.
    pub to_world: [Vec3<F>; 3],
    /// The rows of A⁻¹.
    pub to_mesh: [Vec3<F>; 3],
    /// c.
    pub origin: Vec3<F>,
    /// The largest factor by which A stretches a vector.
    pub stretch: F,
    /// The condition number of A for errors: ‖|A|·|A⁻¹|‖ in the maximum norm.
    pub condition: F,
    /// −1 for a group with a mirroring A, which reverses the order of its triangles' corners; otherwise 1. For a mesh,
    /// its row holds the orientation.
    pub side: F,
}

value!(InstanceTransform { to_world, to_mesh, origin, stretch, condition, side });

/// The floats in the order of the table, with the nine floats of a matrix by rows; `None` if the transform is not
/// supported.
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

/// Three floats of a table, starting at index `i`.
#[inline(always)]
fn row<F: Float>(number: &impl Fn(usize) -> F, i: usize) -> Vec3<F> {
    Vec3::new(number(i), number(i + 1), number(i + 2))
}

impl<F: Float> InstanceTransform<F> {
    /// Made from a table's floats, which `number` looks up.
    #[inline(always)]
    fn new(number: impl Fn(usize) -> F) -> Self {
        InstanceTransform {
            to_world: [row(&number, 0), row(&number, 3), row(&number, 6)],
            to_mesh: [row(&number, 9), row(&number, 12), row(&number, 15)],
            origin: row(&number, 18),
            stretch: number(21),
            condition: number(22),
            side: number(23),
        }
    }

    /// A ray in the instance's own space. The length of its direction changes.
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

    /// A point in world space, of one in the instance's own space.
    #[inline(always)]
    pub(super) fn point(&self, p: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = &self.to_world;
        Vec3::new(x.dot(p), y.dot(p), z.dot(p)) + self.origin
    }

    /// A direction in world space. Its length changes.
    #[inline(always)]
    pub(super) fn vector(&self, v: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = &self.to_world;
        Vec3::new(x.dot(v), y.dot(v), z.dot(v))
    }

    /// A normal in the instance's own space, Aᵀn, of one in world space. For unit normals, its length is the inverse of
    /// that of [`Self::long_normal`].
    #[inline(always)]
    pub(super) fn normal_within(&self, n: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = self.to_world;
        x * n.x + y * n.y + z * n.z
    }

    /// A point in the instance's own space, of one in world space.
    #[inline(always)]
    pub(super) fn point_within(&self, p: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = &self.to_mesh;
        let p = p - self.origin;
        Vec3::new(x.dot(p), y.dot(p), z.dot(p))
    }

    /// |det A|: the ratio of a volume in the world to that in the instance's own space.
    #[inline(always)]
    pub(super) fn volume(&self) -> F {
        let [x, y, z] = self.to_world;
        x.dot(y.cross(z)).abs()
    }

    /// A normal in world space, A⁻ᵀn, not normalised.
    #[inline(always)]
    pub(super) fn long_normal(&self, n: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = self.to_mesh;
        x * n.x + y * n.y + z * n.z
    }

    /// A unit normal in world space; zero stays zero.
    #[inline(always)]
    pub(super) fn normal(&self, n: Vec3<F>) -> Vec3<F> {
        let n = self.long_normal(n);
        let length = n.length();
        let per_length = F::select(length.gt(F::zero()), F::splat(1.0) / length, F::zero());
        n * per_length
    }

    /// The error bound that the transform adds at a world-space point `p` on a triangle whose error bound in its own
    /// space is `error`.
    ///
    /// The rounding error of a transformed ray is some 5 ulp of its distance from the mesh's origin. In the world it is
    /// multiplied by the condition number.
    #[inline(always)]
    pub(super) fn error(&self, p: Vec3<F>, error: F) -> F {
        let away = (p - self.origin).max_abs() + self.origin.max_abs() * ROUNDING;
        error * self.stretch + away * self.condition * RAY_ERROR
    }

    /// The error bound of a hit at a world-space point `p` on a surface of a group, other than a triangle, with the
    /// bound `error` in the group's space. `length` is the length of its transformed normal, [`Self::long_normal`].
    ///
    /// An offset along the normal there becomes that offset over `length` here: a plane X·n = d of the group is (X −
    /// c)·A⁻ᵀn = d in the world. The point, and rays on their way to the group, are rounded once more.
    #[inline(always)]
    pub(super) fn error_along(&self, p: Vec3<F>, length: F, error: F) -> F {
        let away = (p - self.origin).max_abs() + self.origin.max_abs() * ROUNDING;
        p.max_abs() * POSITION_ERROR + error / length + away * self.condition * RAY_ERROR
    }
}

/// The error of a transformed ray per unit of its distance from the mesh's origin: as [`BOUNDS_ERROR`], with a margin
/// because the sum of the coordinates exceeds the largest one.
pub const RAY_ERROR: f32 = BOUNDS_ERROR / 2.0;

const ROUNDING: f32 = crate::shape::UNIT_ROUNDOFF;

/// The surfaces of a group other than triangles, in the group's space. Each has its row in the surface table, and rows
/// ascend.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Members {
    /// The spheres.
    pub spheres: Vec<(Sphere, u32)>,
    /// The quads.
    pub quads: Vec<(Quad, u32)>,
    /// The custom shapes.
    pub custom: Vec<(CustomShape, u32)>,
}

/// The groups, the shared meshes, and their instances. Groups are numbered before shared meshes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instances {
    /// The surfaces of each group other than triangles.
    pub groups: Vec<Members>,
    /// The triangles of each group and each shared mesh, as indices into [`super::Triangles`].
    pub meshes: Vec<Range<usize>>,
    /// The group or shared mesh of each instance.
    pub mesh: Vec<u32>,
    /// The row of a mesh in the surface table; `OWN_ROWS` for a group.
    pub rows: Vec<u32>,
    /// The [`InstanceTransform`] of each instance, [`NUMBERS`] floats each.
    numbers: Vec<f32>,
}

impl Instances {
    /// The number of instances.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Whether a mesh with this transform can be shared. Transforms with strong shear or anisotropic scale cannot.
    pub fn can_place(transform: &DAffine3) -> bool {
        is_placeable(transform)
    }

    /// Whether there are groups.
    #[inline(always)]
    pub fn has_groups(&self) -> bool {
        !self.groups.is_empty()
    }

    /// The number of instances of groups.
    pub fn of_groups(&self) -> usize {
        self.mesh.iter().filter(|&&thing| (thing as usize) < self.groups.len()).count()
    }

    /// The number of surfaces that a ray is tested against if it is tested against each instance of a group in turn.
    pub fn tests_of_groups(&self) -> usize {
        let tests = |thing: usize| {
            let Members { spheres, quads, custom } = &self.groups[thing];
            spheres.len() + quads.len() + custom.len() + self.meshes[thing].len()
        };
        let of_group: Vec<usize> = (0..self.groups.len()).map(tests).collect();
        self.mesh.iter().filter_map(|&thing| of_group.get(thing as usize)).sum()
    }

    /// The fraction of a ray's largest origin coordinate by which the ray is moved relative to boxes within shared
    /// geometry: see [`BOUNDS_ERROR`]. Directions have no unit length there, which at most doubles the rounding errors
    /// at spheres.
    pub fn share_within(&self) -> f32 {
        if self.has_groups() { 2.0 * BOUNDS_ERROR } else { BOUNDS_ERROR }
    }

    /// Adds an instance of a shared mesh with a row of the surface table. The transform must be supported.
    pub fn push(&mut self, mesh: usize, transform: &DAffine3, row: u32) {
        self.add(mesh, transform, row, 1.0);
    }

    /// Adds an instance of a group. The transform must be supported.
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

    /// The row of an instance of a mesh; `None` for a group.
    pub fn row_of(&self, instance: usize) -> Option<u32> {
        Some(self.rows[instance]).filter(|&row| row != OWN_ROWS)
    }

    /// The transform of one instance.
    #[inline(always)]
    pub fn place(&self, instance: usize) -> InstanceTransform<f32> {
        let numbers = &self.numbers[instance * NUMBERS..(instance + 1) * NUMBERS];
        InstanceTransform::new(
            #[inline(always)]
            |i| numbers[i],
        )
    }

    /// The transform of one instance, for every lane.
    #[inline(always)]
    pub(super) fn splat<F: Float>(&self, instance: usize) -> InstanceTransform<F> {
        let numbers = &self.numbers[instance * NUMBERS..(instance + 1) * NUMBERS];
        InstanceTransform::new(
            #[inline(always)]
            |i| F::splat(numbers[i]),
        )
    }

    /// The transforms of the instances of hits. Lanes without an instance are unspecified.
    #[inline(always)]
    pub(super) fn gather<F: Float>(&self, instance: F::Uint) -> InstanceTransform<F> {
        F::device(&GatherTransform(self), instance)
    }

    /// The rows of hits on triangles of instances; `own` for those in groups. Lanes without an instance are
    /// unspecified.
    #[inline(always)]
    pub(super) fn row<F: Float>(&self, instance: F::Uint, own: F::Uint) -> F::Uint {
        let row = F::Uint::gather(&self.rows, index_of::<F>(instance));
        if !self.has_groups() {
            return row;
        }
        F::Uint::select(row.eq(F::Uint::splat(OWN_ROWS)), own, row)
    }

    /// The world-space bounds of an instance of boxes in its own space, enlarged by the rounding errors of transformed
    /// rays. Also returns the fraction by which such a ray has to be moved relative to the bounds: see
    /// [`BOUNDS_ERROR`].
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
        // The mesh's own boxes are correct to BOUNDS_ERROR of the coordinates there, and the ray to RAY_ERROR of its
        // distance from the mesh's origin. In the world both are multiplied by the condition number.
        let share = (self.share_within() + BOUNDS_ERROR) * place.condition;
        let reach = farthest * place.stretch + place.origin.max_abs();
        let margin = reach * share;
        let Bounds { low, high } = around.grown(BOUNDS_ERROR);
        (Bounds { low: low.map(|x| x - margin), high: high.map(|x| x + margin) }, share)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        let members = |Members { spheres, quads, custom }: &Members| {
            size_of_val(&spheres[..]) + size_of_val(&quads[..]) + size_of_val(&custom[..])
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

/// [`Instances::gather`], as a device function: GPUs read a transform as a whole.
struct GatherTransform<'a>(&'a Instances);

impl Device for GatherTransform<'_> {
    const NAME: &'static str = "place_of";
    type Arguments<F: Float> = F::Uint;
    type Output<F: Float> = InstanceTransform<F>;

    #[inline(always)]
    fn run<F: LaneFloat>(&self, instance: F::Uint) -> InstanceTransform<F> {
        let first = index_of::<F>(instance) * F::Uint::splat(NUMBERS as u32);
        InstanceTransform::new(
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
    fn transformed_rays_and_points_agree() {
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
            // Distances are unchanged.
            let (p, back) = (ray.at(t), place.point(seen.at(t)));
            assert!((p - back).max_abs() < 1e-4, "{p:?} is not {back:?}");
        }
        // Normals stay perpendicular.
        let (along, normal) = (DVec3::new(1.0, 2.0, 3.0), DVec3::new(3.0, 0.0, -1.0));
        let narrow = |v: DVec3| Vec3::<f32>::splat(v.to_array().map(|x| x as f32));
        let n = place.normal(narrow(normal));
        assert!((n.length() - 1.0).abs() < 1e-6);
        assert!(n.dot(narrow(transform.transform_vector3(along)).normalized()).abs() < 1e-6);
        assert_eq!(place.normal(Vec3::zero()), Vec3::zero());
    }

    #[test]
    fn meshes_with_strong_shear_are_not_shared() {
        let scale = |x, y, z| Instances::can_place(&DAffine3::from_scale(DVec3::new(x, y, z)));
        assert!(scale(1e-6, 1e-6, 1e-6) && scale(1e6, -1e6, 1e6) && scale(1.0, 100.0, 0.01));
        assert!(!scale(1e-40, 1e-40, 1e-40) && !scale(0.0, 1.0, 1.0));
        let shear = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, DVec3::new(999.0, 1.0, 0.0), DVec3::Z));
        assert!(!Instances::can_place(&shear));
    }
}
