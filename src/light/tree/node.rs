//! Nodes of eight children.

use super::group::Group;
use crate::math::{LaneFloat, Vec3};

/// The maximum number of children of a node.
pub(super) const WIDTH: usize = 8;

/// The bit of a link to a light.
pub const LEAF: u32 = 0x8000_0000;

/// Up to eight children, one column each, in the order of the lights below them. Unused places contain a light without
/// power.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    /// The mean position of the lights, weighted by power.
    pub(super) centre: [[f32; WIDTH]; 3],
    /// The mean squared distance from there.
    pub(super) spread: [f32; WIDTH],
    pub(super) power: [f32; WIDTH],
    /// The greatest distance from the centre.
    pub(super) radius: [f32; WIDTH],
    /// The axis of the cone of normals.
    pub(super) axis: [[f32; WIDTH]; 3],
    /// The cosine of the cone's half angle.
    pub(super) cos_o: [f32; WIDTH],
    /// The sine of the cone's half angle.
    pub(super) sin_o: [f32; WIDTH],
    /// The cosine of the greatest angle between a normal and a direction of emission.
    pub(super) cos_e: [f32; WIDTH],
    /// The square of the smallest distance from the centre at which the lights count as distant. Infinite at leaves,
    /// and if the lights belong to different meshes or are too many to share units.
    pub(super) far2: [f32; WIDTH],
    /// The index of a node, or of a light with [`LEAF`] set.
    pub(super) link: [u32; WIDTH],
    /// The position of the first light below it in the order of the tree.
    pub(super) first: [u32; WIDTH],
    /// Power in whole units, which the lights of a node divide without rounding.
    pub(super) units: [u32; WIDTH],
    /// The first of these units.
    pub(super) first_unit: [u32; WIDTH],
    /// The number of children, at most eight.
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

    /// The children, with their links unchanged.
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

/// One node of a [`super::LightTree`], for workers that store the tree in another layout.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightNode {
    /// The mean position of the lights, weighted by power.
    pub centre: [f32; 3],
    /// The mean squared distance from the centre.
    pub spread: f32,
    /// The fraction of the total power.
    pub power: f32,
    /// The greatest distance from the centre.
    pub radius: f32,
    /// The axis of the cone of normals.
    pub axis: [f32; 3],
    /// The cosine of the cone's half angle.
    pub cos_o: f32,
    /// The cosine of the greatest angle between a normal and a direction of emission.
    pub cos_e: f32,
    /// The square of the distance from the centre beyond which lights are chosen by power alone, if they face the point
    /// or their normals agree; infinite for lights of different meshes.
    pub far2: f32,
    /// Power in whole units, for the choice among distant lights.
    pub units: u32,
    /// The position of its first light in the order of the tree.
    pub first: u32,
    /// The index of the first child, which the others follow, with their number minus one from bit [`COUNT_FROM`] on;
    /// or the index of the light with [`LEAF`] set.
    pub link: u32,
}

/// See [`LightNode::link`].
pub const COUNT_FROM: u32 = 28;

/// The child of each lane: the same one in all lanes, or a different one in each.
pub(super) trait ChildIndex<F: LaneFloat>: Copy {
    fn number(self, column: &[f32; WIDTH]) -> F;
    #[inline(always)]
    fn vector(self, columns: &[[f32; WIDTH]; 3]) -> Vec3<F> {
        Vec3::new(self.number(&columns[0]), self.number(&columns[1]), self.number(&columns[2]))
    }
}

impl<F: LaneFloat> ChildIndex<F> for usize {
    #[inline(always)]
    fn number(self, column: &[f32; WIDTH]) -> F {
        F::splat(column[self])
    }
}

/// All eight children, in eight lanes.
#[derive(Clone, Copy)]
pub(super) struct Each;

impl<F: LaneFloat> ChildIndex<F> for Each {
    #[inline(always)]
    fn number(self, column: &[f32; WIDTH]) -> F {
        F::load(column)
    }
}
