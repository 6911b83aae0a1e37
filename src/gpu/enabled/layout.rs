//! Data exchanged between the host and the device: layouts, and constants that both must agree on.

use crate::film::Reject;
use bytemuck::{Pod, Zeroable};

/// A structure and its memory layout.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Structure {
    pub(super) name: &'static str,
    pub(super) size: usize,
    docs: &'static [&'static str],
    pub(super) fields: Vec<Field>,
}

/// A field of a structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) offset: usize,
    pub(super) size: usize,
    /// The type in Rust.
    ty: &'static str,
    docs: &'static [&'static str],
}

/// Declares structures for the host, and lists their fields, from which the WGSL declarations are made. Fields whose
/// names begin with an underscore are padding that WGSL inserts by itself.
macro_rules! shared {
    ($(
        $(#[doc = $doc:literal])*
        struct $name:ident { $($(#[doc = $field_doc:literal])* $field:ident: $type:ty,)* }
    )*) => {
        $($(#[doc = $doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        #[repr(C)]
        pub(super) struct $name { $($(#[doc = $field_doc])* pub(super) $field: $type,)* })*

        /// All structures.
        pub(super) fn structures() -> Vec<Structure> {
            vec![$(Structure {
                name: stringify!($name),
                size: size_of::<$name>(),
                docs: &[$($doc),*],
                fields: vec![$(Field {
                    name: stringify!($field),
                    offset: std::mem::offset_of!($name, $field),
                    size: size_of::<$type>(),
                    ty: stringify!($type),
                    docs: &[$($field_doc),*],
                },)*],
            },)*]
        }
    };
}

impl Structure {
    /// The fields without padding.
    pub(super) fn named(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| !field.name.starts_with('_'))
    }

    /// The declaration in WGSL.
    fn declaration(&self) -> String {
        let comment = |docs: &[&str], indent: &str| -> String {
            docs.iter().map(|doc| format!("{indent}//{doc}\n")).collect()
        };
        let field = |field: &Field| {
            format!("{}    {}: {},\n", comment(field.docs, "    "), field.name, field.wgsl_type())
        };
        let fields: String = self.named().map(field).collect();
        format!("{}struct {} {{\n{fields}}}\n\n", comment(self.docs, ""), self.name)
    }
}

impl Field {
    /// The type in WGSL.
    pub(super) fn wgsl_type(&self) -> &'static str {
        match self.ty {
            "u32" => "u32",
            "i32" => "i32",
            "f32" => "f32",
            "[f32; 2]" => "vec2f",
            "[f32; 3]" => "vec3f",
            "[f32; 4]" => "vec4f",
            "[u32; 2]" => "vec2u",
            "[u32; 3]" => "vec3u",
            "[u32; 4]" => "vec4u",
            "[[f32; 4]; 17]" => "array<vec4f, 17>",
            other => unreachable!("no field has the type {other}"),
        }
    }
}

impl Scene {
    /// Sets a field from the bits of its numbers.
    ///
    /// # Panics
    /// Panics if there is no such field, or it takes another number of words.
    pub(super) fn set(&mut self, name: &str, words: &[u32]) {
        let all = structures();
        let fields = all.iter().filter(|structure| structure.name == "Scene").flat_map(Structure::named);
        let Some(&Field { offset, size, .. }) = fields.into_iter().find(|field| field.name == name) else {
            unreachable!("a scene has no field {name}");
        };
        bytemuck::bytes_of_mut(self)[offset..offset + size].copy_from_slice(bytemuck::cast_slice(words));
    }
}

/// The declarations of all structures in WGSL.
pub(super) fn declarations() -> String {
    structures().iter().map(Structure::declaration).collect()
}

shared! {
    /// The camera, the film, the settings, and the sizes of all tables.
    struct Scene {
        eye: [f32; 3],
        pixel_side: f32,
        left: [f32; 3],
        near: f32,
        up: [f32; 3],
        aperture_radius: f32,
        forward: [f32; 3],
        focus_distance: f32,
        environment: [f32; 3],
        seed: u32,
        /// The bounding sphere of the scene.
        extent_centre: [f32; 3],
        extent_radius: f32,
        /// The ambient radiance of `whitted`.
        ambient: [f32; 3],
        max_depth: u32,
        centre: [f32; 2],
        offset_radius: f32,
        /// The surfaces that every ray is tested against, sorted by kind: planes, spheres, quads, then custom shapes.
        /// Each field is the end of a kind and the start of the next; the following rows are in the tree or belong to
        /// meshes.
        planes_end: u32,
        spheres_end: u32,
        quads_end: u32,
        custom_end: u32,
        /// The numbers of lights that can be sampled, and of delta lights and lights at infinity among them. Each light
        /// at infinity is a group of its own; all others form one group.
        lights: u32,
        delta_lights: u32,
        infinite_lights: u32,
        light_groups: u32,
        film_width: u32,
        region_x: u32,
        region_y: u32,
        region_width: u32,
        /// Zero, in a form that no compiler can fold.
        zero: u32,
        /// The heap's words at which the tables start.
        surfaces_from: u32,
        materials_from: u32,
        lights_from: u32,
        light_nodes_from: u32,
        tree_nodes_from: u32,
        triangles_from: u32,
        vertices_from: u32,
        places_from: u32,
        /// The root of the top-level tree, and the fraction by which a ray is moved relative to its boxes.
        tree_root: u32,
        tree_share: f32,
        /// The heap's word at which the filter's weights start.
        weights_from: u32,
        /// The heap's words at which these start: the cells of grids, the uv of textured triangles, media, textured
        /// parameters, instructions of textures, pictures, and their texels.
        cells_from: u32,
        corners_from: u32,
        media_from: u32,
        bindings_from: u32,
        instructions_from: u32,
        pictures_from: u32,
        texels_from: u32,
        /// Added to a position in multiples of 2^−CHANCE_BITS, the first number gives the first tap, rounded down. The
        /// second tells whether it is inexact, so that ties are possible.
        tap_shift: i32,
        tap_ties: u32,
        /// Columns and rows of the grid by which a picture at infinity is sampled.
        smooth_columns: u32,
        smooth_rows: u32,
        /// The media that contain the camera, in two words.
        inside_x: u32,
        inside_y: u32,
        /// The table of `FilmOffset::Drawn`: 65 nodes, four per row.
        offset_nodes: [[f32; 4]; 17],
    }

    /// One dispatch: a range of samples, for each of some slots of a stride.
    struct Dispatch {
        /// The stride: every nth pixel, or every nth run of pixels.
        stride_first: u32,
        stride_step: u32,
        stride_run: u32,
        first_slot: u32,
        slots: u32,
        invocations: u32,
        first_sample: u32,
        samples: u32,
        sends_samples: u32,
        /// The band that samples are added to: its first column and row on the entire film, and its size.
        band_left: i32,
        band_top: i32,
        band_width: u32,
        band_pixels: u32,
        /// The maximum number of samples returned because they are too bright for the band.
        most_bright: u32,
    }

    /// A node of the light tree.
    struct LightNode {
        centre: [f32; 3],
        radius: f32,
        axis: [f32; 3],
        power: f32,
        cos_o: f32,
        cos_e: f32,
        spread: f32,
        /// The index of the first child, which the others follow, with the number of children minus one in the bits
        /// from COUNT_FROM; or the index of the light, with LEAF set.
        link: u32,
        /// The squared distance beyond which lights are chosen by power alone.
        far2: f32,
        /// The power, in integer units.
        units: u32,
        /// The index of its first light in the order of the tree.
        first: u32,
        /// The root of a mesh light's tree, and the number of its lights.
        lights: u32,
    }

    /// A node of the tree over surfaces: eight boxes, rounded outwards to 256 steps of a power of two along each axis.
    struct TreeNode {
        /// The minimum coordinates of the boxes.
        origin: [f32; 3],
        /// The exponents of the steps along x, y and z, biased as in floats, then a mask of the boxes that hold nodes.
        scales: u32,
        /// The index of the first child node, which the others follow, and of the first leaf item of each kind;
        /// instances are stored among triangles.
        nodes: u32,
        triangles: u32,
        surfaces: u32,
        /// The parent; NO_NODE for the root of a tree.
        parent: u32,
        /// Sixteen bits for each box: see `leaf_at`.
        leaves: [u32; 4],
        /// Eight bits for each box.
        low_x: [u32; 2],
        low_y: [u32; 2],
        low_z: [u32; 2],
        high_x: [u32; 2],
        high_y: [u32; 2],
        high_z: [u32; 2],
    }

    /// A triangle of a mesh.
    struct Triangle {
        a: [f32; 3],
        /// The host's surface number, by which ties are resolved.
        number: u32,
        b: [f32; 3],
        /// The mesh's index in `surfaces`. For a shared mesh, its instance holds the index.
        surface: u32,
        c: [f32; 3],
        /// Index into `lights`, or NO_LIGHT.
        light: u32,
        /// Indices into `vertices`.
        vertices: [u32; 3],
        _end: u32,
    }

    /// An instance of a group or shared mesh, for traversal. It has the size of a triangle.
    struct Instance {
        /// The rows of the matrix that transforms directions to the mesh's own space.
        to_mesh_x: [f32; 3],
        /// The root of the mesh's tree.
        root: u32,
        to_mesh_y: [f32; 3],
        /// The instance's number on the host, from 1.
        number: u32,
        to_mesh_z: [f32; 3],
        _middle: u32,
        /// The origin of the mesh's space, in the world.
        origin: [f32; 3],
        _end: u32,
    }

    /// An instance for the completion of hits, indexed by its number minus 1.
    struct PlaceRow {
        /// The rows of the matrix that transforms directions to the world.
        to_world_x: [f32; 3],
        /// The largest factor by which the matrix stretches a vector.
        stretch: f32,
        to_world_y: [f32; 3],
        /// The condition number of the matrix for errors.
        condition: f32,
        to_world_z: [f32; 3],
        /// The row in `surfaces`; for a group, whose surfaces have their own rows, the largest `u32`.
        surface: u32,
        to_mesh_x: [f32; 3],
        /// −1 for a mirrored group, else 1.
        side: f32,
        to_mesh_y: [f32; 3],
        _y: u32,
        to_mesh_z: [f32; 3],
        _z: u32,
        origin: [f32; 3],
        _end: u32,
    }

    /// The attributes of a mesh vertex.
    struct MeshVertex {
        /// The normal, or zero if there is none; a missing uv is NaN.
        normal: [f32; 3],
        u: f32,
        v: f32,
        second_u: f32,
        second_v: f32,
        _end: u32,
    }

    /// A pending branch of `whitted`.
    struct WaitingBranch {
        o: [f32; 3],
        depth: u32,
        d: [f32; 3],
        /// The two words of its interiors.
        interiors_x: u32,
        beta: [f32; 3],
        interiors_y: u32,
    }

    /// Exact sums of the samples of one slot. Radiance: 96 bits per channel, in three words; squares: 128 bits.
    struct SlotSums {
        low: [u32; 3],
        /// The number of rays traced; zero if the driver ended the work early.
        rays: u32,
        middle: [u32; 3],
        /// The number of rejected samples; the two highest bits are the reason for the first.
        rejected: u32,
        high: [u32; 3],
        first_reject: u32,
        squares: [u32; 4],
    }

    /// One sample. Floats are stored as bit patterns, so that NaN is preserved.
    struct SampleWords {
        pixel: u32,
        sample: u32,
        x: u32,
        y: u32,
        red: u32,
        green: u32,
        blue: u32,
    }
}

/// The bits of [`SlotSums::rejected`] that hold the number.
pub(super) const REJECT_SHIFT: u32 = 30;

/// The reasons and their codes on the device; zero means none.
pub(super) const REJECTS: [(u32, Reject); 3] =
    [(1, Reject::NotANumber), (2, Reject::TooBright), (3, Reject::Negative)];

/// The distance of a missing hit. The CPU uses infinity, which WGSL cannot express.
pub(super) const NOTHING: f32 = f32::MAX;

/// Fraction bits of a film position, which is the sum of a half-integer and a drawn number of that many bits.
pub(super) const CHANCE_BITS: u32 = 24;

/// Taps per word of the heap.
pub(super) const TAPS_IN_A_WORD: u32 = 4;

/// The maximum number of pending branches of `whitted` per invocation. Beyond it, branches are chosen at random.
pub(super) const MOST_BRANCHES: u32 = 16;
