//! Lights of every shape, seen from points.

use crate::common::chi_square::{Outcome, Polar, compare, narrow};
use crate::common::scenes::{
    cylinder, disk, emitting, flipped, gallery, matte, mesh, quad, scene, sphere, v,
};
use glam::DVec3;
use stride::light::LightSample;
use stride::math::lanes::scalar::Wrapping;
use stride::math::{Ray, Vec3};
use stride::scene::{Entity, Mesh};
use stride::world::{AcceleratorChoice, CompiledScene, World, compile};

/// A scene with one light, seen from a point.
pub(super) struct Seen {
    pub(super) tables: CompiledScene,
    pub(super) world: World,
    pub(super) p: DVec3,
}

impl Seen {
    pub(super) fn new(light: Entity, p: DVec3) -> Seen {
        let (tables, surfaces) =
            compile(&scene(vec![matte([0.5; 3])], vec![emitting(light, 1.0)]), 16, 16).unwrap();
        Seen { tables, world: World::new(&surfaces, AcceleratorChoice::Simple), p }
    }

    pub(super) fn sample(&self, u: [f32; 4]) -> LightSample<f32> {
        self.tables.lights.sample(Wrapping(0), narrow(self.p), [u[0], u[1]])
    }

    /// The density of a direction, as for an integrator: where a ray hits the emitting side.
    pub(super) fn pdf(&self, d: Vec3<f32>) -> f32 {
        let ray = Ray::new(narrow(self.p), d);
        let hit = self.world.intersect(&ray, true);
        if !hit.is_some() {
            return 0.0;
        }
        let cos = -d.dot(self.tables.surfaces.point(&ray, &hit).n);
        if cos > 0.0 { self.tables.lights.pdf(Wrapping(0), ray.o, ray.at(hit.t), hit.t, cos) } else { 0.0 }
    }

    pub(super) fn compare(&self, polar: Polar, seed: u32) -> Outcome {
        compare(polar, seed, |u| self.sample(u).wi, |d| self.pdf(d))
    }
}

/// A rectangle of 2 by 1 seen from `p` in front of its centre, like [`sheet`].
pub(super) fn window(p: DVec3) -> (Seen, Polar) {
    let (s, t, n) = (v(0.8, 0.6, 0.0), v(0.0, 0.0, 1.0), v(0.6, -0.8, 0.0));
    let (a, b) = (s * 2.0, t);
    let middle = CENTRE + (a + b) / 2.0;
    let p = middle + s * p.x + t * p.y + n * p.z;
    (Seen::new(quad(CENTRE, a, b, 0), p), Polar::new(-n, middle - p))
}

pub(super) const CENTRE: DVec3 = DVec3::new(0.3, -0.2, 0.5);

/// A sphere of radius 1 seen from a distance to its centre.
pub(super) fn ball(distance: f64) -> (Seen, Polar) {
    let away = v(0.48, 0.6, -0.64);
    let light = sphere(CENTRE, 1.0, 0);
    let light = if distance < 1.0 { flipped(light) } else { light };
    (Seen::new(light, CENTRE + away * distance), Polar::new(-away, DVec3::X))
}

/// A quad with sides of 2 and 1, not perpendicular, seen from `p` in front of its centre: across, along, and above it.
/// Around its normal it covers a compact box of angles, however flat it appears.
pub(super) fn sheet(p: DVec3) -> (Seen, Polar) {
    let (s, t, n) = (v(0.8, 0.6, 0.0), v(0.0, 0.0, 1.0), v(0.6, -0.8, 0.0));
    let (a, b) = (s * 2.0, s * 0.3 + t);
    assert!((a.cross(b).normalize() - n).length() < 1e-9);
    let middle = CENTRE + (a + b) / 2.0;
    let p = middle + s * p.x + t * p.y + n * p.z;
    (Seen::new(quad(CENTRE, a, b, 0), p), Polar::new(-n, middle - p))
}

/// A [`sheet`] that emits a texture.
pub(super) fn screen(p: DVec3) -> (Seen, Polar) {
    let (Seen { p, .. }, polar) = sheet(p);
    let mut scene = gallery(16, 16);
    let (s, t) = (v(0.8, 0.6, 0.0), v(0.0, 0.0, 1.0));
    scene.entities = vec![Entity { emission_texture: Some(0), ..quad(CENTRE, s * 2.0, s * 0.3 + t, 6) }];
    let (tables, surfaces) = compile(&scene, 16, 16).unwrap();
    (Seen { tables, world: World::new(&surfaces, AcceleratorChoice::Simple), p }, polar)
}

/// A disk of radius 1 seen from `p`: across it, and above it.
pub(super) fn plate(p: DVec3) -> (Seen, Polar) {
    let (s, t, n) = (v(0.8, 0.6, 0.0), v(0.0, 0.0, 1.0), v(0.6, -0.8, 0.0));
    let p = CENTRE + s * p.x + t * p.y + n * p.z;
    (Seen::new(disk(CENTRE, n, 1.0, 0), p), Polar::new(-n, CENTRE - p))
}

