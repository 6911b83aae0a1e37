//! Instances of the groups of a scene, and the scene's invariants about them.

use super::description::{Entity, Scene, Shape};
use super::names::MAX_NESTING;
use super::placement::{is_flat, is_placeable, misplaced_box};
use crate::math::Bounds;
use crate::shape::transformed;
use glam::{DAffine3, DVec3};

/// The maximum number of instances of groups, including those within groups; each takes 300 bytes.
pub const MOST_PLACES: u64 = 1 << 24;

/// The maximum number of lights in instances of groups. Every triangle or piece of an entity that emits is a light of its
/// own in each instance, because lights are chosen one by one; each takes 600 bytes.
pub const MOST_COPIED_LIGHTS: u64 = 1 << 23;

/// The number of lights that a textured one other than a triangle counts as: its grid of densities takes 128 KiB.
const LIGHTS_PER_GRID: u64 = 256;

/// An instance of a group in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupPlace {
    /// Index of the group.
    pub group: usize,
    /// The transform from the group's space to the world.
    pub transform: DAffine3,
    /// Index of the top-level instance that contains it.
    pub instance: usize,
}

/// The part that violates an invariant.
pub(super) enum Broken {
    /// The group with this index.
    Group(usize, String),
    /// The instance with this index.
    Instance(usize, String),
    /// The entity with this index.
    Entity(usize, String),
}

impl Scene {
    /// The number of instances of each group in the world, including indirect ones.
    pub fn place_counts(&self) -> Vec<u64> {
        let mut counts = vec![0_u64; self.groups.len()];
        let mut within = vec![Vec::new(); self.groups.len()];
        for instance in &self.instances {
            match instance.within {
                None => counts[instance.group] = counts[instance.group].saturating_add(1),
                Some(group) => within[group].push(instance.group),
            }
        }
        // Groups follow those that they contain, so in reverse order every container comes first.
        for group in (0..counts.len()).rev() {
            for &held in &within[group] {
                counts[held] = counts[held].saturating_add(counts[group]);
            }
        }
        counts
    }

    /// All instances of groups in the world, in the order of the top-level instances, containing groups first. There
    /// are at most [`MOST_PLACES`] in a checked scene.
    pub fn group_places(&self) -> Vec<GroupPlace> {
        let mut within = vec![Vec::new(); self.groups.len()];
        for (index, instance) in self.instances.iter().enumerate() {
            if let Some(group) = instance.within {
                within[group].push(index);
            }
        }
        let mut places = Vec::new();
        for (index, instance) in self.instances.iter().enumerate() {
            if instance.within.is_none() {
                self.place(index, index, &DAffine3::IDENTITY, &within, &mut places);
            }
        }
        places
    }

    /// Adds the instances within an instance. The depth is at most [`MAX_NESTING`].
    fn place(
        &self,
        own: usize,
        instance: usize,
        outer: &DAffine3,
        within: &[Vec<usize>],
        places: &mut Vec<GroupPlace>,
    ) {
        let (group, transform) =
            (self.instances[instance].group, *outer * self.instances[instance].transform);
        places.push(GroupPlace { group, transform, instance: own });
        for &held in &within[group] {
            self.place(own, held, &transform, within, places);
        }
    }
}

impl Scene {
    /// For each entity, whether it is written out as a surface in every instance of its group, so that it can be
    /// sampled as a light: it emits, and it keeps its kind of shape under all transforms.
    pub fn written_out(&self, places: &[GroupPlace]) -> Vec<bool> {
        let mut of_group = vec![Vec::new(); self.groups.len()];
        places.iter().for_each(|place| of_group[place.group].push(&place.transform));
        let is_written_out = |entity: &Entity| {
            let Some(group) = entity.within else { return false };
            let emits = entity.emits();
            match &entity.shape {
                Shape::Mesh { .. } | Shape::Quad(_) | Shape::Box(_) => emits,
                shape => {
                    let keeps_uv = self.looks_at_uv(entity.material) || entity.emission_texture.is_some();
                    let mut transforms = of_group[group].iter();
                    emits && transforms.all(|transform| transformed(shape, transform, keeps_uv).is_some())
                }
            }
        };
        self.entities.iter().map(is_written_out).collect()
    }

    /// Whether a material may depend on uv or tangents.
    fn looks_at_uv(&self, material: usize) -> bool {
        let material = &self.materials[material];
        !material.textures.is_empty()
            || material.named().next().is_some()
            || material.kind.row().is_anisotropic
    }
}

