//! Nodes of eight children.

use super::group::Group;
use crate::math::{LaneFloat, Vec3};

/// Children of a node at most.
pub(super) const WIDTH: usize = 8;

/// The bit of a link that leads to a light.
pub const LEAF: u32 = 0x8000_0000;

/// Up to eight children, a column each, in the order of the lights below them. Where there is no child, there is a
/// light without power.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    /// Mean place of the lights, by their power.
    pub(super) centre: [[f32; WIDTH]; 3],
    /// Mean squared distance from there.
    pub(super) spread: [f32; WIDTH],
    pub(super) power: [f32; WIDTH],
    /// Greatest distance from the centre.
    pub(super) radius: [f32; WIDTH],
    /// Axis of the cone of normals.
    pub(super) axis: [[f32; WIDTH]; 3],
    /// Cosine of the cone's half angle,
    pub(super) cos_o: [f32; WIDTH],
    /// and its sine.
    pub(super) sin_o: [f32; WIDTH],
    /// Cosine of the greatest angle between a normal and a direction of emission.
    pub(super) cos_e: [f32; WIDTH],
    /// The square of the least distance from the centre at which the lights are far; infinite at leaves, and if the
    /// lights are not all of one mesh or are too many to share units.
    pub(super) far2: [f32; WIDTH],
    /// Index of a node, or of a light with [`LEAF`] set.
    pub(super) link: [u32; WIDTH],
    /// The place of the first light below in the order of the tree.
    pub(super) first: [u32; WIDTH],
    /// Power in whole units, so that the lights of a node share it without rounding.
    pub(super) units: [u32; WIDTH],
    /// The first of these units.
    pub(super) first_unit: [u32; WIDTH],
    /// How many children there are: eight at most.
    pub(super) count: usize,
}

impl Default for Node {
    fn default() -> Self {
        let nothing = [0.0; WIDTH];
        Node {
            centre: [nothing; 3],
            spread: nothing,
            power: nothing,
            radius: nothing,
            axis: [nothing; 3],
            cos_o: nothing,
            sin_o: nothing,
            cos_e: nothing,
            far2: [f32::INFINITY; WIDTH],
            link: [LEAF; WIDTH],
            first: [u32::MAX; WIDTH],
            units: [0; WIDTH],
            first_unit: [0; WIDTH],
            count: 0,
        }
    }
}

impl Node {
    /// Adds a child.
    pub(super) fn push(&mut self, group: &Group, link: u32) {
        let (i, bounds) = (self.count, &group.bounds);
        for c in 0..3 {
            self.centre[c][i] = bounds.mean[c] as f32;
            self.axis[c][i] = bounds.axis[c];
        }
        self.spread[i] = bounds.spread as f32;
        self.power[i] = bounds.power as f32;
        self.radius[i] = bounds.radius() as f32;
        self.cos_o[i] = bounds.cos_o;
        self.sin_o[i] = (1.0 - bounds.cos_o * bounds.cos_o).max(0.0).sqrt();
        self.cos_e[i] = bounds.cos_e;
        self.far2[i] = group.far2;
        self.link[i] = link;
        self.first[i] = group.first;
        self.units[i] = group.units;
        self.first_unit[i] = group.first_unit;
        self.count += 1;
    }

    /// The children, with links as they are.
    pub(super) fn children(&self) -> impl Iterator<Item = LightNode> + '_ {
        let at = |columns: &[[f32; WIDTH]; 3], i: usize| [0, 1, 2].map(|c: usize| columns[c][i]);
        (0..self.count).map(move |i| LightNode {
            centre: at(&self.centre, i),
            spread: self.spread[i],
            power: self.power[i],
            radius: self.radius[i],
            axis: at(&self.axis, i),
            cos_o: self.cos_o[i],
            cos_e: self.cos_e[i],
            far2: self.far2[i],
            units: self.units[i],
            first: self.first[i],
            link: self.link[i],
        })
    }
}

/// One node of a [`super::LightTree`], for workers that keep the tree in another form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightNode {
    /// Mean place of the lights, by their power.
    pub centre: [f32; 3],
    /// Mean squared distance from the centre.
    pub spread: f32,
    /// Share of the power.
    pub power: f32,
    /// Greatest distance from the centre.
    pub radius: f32,
    /// Axis of the cone of normals.
    pub axis: [f32; 3],
    /// Cosine of the cone's half angle.
    pub cos_o: f32,
    /// Cosine of the greatest angle between a normal and a direction of emission.
    pub cos_e: f32,
    /// Square of the distance from the centre beyond which the light is chosen by power alone, if the lights face the
    /// point or their normals agree; infinite for lights that are not of one mesh.
    pub far2: f32,
    /// Whole units of power, for the choice among far lights.
    pub units: u32,
    /// The place of its first light in the order of the tree.
    pub first: u32,
    /// Index of the first child, the others follow it, and from bit [`COUNT_FROM`] on one less than their number; or
    /// the index of the light with [`LEAF`] set.
    pub link: u32,
}

/// See [`LightNode::link`].
pub const COUNT_FROM: u32 = 28;

/// The child of each lane: the same one in all lanes, or another one in each.
pub(super) trait Place<F: LaneFloat>: Copy {
    fn number(self, column: &[f32; WIDTH]) -> F;
    #[inline(always)]
    fn vector(self, columns: &[[f32; WIDTH]; 3]) -> Vec3<F> {
        Vec3::new(self.number(&columns[0]), self.number(&columns[1]), self.number(&columns[2]))
    }
}

impl<F: LaneFloat> Place<F> for usize {
    #[inline(always)]
    fn number(self, column: &[f32; WIDTH]) -> F {
        F::splat(column[self])
    }
}

/// All eight, in eight lanes.
#[derive(Clone, Copy)]
pub(super) struct Each;

impl<F: LaneFloat> Place<F> for Each {
    #[inline(always)]
    fn number(self, column: &[f32; WIDTH]) -> F {
        F::load(column)
    }
}
