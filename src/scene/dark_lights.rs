//! Warnings about lights that can reach no surface.
//!
//! They are given only where this is certain: where the bounds of no other surface reach into the half-space in front of
//! a flat lamp, nor does the camera; or where those of no surface reach into the cone of a spot light.

use super::description::{
    CameraSettings, DiskParameters, Entity, Light, Mesh, PlaneParameters, QuadParameters, Scene, Shape,
    SpotLightParameters,
};
use super::groups::GroupPlace;
use crate::math::Bounds;
use glam::{DAffine3, DVec3};
use std::collections::HashMap;
use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

/// The most surfaces, counted in every instance, for which lights are tested.
const MOST_SURFACES: usize = 1 << 16;

/// The most pairs of a light and a surface that are tested.
const MOST_PAIRS: usize = 1 << 24;

/// The rounding errors of rendering, per unit of the largest coordinate. A surface that is nearer to the border of a
/// light counts as lit.
const MARGIN: f64 = 1e-5;

/// A light by its index in the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dark {
    Entity(usize),
    Light(usize),
}

/// A warning about lights of one kind.
pub(super) struct DarkLights {
    pub(super) first: Dark,
    pub(super) message: String,
    /// The remedy.
    pub(super) help: String,
}

/// Warnings about lights that reach no surface, one for each kind, with names in quotes. `flip` is the name in the file
/// of the parameter that turns a lamp around.
pub(super) fn dark_lights(scene: &Scene, quote: impl Fn(&str) -> String, flip: &str) -> Vec<DarkLights> {
    let lamps = scene.entities.iter().any(|entity| lamp(entity).is_some());
    let spots = scene.lights.iter().any(|light| matches!(light, Light::Spot(_)));
    // Counted before the places are listed, which takes time and memory for each of up to 2²⁴.
    let count = scene.place_counts().into_iter().fold(0, u64::saturating_add);
    if scene.entities.is_empty() || !(lamps || spots) || count > MOST_SURFACES as u64 {
        return Vec::new();
    }
    let places = scene.group_places();
    let mut of_group = vec![Vec::new(); scene.groups.len()];
    places.iter().enumerate().for_each(|(index, place)| of_group[place.group].push(index));
    let Some(surfaces) = surfaces(scene, &places, &of_group) else { return Vec::new() };
    let mut pairs = 0;
    let mut is_any = |reaches: &dyn Fn(&Surface) -> bool| {
        pairs += surfaces.len();
        // Beyond the limit nothing is certain.
        pairs > MOST_PAIRS || surfaces.iter().any(reaches)
    };

    let mut dark = Vec::new();
    for (index, entity) in scene.entities.iter().enumerate() {
        let Some(lamp) = lamp(entity) else { continue };
        let mut is_lit = |place: Option<usize>| {
            let lamp = place.map_or(lamp, |place| lamp.under(&places[place].transform));
            lamp.faces_camera(&scene.camera)
                || is_any(&|surface| {
                    (surface.entity, surface.place) != (index, place) && lamp.faces(&surface.extent)
                })
        };
        let is_dark = match entity.within {
            None => !is_lit(None),
            Some(group) => {
                let own = &of_group[group];
                !own.is_empty() && !own.iter().any(|&place| is_lit(Some(place)))
            }
        };
        if is_dark {
            dark.push(index);
        }
    }
    let mut warnings = Vec::new();
    if let Some(&first) = dark.first() {
        let name = quote(&scene.entities[first].name);
        let message = match dark.len() {
            1 => format!("{name} emits away from the camera and from every surface: it lights nothing"),
            count => format!(
                "{count} entities, {name} the first, emit away from the camera and from every surface: they light nothing"
            ),
        };
        let help = format!("set {flip} = true, or remove it if it is set; or move the lamp");
        warnings.push(DarkLights { first: Dark::Entity(first), message, help });
    }
    let mut missing = Vec::new();
    for (index, light) in scene.lights.iter().enumerate() {
        let Light::Spot(spot) = light else { continue };
        if !is_any(&|surface| reaches(spot, &surface.extent)) {
            missing.push(index);
        }
    }
    if let Some(&first) = missing.first() {
        let number = first + 1;
        let message = match missing.len() {
            1 => format!("light {number} is a spot with no surface in its cone: it lights nothing"),
            count => format!(
                "{count} lights, light {number} the first, are spots with no surface in their cones: they light nothing"
            ),
        };
        let help = "check its position and direction".to_owned();
        warnings.push(DarkLights { first: Dark::Light(first), message, help });
    }
    warnings
}

