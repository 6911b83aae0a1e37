//! Trees compared with an exhaustive search, to the bit, at every SIMD level, in the library as programs use it.
//!
//! As a unit test of the library it found a compiler bug: where lanes were plain arrays, the SLP vectoriser of LLVM
//! 22.1.2 used a value of the intersection of rays with triangles before it was computed (where it packed copied
//! values), and shadows in a scene of instances were wrong.

use crate::common::shapes::{bounded_samples, placed};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use rand::RngExt;
use std::sync::Arc;
use stride::math::lanes::{Kernel, Level, MAX_LANES, dispatch};
use stride::math::{LaneFloat, LaneMask, LaneUint, Ray, Vec3};
use stride::sampling::Stream;
use stride::shape::{CustomShape, Cylinder, Disk, Mesh, NOTHING, Piece, Plane, Quad, Sphere};
use stride::world::{AcceleratorChoice, Bvh, Instances, Simple, TreeScope, Triangles, World};

fn direction(stream: &mut Stream) -> DVec3 {
    let z = stream.random_range(-1.0..1.0_f64);
    let phi = stream.random_range(0.0..std::f64::consts::TAU);
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * phi.cos(), r * phi.sin(), z)
}

fn narrow(v: DVec3) -> Vec3<f32> {
    Vec3::splat(v.to_array().map(|x| x as f32))
}

/// A random scene, and points of it for rays to aim at.
struct Jumble {
    surfaces: Simple,
    scale: f64,
    targets: Vec<DVec3>,
}

