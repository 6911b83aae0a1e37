//! What the host and the device exchange: the layouts, and the constants that both must agree on.

use crate::film::Reject;
use bytemuck::{Pod, Zeroable};

/// A structure, as it lies in memory.
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
    /// As Rust writes it.
    ty: &'static str,
    docs: &'static [&'static str],
}

/// Declares structures for the host, and lists them with their fields, of which WGSL gets its declarations. Fields whose
/// names begin with an underscore are WGSL's own gaps between its fields.
macro_rules! shared {
    ($(
        $(#[doc = $doc:literal])*
        struct $name:ident { $($(#[doc = $field_doc:literal])* $field:ident: $type:ty,)* }
    )*) => {
        $($(#[doc = $doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        #[repr(C)]
        pub(super) struct $name { $($(#[doc = $field_doc])* pub(super) $field: $type,)* })*

        /// Every structure.
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
    /// The fields that WGSL has.
    pub(super) fn named(&self) -> impl Iterator<Item = &Field> {
        self.fields.iter().filter(|field| !field.name.starts_with('_'))
    }

    /// Its declaration in WGSL.
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
    /// Its type in WGSL.
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
    /// Sets a field to the bits of its numbers.
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

/// The structures in WGSL.
pub(super) fn declarations() -> String {
    structures().iter().map(Structure::declaration).collect()
}

shared! {
    /// The camera, the film, the settings, and how much of everything there is.
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
        /// A ball around the scene.
        extent_centre: [f32; 3],
        extent_radius: f32,
        /// The ambient term of `whitted`.
        ambient: [f32; 3],
        max_depth: u32,
        centre: [f32; 2],
        offset_radius: f32,
        /// Surfaces that every ray asks are sorted by shape: planes, then spheres, then quads, then disks and cylinders as
        /// they come. Each ends where the next begins; what follows is in the tree, or is a mesh.
        planes_end: u32,
        spheres_end: u32,
        quads_end: u32,
        rare_end: u32,
        /// All lights that can be sampled, and the delta lights and those at infinity among them. Each of the latter is a
        /// group, and all others are one.
        lights: u32,
        delta_lights: u32,
        infinite_lights: u32,
        light_groups: u32,
        light_group_share: f32,
        film_width: u32,
        region_x: u32,
        region_y: u32,
        region_width: u32,
        /// Zero, which no compiler can know.
        zero: u32,
        /// The heap's words with which the tables begin.
        surfaces_from: u32,
        materials_from: u32,
        lights_from: u32,
        light_nodes_from: u32,
        tree_nodes_from: u32,
        triangles_from: u32,
        vertices_from: u32,
        places_from: u32,
        /// The node with which the tree in the world's own space begins, and the share of a ray's origin by which a ray is
        /// moved beside its boxes.
        tree_root: u32,
        tree_share: f32,
        /// The heap's word with which the filter's weights begin.
        weights_from: u32,
        /// Those with which the cells of grids begin, the media, the textures in the place of parameters, the instructions of
        /// textures, the pictures, and the texels of these.
        cells_from: u32,
        media_from: u32,
        bindings_from: u32,
        instructions_from: u32,
        pictures_from: u32,
        texels_from: u32,
        /// Added to a position in multiples of 2^−CHANCE_BITS, it gives the first tap, rounded down; and whether it was not
        /// rounded, so that there may be ties.
        tap_shift: i32,
        tap_ties: u32,
        /// Columns and rows of the grid by which a picture at infinity is sampled.
        smooth_columns: u32,
        smooth_rows: u32,
        /// The media that the camera is inside of, in two words.
        inside_x: u32,
        inside_y: u32,
        /// Of `FilmOffset::Drawn`: 65 nodes, four a row.
        offset_nodes: [[f32; 4]; 17],
    }

    /// One dispatch: the same samples for each of some slots of a stride.
    struct Dispatch {
        /// The stride: every nth place, or every nth run of places.
        stride_first: u32,
        stride_step: u32,
        stride_run: u32,
        first_slot: u32,
        slots: u32,
        invocations: u32,
        first_sample: u32,
        samples: u32,
        sends_samples: u32,
        /// The band that samples are added to: its first column and row, in those of the whole film, and its size.
        band_left: i32,
        band_top: i32,
        band_width: u32,
        band_pixels: u32,
        /// The most samples that are sent because they are too bright for the band.
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
        /// Index of the first child, the others follow it, and from bit COUNT_FROM on one less than their number; or the
        /// index of the light with LEAF set.
        link: u32,
        /// Square of the distance from which on power alone says which of the lights is asked.
        far2: f32,
        /// Whole units of power.
        units: u32,
        /// Where its lights begin in the order of the tree.
        first: u32,
        /// Where a lamp's tree begins, how many lights the lamp has.
        lights: u32,
    }

    /// A node of the tree over surfaces: eight boxes, rounded outwards to 256 steps of a power of two along each axis.
    struct TreeNode {
        /// The boxes' least coordinates.
        origin: [f32; 3],
        /// The exponents of the steps along x, y and z as floats have them, then which boxes hold nodes.
        scales: u32,
        /// The first of those nodes, which stand side by side, and of what the leaves hold; instances are among triangles.
        nodes: u32,
        triangles: u32,
        surfaces: u32,
        /// NO_NODE at the beginning of a tree.
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
        /// Its number on the host, which decides ties.
        number: u32,
        b: [f32; 3],
        /// Its mesh: index into `surfaces`. Of a shared mesh its place tells.
        surface: u32,
        c: [f32; 3],
        /// Index into `lights`, or NO_LIGHT.
        light: u32,
        /// Indices into `vertices`.
        vertices: [u32; 3],
        _end: u32,
    }

    /// A group or a shared mesh where it stands, as rays come to it. It has the place of a triangle.
    struct Instance {
        /// The rows of the matrix that takes directions to the mesh's own space.
        to_mesh_x: [f32; 3],
        /// The node with which the mesh's tree begins.
        root: u32,
        to_mesh_y: [f32; 3],
        /// Its number on the host, from one.
        number: u32,
        to_mesh_z: [f32; 3],
        _middle: u32,
        /// Where the mesh's origin is in the world.
        origin: [f32; 3],
        _end: u32,
    }

    /// The same as hits look it up: by its number less one.
    struct PlaceRow {
        /// The rows of the matrix that takes directions to the world.
        to_world_x: [f32; 3],
        /// The most by which it lengthens.
        stretch: f32,
        to_world_y: [f32; 3],
        /// The condition number of that matrix for errors.
        condition: f32,
        to_world_z: [f32; 3],
        /// Index into `surfaces`; of a group, whose surfaces have rows of their own, the greatest number.
        surface: u32,
        to_mesh_x: [f32; 3],
        /// −1 for a group that is mirrored, else 1.
        side: f32,
        to_mesh_y: [f32; 3],
        _y: u32,
        to_mesh_z: [f32; 3],
        _z: u32,
        origin: [f32; 3],
        _end: u32,
    }

    /// What a mesh says of a vertex.
    struct MeshVertex {
        /// Zero where it says nothing; uv then are NaN.
        normal: [f32; 3],
        u: f32,
        v: f32,
        _end: [u32; 3],
    }

    /// A branch of `whitted` that waits.
    struct WaitingBranch {
        o: [f32; 3],
        depth: u32,
        d: [f32; 3],
        /// The two words of its interiors.
        interiors_x: u32,
        beta: [f32; 3],
        interiors_y: u32,
    }

    /// Exact sums of one slot's samples. Radiance: 96 bits a channel, in three words; squares: 128 bits.
    struct SlotSums {
        low: [u32; 3],
        /// Zero where the driver ended the work before its end.
        rays: u32,
        middle: [u32; 3],
        /// How many samples were left out, and in the uppermost two bits why the first was.
        rejected: u32,
        high: [u32; 3],
        first_reject: u32,
        squares: [u32; 4],
    }

    /// One sample, bit patterns of floats where it holds floats: what is no number must travel as it is.
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

/// The bits of [`SlotSums::rejected`] below the reason.
pub(super) const REJECT_SHIFT: u32 = 30;

/// The reasons, in the numbers that the device uses; zero is none.
pub(super) const REJECTS: [(u32, Reject); 3] =
    [(1, Reject::NotANumber), (2, Reject::TooBright), (3, Reject::Negative)];

/// The distance of a hit that does not happen. The CPU has an infinity for it, which WGSL cannot name.
pub(super) const NOTHING: f32 = f32::MAX;

/// Bits behind the binary point of a position on the film: a sum of halves and of what is drawn from so many bits.
pub(super) const CHANCE_BITS: u32 = 24;

/// Taps in a word of the heap.
pub(super) const TAPS_IN_A_WORD: u32 = 4;

/// Branches of `whitted` that may wait for one invocation; from then on chance chooses among them.
pub(super) const MOST_BRANCHES: u32 = 16;