/// A cylinder of radius ½ and length 2 seen from `p`: across its axis, and along it from its middle. One seen from
/// inside, or through an end, emits inwards.
pub(super) fn tube(p: DVec3) -> (Seen, Polar) {
    let (s, t, n) = (v(0.8, 0.6, 0.0), v(0.0, 0.0, 1.0), v(0.6, -0.8, 0.0));
    let light = cylinder(CENTRE - n, CENTRE + n, 0.5, 0);
    let light = if p.truncate().length() < 0.5 { flipped(light) } else { light };
    let p = CENTRE + s * p.x + t * p.y + n * p.z;
    (Seen::new(light, p), Polar::new(-n, CENTRE - p))
}

pub(super) fn all() -> Vec<(&'static str, (Seen, Polar))> {
    vec![
        ("a sphere", ball(3.0)),
        ("a distant sphere", ball(200.0)),
        ("a near sphere", ball(1.05)),
        ("a sphere at grazing distance", ball(1.0005)),
        ("a sphere from its centre", ball(0.0)),
        ("a sphere from inside", ball(0.5)),
        ("a sphere from inside, near its wall", ball(0.95)),
        ("a quad", sheet(v(0.2, 0.1, 2.0))),
        ("a distant quad", sheet(v(30.0, -50.0, 100.0))),
        ("a near quad", sheet(v(0.3, 0.1, 0.1))),
        ("a quad aside", sheet(v(-3.0, 2.0, 1.0))),
        ("a quad almost edge-on", sheet(v(3.0, 0.0, 0.02))),
        ("a rectangle", window(v(0.2, 0.1, 2.0))),
        ("a rectangle at the least solid angle", window(v(1.5, 1.0, 7.6))),
        ("a distant rectangle", window(v(30.0, -50.0, 100.0))),
        ("a near rectangle", window(v(0.3, 0.1, 0.1))),
        ("a rectangle almost touched", window(v(0.3, 0.1, 0.003))),
        ("a rectangle aside", window(v(-3.0, 2.0, 1.0))),
        ("a rectangle almost edge-on", window(v(2.0, 0.0, 0.2))),
        ("a screen", screen(v(0.2, 0.1, 2.0))),
        ("a screen close by", screen(v(0.3, 0.1, 0.3))),
        ("a screen aside", screen(v(-3.0, 2.0, 1.0))),
        ("a disk", plate(v(0.2, 0.1, 2.0))),
        ("a distant disk", plate(v(30.0, -50.0, 100.0))),
        ("a near disk", plate(v(0.3, 0.1, 0.1))),
        ("a disk aside", plate(v(-3.0, 2.0, 1.0))),
        ("a cylinder", tube(v(1.0, 2.0, 0.3))),
        ("a distant cylinder", tube(v(40.0, 90.0, -20.0))),
        ("a near cylinder", tube(v(0.3, 0.45, 0.2))),
        ("a cylinder almost touched", tube(v(0.3, 0.4002, 0.2))),
        ("a cylinder from beyond its end", tube(v(0.5, -0.4, 2.0))),
        ("a cylinder from far beyond its end", tube(v(1.0, 0.5, -20.0))),
        ("a cylinder from inside", tube(v(0.2, 0.1, 0.3))),
        ("a cylinder through its end", tube(v(0.2, 0.1, 2.0))),
    ]
}

/// Lights of every shape that emit a texture and are sampled by area, so that some samples face away.
pub(super) fn textured() -> Vec<(&'static str, (Seen, Polar))> {
    let glowing = |light: Entity, (seen, polar): (Seen, Polar)| {
        let mut scene = gallery(16, 16);
        scene.entities = vec![Entity { emission_texture: Some(0), material: 6, ..light }];
        let (tables, surfaces) = compile(&scene, 16, 16).unwrap();
        (Seen { tables, world: World::new(&surfaces, AcceleratorChoice::Simple), p: seen.p }, polar)
    };
    let (s, t, n) = (v(0.8, 0.6, 0.0), v(0.0, 0.0, 1.0), v(0.6, -0.8, 0.0));
    let round = || sphere(CENTRE, 1.0, 0);
    let flat = || disk(CENTRE, n, 1.0, 0);
    let long = || cylinder(CENTRE - n, CENTRE + n, 0.5, 0);
    let corners = [CENTRE, CENTRE + s * 2.0, CENTRE + s * 0.3 + t].map(|p| p.to_array().map(|x| x as f32));
    let uv = vec![[0.1, 0.2], [1.4, 0.1], [0.6, 0.9]];
    let triangle = Mesh { positions: corners.to_vec(), uv, triangles: vec![[0, 1, 2]], ..Mesh::default() };
    vec![
        ("a textured sphere", glowing(round(), ball(3.0))),
        ("a near textured sphere", glowing(round(), ball(1.2))),
        ("a textured sphere from inside", glowing(flipped(round()), ball(0.5))),
        ("a textured disk", glowing(flat(), plate(v(0.2, 0.1, 2.0)))),
        ("a near textured disk", glowing(flat(), plate(v(0.3, 0.1, 0.4)))),
        ("a textured cylinder", glowing(long(), tube(v(1.0, 2.0, 0.3)))),
        ("a textured cylinder from beyond its end", glowing(long(), tube(v(0.5, -0.4, 2.0)))),
        ("a textured cylinder from inside", glowing(flipped(long()), tube(v(0.2, 0.1, 0.3)))),
        ("a textured triangle", glowing(mesh(triangle, 0), sheet(v(0.2, 0.1, 2.0)))),
    ]
}