/// Shapes whose sizes differ by up to 10⁶, some of them twice, some coincident, some flat along an axis, some oblique
/// by a ten-thousandth.
fn jumble(stream: &mut Stream) -> Jumble {
    let scale = 10_f64.powi(stream.random_range(-6..=6));
    let place = direction(stream) * scale * [0.0, 1.0, 1e3][stream.random_range(0..3)];
    let count = [1, 2, 7, 9, 40, 150][stream.random_range(0..6)];
    let spread = [0.0, 1.0, 30.0][stream.random_range(0..3)];
    let mut surfaces = Simple::default();
    let mut targets = Vec::new();
    let mut mesh = Mesh::default();
    let mut rows: Vec<u32> = (0..3 * count).collect();
    // Rows in random order, with gaps.
    for i in (1..rows.len()).rev() {
        rows.swap(i, stream.random_range(0..=i));
    }
    for &row in &rows[..count as usize] {
        let size = scale * 10_f64.powf(stream.random_range(-3.0..0.0) * stream.random_range(0.0..2.0));
        let centre = place + direction(stream) * scale * spread * stream.random::<f64>();
        let twice = stream.random_range(0..5) == 0;
        match stream.random_range(0..28) {
            16..=23 => {
                // Slivers, needles and points; some share vertices with the previous one.
                let thin = [1.0, 1.0, 1e-3, 1e-6, 0.0][stream.random_range(0..5)];
                let (u, v) = match stream.random_range(0..3) {
                    0 => (DVec3::X, DVec3::Y),
                    1 => (DVec3::NEG_Y, DVec3::Z),
                    _ => (direction(stream), direction(stream)),
                };
                let corners = [centre, centre + u * size, centre + v * size * thin];
                let base = mesh.positions.len() as u32;
                mesh.positions.extend(corners.map(|p| p.to_array().map(|x| x as f32)));
                let shared = if base > 0 && twice { base - 1 } else { base };
                mesh.triangles.push([shared, base + 1, base + 2]);
                if twice {
                    mesh.triangles.push([base + 2, base + 1, shared]);
                }
                targets.extend(corners);
                targets.push((corners[0] + corners[1]) * 0.5);
                targets.push((corners[0] + corners[1] + corners[2]) / 3.0);
            }
            24.. => {
                let (along, to) = (direction(stream) * size, centre + direction(stream) * size);
                let mut shapes = vec![
                    CustomShape::Disk(Disk::new(centre, along.normalize(), size)),
                    CustomShape::Cylinder(Cylinder::new(centre, to, size * stream.random_range(0.01..2.0))),
                ];
                let turn = DQuat::from_axis_angle(along.normalize(), stream.random_range(0.0..6.0));
                let similar = DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, centre);
                for (_, shape) in bounded_samples(DVec3::ZERO, 1.0) {
                    if let [Piece::Custom(shape)] = placed(&shape, &similar).0[0].pieces()[..] {
                        shapes.push(shape);
                    }
                }
                let shape = shapes[stream.random_range(0..shapes.len())];
                surfaces.custom.push((shape, row));
                if twice {
                    surfaces.custom.push((shape, row + 1000));
                }
                targets.extend([centre, to, centre + along.any_orthonormal_vector() * size]);
            }
            0..8 => {
                let sphere = Sphere::new(centre, size);
                surfaces.spheres.push((sphere, row));
                if twice {
                    surfaces.spheres.push((sphere, row + 1000));
                }
                targets.extend((0..4).map(|_| centre + direction(stream) * size));
                targets.extend([DVec3::X, DVec3::NEG_Y, DVec3::Z].map(|axis| centre + axis * size));
            }
            8..=14 => {
                let u = match stream.random_range(0..2) {
                    0 => direction(stream),
                    _ => [DVec3::X, DVec3::Y, DVec3::NEG_Z][stream.random_range(0..3)],
                } * size;
                let v = match stream.random_range(0..3) {
                    0 => direction(stream) * size,
                    1 => u.any_orthogonal_vector() * stream.random_range(0.1..2.0),
                    _ => u + u.any_orthogonal_vector() * 1e-4,
                };
                let quad = Quad::new(centre, u, v);
                surfaces.quads.push((quad, row));
                if twice {
                    surfaces.quads.push((quad, row + 1000));
                }
                targets.extend([centre, centre + u, centre + v, centre + u + v, centre + (u + v) * 0.5]);
                targets.extend([centre + u * stream.random::<f64>(), centre + v * stream.random::<f64>()]);
            }
            _ => {
                let normal = direction(stream);
                let n = narrow(normal);
                let distance = (normal.dot(place) - scale) as f32;
                surfaces.planes.push((Plane { normal: [n.x, n.y, n.z], distance }, row));
                targets.push(centre);
            }
        }
    }
    surfaces.spheres.sort_by_key(|(_, row)| *row);
    surfaces.quads.sort_by_key(|(_, row)| *row);
    surfaces.planes.sort_by_key(|(_, row)| *row);
    surfaces.custom.sort_by_key(|(_, row)| *row);
    let mut triangles = Triangles::default();
    triangles.push(&mesh, &DAffine3::IDENTITY, 0);
    if stream.random_range(0..3) == 0 {
        surfaces.instances = Arc::new(instances(&mut triangles, place, scale, spread, &mut targets, stream));
    }
    surfaces.triangles = Arc::new(triangles);
    Jumble { surfaces, scale, targets }
}

/// Shared meshes of a few triangles, rotated, scaled, mirrored and sheared; some instances coincide.
fn instances(
    triangles: &mut Triangles,
    place: DVec3,
    scale: f64,
    spread: f64,
    targets: &mut Vec<DVec3>,
    stream: &mut Stream,
) -> Instances {
    let mut all = Instances::default();
    let mut vertices = Vec::new();
    for _ in 0..stream.random_range(1..3) {
        let (size, away) = (10_f64.powi(stream.random_range(-6..=6)), [0.0, 3.0][stream.random_range(0..2)]);
        let count = [1, 5, 12][stream.random_range(0..3)];
        let mut mesh = Mesh::default();
        for i in 0..count {
            let corner = (direction(stream) + DVec3::X * away) * size;
            let corners =
                [corner, corner + direction(stream) * size, corner + direction(stream) * size * 0.3];
            mesh.positions.extend(corners.map(|p| p.to_array().map(|x| x as f32)));
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
        }
        all.meshes.push(triangles.push_shared(&mesh));
        vertices.push((size, mesh.positions));
    }
    let count = [1, 2, 9][stream.random_range(0..3)];
    let mut row = 100_000;
    while all.len() < count {
        let mesh = stream.random_range(0..vertices.len());
        let (size, vertices) = &vertices[mesh];
        let to = scale / size * 10_f64.powf(stream.random_range(-2.0..0.5));
        let squeeze = [0.0, 0.0, 1.0, 1.0, 3.0][stream.random_range(0..5)];
        let scales = DVec3::from([(); 3].map(|()| {
            let sign = [1.0, 1.0, -1.0][stream.random_range(0..3)];
            sign * to * 10_f64.powf(-squeeze * stream.random::<f64>())
        }));
        let turn = DQuat::from_axis_angle(direction(stream), stream.random_range(0.0..6.0));
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(squeeze, 1.0, 0.0), DVec3::Z);
        let at = place + direction(stream) * scale * spread * stream.random::<f64>();
        let mut transform = DAffine3::from_scale_rotation_translation(scales, turn, at);
        transform.matrix3 *= shear;
        if !Instances::can_place(&transform) {
            continue;
        }
        for _ in 0..1 + u32::from(stream.random_range(0..5) == 0) {
            all.push(mesh, &transform, row);
            row += 1;
        }
        let some = vertices.chunks(3).take(8).flat_map(|corners| {
            let [a, b, c] = [0, 1, 2].map(|i| DVec3::from(corners[i].map(f64::from)));
            [a, (a + b) * 0.5, (a + b + c) / 3.0].map(|p| transform.transform_point3(p))
        });
        targets.extend(some);
    }
    all
}

