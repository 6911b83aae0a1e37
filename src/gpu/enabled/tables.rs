//! From the compiled scene to the device's tables.

use super::layout::{self, Light, LightNode, Material, Scene, Surface};
use crate::gpu::{GpuError, Job};
use crate::light::{self, LightRow};
use crate::material::{Kind, Row};
use crate::sampling::warp::{FilmOffset, OFFSET_NODES};
use crate::scene::UNLIMITED;
use crate::shape;
use crate::world::{CompiledScene, SurfaceTable};

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
    pub(super) lights: Vec<Light>,
    pub(super) light_nodes: Vec<LightNode>,
}

impl Tables {
    pub(super) fn new(job: &Job<'_>) -> Result<Tables, GpuError> {
        let CompiledScene { camera, surfaces: table, materials, lights, environment, ambient, .. } =
            job.scene;
        if job.render.max_depth > MAX_DEPTH && job.render.max_depth != UNLIMITED {
            return Err(GpuError::Unsupported(format!("paths of more than {MAX_DEPTH} bounces")));
        }
        if table.triangles().is_some() {
            return Err(GpuError::Unsupported("triangle meshes".to_owned()));
        }
        // Sorted by shape, so that neighbouring invocations ask the same one.
        let mut surfaces = Vec::with_capacity(table.len());
        let mut take = |wanted: Form| {
            let rows =
                (0..table.len() as u32).filter(|&row| Form::of(&table.rows()[row as usize].0) == wanted);
            surfaces.extend(rows.map(|row| surface(table, row)));
            surfaces.len() as u32
        };
        let [planes_end, spheres_end, quads_end] = [Form::Plane, Form::Sphere, Form::Quad].map(&mut take);
        let point_lights = lights.rows().take_while(|light| light.kind == light::POINT).count();
        let mut offset_nodes = [[0.0; 4]; 17];
        let (offset_kind, offset_radius) = match job.offset {
            FilmOffset::Centre => (layout::OFFSET_CENTRE, 0.0),
            FilmOffset::Uniform(radius) => (layout::OFFSET_UNIFORM, radius),
            FilmOffset::Tent(radius) => (layout::OFFSET_TENT, radius),
            FilmOffset::Drawn(nodes) => {
                offset_nodes.as_flattened_mut()[..OFFSET_NODES].copy_from_slice(&nodes);
                (layout::OFFSET_DRAWN, 0.0)
            }
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
            environment: *environment,
            seed: job.render.seed,
            ambient: *ambient,
            max_depth: job.render.max_depth,
            centre: camera.centre,
            offset_kind,
            offset_radius,
            planes_end,
            spheres_end,
            quads_end,
            lights: lights.len() as u32,
            point_lights: point_lights as u32,
            film_width: job.region.film_width,
            region_x: job.region.x,
            region_y: job.region.y,
            region_width: job.region.width,
            offset_nodes,
            ..Scene::default()
        };
        Ok(Tables {
            scene,
            surfaces,
            materials: materials.rows().iter().map(material).collect(),
            lights: lights.rows().map(light_row).collect(),
            light_nodes: lights.tree().nodes().map(light_node).collect(),
        })
    }
}

/// Which shape a row of the surface table has.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Plane,
    Sphere,
    Quad,
}

impl Form {
    fn of(surface: &shape::Surface) -> Form {
        if surface.radius > 0.0 {
            Form::Sphere
        } else if surface.area.is_infinite() {
            Form::Plane
        } else {
            Form::Quad
        }
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
        light: look.light,
        row,
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

pub(super) fn light_row(light: LightRow) -> Light {
    Light {
        origin: light.origin,
        kind: light.kind,
        edge_u: light.edge_u,
        radius: light.radius,
        edge_v: light.edge_v,
        area: light.area,
        normal: light.normal,
        error: light.error,
        emission: light.emission,
        inward: u32::from(light.inward),
        way: light.way,
        square: u32::from(light.square),
        ..Light::default()
    }
}

pub(super) fn light_node(node: light::LightNode) -> LightNode {
    let light::LightNode { centre, spread, power, radius, axis, cos_o, cos_e, link } = node;
    LightNode { centre, radius, axis, power, cos_o, cos_e, spread, link }
}
