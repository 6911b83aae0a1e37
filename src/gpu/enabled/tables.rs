//! From the compiled scene to the device's tables.

use super::layout::{self, Material, PointLight, Scene, Surface};
use crate::gpu::{GpuError, Job};
use crate::light;
use crate::material::{Kind, Row};
use crate::sampling::warp::FilmOffset;
use crate::world::SurfaceTable;

/// The deepest paths that the GPU follows: a dispatch cannot be stopped, so its longest path must not take
/// long.
const MAX_DEPTH: u32 = 65_536;

/// WGSL promises square roots within 4.5 units in the last place where the CPU's are within ½, and a round
/// surface's share of a hit's error bound comes from one.
const ROUND_ERROR: f32 = 2.0;

/// A scene as the device sees it.
pub(super) struct Tables {
    pub(super) scene: Scene,
    pub(super) surfaces: Vec<Surface>,
    pub(super) materials: Vec<Material>,
    pub(super) point_lights: Vec<PointLight>,
}

impl Tables {
    pub(super) fn new(job: &Job<'_>) -> Result<Tables, GpuError> {
        if job.settings.max_depth > MAX_DEPTH {
            return Err(GpuError::Unsupported(format!("paths of more than {MAX_DEPTH} bounces")));
        }
        let worlds = [&job.geometry.first, &job.geometry.second];
        let mut surfaces = Vec::new();
        let mut take = |rows: &mut dyn Iterator<Item = u32>| {
            surfaces.extend(rows.map(|row| surface(&job.scene.surfaces, row)));
            surfaces.len() as u32
        };
        let planes_end = take(&mut worlds.iter().flat_map(|w| w.planes.iter().map(|(_, row)| *row)));
        let spheres_end = take(&mut worlds.iter().flat_map(|w| w.spheres.iter().map(|(_, row)| *row)));
        let quads_end = take(&mut worlds.iter().flat_map(|w| w.quads.iter().map(|(_, row)| *row)));
        let point_lights: Vec<_> = job.scene.point_lights.iter().map(point_light).collect();

        let camera = &job.scene.camera;
        let (offset_kind, offset_radius) = match job.settings.offset {
            FilmOffset::Centre => (layout::OFFSET_CENTRE, 0.0),
            FilmOffset::Uniform(radius) => (layout::OFFSET_UNIFORM, radius),
            FilmOffset::Tent(radius) => (layout::OFFSET_TENT, radius),
        };
        let scene = Scene {
            eye: camera.eye,
            pixel_side: camera.pixel_side,
            left: camera.left,
            near: camera.near,
            up: camera.up,
            aperture_radius: camera.aperture_radius,
            forward: camera.forward,
            focus_distance: camera.focus_distance,
            environment: job.scene.environment,
            seed: job.settings.sampler.seed,
            centre: camera.centre,
            offset_kind,
            offset_radius,
            planes_end,
            spheres_end,
            quads_end,
            point_lights: point_lights.len() as u32,
            max_depth: job.settings.max_depth,
            film_width: job.region.film_width,
            region_x: job.region.x,
            region_y: job.region.y,
            region_width: job.region.width,
            ..Scene::default()
        };
        let materials = job.scene.materials.rows().iter().map(material).collect();
        Ok(Tables { scene, surfaces, materials, point_lights })
    }
}

pub(super) fn surface(table: &SurfaceTable, row: u32) -> Surface {
    let (form, look) = &table.rows()[row as usize];
    let round = form.radius > 0.0;
    let error = if round { form.error * ROUND_ERROR } else { form.error };
    Surface {
        anchor: form.anchor,
        radius: form.radius,
        axis: if round { form.to_centre } else { form.normal },
        constant: if round { form.anchor_power } else { form.distance },
        u_axis: form.u_axis,
        v_axis: form.v_axis,
        emission: look.emission,
        error,
        orientation: if look.flip_normal { -1.0 } else { 1.0 },
        material: look.material,
        row,
        ..Surface::default()
    }
}

pub(super) fn material(row: &Row) -> Material {
    let transmittance = match row.kind {
        Kind::Matte | Kind::Mirror | Kind::Glass | Kind::Checkerboard => row.transmittance,
        // What the material returns, in the order of its thirds.
        #[cfg(feature = "broken-material")]
        Kind::Broken => [f32::NAN, f32::INFINITY, -1.0],
    };
    Material {
        reflectance: row.reflectance,
        kind: row.kind as u32,
        transmittance,
        ior: row.ior,
        checks: row.checks,
        checks_per_unit: row.checks_per_unit,
    }
}

fn point_light(light: light::PointLight) -> PointLight {
    PointLight { position: light.position, intensity: light.intensity, ..PointLight::default() }
}
