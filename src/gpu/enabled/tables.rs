//! The device's tables, built from the compiled scene.

use super::heap::Section;
use super::layout::{CHANCE_BITS, LightNode, Scene, TAPS_IN_A_WORD};
use super::recorded;
use super::rows::{HeapWord, Rows};
use super::tree::Tree;
use crate::film::{self, Splatter};
use crate::gpu::{GpuError, Job};
use crate::integrator::{self, Settings};
use crate::light::{self, LightTable};
use crate::material::MaterialTable;
use crate::math::ColumnReader;
use crate::sampling::warp::{FilmOffset, OFFSET_NODES};
use crate::scene::UNLIMITED;
use crate::shape::{self, CustomKind, SurfaceKind};
use crate::texture::Picture;
use crate::world::{CompiledScene, Simple, SurfaceTable, TreeScope, World};
use std::sync::Arc;

/// The maximum depth of paths on the GPU: a dispatch cannot be interrupted, so its longest path must be short.
const MAX_DEPTH: u32 = 65_536;

/// WGSL guarantees square roots within 4.5 ulp, the CPU within ½ ulp. The error bounds of hits on curved surfaces
/// depend on a square root.
pub(super) const ROUND_ERROR: f32 = 2.0;

/// A scene in the device's layout.
pub(super) struct Tables {
    pub(super) scene: Scene,
    pub(super) surfaces: Vec<HeapWord>,
    pub(super) materials: Vec<HeapWord>,
    pub(super) lights: Vec<HeapWord>,
    pub(super) light_nodes: Vec<LightNode>,
    pub(super) tree: Tree,
    pub(super) weights: Weights,
    pub(super) cells: Vec<HeapWord>,
    pub(super) corners: Vec<HeapWord>,
    pub(super) media: Vec<HeapWord>,
    pub(super) bindings: Vec<HeapWord>,
    pub(super) instructions: Vec<HeapWord>,
    pub(super) pictures: Vec<HeapWord>,
    /// The pictures, in the order of their texels in the heap.
    pub(super) texels: Vec<Arc<Picture>>,
    /// The recorded functions of the program for the scene.
    pub(super) recorded: String,
}

/// A filter's weights, if samples count in all pixels around them.
#[derive(Default)]
pub(super) struct Weights {
    /// Taps along an axis; zero if samples count only in their own pixels.
    pub(super) taps: u32,
    /// The table's rows, each padded with zero taps to whole words of the heap.
    rows: Vec<[i32; TAPS_IN_A_WORD as usize]>,
}

impl Weights {
    fn new(weights: &film::Weights) -> Weights {
        let mut rows = Vec::new();
        for row in weights.table().chunks_exact(weights.width()) {
            rows.extend(row.chunks(TAPS_IN_A_WORD as usize).map(|some| {
                let mut taps = [0; TAPS_IN_A_WORD as usize];
                taps[..some.len()].copy_from_slice(some);
                taps
            }));
        }
        Weights { taps: weights.width() as u32, rows }
    }
}

