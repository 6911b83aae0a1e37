//! Shapes, groups and instances.

use super::builder::{Builder, Emission, MeshKey};
use super::formed::Formed;
use super::limits::MOST_ENTITIES;
use super::object::{Object, Tag};
use super::report::Read;
use super::shade::Shade;
use super::spectrum::Of;
use super::transform::{affine, normal, uniform_scale};
use crate::scene::description::{
    CylinderParameters, DiskParameters, Entity, Mesh, QuadParameters, SphereParameters,
};
use crate::scene::spelling::quote;
use glam::{DAffine3, DMat3, DVec3};
use std::sync::Arc;

/// The plugins that have a counterpart.
const SHAPES: [&str; 11] = [
    "cube",
    "cylinder",
    "disk",
    "instance",
    "merge",
    "obj",
    "ply",
    "rectangle",
    "serialized",
    "shapegroup",
    "sphere",
];

impl Builder<'_, '_> {
    /// Adds the entities of a shape. `parent` is the transform of its parent to the world.
    pub(super) fn shape(&mut self, index: usize, parent: DAffine3) -> Read<()> {
        let object = self.object(index);
        self.shapes += 1;
        if self.shapes > MOST_ENTITIES {
            let message = format!("the scene has more than {MOST_ENTITIES} shapes");
            return Err(self.reports.error(object.place, message));
        }
        object.ignore(&["silhouette_sampling_weight"]);
        for &medium in self.document.children(object, Tag::Medium) {
            let medium = &self.document.objects[medium];
            self.reports.lacks(medium.place, medium.what(), "it is left out");
        }
        match object.plugin.as_str() {
            // Only instances make it visible.
            "shapegroup" => return Ok(()),
            "instance" => return self.instance(object, parent),
            "merge" => return self.all_of(object, parent),
            _ => {}
        }
        let transform = self.placed(object, parent)?;
        let formed = match object.plugin.as_str() {
            "rectangle" => Self::rectangle(&transform),
            "sphere" => self.sphere(object, &transform)?,
            "disk" => self.disk(object, &transform),
            "cylinder" => self.cylinder(object, &transform)?,
            "cube" => Formed::mesh(self.cube(), transform, false),
            "obj" | "ply" | "serialized" => match self.mesh(object, transform)? {
                Some(formed) => formed,
                None => {
                    object.ignore_all();
                    return Ok(());
                }
            },
            other => {
                let instead = match SHAPES.iter().find(|shape| other.eq_ignore_ascii_case(shape)) {
                    Some(shape) => format!("it is left out; did you mean {}?", quote(shape)),
                    None => "it is left out".into(),
                };
                self.reports.lacks(object.place, format!("shape {}", quote(other)), &instead);
                object.ignore_all();
                return Ok(());
            }
        };
        self.stand(object, formed)
    }

    /// Adds the shapes in a group or a merge.
    fn all_of(&mut self, object: &Object, parent: DAffine3) -> Read<()> {
        let mut outcome = Ok(());
        for &shape in self.document.children(object, Tag::Shape) {
            if self.document.objects[shape].plugin == "instance" && self.within.is_some() {
                let place = self.document.objects[shape].place;
                return Err(self.reports.error(place, "a shapegroup cannot contain an instance"));
            }
            outcome = self.shape(shape, parent).and(outcome);
        }
        outcome
    }

    fn instance(&mut self, object: &Object, parent: DAffine3) -> Read<()> {
        let transform = self.placed(object, parent)?;
        let group = self.document.children(object, Tag::Shape);
        let group = group.first().filter(|&&group| self.document.objects[group].plugin == "shapegroup");
        let Some(&group) = group else {
            return Err(self.reports.error(object.place, "an instance must refer to a shapegroup"));
        };
        let known = self.groups.get(&group).copied();
        // There is no group if nothing in it has a counterpart.
        if let Some(made) = known.unwrap_or_else(|| self.group(group))? {
            self.add_instance(object, made, transform);
        }
        Ok(())
    }