/// All violations of invariants about groups.
pub(super) fn broken(scene: &Scene) -> Vec<Broken> {
    let mut all = Vec::new();
    let groups = scene.groups.len();
    let no_group = |group: usize| format!("there is no group {}, only {groups}", group + 1);
    for (i, entity) in scene.entities.iter().enumerate() {
        let Some(group) = entity.within else { continue };
        if group >= groups {
            all.push(Broken::Entity(i, no_group(group)));
        }
        if matches!(entity.shape, Shape::Plane(_)) {
            all.push(Broken::Entity(i, PLANE.to_owned()));
        }
    }
    let mut nesting = vec![0; groups];
    for (i, instance) in scene.instances.iter().enumerate() {
        for group in [Some(instance.group), instance.within].into_iter().flatten() {
            if group >= groups {
                all.push(Broken::Instance(i, no_group(group)));
            }
        }
        if instance.within.is_some_and(|within| instance.group >= within) {
            let message =
                format!("its group {} does not precede the group that contains it", instance.group + 1);
            all.push(Broken::Instance(i, message));
        }
        if is_flat(&instance.transform) {
            let message = "the transform is singular or not finite";
            all.push(Broken::Instance(i, message.to_owned()));
        }
    }
    if !all.is_empty() {
        return all;
    }
    let mut held: Vec<(usize, usize)> =
        scene.instances.iter().filter_map(|instance| Some((instance.within?, instance.group))).collect();
    // In the order of the containing groups, all contained groups have been visited.
    held.sort_unstable();
    for (group, held) in held {
        nesting[group] = nesting[group].max(nesting[held] + 1);
    }
    let too_deep = (0..groups).find(|&group| nesting[group] > MAX_NESTING);
    if let Some(group) = too_deep {
        return vec![Broken::Group(group, format!("it is nested more than {MAX_NESTING} levels deep"))];
    }
    let (mut places, counts) = (0_u64, scene.place_counts());
    for (group, &count) in counts.iter().enumerate() {
        places = places.saturating_add(count);
        if places > MOST_PLACES {
            let message = format!(
                "with it there are more than {MOST_PLACES} instances of groups, including nested ones"
            );
            return vec![Broken::Group(group, message)];
        }
    }
    too_many_lights(scene, &counts).map_or_else(|| broken_places(scene), |broken| vec![broken])
}

/// The entity with which there are too many lights in instances of groups, given the number of instances of each group.
fn too_many_lights(scene: &Scene, counts: &[u64]) -> Option<Broken> {
    let mut lights = 0_u64;
    for (i, entity) in scene.entities.iter().enumerate() {
        let Some(group) = entity.within.filter(|_| entity.emits()) else { continue };
        let own = match &entity.shape {
            Shape::Mesh { mesh, .. } => mesh.triangles.len(),
            shape => shape.pieces().len(),
        };
        let has_grid = entity.emission_texture.is_some() && !matches!(entity.shape, Shape::Mesh { .. });
        let weight = if has_grid { LIGHTS_PER_GRID } else { 1 };
        lights = lights.saturating_add(counts[group].saturating_mul(own as u64 * weight));
        if lights > MOST_COPIED_LIGHTS {
            let textured = match has_grid {
                true => format!(", of which a textured one counts as {LIGHTS_PER_GRID}"),
                false => String::new(),
            };
            let message = format!(
                "it emits with {own} triangles or surfaces in each of {} instances: with it there are more than \
                 {MOST_COPIED_LIGHTS} lights in groups{textured}; use fewer instances, or let a coarser mesh emit",
                counts[group]
            );
            return Some(Broken::Entity(i, message));
        }
    }
    None
}

/// The reason why a plane cannot be in a group.
pub(super) const PLANE: &str = "a plane is unbounded and cannot be in a group";

/// Invalid transforms of groups. For each top-level instance, only the first problem is reported.
fn broken_places(scene: &Scene) -> Vec<Broken> {
    let mut boxes = vec![Bounds::NOTHING; scene.groups.len()];
    for entity in &scene.entities {
        if let Some(group) = entity.within {
            boxes[group] = boxes[group].with(&around(entity));
        }
    }
    let mut all = Vec::new();
    let mut reported = None;
    for GroupPlace { group, transform, instance } in scene.group_places() {
        if reported == Some(instance) {
            continue;
        }
        let own = &boxes[group];
        let is_there = own.low[0] <= own.high[0];
        let message = if !is_placeable(&transform) {
            Some("the transform shears the group, or scales it unevenly, too much to trace rays in it")
        } else if is_there {
            misplaced_box(own, &transform)
        } else {
            None
        };
        if let Some(message) = message {
            reported = Some(instance);
            all.push(Broken::Instance(instance, message.to_owned()));
        }
    }
    all
}

/// The bounds of an entity, in its own space.
fn around(entity: &Entity) -> Bounds {
    if let Shape::Mesh { mesh, transform } = &entity.shape {
        let place = |p: &[f32; 3]| {
            let p = transform.transform_point3(DVec3::from(p.map(f64::from)));
            p.to_array().map(|x| x as f32)
        };
        return Bounds::of(mesh.positions.iter().map(place));
    }
    entity.shape.pieces().iter().fold(Bounds::NOTHING, |all, piece| all.with(&piece.bounds()))
}
