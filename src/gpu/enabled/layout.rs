//! What the host and the device exchange: the layouts, and the constants that both must agree on.

use crate::film::Reject;
use bytemuck::{Pod, Zeroable};

/// A field of a structure, as it lies in memory.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: &'static str,
    pub(super) offset: usize,
    pub(super) size: usize,
    /// As Rust writes it.
    pub(super) ty: &'static str,
}

/// Declares structures that WGSL declares too, and lists their fields. Fields whose names begin with an
/// underscore are WGSL's own gaps between its fields.
macro_rules! shared {
    ($($(#[$doc:meta])* struct $name:ident { $($field:ident: $type:ty,)* })*) => {
        $($(#[$doc])*
        #[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
        #[repr(C)]
        pub(super) struct $name { $(pub(super) $field: $type,)* })*

        /// Every structure: its name, its size, its fields.
        pub(super) fn structures() -> Vec<(&'static str, usize, Vec<Field>)> {
            vec![$((stringify!($name), size_of::<$name>(), vec![$(Field {
                name: stringify!($field),
                offset: std::mem::offset_of!($name, $field),
                size: size_of::<$type>(),
                ty: stringify!($type),
            },)*]),)*]
        }
    };
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
        ambient: [f32; 3],
        max_depth: u32,
        centre: [f32; 2],
        offset_kind: u32,
        offset_radius: f32,
        planes_end: u32,
        spheres_end: u32,
        quads_end: u32,
        rare_end: u32,
        lights: u32,
        point_lights: u32,
        film_width: u32,
        region_x: u32,
        region_y: u32,
        region_width: u32,
        zero: u32,
        surfaces_from: u32,
        materials_from: u32,
        lights_from: u32,
        light_nodes_from: u32,
        tree_nodes_from: u32,
        triangles_from: u32,
        vertices_from: u32,
        places_from: u32,
        tree_root: u32,
        tree_share: f32,
        weights_from: u32,
        tap_shift: i32,
        tap_ties: u32,
        offset_nodes: [[f32; 4]; 17],
    }

    /// One dispatch: the same samples for each of some slots of a stride.
    struct Dispatch {
        stride_first: u32,
        stride_step: u32,
        stride_run: u32,
        first_slot: u32,
        slots: u32,
        invocations: u32,
        first_sample: u32,
        samples: u32,
        sends_samples: u32,
        band_left: i32,
        band_top: i32,
        band_width: u32,
        band_pixels: u32,
        most_bright: u32,
    }

    /// A row of the surface table.
    struct Surface {
        anchor: [f32; 3],
        radius: f32,
        axis: [f32; 3],
        constant: f32,
        u_axis: [f32; 4],
        v_axis: [f32; 4],
        emission: [f32; 3],
        error: f32,
        orientation: f32,
        material: u32,
        light: u32,
        row: u32,
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
        link: u32,
        far2: f32,
        units: u32,
        first: u32,
        lights: u32,
    }

    /// A node of the tree over surfaces.
    struct TreeNode {
        origin: [f32; 3],
        scales: u32,
        nodes: u32,
        triangles: u32,
        surfaces: u32,
        parent: u32,
        leaves: [u32; 4],
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
        number: u32,
        b: [f32; 3],
        surface: u32,
        c: [f32; 3],
        light: u32,
        vertices: [u32; 3],
        error: f32,
    }

    /// A shared mesh where it stands, as rays come to it: in the place of a triangle.
    struct Instance {
        to_mesh_x: [f32; 3],
        root: u32,
        to_mesh_y: [f32; 3],
        number: u32,
        to_mesh_z: [f32; 3],
        _middle: u32,
        origin: [f32; 3],
        _end: u32,
    }

    /// The same as hits look it up.
    struct Place {
        to_world_x: [f32; 3],
        stretch: f32,
        to_world_y: [f32; 3],
        ray_error: f32,
        to_world_z: [f32; 3],
        surface: u32,
        to_mesh_x: [f32; 3],
        _x: u32,
        to_mesh_y: [f32; 3],
        _y: u32,
        to_mesh_z: [f32; 3],
        _z: u32,
        origin: [f32; 3],
        _end: u32,
    }

    /// What a mesh says of a vertex.
    struct Vertex {
        normal: [f32; 3],
        u: f32,
        v: f32,
        _end: [u32; 3],
    }

    /// A branch of `whitted` that waits.
    struct Branch {
        o: [f32; 3],
        depth: u32,
        d: [f32; 3],
        _middle: u32,
        beta: [f32; 3],
        _end: u32,
    }

    /// Exact sums of one slot's samples, words from the lowest: 96 bits for each channel, 128 for squares.
    struct SlotSums {
        low: [u32; 3],
        rays: u32,
        middle: [u32; 3],
        rejected: u32,
        high: [u32; 3],
        first_reject: u32,
        squares: [u32; 4],
    }

    /// One sample.
    struct SampleWords {
        pixel: u32,
        sample: u32,
        x: f32,
        y: f32,
        red: f32,
        green: f32,
        blue: f32,
    }
}

/// How [`crate::sampling::warp::FilmOffset`] is told to the device.
pub(super) const OFFSET_CENTRE: u32 = 0;
pub(super) const OFFSET_UNIFORM: u32 = 1;
pub(super) const OFFSET_TENT: u32 = 2;
pub(super) const OFFSET_DRAWN: u32 = 3;

/// What stands for the radius of a surface that is neither flat nor a sphere: below zero.
pub(super) const IS_DISK: f32 = -1.0;
pub(super) const IS_CYLINDER: f32 = -2.0;

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