    /// The group of an object, made once; none if it is empty.
    fn group(&mut self, index: usize) -> Read<Option<usize>> {
        let object = self.object(index);
        let group = self.add_group(object);
        let before = self.within.replace(group);
        let entities = self.scene.entities.len();
        let made = self.all_of(object, DAffine3::IDENTITY);
        self.within = before;
        let is_empty = self.scene.entities.len() == entities;
        if is_empty {
            self.scene.groups.pop();
            self.places.groups.pop();
        }
        let made = made.map(|()| (!is_empty).then_some(group));
        self.groups.insert(index, made);
        made
    }

    /// The transform from a shape's space to the world.
    fn placed(&mut self, object: &Object, parent: DAffine3) -> Read<DAffine3> {
        let Some((transform, place)) = object.transform("to_world", self.reports)? else {
            return Ok(parent);
        };
        let Some(transform) = affine(&transform) else {
            return Err(self.reports.error(place, "the last row of this transform is not 0 0 0 1"));
        };
        let all = parent * transform;
        let flat = all.matrix3.determinant() == 0.0 || !all.is_finite();
        if flat { Err(self.reports.error(place, "the transform is singular")) } else { Ok(all) }
    }

    /// Adds the entity of a shape, with its material and emission.
    fn stand(&mut self, object: &Object, formed: Formed) -> Read<()> {
        let flipped = object.flag("flip_normals", false, self.reports)?;
        let emitter = self.child(object, Tag::Emitter);
        let material = self.material_of(object, emitter.is_some());
        let (emission, emission_texture) = match emitter {
            Some(emitter) => self.area_light(emitter)?,
            None => ([0.0; 3], None),
        };
        let mut material = material?;
        // The back of a closed surface is visible only from inside.
        if formed.is_open && self.is_one_sided(object) && self.shows(material) {
            material = self.one_sided(object, material);
        }
        let looks_at_uv = self.looks_at_uv[material] || emission_texture.is_some();
        let local = formed.local.filter(|(.., always)| (*always || looks_at_uv) && self.within.is_none());
        let keeps_uv = local.as_ref().is_some_and(|(.., always)| !always);
        if let Some(uv) = formed.uv.filter(|_| looks_at_uv && !keeps_uv) {
            self.reports.lacks(object.place, format!("uv of shape {}", quote(&object.plugin)), uv);
        }
        let flip_normal = flipped != formed.turned;
        let entity = Entity { material, emission, emission_texture, flip_normal, ..Entity::default() };
        match local {
            None => self.add_entity(object, Entity { shape: formed.shape, ..entity }),
            Some((shape, transform, _)) => {
                // A group with this shape only.
                let group = self.add_group(object);
                self.within = Some(group);
                let added = self.add_entity(object, Entity { shape, ..entity });
                self.within = None;
                self.add_instance(object, group, transform);
                added
            }
        }
    }

    /// The emission of an emitter inside a shape.
    fn area_light(&mut self, emitter: &Object) -> Read<Emission> {
        let address = std::ptr::from_ref(emitter).addr();
        if let Some(&known) = self.area_lights.get(&address) {
            return known;
        }
        let emission = self.new_area_light(emitter);
        self.area_lights.insert(address, emission);
        emission
    }

    fn new_area_light(&mut self, emitter: &Object) -> Read<Emission> {
        if emitter.plugin != "area" {
            self.reports.lacks(emitter.place, emitter.what(), "the shape emits nothing");
            emitter.ignore_all();
            return Ok(([0.0; 3], None));
        }
        emitter.ignore(&["sampling_weight"]);
        Ok(match self.shade(emitter, "radiance", 1.0, Of::Light)? {
            Shade::Colour(radiance) => (radiance, None),
            Shade::Texture(texture) => ([0.0; 3], Some(texture)),
        })
    }

    /// The square from −1 to 1 in x and y.
    fn rectangle(transform: &DAffine3) -> Formed {
        let corner = transform.transform_point3(DVec3::new(-1.0, -1.0, 0.0));
        let [u, v] = [DVec3::X, DVec3::Y].map(|axis| transform.transform_vector3(axis * 2.0));
        let shape = QuadParameters { corner, u, v }.into();
        // A mirror image reverses the normal, but not u × v.
        Formed { shape, turned: transform.matrix3.determinant() < 0.0, is_open: true, local: None, uv: None }
    }