/// A surface in one place.
struct Surface {
    entity: usize,
    /// Index of the instance; `None` in the world.
    place: Option<usize>,
    extent: Extent,
}

/// A region that contains a surface.
#[derive(Clone, Copy)]
enum Extent {
    /// The points X with X·normal = distance, of a normal of length one.
    Plane { normal: DVec3, distance: f64 },
    /// The corners of a box, which need not be parallel to the axes.
    Corners([DVec3; 8]),
}

/// The surfaces in all places; `None` if there are too many. `of_group` has the indices of the places of each group.
fn surfaces(scene: &Scene, places: &[GroupPlace], of_group: &[Vec<usize>]) -> Option<Vec<Surface>> {
    let mut meshes = HashMap::new();
    let mut all = Vec::new();
    for (entity, Entity { shape, within, .. }) in scene.entities.iter().enumerate() {
        let own = extent(shape, &mut meshes);
        match within {
            None => all.push(Surface { entity, place: None, extent: own }),
            Some(group) => all.extend(of_group[*group].iter().map(|&place| Surface {
                entity,
                place: Some(place),
                extent: own.under(&places[place].transform),
            })),
        }
        if all.len() > MOST_SURFACES {
            return None;
        }
    }
    Some(all)
}

/// A region that contains a shape. `meshes` has the bounds of meshes that were seen before.
fn extent(shape: &Shape, meshes: &mut HashMap<*const Mesh, Bounds>) -> Extent {
    let corners = |bounds: &Bounds| {
        Extent::Corners([0, 1, 2, 3, 4, 5, 6, 7].map(|corner| {
            let of = |axis: usize| if corner >> axis & 1 == 0 { bounds.low[axis] } else { bounds.high[axis] };
            DVec3::from([0, 1, 2].map(|axis| f64::from(of(axis))))
        }))
    };
    match shape {
        Shape::Plane(PlaneParameters { normal, distance }) => {
            Extent::Plane { normal: normal.normalize(), distance: *distance }
        }
        Shape::Mesh { mesh, transform } => {
            let own = meshes.entry(Arc::as_ptr(mesh));
            corners(own.or_insert_with(|| Bounds::of(mesh.positions.iter().copied()))).under(transform)
        }
        // Of flat shapes the corners are exact, so that lamps in one plane do not seem to face each other.
        Shape::Quad(QuadParameters { corner, u, v }) => {
            let p = *corner;
            Extent::Corners([p, p + *u, p + *v, p + *u + *v, p, p + *u, p + *v, p + *u + *v])
        }
        Shape::Disk(DiskParameters { center, normal, radius }) => {
            let (x, y) = normal.normalize().any_orthonormal_pair();
            let around = [x + y, x - y, y - x, -x - y].map(|to| *center + to * *radius);
            Extent::Corners([0, 1, 2, 3, 0, 1, 2, 3].map(|corner| around[corner]))
        }
        other => {
            let pieces = other.pieces();
            corners(&pieces.iter().fold(Bounds::NOTHING, |around, piece| around.with(&piece.bounds())))
        }
    }
}

impl Extent {
    /// The transformed region. Planes are in no group.
    fn under(self, transform: &DAffine3) -> Extent {
        match self {
            Extent::Plane { .. } => self,
            Extent::Corners(corners) => {
                Extent::Corners(corners.map(|corner| transform.transform_point3(corner)))
            }
        }
    }
}

/// A flat lamp: a point of it, and the direction of length one to which it emits.
#[derive(Clone, Copy)]
struct Lamp {
    point: DVec3,
    normal: DVec3,
}