impl Tables {
    pub(super) fn new(job: &Job<'_>) -> Result<Tables, GpuError> {
        let CompiledScene { surfaces: table, materials, lights, ambient, .. } = job.scene;
        if job.render.max_depth > MAX_DEPTH && job.render.max_depth != UNLIMITED {
            return Err(GpuError::Unsupported(format!("paths of more than {MAX_DEPTH} bounces")));
        }
        if integrator::contributes(job.render.integrator) {
            return Err(GpuError::Unsupported("samples that contribute to other pixels".to_owned()));
        }
        // Meshes and groups are intersected only through the tree.
        let with_meshes;
        let Simple { triangles, instances, .. } = &job.world.simple;
        let world = if triangles.is_empty() && instances.is_empty() {
            job.world
        } else {
            with_meshes = World::with_tree_scope(&job.world.simple, TreeScope::Meshes);
            &with_meshes
        };
        let mut order = Order::default();
        // Sorted by kind, so that neighbouring invocations run the same test.
        let [planes_end, spheres_end, quads_end, custom_end] = order.asked_by_all(&world.simple);
        let tree = world.tree.as_ref();
        let mut tree = tree.map_or_else(Tree::default, |bvh| Tree::new(bvh, table, custom_end));
        order.append(&tree.rows);
        order.append(&meshes(table));
        let places = order.places(table.len());
        tree.put_surfaces(&places);
        let surfaces = surface_rows(table, &SurfaceColumns::new(table)?).packed_as(&order.rows);
        let mut offset_nodes = [[0.0; 4]; 17];
        if let FilmOffset::Drawn(nodes) = job.offset {
            offset_nodes.as_flattened_mut()[..OFFSET_NODES].copy_from_slice(&nodes);
        }
        let weights = job.splatter.map(Splatter::weights);
        // The truncated bits lie between two possible positions: no sample gets another tap because of it.
        let shift = weights.map_or(0.0, film::Weights::shift) * f64::from(1_u32 << CHANCE_BITS);
        let (tap_shift, tap_ties) = (shift.floor() as i32, u32::from(shift.floor() == shift));
        let settings = Settings::new(job.render, job.offset);
        let scene = Scene {
            ambient: *ambient,
            planes_end,
            spheres_end,
            quads_end,
            custom_end,
            lights: lights.len() as u32,
            film_width: job.region.film_width,
            region_x: job.region.x,
            region_y: job.region.y,
            region_width: job.region.width,
            offset_nodes,
            tree_root: tree.root,
            tree_share: tree.share,
            tap_shift,
            tap_ties,
            ..recorded::numbers(job.scene, &settings)
        };
        let (cells, corners) = (cell_rows(lights).packed(), corner_rows(lights).packed());
        let (lights, light_nodes) = light_tables(lights);
        let source = recorded::Source {
            scene: job.scene,
            world,
            settings: &settings,
            integrator: job.render.integrator,
        };
        Ok(Tables {
            recorded: recorded::text(&source)?,
            scene,
            surfaces,
            materials: material_rows(materials).packed(),
            lights,
            light_nodes,
            tree,
            weights: weights.map_or_else(Weights::default, Weights::new),
            cells,
            corners,
            media: medium_rows(materials).packed(),
            bindings: binding_rows(materials).packed(),
            instructions: instruction_rows(materials).packed(),
            pictures: picture_rows(materials).packed(),
            texels: materials.textures().pictures().to_vec(),
        })
    }
}

/// The host's rows of surfaces, in the device's order.
#[derive(Default)]
struct Order {
    rows: Vec<u32>,
}

impl Order {
    /// Adds the surfaces that every ray is tested against: planes, spheres, quads and custom shapes. Returns the end of
    /// each kind.
    fn asked_by_all(&mut self, simple: &Simple) -> [u32; 4] {
        let Simple { planes, spheres, quads, custom, .. } = simple;
        let kinds: [Vec<u32>; 4] = [
            planes.iter().map(|(_, row)| *row).collect(),
            spheres.iter().map(|(_, row)| *row).collect(),
            quads.iter().map(|(_, row)| *row).collect(),
            custom.iter().map(|(_, row)| *row).collect(),
        ];
        kinds.map(|mut rows| {
            rows.sort_unstable();
            self.append(&rows);
            self.rows.len() as u32
        })
    }

    fn append(&mut self, rows: &[u32]) {
        self.rows.extend(rows);
    }

    /// The device's row of each of the host's rows.
    fn places(&self, rows: usize) -> Vec<u32> {
        let mut places = vec![0; rows];
        (0..).zip(&self.rows).for_each(|(place, &row)| places[row as usize] = place);
        places
    }
}

/// The host's rows of meshes.
fn meshes(table: &SurfaceTable) -> Vec<u32> {
    let is_mesh = |row: &u32| table.rows()[*row as usize].0 == shape::Surface::OF_A_MESH;
    (0..table.len() as u32).filter(is_mesh).collect()
}