    fn sphere(&mut self, object: &Object, transform: &DAffine3) -> Read<Formed> {
        let center = object.triple("center", self.reports)?.map_or(DVec3::ZERO, DVec3::from);
        let radius = object.number("radius", 1.0, self.reports)?;
        let scale = uniform_scale(&transform.matrix3);
        if scale.is_none() {
            let what = "shape \"sphere\" with a to_world that scales the axes differently";
            self.reports.lacks(object.place, what, "it is a sphere with the scale of the x axis");
        }
        let x = transform.matrix3.x_axis;
        let own = SphereParameters { center, radius };
        let radius = scale.unwrap_or(x.length()) * radius;
        // In stride, u is the angle about the world's z axis.
        let upright = (transform.matrix3 - DMat3::from_diagonal(DVec3::splat(x.length())))
            .to_cols_array()
            .iter()
            .all(|entry| entry.abs() <= 1e-6 * x.length());
        let uv = (!upright).then_some("u is the angle about the z axis from the x axis");
        let shape = SphereParameters { center: transform.transform_point3(center), radius }.into();
        let local = (scale.is_some() && !upright).then(|| (own.into(), *transform, false));
        let turned = transform.matrix3.determinant() < 0.0;
        Ok(Formed { shape, turned, is_open: false, local, uv })
    }

    fn disk(&mut self, object: &Object, transform: &DAffine3) -> Formed {
        let [x, y] = [DVec3::X, DVec3::Y].map(|axis| transform.transform_vector3(axis));
        let radius = x.length();
        let is_round =
            (y.length() - radius).abs() <= 1e-6 * radius && x.dot(y).abs() <= 1e-6 * radius * radius;
        let uv = Some("u is the angle and v the distance from the centre; Mitsuba exchanges the two");
        if !is_round && self.within.is_none() {
            let own = DiskParameters { center: DVec3::ZERO, normal: DVec3::Z, radius: 1.0 };
            let local = Some((own.into(), *transform, true));
            return Formed { shape: own.into(), turned: false, is_open: true, local, uv };
        }
        if !is_round {
            let what = "shape \"disk\" that is an ellipse in a group";
            self.reports.lacks(object.place, what, "it is a mesh of 256 triangles");
            return Formed::mesh(self.ellipse(), *transform, true);
        }
        let shape = DiskParameters {
            center: transform.translation,
            normal: normal(&transform.matrix3, DVec3::Z),
            radius,
        };
        Formed { shape: shape.into(), turned: false, is_open: true, local: None, uv }
    }

    fn cylinder(&mut self, object: &Object, transform: &DAffine3) -> Read<Formed> {
        let from = object.triple("p0", self.reports)?.map_or(DVec3::ZERO, DVec3::from);
        let to = object.triple("p1", self.reports)?.map_or(DVec3::Z, DVec3::from);
        let radius = object.number("radius", 1.0, self.reports)?;
        if from == to {
            return Err(self.reports.error(object.place, "p0 and p1 of shape \"cylinder\" are one point"));
        }
        let (x, y) = crate::parameter::unit(to - from).any_orthonormal_pair();
        let [x, y] = [x, y].map(|axis| transform.transform_vector3(axis));
        let along = crate::parameter::unit(transform.transform_vector3(to - from));
        let square = [x.dot(y), x.dot(along) * x.length(), y.dot(along) * x.length()];
        let tolerance = 1e-4 * x.length_squared();
        if (x.length() - y.length()).abs() > 1e-4 * x.length()
            || square.iter().any(|dot| dot.abs() > tolerance)
        {
            let what = "shape \"cylinder\" with a to_world that squeezes or shears it";
            self.reports.lacks(object.place, what, "it is a circular cylinder with the scale of the x axis");
        }
        let shape = CylinderParameters {
            from: transform.transform_point3(from),
            to: transform.transform_point3(to),
            radius: radius * x.length(),
        };
        let uv = Some("u begins at another angle");
        let turned = transform.matrix3.determinant() < 0.0;
        let own = CylinderParameters { from, to, radius };
        let local = Some((own.into(), *transform, false));
        Ok(Formed { shape: shape.into(), turned, is_open: true, local, uv })
    }

