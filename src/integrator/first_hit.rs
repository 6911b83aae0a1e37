//! The first hits of camera rays, for the layers of an image that compositors and denoisers read.

use super::interiors::{self, Around};
use super::paths::Paths;
use super::queue::{Queue, Start};
use super::vertex::{State, TraceContext, with_material};
use crate::material::Bxdf;
use crate::math::lanes::{Kernel, MAX_LANES, Value};
use crate::math::{LaneFloat, LaneMask, LaneUint, Mask, Ray, Vec3};
use crate::world::{Hit, Uv};

/// The first hit of a camera ray behind any holes and surfaces that are no interfaces; all fields are zero if there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FirstHit {
    /// The index of the ray's pixel in [`Paths::pixels`].
    pub slot: u32,
    /// Whether the ray hit a surface.
    pub met: bool,
    /// The albedo: the fraction of light that the surface reflects, or transmits if it is transmissive.
    pub albedo: [f32; 3],
    /// The outward normal in world space; in scenes with normal or height maps, the shading normal.
    pub normal: [f32; 3],
    /// The point in world space.
    pub position: [f32; 3],
    /// The distance of the point from the eye along the viewing direction.
    pub depth: f32,
    /// The surface's uv coordinates.
    pub uv: [f32; 2],
    /// The entity's index in the scene.
    pub entity: u32,
    /// The index of the material at the point; with a checkerboard, that of the square.
    pub material: u32,
}

/// Traces the camera rays of paths to their first hits. The film positions are those of the paths.
pub(super) struct FirstHits<'a> {
    pub context: TraceContext<'a>,
    pub paths: &'a Paths<'a>,
    pub out: &'a mut Vec<FirstHit>,
}

impl Kernel for FirstHits<'_> {
    type Output = ();

    #[inline(always)]
    fn run<F: LaneFloat>(self) {
        let FirstHits { context, paths, out } = self;
        let (scene, settings) = (context.scene, context.settings);
        let (eye, forward) = (Vec3::splat(scene.camera.eye), Vec3::splat(scene.camera.forward));
        let mut queue = Queue::new(paths);
        let mut start = Start::<F>::nowhere();
        let mut ray = Ray::none();
        loop {
            let alive = queue.take(F::Mask::splat(true), settings, &scene.camera, &mut start, &mut ray);
            if !alive.any() {
                return;
            }
            let mut state = State::start(start.id, ray);
            let mut around = Around::at_camera(scene);
            // The lanes that look for a surface: at first all, then those behind holes and behind surfaces that are no
            // interfaces. Surfaces that samples pass straight through are not first hits.
            let (mut look, mut hit) = (alive, Hit::none());
            let (met, at) = loop {
                hit = Hit::blend(look, context.world.intersect_apart(&state.ray, look), hit);
                let met = alive & hit.is_some();
                if !met.any() {
                    break (met, None);
                }
                let at = scene.interaction_apart(&state.ray, &hit, met, Uv::Everywhere);
                let (at, holes) = with_material(&context, &state, &around, at, met);
                let mut is_none = F::Mask::splat(false);
                if interiors::are_tracked(scene) {
                    (around, is_none) = interiors::at_surface(scene, around, &at, met & !holes);
                }
                let (at_first, goes) = (around, look & (holes | is_none));
                if !goes.any() {
                    break (met, Some(at));
                }
                (around, look) = interiors::straight_on(around, goes & is_none, goes & holes);
                look = look & goes;
                // A path that has passed too many surfaces stays where it is.
                around = Around::blend(look, around, at_first);
                if !look.any() {
                    break (met, Some(at));
                }
                state.ray = Ray::blend(look, at.straight_on(&state.ray), state.ray);
            };
            let mut slot = [0; MAX_LANES];
            start.slot.store(&mut slot);
            let mut values = [[0.0; MAX_LANES]; 12];
            let (mut rows, mut materials) = ([0; MAX_LANES], [0; MAX_LANES]);
            if let Some(at) = at {
                at.point.row.store(&mut rows);
                scene.surfaces.material(&at.point).store(&mut materials);
                let albedo = scene.bsdf(&at).albedo();
                // Mapped normals are the visible ones.
                let n = if scene.materials.has_maps() { at.point.shading } else { at.point.n };
                let (p, [u, v]) = (at.point.p, at.uv);
                let depth = (p - eye).dot(forward);
                let all = [albedo.r, albedo.g, albedo.b, n.x, n.y, n.z, p.x, p.y, p.z, depth, u, v];
                values.iter_mut().zip(all).for_each(|(to, value)| value.store(to));
            }
            // The queue fills lanes in the order of the paths, and all of them end together.
            let (alive, met) = (alive.bits(), met.bits());
            for lane in (0..F::LANES).filter(|lane| alive >> lane & 1 != 0) {
                let empty = FirstHit { slot: slot[lane], ..FirstHit::default() };
                let at = |i: usize| values[i][lane];
                out.push(match met >> lane & 1 {
                    0 => empty,
                    _ => FirstHit {
                        met: true,
                        albedo: [at(0), at(1), at(2)],
                        normal: [at(3), at(4), at(5)],
                        position: [at(6), at(7), at(8)],
                        depth: at(9),
                        uv: [at(10), at(11)],
                        entity: scene.surfaces.entity(rows[lane]),
                        material: materials[lane],
                        ..empty
                    },
                });
            }
        }
    }
}