/// The lamp that an entity is, if it is flat and emits.
fn lamp(entity: &Entity) -> Option<Lamp> {
    if !entity.emits() {
        return None;
    }
    let (point, normal) = match &entity.shape {
        Shape::Plane(PlaneParameters { normal, distance }) => (normal.normalize() * *distance, *normal),
        Shape::Quad(QuadParameters { corner, u, v }) => (*corner, u.cross(*v)),
        Shape::Disk(DiskParameters { center, normal, .. }) => (*center, *normal),
        _ => return None,
    };
    let sign = if entity.flip_normal { -1.0 } else { 1.0 };
    Some(Lamp { point, normal: normal.normalize() * sign })
}

impl Lamp {
    /// The transformed lamp. Its outward side is that of the transformed outward side, also under a reflection.
    fn under(self, transform: &DAffine3) -> Lamp {
        let normal = transform.matrix3.inverse().transpose() * self.normal;
        Lamp { point: transform.transform_point3(self.point), normal: normal.normalize() }
    }

    /// Whether a point may be in front of it.
    fn is_before(&self, p: DVec3) -> bool {
        // Of double precision; bounds of curved shapes include the rounding errors of rendering.
        let margin = 1e-12 * (p.abs().max_element() + self.point.abs().max_element());
        (p - self.point).dot(self.normal) > margin
    }

    /// Whether a surface may have a point in front of it.
    fn faces(&self, extent: &Extent) -> bool {
        match extent {
            Extent::Corners(corners) => corners.iter().any(|&corner| self.is_before(corner)),
            Extent::Plane { normal, distance } => {
                self.normal.cross(*normal).length() > 1e-9 || self.is_before(*normal * *distance)
            }
        }
    }

    /// Whether a ray may start at a camera in front of it.
    fn faces_camera(&self, camera: &CameraSettings) -> bool {
        if camera.orthographic_height.is_some() {
            // Rays start anywhere on its plane: the shape of the picture may be changed after loading.
            let (normal, distance) = (camera.forward, camera.forward.dot(camera.eye));
            return self.faces(&Extent::Plane { normal, distance });
        }
        self.is_before(camera.eye + self.normal * camera.aperture_radius)
    }
}