impl Tables {
    /// The tables, in their order in the heap.
    pub(super) fn sections(&self) -> Vec<Section<'_>> {
        let tables = [
            Section::new(&self.surfaces),
            Section::new(&self.materials),
            Section::new(&self.lights),
            Section::new(&self.light_nodes),
            Section::new(&self.tree.nodes),
            Section::new(&self.tree.triangles),
            Section::new(&self.tree.vertices),
            Section::new(&self.tree.places),
            Section::new(&self.weights.rows),
            Section::new(&self.cells),
            Section::new(&self.corners),
            Section::new(&self.media),
            Section::new(&self.bindings),
            Section::new(&self.instructions),
            Section::new(&self.pictures),
        ];
        tables.into_iter().chain(self.texels.iter().map(|picture| Section::new(picture.words()))).collect()
    }

    /// The number of words of the heap.
    pub(super) fn words(&self) -> usize {
        self.sections().iter().map(Section::words).sum()
    }

    /// The scene's numbers, including the start of each table in the heap.
    pub(super) fn scene(&self) -> Scene {
        let mut next = 0;
        let mut begin = self.sections().into_iter().map(|section| {
            let from = next;
            // A heap whose words cannot be indexed is rejected.
            next += section.words() as u32;
            from
        });
        let mut table = || begin.next().unwrap_or(0);
        Scene {
            surfaces_from: table(),
            materials_from: table(),
            lights_from: table(),
            light_nodes_from: table(),
            tree_nodes_from: table(),
            triangles_from: table(),
            vertices_from: table(),
            places_from: table(),
            weights_from: table(),
            cells_from: table(),
            corners_from: table(),
            media_from: table(),
            bindings_from: table(),
            instructions_from: table(),
            pictures_from: table(),
            // The first picture, if there is one.
            texels_from: table(),
            ..self.scene
        }
    }
}

/// Columns of surfaces that only the device has.
#[derive(Default)]
pub(super) struct SurfaceColumns {
    /// The coefficient of a hit's error bound.
    error: Vec<f32>,
    /// The host's surface number, by which ties are resolved.
    row: Vec<u32>,
}

impl SurfaceColumns {
    /// Fails if the device does not support a surface's shape.
    pub(super) fn new(table: &SurfaceTable) -> Result<SurfaceColumns, GpuError> {
        let mut own = SurfaceColumns::default();
        for (row, ((form, attributes), error)) in (0..).zip(table.rows().iter().zip(table.errors())) {
            // Whether `shapes.wgsl` supports the shape, and whether its hits depend on a square root.
            let (is_known, is_rooted) = match form.kind {
                SurfaceKind::Flat | SurfaceKind::Custom(CustomKind::Disk) => (true, false),
                SurfaceKind::Round | SurfaceKind::Custom(CustomKind::Cylinder) => (true, true),
            };
            if !is_known {
                return Err(GpuError::Unsupported(format!("the shape of entity {}", attributes.entity + 1)));
            }
            own.error.push(error * if is_rooted { ROUND_ERROR } else { 1.0 });
            own.row.push(row);
        }
        Ok(own)
    }

    fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let SurfaceColumns { error, row } = self;
        reader.floats("error", error);
        reader.words("row", row);
    }
}

/// The columns of surfaces.
pub(super) fn surface_rows<'a>(table: &'a SurfaceTable, own: &'a SurfaceColumns) -> Rows<'a> {
    let mut rows = Rows::default();
    table.columns(&mut rows);
    own.columns(&mut rows);
    rows
}

/// The columns of materials.
pub(super) fn material_rows(table: &MaterialTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.columns(&mut rows);
    rows
}

/// The columns of the grids of lights.
pub(super) fn cell_rows(table: &LightTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.grids().columns(&mut rows);
    rows
}

/// The columns of the uv of lights.
pub(super) fn corner_rows(table: &LightTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.corner_uv().columns(&mut rows);
    rows
}

/// The columns of media.
pub(super) fn medium_rows(table: &MaterialTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.media_columns(&mut rows);
    rows
}

/// The columns of textured parameters.
pub(super) fn binding_rows(table: &MaterialTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.bindings().columns(&mut rows);
    rows
}

/// The columns of the instructions of textures.
pub(super) fn instruction_rows(table: &MaterialTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.textures().instruction_columns(&mut rows);
    rows
}

/// The columns of pictures.
pub(super) fn picture_rows(table: &MaterialTable) -> Rows<'_> {
    let mut rows = Rows::default();
    table.textures().picture_columns(&mut rows);
    rows
}

