//! The keys of groups and instances, and their conversion.
//!
//! ```toml
//! [[groups.tree.entities]]
//! shape = { type = "cylinder", from = [0, 0, 0], to = [0, 0, 2], radius = 0.2 }
//! material = "bark"
//! [[groups.tree.entities]]
//! shape = { type = "sphere", center = [0, 0, 3], radius = 1.5 }
//! material = "leaves"
//!
//! [[instances]]
//! group = "tree"
//! transform = { scale = [1, 1, 1.5], rotate = [0, 0, 40], translate = [5, 2, 0] }
//!
//! [[groups.forest.instances]]      # a group may hold other groups
//! group = "tree"
//! transform = { translate = [3, 0, 0] }
//! ```
//!
//! A group has the tables of the scene that describe surfaces: entities, in its own space, and instances of other groups.
//! It is stored once, whatever the number of its instances. It cannot contain a plane, which is unbounded.

use std::collections::HashMap;

use glam::DAffine3;

use super::entity::{ENTITY_TABLE, RawEntity, entity};
use super::report::{Diagnostics, Placed, Read, Reported};
use super::shape::Transform;
use super::table::{At, Block, Fields, Key, ListOf, Named, Table};
use super::value::Word;
use crate::scene::description::{Entity, Group, Instance, Scene};
use crate::scene::groups::{Broken, broken};
use crate::scene::names::{self, Disorder, MAX_NESTING, Names};
use crate::scene::spelling::quote;

/// The contents of a group.
pub(super) struct RawGroup {
    entities: Read<Vec<RawEntity>>,
    instances: Read<Vec<RawInstance>>,
}

/// An instance with the name of its group.
pub(super) struct RawInstance {
    name: Read<Option<Placed<String>>>,
    group: Read<Placed<String>>,
    transform: Read<DAffine3>,
    /// The position of the transform.
    at: usize,
}

pub(super) static GROUP_TABLE: Table = Table::new("a group", &[&ENTITIES, &INSTANCES]);

static ENTITIES: Key<ListOf<Block<RawEntity>>> = Key::default(
    "entities",
    ListOf(Block { table: &ENTITY_TABLE, build: entity }),
    "[]",
    "The surfaces of the group, in its own space. An emissive mesh, quad or box is sampled as a light in every instance. Another emissive shape is sampled if all instances scale it uniformly and, for a material or an emission with uv, do not rotate it. Paths find other emission by chance only.",
);
static INSTANCES: Key<ListOf<Block<RawInstance>>> = Key::default(
    "instances",
    ListOf(Block { table: &INSTANCE_TABLE, build: instance }),
    "[]",
    "Instances of other groups within this one. Groups may be nested, but not contain themselves.",
);

pub(super) static INSTANCE_TABLE: Table = Table::new("an instance", &[&NAME, &GROUP, &TRANSFORM]);

static NAME: Key<At<Word>> = Key::optional("name", At(Word), "The name of the instance in messages.");
static GROUP: Key<At<Word>> = Key::required("group", At(Word), "The name of the group.");
static TRANSFORM: Key<Transform> = Key::default(
    "transform",
    Transform,
    "{}",
    "The transform from the group's space to that of the instance: scale, then rotate, then translate; or a matrix.",
);