impl Jumble {
    /// A ray that starts at a distance from a thousandth to a million sizes, or at a target itself, and goes to a
    /// target, past it, or along an axis.
    fn ray(&self, stream: &mut Stream) -> Ray<f32> {
        let target = self.targets[stream.random_range(0..self.targets.len())];
        let far = [1e-3, 0.1, 1.0, 10.0, 1e3, 1e6][stream.random_range(0..6)];
        let o = match stream.random_range(0..4) {
            0 => narrow(self.targets[stream.random_range(0..self.targets.len())]),
            _ => narrow(target + direction(stream) * self.scale * far),
        };
        let axis = [0.0_f32, -0.0, 1.0, -1.0];
        let d = match stream.random_range(0..4) {
            0 => narrow(direction(stream)),
            1 => {
                let i = stream.random_range(0..3);
                let zero = axis[stream.random_range(0..2)];
                let mut d = [zero; 3];
                d[i] = axis[stream.random_range(2..4)];
                Vec3::splat(d)
            }
            _ => {
                let from = DVec3::new(f64::from(o.x), f64::from(o.y), f64::from(o.z));
                narrow((target - from).normalize_or(DVec3::Y))
            }
        };
        let o = match stream.random_range(0..3) {
            // Along an axis exactly through a target.
            0 => {
                let t = narrow(target);
                let back = (self.scale * far) as f32;
                Vec3::new(t.x - d.x * back, t.y - d.y * back, t.z - d.z * back)
            }
            _ => o,
        };
        Ray::new(o, d.normalized())
    }
}

/// The results for a ray as bits: distance, surface, instance and weights of its hit, and whether anything is nearer
/// than its limit.
type Answer = (u32, u32, u32, [u32; 2], bool);

/// The results of a world for some rays.
struct Ask<'a> {
    world: &'a World,
    rays: &'a [Ray<f32>],
    limits: &'a [f32],
}