/// Columns of lights that only the device has.
#[derive(Default)]
pub(super) struct LightColumns {
    /// Its index in the order of the light tree.
    pub(super) place: Vec<u32>,
    /// The power, in integer units.
    pub(super) units: Vec<u32>,
    /// For the first triangle of a mesh that is one light, the root of the tree of its triangles; otherwise zero.
    pub(super) lamp: Vec<u32>,
    /// The rows of delta lights, in the first rows.
    pub(super) delta_light: Vec<u32>,
    /// The rows of lights at infinity, in the first rows.
    pub(super) infinite_light: Vec<u32>,
}

impl LightColumns {
    fn columns<'a>(&'a self, reader: &mut impl ColumnReader<'a>) {
        let LightColumns { place, units, lamp, delta_light, infinite_light } = self;
        reader.words("place", place);
        reader.words("units", units);
        reader.words("lamp", lamp);
        reader.words("delta_light", delta_light);
        reader.words("infinite_light", infinite_light);
    }
}

/// A column padded with zeros to a number of rows.
fn padded(values: &[u32], rows: usize) -> Vec<u32> {
    let mut column = values.to_vec();
    column.resize(rows, 0);
    column
}

/// The columns of lights.
pub(super) fn light_rows<'a>(table: &'a LightTable, own: &'a LightColumns) -> Rows<'a> {
    let mut rows = Rows::default();
    table.columns(&mut rows);
    own.columns(&mut rows);
    rows
}

/// WGSL that declares and reads the rows that are built from columns. It is the same for all scenes.
pub(super) fn readers() -> String {
    let (surfaces, lights) = (SurfaceTable::default(), LightTable::default());
    let materials = MaterialTable::default();
    surface_rows(&surfaces, &SurfaceColumns::default()).text("Surface", "surface_at", "surfaces_from")
        + &material_rows(&materials).text("Material", "material_at", "materials_from")
        + &cell_rows(&lights).text("Cell", "cell_at", "cells_from")
        + &corner_rows(&lights).text("Corner", "corner_at", "corners_from")
        + &medium_rows(&materials).text("Medium", "medium_at", "media_from")
        + &binding_rows(&materials).text("Binding", "binding_at", "bindings_from")
        + &instruction_rows(&materials).text("Instruction", "instruction_at", "instructions_from")
        + &picture_rows(&materials).text("PictureRow", "picture_at", "pictures_from")
        + &light_rows(&lights, &LightColumns::default()).text("Light", "light_at", "lights_from")
}

/// The rows of lights and the nodes of their tree, followed by those of mesh lights.
pub(super) fn light_tables(table: &LightTable) -> (Vec<HeapWord>, Vec<LightNode>) {
    let (tree, lights) = (table.tree(), 0..table.len());
    let mut own = LightColumns {
        place: lights.clone().map(|light| tree.place(light)).collect(),
        units: lights.clone().map(|light| tree.units(light)).collect(),
        lamp: vec![0; lights.len()],
        delta_light: padded(table.delta_lights(), lights.len()),
        infinite_light: padded(table.infinite_lights(), lights.len()),
    };
    let mut nodes: Vec<_> = tree.nodes().map(light_node).collect();
    for lamp in table.mesh_emitters() {
        let root = nodes.len() as u32;
        own.lamp[lamp.lights.start as usize] = root;
        // Its lights and its nodes are indexed from zero.
        nodes.extend(lamp.tree.nodes().map(|node| {
            let link = node.link + if node.link < light::LEAF { root } else { lamp.lights.start };
            light_node(light::LightNode { link, ..node })
        }));
        nodes[root as usize].lights = lamp.lights.len() as u32;
    }
    (light_rows(table, &own).packed(), nodes)
}

fn light_node(node: light::LightNode) -> LightNode {
    let light::LightNode { centre, spread, power, radius, axis, cos_o, cos_e, far2, units, first, link } =
        node;
    // Not infinity: WGSL lets compilers assume that there is none.
    let far2 = far2.min(f32::MAX);
    LightNode {
        centre,
        radius,
        axis,
        power,
        cos_o,
        cos_e,
        spread,
        link,
        far2,
        units,
        first,
        ..LightNode::default()
    }
}