pub(super) fn group(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<RawGroup> {
    Ok(RawGroup {
        entities: fields.get(&ENTITIES, diagnostics),
        instances: fields.get(&INSTANCES, diagnostics),
    })
}

pub(super) fn instance(fields: &Fields<'_, '_>, diagnostics: &mut Diagnostics<'_>) -> Read<RawInstance> {
    Ok(RawInstance {
        name: fields.find(&NAME, diagnostics),
        group: fields.get(&GROUP, diagnostics),
        transform: fields.get(&TRANSFORM, diagnostics),
        at: fields.place_of(&TRANSFORM),
    })
}

/// Entities in the order of the file, each with the group that contains it.
type Entities = Vec<(Option<usize>, RawEntity)>;

/// The groups of a file, with instances that refer to groups by name.
pub(super) struct Unlinked {
    /// The names, with their positions.
    names: Vec<(String, usize)>,
    instances: Vec<(Option<usize>, RawInstance)>,
}

/// The groups of a scene.
pub(super) struct Linked {
    pub(super) groups: Vec<Group>,
    pub(super) instances: Vec<Instance>,
    /// The final index of each group in the order of the file.
    pub(super) index_of: Vec<usize>,
    pub(super) places: GroupOffsets,
}

/// The positions of groups and instances in the file.
pub(super) struct GroupOffsets {
    groups: Vec<usize>,
    /// The positions of the instances' transforms.
    instances: Vec<usize>,
}

/// The entities of the world and of all groups, and the groups without them.
pub(super) fn split(
    entities: Read<Vec<RawEntity>>,
    groups: Read<Vec<Named<Read<RawGroup>>>>,
    instances: Read<Vec<RawInstance>>,
) -> Read<(Entities, Unlinked)> {
    let mut all: Entities = entities?.into_iter().map(|entity| (None, entity)).collect();
    let mut unlinked = Unlinked { names: Vec::new(), instances: Vec::new() };
    unlinked.instances.extend(instances?.into_iter().map(|instance| (None, instance)));
    for (index, Named { name, at, value }) in groups?.into_iter().enumerate() {
        let RawGroup { entities, instances } = value?;
        all.extend(entities?.into_iter().map(|entity| (Some(index), entity)));
        unlinked.instances.extend(instances?.into_iter().map(|instance| (Some(index), instance)));
        unlinked.names.push((name, at));
    }
    Ok((all, unlinked))
}

/// Sorts groups so that each follows those that it contains, and resolves their names.
pub(super) fn link(unlinked: Unlinked, diagnostics: &mut Diagnostics<'_>) -> Read<Linked> {
    let Unlinked { names, instances } = unlinked;
    let known = Names::of("groups", names.iter().map(|(name, _)| name.as_str()));
    let mut edges = vec![Vec::new(); names.len()];
    let mut edge_places = vec![Vec::new(); names.len()];
    let mut outcome = Ok(());
    let mut linked = Vec::new();
    let mut places = Vec::new();
    for (i, (within, raw)) in instances.into_iter().enumerate() {
        let resolve = || {
            let (group, name, transform) = (raw.group?, raw.name?, raw.transform?);
            let index = find(&group, &known, diagnostics)?;
            if let Some(within) = within {
                edges[within].push(index);
                edge_places[within].push(group.at);
            }
            let name = name.map_or_else(|| format!("instance {}", i + 1), |name| name.value);
            linked.push(Instance { name, group: index, transform, within });
            places.push(raw.at);
            Ok(())
        };
        outcome = resolve().and(outcome);
    }
    outcome?;
    let order = names::order(&edges, |disorder| match disorder {
        Disorder::Circle { nodes, last, edge } => {
            let message = format!("group contains itself: {}", known.circle(&nodes));
            diagnostics.error(edge_places[last][edge], message)
        }
        Disorder::TooDeep(node) => {
            let (name, at) = &names[node];
            let message = format!("group {} is nested more than {MAX_NESTING} levels deep", quote(name));
            diagnostics.error(*at, message)
        }
    })?;
    let mut index_of = vec![0; names.len()];
    order.iter().enumerate().for_each(|(index, &i)| index_of[i] = index);
    for instance in &mut linked {
        instance.group = index_of[instance.group];
        instance.within = instance.within.map(|group| index_of[group]);
    }
    let groups: Vec<_> = order.iter().map(|&i| Group { name: names[i].0.clone() }).collect();
    let places = GroupOffsets { groups: order.iter().map(|&i| names[i].1).collect(), instances: places };
    warn_of_unused(&groups, &linked, &places, diagnostics);
    Ok(Linked { groups, instances: linked, index_of, places })
}

/// Replaces every entity that has a transform by an instance of a group that contains only this entity. These groups
/// precede those of the file.
pub(super) fn place_alone(
    entities: &mut [Entity],
    placed: Vec<Placed<(usize, DAffine3)>>,
    linked: &mut Linked,
) {
    let count = placed.len();
    let Linked { groups, instances, places, index_of: _ } = linked;
    for instance in instances.iter_mut() {
        instance.group += count;
    }
    let withins = instances.iter_mut().map(|instance| &mut instance.within);
    let withins = withins.chain(entities.iter_mut().map(|entity| &mut entity.within));
    withins.flatten().for_each(|within| *within += count);
    let mut alone = Vec::with_capacity(count);
    places.groups.splice(0..0, placed.iter().map(|placed| placed.at));
    for (group, Placed { at, value: (entity, transform) }) in placed.into_iter().enumerate() {
        let entity = &mut entities[entity];
        let within = entity.within.replace(group);
        alone.push(Group { name: entity.name.clone() });
        instances.push(Instance { name: entity.name.clone(), group, transform, within });
        places.instances.push(at);
    }
    groups.splice(0..0, alone);
}

/// The index, in the order of the file, of a group by its name.
fn find(
    name: &Placed<String>,
    known: &Names<'_>,
    diagnostics: &mut Diagnostics<'_>,
) -> Result<usize, Reported> {
    known.find(&name.value).ok_or_else(|| {
        diagnostics.error_with(name.at, format!("no group {}", quote(&name.value)), |_| {
            let none = || "this file has no [groups.NAME]".into();
            Some(known.instead(&name.value).unwrap_or_else(none))
        })
    })
}

/// Warns of groups without instances.
fn warn_of_unused(
    groups: &[Group],
    instances: &[Instance],
    places: &GroupOffsets,
    diagnostics: &mut Diagnostics<'_>,
) {
    let mut used = vec![false; groups.len()];
    let mut held: HashMap<usize, Vec<usize>> = HashMap::new();
    for instance in instances {
        match instance.within {
            None => used[instance.group] = true,
            Some(within) => held.entry(within).or_default().push(instance.group),
        }
    }
    // Groups follow those that they contain, so in reverse order every container comes first.
    for group in (0..groups.len()).rev() {
        if used[group] {
            held.remove(&group).into_iter().flatten().for_each(|held| used[held] = true);
        }
    }
    let mut unused: Vec<usize> = (0..groups.len()).filter(|&group| !used[group]).collect();
    unused.sort_unstable_by_key(|&group| places.groups[group]);
    for group in unused {
        let message = format!("group {} is not used", quote(&groups[group].name));
        diagnostics.warn(Some(places.groups[group]), message, "no instance refers to it");
    }
}

/// Reports invalid groups and instances. `entities` are the positions of the entities in the file.
pub(super) fn check(
    scene: &Scene,
    places: &GroupOffsets,
    entities: &[usize],
    diagnostics: &mut Diagnostics<'_>,
) -> Read<()> {
    let mut outcome = Ok(());
    for broken in broken(scene) {
        let (at, message) = match broken {
            Broken::Group(i, message) => {
                (places.groups[i], format!("group {}: {message}", quote(&scene.groups[i].name)))
            }
            Broken::Instance(i, message) => (places.instances[i], message),
            Broken::Entity(i, message) => (entities[i], message),
        };
        outcome = Err(diagnostics.error(at, message));
    }
    outcome
}

/// Warns of emissive entities in groups that are not sampled as lights.
pub(super) fn warn_of_chance(scene: &Scene, places: &[usize], diagnostics: &mut Diagnostics<'_>) {
    if scene.groups.is_empty() {
        return;
    }
    let written = scene.written_out(&scene.group_places());
    for (i, entity) in scene.entities.iter().enumerate() {
        if entity.within.is_some() && entity.emits() && !written[i] {
            let message = format!(
                "{} emits, but its instance scales it unevenly or rotates its texture: it is not sampled as a light",
                quote(&entity.name)
            );
            diagnostics.warn(Some(places[i]), message, "paths find its emission by chance");
        }
    }
}
