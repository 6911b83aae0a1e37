//! Meshes that stand at several places, and are kept once.
//!
//! A ray is taken to a mesh's own space instead of the mesh to the ray's. Its direction changes length there, so
//! that distances do not.

use crate::math::lanes::Device;
use crate::math::{Bounds, Float, LaneFloat, Ray, Uint, Vec3, value};
use crate::shape::BOUNDS_ERROR;
use glam::{DAffine3, DMat3};
use std::ops::Range;

/// The value of [`super::Hit::instance`] for a hit in world space.
pub const NO_INSTANCE: u32 = 0;

/// The greatest factor by which a place may magnify errors. A mesh that is sheared, or squeezed obliquely, more is not
/// shared.
const WORST_CONDITION: f32 = 1000.0;

/// Numbers of a place in the table.
const NUMBERS: usize = 32;

/// Where a mesh stands: X in its own space is at A·X + c in the world's.
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
}

value!(Place { to_world, to_mesh, origin, stretch, condition });

/// Numbers in the order in which the table has them, nine of each matrix by rows.
fn numbers(transform: &DAffine3) -> Option<[f32; NUMBERS]> {
    let (a, inverse) = (transform.matrix3, transform.matrix3.inverse());
    let absolute = |m: DMat3| DMat3::from_cols(m.x_axis.abs(), m.y_axis.abs(), m.z_axis.abs());
    let most = |m: DMat3| (0..3).map(|i| m.row(i).element_sum()).fold(0.0, f64::max);
    let sizes = [most(absolute(a)), most(absolute(a) * absolute(inverse))];
    let mut all = [0.0; NUMBERS];
    let rows = [a, inverse].into_iter().flat_map(|m| (0..3).flat_map(move |i| m.row(i).to_array()));
    let given = rows.chain(transform.translation.to_array()).chain(sizes);
    for (number, given) in all.iter_mut().zip(given) {
        *number = given as f32;
    }
    let sound = all.iter().all(|x| x.is_finite()) && all[22] <= WORST_CONDITION;
    sound.then_some(all)
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

    /// A normal of the mesh in the world, of length one; zero stays zero.
    #[inline(always)]
    pub(super) fn normal(&self, n: Vec3<F>) -> Vec3<F> {
        let [x, y, z] = self.to_mesh;
        let n = x * n.x + y * n.y + z * n.z;
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
}

/// Error of a ray that is taken to a mesh for each unit of its distance from the mesh's origin: as in
/// [`BOUNDS_ERROR`], with room for what the sum of coordinates is larger than the largest.
pub const RAY_ERROR: f32 = BOUNDS_ERROR / 2.0;

const ROUNDING: f32 = crate::shape::UNIT_ROUNDOFF;

/// The shared meshes and where they stand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Instances {
    /// The triangles of each shared mesh, as indices in [`super::Triangles`].
    pub meshes: Vec<Range<usize>>,
    /// The shared mesh of each instance.
    pub mesh: Vec<u32>,
    /// Its row in the surface table.
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
        numbers(transform).is_some()
    }

    /// Adds an instance of a shared mesh, as the surface of a row. The transform is one that can place it.
    pub fn push(&mut self, mesh: usize, transform: &DAffine3, row: u32) {
        let numbers = numbers(transform);
        debug_assert!(numbers.is_some());
        self.numbers.extend(numbers.unwrap_or_default());
        self.mesh.push(mesh as u32);
        self.rows.push(row);
    }

    /// The place of one instance.
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

    /// The rows of hits' instances, likewise.
    #[inline(always)]
    pub(super) fn row<F: Float>(&self, instance: F::Uint) -> F::Uint {
        F::Uint::gather(&self.rows, index_of::<F>(instance))
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
        let share = BOUNDS_ERROR * 2.0 * place.condition;
        let reach = farthest * place.stretch + place.origin.max_abs();
        let margin = reach * share;
        let Bounds { low, high } = around.grown(BOUNDS_ERROR);
        (Bounds { low: low.map(|x| x - margin), high: high.map(|x| x + margin) }, share)
    }

    /// Their memory, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.numbers[..]) + size_of_val(&self.rows[..]) + size_of_val(&self.mesh[..])
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
    use glam::{DQuat, DVec3};

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