impl Kernel for Ask<'_> {
    type Output = Vec<Answer>;

    #[inline(always)]
    fn run<F: LaneFloat>(self) -> Self::Output {
        let mut all = Vec::new();
        for (chunk, limits) in self.rays.chunks(F::LANES).zip(self.limits.chunks(F::LANES)) {
            let column = |f: &dyn Fn(&Ray<f32>) -> f32| {
                let mut numbers = [f32::NAN; MAX_LANES];
                numbers.iter_mut().zip(chunk).for_each(|(x, ray)| *x = f(ray));
                F::load(&numbers)
            };
            let ray = Ray::new(
                Vec3::new(column(&|r| r.o.x), column(&|r| r.o.y), column(&|r| r.o.z)),
                Vec3::new(column(&|r| r.d.x), column(&|r| r.d.y), column(&|r| r.d.z)),
            );
            let mut t_max = [0.0; MAX_LANES];
            t_max[..limits.len()].copy_from_slice(limits);
            let asks = F::Mask::from_bits((1_u32 << chunk.len()) - 1);
            let hit = self.world.intersect(&ray, asks);
            let occluded = self.world.occluded(&ray, F::load(&t_max), asks, ray.d.x.gt(F::zero())).bits();
            let (mut t, mut rows, mut instances) = ([0.0; MAX_LANES], [0; MAX_LANES], [0; MAX_LANES]);
            hit.t.store(&mut t);
            hit.surface.store(&mut rows);
            hit.instance.store(&mut instances);
            let mut weights = [[0.0; MAX_LANES]; 2];
            hit.weights[0].store(&mut weights[0]);
            hit.weights[1].store(&mut weights[1]);
            all.extend((0..chunk.len()).map(|i| {
                let is_some = t[i] < NOTHING;
                let (row, instance) = if is_some { (rows[i], instances[i]) } else { (u32::MAX, 0) };
                // The weights of a hit on a degenerate triangle are NaN, whose bits do not matter.
                let bits = |x: f32| if x.is_nan() { f32::NAN.to_bits() } else { x.to_bits() };
                let weights = weights.map(|each| if is_some { bits(each[i]) } else { 0 });
                (t[i].to_bits(), row, instance, weights, occluded >> i & 1 != 0)
            }));
        }
        all
    }
}

/// The number of rays for which a tree differs from an exhaustive search, and the number of hits.
fn differences(
    jumble: &Jumble,
    tree: &World,
    level: Level,
    rays: usize,
    stream: &mut Stream,
) -> (usize, usize) {
    let rays: Vec<_> = (0..rays).map(|_| jumble.ray(stream)).collect();
    let every = World::new(&jumble.surfaces, AcceleratorChoice::Simple);
    let truth: Vec<f32> = rays.iter().map(|ray| every.intersect(ray, true).t).collect();
    let limits: Vec<f32> = truth
        .iter()
        .map(|&t| match stream.random_range(0..5) {
            0 => t,
            1 => t.next_up(),
            2 => t.next_down(),
            3 => NOTHING,
            _ => t.min(1e30) * stream.random_range(0.5..2.0),
        })
        .collect();
    let simple = dispatch(Level::SCALAR, Ask { world: &every, rays: &rays, limits: &limits });
    let found = dispatch(level, Ask { world: tree, rays: &rays, limits: &limits });
    let hits = truth.iter().filter(|&&t| t < NOTHING).count();
    let differing: Vec<_> = found.iter().zip(&simple).filter(|(a, b)| a != b).collect();
    if let Some(first) = differing.first() {
        println!("found and to be found: {first:?}");
    }
    (differing.len(), hits)
}

#[test]
fn trees_agree_with_an_exhaustive_search() {
    let stream = &mut Stream::new(11, 0, 0);
    let levels = Level::available();
    let (mut rays, mut hits) = (0, 0);
    for i in 0..1000 {
        let jumble = jumble(stream);
        // Everything in the tree, or only meshes, which are searched up to the hit on other surfaces.
        let tree_scope =
            if (i / levels.len()).is_multiple_of(2) { TreeScope::Everything } else { TreeScope::Meshes };
        let tree = World::with_tree_scope(&jumble.surfaces, tree_scope);
        let level = levels[i % levels.len()];
        let (wrong, some) = differences(&jumble, &tree, level, 1000, stream);
        assert_eq!(wrong, 0, "scene {i}, {level}: {:?}", jumble.surfaces);
        rays += 1000;
        hits += some;
    }
    assert!(rays >= 1_000_000 && hits > rays / 4, "{hits} hits of {rays} rays");
}

#[test]
fn boxes_that_are_too_small_are_detected() {
    // Smaller than the shapes by a thousandth, and by rounding errors.
    for share in [1e-3, 3e-6] {
        let stream = &mut Stream::new(12, 0, 0);
        let mut wrong = 0;
        for _ in 0..200 {
            let jumble = jumble(stream);
            let (simple, tree) = Bvh::with(
                &jumble.surfaces,
                TreeScope::Everything,
                |bounds| bounds.grown(-share).grown(-stride::shape::BOUNDS_ERROR),
                1,
            );
            let tree = World { simple, tree: Some(tree) };
            wrong += differences(&jumble, &tree, Level::SCALAR, 500, stream).0;
        }
        assert!(wrong > 20, "{wrong} wrong results with boxes smaller by {share}");
    }
}

