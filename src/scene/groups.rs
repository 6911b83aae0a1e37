//! Where the groups of a scene stand, and the promises of a scene about them.

use super::description::{Entity, Scene, Shape};
use super::names::MAX_NESTING;
use super::placement::{is_flat, is_placeable, misplaced_box};
use crate::math::Bounds;
use crate::shape::moved;
use glam::{DAffine3, DVec3};

/// The most places of groups, those of groups within groups counted each: 300 bytes each.
pub const MOST_PLACES: u64 = 1 << 24;

/// A group where it stands in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroupPlace {
    /// Index of the group.
    pub group: usize,
    /// From the group's space to the world.
    pub transform: DAffine3,
    /// Index of the scene's own instance by which it stands there.
    pub instance: usize,
}

/// What breaks a promise.
pub(super) enum Broken {
    /// The group of this index.
    Group(usize, String),
    /// The instance of this index.
    Instance(usize, String),
    /// The entity of this index.
    Entity(usize, String),
}

impl Scene {
    /// At how many places each group stands in the world, by way of other groups too.
    pub fn place_counts(&self) -> Vec<u64> {
        let mut counts = vec![0_u64; self.groups.len()];
        let mut within = vec![Vec::new(); self.groups.len()];
        for instance in &self.instances {
            match instance.within {
                None => counts[instance.group] = counts[instance.group].saturating_add(1),
                Some(group) => within[group].push(instance.group),
            }
        }
        // Groups come after those that they hold, so going backwards meets every holder first.
        for group in (0..counts.len()).rev() {
            for &held in &within[group] {
                counts[held] = counts[held].saturating_add(counts[group]);
            }
        }
        counts
    }

    /// All places of groups in the world, in the order of the instances; a group before what it holds. There are no more
    /// than [`MOST_PLACES`] in a scene that is checked.
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

    /// Adds the places of an instance in some space. Groups are nested [`MAX_NESTING`] deep at most.
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
    /// For each entity whether it stands as a surface of its own at every place of its group, so that paths can choose
    /// points of it as those of a light: it emits, and it is a shape of its kind at each of these places.
    pub fn written_out(&self, places: &[GroupPlace]) -> Vec<bool> {
        let mut of_group = vec![Vec::new(); self.groups.len()];
        places.iter().for_each(|place| of_group[place.group].push(&place.transform));
        let is_written_out = |entity: &Entity| {
            let Some(group) = entity.within else { return false };
            let is_textured = entity.emission_texture.is_some();
            let shines = entity.emission.iter().any(|&channel| channel > 0.0) && !is_textured;
            match &entity.shape {
                Shape::Mesh { .. } => shines,
                Shape::Quad(_) | Shape::Box(_) => shines || is_textured,
                shape => {
                    let keeps_uv = self.looks_at_uv(entity.material);
                    let mut transforms = of_group[group].iter();
                    shines && transforms.all(|transform| moved(shape, transform, keeps_uv).is_some())
                }
            }
        };
        self.entities.iter().map(is_written_out).collect()
    }

    /// Whether a material may look at the uv of a surface, or at their directions.
    fn looks_at_uv(&self, material: usize) -> bool {
        let material = &self.materials[material];
        !material.textures.is_empty()
            || material.named().next().is_some()
            || material.kind.row().is_anisotropic
    }
}

/// All that breaks promises about groups.
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
                format!("its group {} is not before the group that it is within", instance.group + 1);
            all.push(Broken::Instance(i, message));
        }
        if is_flat(&instance.transform) {
            let message = "the transform makes everything flat, or has numbers that are not finite";
            all.push(Broken::Instance(i, message.to_owned()));
        }
    }
    if !all.is_empty() {
        return all;
    }
    let mut held: Vec<(usize, usize)> =
        scene.instances.iter().filter_map(|instance| Some((instance.within?, instance.group))).collect();
    // In the order of the groups that hold, those that they hold are done.
    held.sort_unstable();
    for (group, held) in held {
        nesting[group] = nesting[group].max(nesting[held] + 1);
    }
    let too_deep = (0..groups).find(|&group| nesting[group] > MAX_NESTING);
    if let Some(group) = too_deep {
        return vec![Broken::Group(group, format!("it is nested more than {MAX_NESTING} deep"))];
    }
    let mut places = 0_u64;
    for (group, count) in scene.place_counts().into_iter().enumerate() {
        places = places.saturating_add(count);
        if places > MOST_PLACES {
            let message = format!(
                "with it there are more than {MOST_PLACES} places of groups, those of groups within groups \
                 counted each"
            );
            return vec![Broken::Group(group, message)];
        }
    }
    broken_places(scene)
}

/// Why a plane is in no group.
pub(super) const PLANE: &str = "a plane is unbounded, and can be in no group";

/// Places where groups cannot stand. Of each of the scene's own instances the first is told.
fn broken_places(scene: &Scene) -> Vec<Broken> {
    let mut boxes = vec![Bounds::NOTHING; scene.groups.len()];
    for entity in &scene.entities {
        if let Some(group) = entity.within {
            boxes[group] = boxes[group].with(&around(entity));
        }
    }
    let mut all = Vec::new();
    let mut told = None;
    for GroupPlace { group, transform, instance } in scene.group_places() {
        if told == Some(instance) {
            continue;
        }
        let own = &boxes[group];
        let is_there = own.low[0] <= own.high[0];
        let message = if !is_placeable(&transform) {
            Some("the transform shears or squeezes the group too much to follow rays in it")
        } else if is_there {
            misplaced_box(own, &transform)
        } else {
            None
        };
        if let Some(message) = message {
            told = Some(instance);
            all.push(Broken::Instance(instance, message.to_owned()));
        }
    }
    all
}

/// A box around an entity, in the space that it is in.
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