/// Whether a surface may have a point in the cone of a spot light.
fn reaches(spot: &SpotLightParameters, extent: &Extent) -> bool {
    let (apex, axis) = (spot.position, spot.direction.normalize());
    // With a margin for rounding errors.
    let angle = spot.cone_angle.to_radians() + 1e-3;
    let between = |direction: DVec3| libm::acos(direction.dot(axis).clamp(-1.0, 1.0));
    match extent {
        Extent::Plane { normal, distance } => {
            let towards = *normal * f64::signum(distance - apex.dot(*normal));
            between(towards) - angle < FRAC_PI_2
        }
        Extent::Corners(corners) => {
            let is_behind = |corner: &DVec3| {
                let margin = MARGIN * (corner.abs().max_element() + apex.abs().max_element());
                (*corner - apex).dot(axis) < -margin
            };
            if angle < FRAC_PI_2 && corners.iter().all(is_behind) {
                return false;
            }
            let centre = corners.iter().sum::<DVec3>() / 8.0;
            let radius = corners.iter().fold(0.0_f64, |most, corner| most.max(corner.distance(centre)));
            let away = centre - apex;
            let share = radius * (1.0 + MARGIN) / away.length();
            // Within the sphere around the box, and where something is not a number.
            if share >= 1.0 || share.is_nan() {
                return true;
            }
            between(away.normalize()) - libm::asin(share) < angle
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    /// The warnings about a ball of radius 1 at the origin and a floor at z = −1, seen from (0, −5, 0), with more.
    fn warnings(more: &str) -> Vec<String> {
        let text = format!(
            r#"
            camera = {{ eye = [0, -5, 0], forward = [0, 1, 0] }}
            materials.grey = {{ type = "matte", reflectance = [0.5, 0.5, 0.5] }}
            [[entities]]
            shape = {{ type = "sphere", center = [0, 0, 0], radius = 1 }}
            material = "grey"
            [[entities]]
            shape = {{ type = "plane", normal = [0, 0, 1], distance = -1 }}
            material = "grey"
            {more}"#
        );
        let loaded =
            crate::scene::parse(&text, Path::new("a.toml")).unwrap_or_else(|error| panic!("{error}"));
        loaded.warnings.iter().map(|warning| warning.message.clone()).collect()
    }

    fn lamp(shape: &str, rest: &str) -> String {
        format!(
            "[[entities]]\nname = \"lamp\"\nshape = {{ {shape} }}\nmaterial = \"grey\"\nemission = [1, 1, 1]\n{rest}\n"
        )
    }

    const QUAD: &str = "type = \"quad\", corner = [-1, -1, 3], u = [2, 0, 0], v = [0, 2, 0]";
    const DARK: &str = "\"lamp\" emits away from the camera and from every surface: it lights nothing";

    #[test]
    fn a_lamp_that_faces_away_from_everything_gives_a_warning() {
        let disk = "type = \"disk\", center = [0, 0, 3], normal = [0, 0, 2], radius = 1";
        let plane = "type = \"plane\", normal = [0, 0, 1], distance = 3";
        let turned = "type = \"quad\", corner = [-1, -1, 0], u = [2, 0, 0], v = [0, 2, 0], transform = { translate = [0, 0, 3] }";
        for shape in [QUAD, disk, plane, turned] {
            assert_eq!(warnings(&lamp(shape, "")), [DARK], "{shape}");
            // Turned around, it lights the ball and the floor.
            assert_eq!(warnings(&lamp(shape, "flip_normal = true")), [""; 0], "{shape}");
            // And so it does upwards, if there is another surface above, or the camera.
            let above = "[[entities]]\nshape = { type = \"sphere\", center = [9, 0, 3], radius = 0.1 }\nmaterial = \"grey\"\n";
            assert_eq!(warnings(&(lamp(shape, "") + above)), [""; 0], "{shape}");
        }
        let tilted = QUAD.replace("v = [0, 2, 0]", "v = [0, 2, 0.1]");
        assert_eq!(warnings(&lamp(&tilted, "")), [""; 0], "it lights the floor at a distance");
        let low = QUAD.replace("[-1, -1, 3]", "[-1, -1, -0.5]");
        assert_eq!(warnings(&lamp(&low, "")), [""; 0], "it lights the ball from below");
        let several = lamp(QUAD, "")
            + &lamp(disk, "").replace("\"lamp\"", "\"other\"")
            + &lamp(QUAD, "flip_normal = true").replace("\"lamp\"", "\"third\"");
        assert_eq!(
            warnings(&several),
            [
                "2 entities, \"lamp\" the first, emit away from the camera and from every surface: they light nothing"
            ]
        );
    }

    #[test]
    fn a_lamp_that_only_the_camera_may_see_gives_none() {
        let text = |camera: &str| {
            format!(
                "camera = {{ {camera} }}\n\
                 materials.grey = {{ type = \"matte\", reflectance = [0.5, 0.5, 0.5] }}\n{}",
                lamp(QUAD, "")
            )
        };
        let count = |camera: &str| {
            let loaded = crate::scene::parse(&text(camera), Path::new("a.toml")).expect("a scene");
            loaded.warnings.len()
        };
        for (height, expected) in [(2.9, 1), (3.1, 0)] {
            assert_eq!(count(&format!("eye = [0, -5, {height}], forward = [0, 1, 0]")), expected);
            // All rays of an orthographic camera start at this height.
            let upwards = "type = \"orthographic\", height = 1, forward = [0, 0, 1], up = [0, 1, 0]";
            assert_eq!(count(&format!("{upwards}, eye = [0, -5, {height}]")), expected);
        }
        // A picture that is wide enough reaches the lamp's front.
        let tilted = "type = \"orthographic\", height = 1, forward = [0, 1, 0], up = [1, 0, 0]";
        assert_eq!(count(&format!("{tilted}, eye = [0, -5, 0]")), 0);
    }

    #[test]
    fn a_spot_with_nothing_in_its_cone_gives_a_warning() {
        let spot = |position: &str, direction: &str, angle: u32| {
            format!(
                "[[lights]]\ntype = \"spot\"\nposition = {position}\ndirection = {direction}\ncone_angle = {angle}\nintensity = [1, 1, 1]\n"
            )
        };
        let dark = "light 1 is a spot with no surface in its cone: it lights nothing";
        for (direction, angle, is_dark) in [
            ("[0, 0, 1]", 30, true),
            ("[0, 0, 1]", 89, true),
            // Below the horizon it lights the floor.
            ("[0, 0, 1]", 91, false),
            ("[0, 0, -1]", 30, false),
            ("[1, 0, 0.1]", 3, true),
            ("[1, 0, 0.1]", 8, false),
        ] {
            let expected: &[&str] = if is_dark { &[dark] } else { &[] };
            assert_eq!(warnings(&spot("[0, 0, 3]", direction, angle)), expected, "{direction}, {angle}");
        }
        // Past the ball alone.
        let text = |direction: &str| {
            let ball = "[[entities]]\nshape = { type = \"sphere\", center = [0, 0, 0], radius = 1 }\nmaterial = \"grey\"\n";
            let grey = "materials.grey = { type = \"matte\", reflectance = [0.5, 0.5, 0.5] }\n";
            let text = format!("{grey}{ball}{}", spot("[-5, 0, 0]", direction, 10));
            crate::scene::parse(&text, Path::new("a.toml")).expect("a scene").warnings.len()
        };
        assert_eq!((text("[1, 0, 0]"), text("[1, 1, 0]"), text("[1, 0.4, 0]")), (0, 1, 0));
        let two = spot("[0, 0, 3]", "[0, 0, 1]", 30) + &spot("[0, 0, 2]", "[0, 0, 1]", 30);
        assert_eq!(
            warnings(&two),
            ["2 lights, light 1 the first, are spots with no surface in their cones: they light nothing"]
        );
    }

    #[test]
    fn a_warning_has_the_position_of_the_first_light() {
        let text = |more: &str| {
            format!(
                "materials.grey = {{ type = \"matte\", reflectance = [0.5, 0.5, 0.5] }}\n\
                 [[entities]]\nshape = {{ type = \"sphere\", center = [0, 0, 0], radius = 1 }}\nmaterial = \"grey\"\n{more}"
            )
        };
        let line = |more: &str| {
            let loaded = crate::scene::parse(&text(more), Path::new("a.toml")).expect("a scene");
            let lines = loaded.warnings.iter().map(|warning| warning.position.map(|position| position.line));
            lines.collect::<Vec<_>>()
        };
        let point = "[[lights]]\ntype = \"point\"\nposition = [0, 0, 3]\nintensity = [1, 1, 1]\n";
        let spot = "[[lights]]\ntype = \"spot\"\nposition = [0, 0, 3]\ndirection = [0, 0, 1]\ncone_angle = 9\nintensity = [1, 1, 1]\n";
        assert_eq!(line(&format!("{point}{spot}{spot}")), [Some(9)]);
        assert_eq!(line(&lamp(QUAD, "")), [Some(8)], "the material, as in other warnings about entities");
    }

    #[test]
    fn lights_are_not_tested_if_there_are_too_many_instances() {
        let group = "[[groups.ball.entities]]\nshape = { type = \"sphere\", center = [0, 0, 0], radius = 1 }\nmaterial = \"grey\"\n\
                     [[instances]]\ngroup = \"ball\"\n";
        let text = format!(
            "camera = {{ eye = [0, -5, 0], forward = [0, 1, 0] }}\n\
             materials.grey = {{ type = \"matte\", reflectance = [0.5, 0.5, 0.5] }}\n{}{group}",
            lamp(QUAD, "")
        );
        let mut scene = crate::scene::parse(&text, Path::new("a.toml")).expect("a scene").scene;
        let count = |scene: &super::Scene| super::dark_lights(scene, str::to_owned, "flip_normal").len();
        assert_eq!(count(&scene), 1);
        scene.instances = vec![scene.instances[0].clone(); super::MOST_SURFACES + 1];
        assert_eq!(count(&scene), 0);
    }
}