/// A non-finite ray: one or several components are NaN or infinite.
fn broken(jumble: &Jumble, stream: &mut Stream) -> Ray<f32> {
    let Ray { o, d, .. } = jumble.ray(stream);
    let mut numbers = [o.x, o.y, o.z, d.x, d.y, d.z];
    let which = match stream.random_range(0..3) {
        0 => 1 << stream.random_range(0..6),
        1 => stream.random_range(1..64_u32),
        _ => [0b00_0111, 0b11_1000, 0b11_1111][stream.random_range(0..3)],
    };
    for coordinate in (0..6).filter(|coordinate| which >> coordinate & 1 != 0) {
        numbers[coordinate] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][stream.random_range(0..3)];
    }
    let [ox, oy, oz, dx, dy, dz] = numbers;
    Ray::new(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz))
}

/// The results of every world for some rays at every level.
fn every_answer(jumble: &Jumble, rays: &[Ray<f32>], limits: &[f32]) -> Vec<Vec<Answer>> {
    let all = [TreeScope::Nothing, TreeScope::Everything, TreeScope::Meshes];
    let worlds = all.map(|tree_scope| World::with_tree_scope(&jumble.surfaces, tree_scope));
    let ask = |level| worlds.iter().map(move |world| dispatch(level, Ask { world, rays, limits }));
    Level::available().into_iter().flat_map(ask).collect()
}

#[test]
fn non_finite_rays_hit_nothing_in_any_world_at_any_level() {
    let stream = &mut Stream::new(14, 0, 0);
    for _ in 0..200 {
        let jumble = jumble(stream);
        let rays: Vec<_> = (0..100).map(|_| broken(&jumble, stream)).collect();
        let limits: Vec<_> = (0..100).map(|i| [NOTHING, 1e30, 1.0, f32::NAN][i % 4]).collect();
        let nothing = vec![(NOTHING.to_bits(), u32::MAX, 0, [0; 2], false); rays.len()];
        for answers in every_answer(&jumble, &rays, &limits) {
            let wrong = answers.iter().zip(&rays).find(|(answer, _)| **answer != nothing[0]);
            assert!(wrong.is_none(), "{wrong:?} in {:?}", jumble.surfaces);
        }
    }
}

#[test]
fn rays_without_a_direction_end_and_agree() {
    let stream = &mut Stream::new(15, 0, 0);
    for _ in 0..100 {
        let jumble = jumble(stream);
        let zero = [0.0_f32, -0.0];
        let ray = |stream: &mut Stream| {
            Ray::new(jumble.ray(stream).o, Vec3::splat([(); 3].map(|()| zero[stream.random_range(0..2)])))
        };
        let rays: Vec<_> = (0..100).map(|_| ray(stream)).collect();
        let answers = every_answer(&jumble, &rays, &[NOTHING; 100]);
        assert!(answers.iter().all(|answer| *answer == answers[0]), "in {:?}", jumble.surfaces);
    }
}

#[test]
fn a_ray_that_overflows_in_an_instance_hits_nothing_there() {
    let mesh = Mesh {
        positions: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]; 9],
        ..Mesh::default()
    };
    let mut triangles = Triangles::default();
    let mut instances = Instances::default();
    instances.meshes.push(triangles.push_shared(&mesh));
    let tiny = DAffine3::from_scale(DVec3::splat(1e-37));
    assert!(Instances::can_place(&tiny));
    instances.push(0, &tiny, 0);
    let surfaces =
        Simple { triangles: Arc::new(triangles), instances: Arc::new(instances), ..Simple::default() };
    let tree = World::new(&surfaces, AcceleratorChoice::Bvh);
    // From so far that its origin has no finite coordinate in the mesh's space.
    let d = Vec3::<f32>::splat([-1.0, -1.0, -1.0]).normalized();
    let ray = Ray::new(d * -1e3, d);
    for level in Level::available() {
        let found = dispatch(level, Ask { world: &tree, rays: &[ray], limits: &[NOTHING] });
        assert_eq!(found, [(NOTHING.to_bits(), u32::MAX, 0, [0; 2], false)], "{level}");
    }
}