    /// The cube from −1 to 1, as a mesh. On each side uv run from 0 to 1.
    fn cube(&mut self) -> Arc<Mesh> {
        Arc::clone(self.made.entry(MeshKey::Cube).or_insert_with(|| Arc::new(cube())))
    }

    /// The unit disk, as a mesh.
    fn ellipse(&mut self) -> Arc<Mesh> {
        Arc::clone(self.made.entry(MeshKey::Ellipse).or_insert_with(|| Arc::new(fan())))
    }

    /// Whether a material scatters light.
    fn shows(&self, material: usize) -> bool {
        use crate::scene::description::MaterialKind;
        let Some(material) = self.scene.materials.get(material) else { return false };
        match material.kind {
            MaterialKind::Matte(matte) => matte.reflectance != [0.0; 3] || !material.textures.is_empty(),
            _ => true,
        }
    }
}

/// The sides of the cube: the corner with uv (0, 0), the edge along u, and the edge along v.
const SIDES_OF_CUBE: [[[f32; 3]; 3]; 6] = [
    [[-1.0, -1.0, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]],
    [[1.0, 1.0, 1.0], [-2.0, 0.0, 0.0], [0.0, 0.0, -2.0]],
    [[1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [0.0, 0.0, -2.0]],
    [[-1.0, -1.0, 1.0], [0.0, 2.0, 0.0], [2.0, 0.0, 0.0]],
    [[-1.0, -1.0, -1.0], [0.0, 2.0, 0.0], [0.0, 0.0, 2.0]],
    [[-1.0, 1.0, -1.0], [0.0, -2.0, 0.0], [2.0, 0.0, 0.0]],
];

fn cube() -> Mesh {
    let mut mesh = Mesh::default();
    for [corner, u, v] in SIDES_OF_CUBE {
        let first = mesh.positions.len() as u32;
        let at = |a: f32, b: f32| [0, 1, 2].map(|i| corner[i] + a * u[i] + b * v[i]);
        for [a, b] in [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]] {
            mesh.positions.push(at(a, b));
            mesh.uv.push([a, b]);
            // The outward direction, as the centre is the origin.
            let middle = at(0.5, 0.5);
            mesh.normals.push(middle);
        }
        mesh.triangles.extend([[first, first + 1, first + 2], [first + 3, first, first + 2]]);
    }
    mesh
}

fn fan() -> Mesh {
    const SIDES: u32 = 256;
    let mut mesh = Mesh::default();
    for i in 0..SIDES {
        let at = |turn: f64| {
            let angle = turn / f64::from(SIDES) * std::f64::consts::TAU;
            [libm::cos(angle) as f32, libm::sin(angle) as f32, 0.0]
        };
        let turn = |turn: f64| (turn / f64::from(SIDES)) as f32;
        let (here, next) = (f64::from(i), f64::from(i + 1));
        mesh.positions.extend([[0.0; 3], at(here), at(next)]);
        mesh.uv.extend([[0.0, turn(here + 0.5)], [1.0, turn(here)], [1.0, turn(next)]]);
        mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
    }
    mesh.normals = vec![[0.0, 0.0, 1.0]; mesh.positions.len()];
    mesh
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn made_meshes_face_outward_and_have_the_right_area() {
        for (mesh, area, up) in [(cube(), 24.0, false), (fan(), std::f64::consts::PI, true)] {
            assert_eq!(mesh.check(), Ok(()));
            let mut sum = 0.0;
            for &[a, b, c] in &mesh.triangles {
                let corner = |i: u32| DVec3::from(mesh.positions[i as usize].map(f64::from));
                let n = (corner(b) - corner(a)).cross(corner(c) - corner(a));
                let out = if up { DVec3::Z } else { corner(a) + corner(b) + corner(c) };
                assert!(n.dot(out) > 0.0);
                assert!(n.dot(DVec3::from(mesh.normals[a as usize].map(f64::from))) > 0.0);
                sum += n.length() / 2.0;
            }
            assert!((sum - area).abs() < 1e-3, "{sum}");
        }
    }
}
