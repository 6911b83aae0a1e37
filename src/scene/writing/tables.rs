//! The tables of a scene file.

use super::sought;
use super::words::{different, list, number, quoted};
use crate::parameter::{Family, ParameterKind, Value, Varying};
use crate::scene::description::{
    CameraSettings, Choice, EnvironmentPicture, FilmMode, FilmSettings, Filter, Modifiers, RenderSettings,
    Scene, Shape, Textured, UNLIMITED,
};
use glam::{DAffine3, DVec3};
use std::fmt::Write;

/// The names by which tables refer to each other.
struct Names<'a> {
    materials: Vec<String>,
    textures: Vec<String>,
    pictures: &'a [String],
    groups: Vec<String>,
}

/// Writes a line of a table. Writing to a string cannot fail.
fn line(text: &mut String, key: &str, value: impl std::fmt::Display) {
    let _ = writeln!(text, "{key} = {value}");
}

/// The whole file.
pub(super) fn scene(scene: &Scene, pictures: &[String], meshes: &[Option<String>]) -> Result<String, String> {
    let names = Names {
        materials: different(scene.materials.iter().map(|material| material.name.as_str())),
        textures: different(scene.textures.iter().map(|texture| texture.name.as_str())),
        pictures,
        groups: different(scene.groups.iter().map(|group| group.name.as_str())),
    };
    let mut text = String::new();
    film(&scene.film, &mut text);
    camera(&scene.camera, &mut text)?;
    render(&scene.render, &mut text);
    if scene.environment != [0.0; 3] {
        text += "\n[environment]\n";
        line(&mut text, "radiance", list(&scene.environment));
    }
    if let Some(picture) = &scene.environment_picture {
        environment(picture, &names, &mut text)?;
    }
    for (texture, name) in scene.textures.iter().zip(&names.textures) {
        let _ = writeln!(text, "\n[textures.{}]", quoted(name));
        text += &(parameters(&texture.kind, &[], &names)?.join("\n") + "\n");
    }
    for (material, name) in scene.materials.iter().zip(&names.materials) {
        let _ = writeln!(text, "\n[materials.{}]", quoted(name));
        let own = parameters(&material.kind, &material.textures, &names)?;
        let common = modifiers(&material.modifiers, &material.textures, &names)?;
        text += &(own.into_iter().chain(common).collect::<Vec<_>>().join("\n") + "\n");
    }
    for light in &scene.lights {
        text += "\n[[lights]]\n";
        text += &(parameters(light, &[], &names)?.join("\n") + "\n");
    }
    for (entity, mesh) in scene.entities.iter().zip(meshes) {
        let _ = writeln!(text, "\n[[{}entities]]", names.within(entity.within));
        line(&mut text, "name", quoted(&entity.name));
        let shape = match (&entity.shape, mesh) {
            (Shape::Mesh { transform, .. }, Some(file)) => {
                format!("{{ type = \"mesh\", file = {}, transform = {} }}", quoted(file), matrix(transform))
            }
            (shape, _) => format!("{{ {} }}", parameters(shape, &[], &names)?.join(", ")),
        };
        line(&mut text, "shape", shape);
        line(&mut text, "material", quoted(&names.materials[entity.material]));
        match entity.emission_texture {
            Some(texture) => line(&mut text, "emission", quoted(&names.textures[texture])),
            None if entity.emission != [0.0; 3] => line(&mut text, "emission", list(&entity.emission)),
            None => {}
        }
        if entity.flip_normal {
            line(&mut text, "flip_normal", true);
        }
    }
    for instance in &scene.instances {
        let _ = writeln!(text, "\n[[{}instances]]", names.within(instance.within));
        line(&mut text, "name", quoted(&instance.name));
        line(&mut text, "group", quoted(&names.groups[instance.group]));
        line(&mut text, "transform", matrix(&instance.transform));
    }
    Ok(text)
}

fn environment(picture: &EnvironmentPicture, names: &Names<'_>, text: &mut String) -> Result<(), String> {
    *text += "\n[environment]\n";
    line(text, "file", quoted(&names.pictures[picture.file.0]));
    line(text, "scale", list(&picture.scale));
    let degrees = sought::degrees(picture.rotate);
    let degrees = degrees.ok_or(
        "rotate of the environment cannot be written as decimal numbers that are read as the same value",
    )?;
    line(text, "rotate", number(degrees));
    let up = sought::direction(picture.up);
    let up = up.ok_or(
        "up of the environment cannot be written as decimal numbers that are read as the same value",
    )?;
    line(text, "up", list(&up.to_array()));
    Ok(())
}

/// The lines of a material's modifiers that differ from their defaults.
fn modifiers(own: &Modifiers, textured: &[Textured], names: &Names<'_>) -> Result<Vec<String>, String> {
    let usual = parameters(&Modifiers::default(), &[], names)?;
    let all = parameters(own, textured, names)?;
    // The first line is the type, which modifiers do not have.
    Ok(all.into_iter().skip(1).filter(|line| !usual.contains(line)).collect())
}

impl Names<'_> {
    /// The prefix of the headers of entities in a group; empty for the world.
    fn within(&self, group: Option<usize>) -> String {
        group.map_or_else(String::new, |group| format!("groups.{}.", quoted(&self.groups[group])))
    }
}

/// A transform as a matrix.
fn matrix(transform: &DAffine3) -> String {
    let columns = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    let row = |i: usize| list(&[columns[0][i], columns[1][i], columns[2][i], transform.translation[i]]);
    format!("{{ matrix = [{}] }}", [0, 1, 2].map(row).join(", "))
}

fn film(film: &FilmSettings, text: &mut String) {
    *text += "[film]\n";
    line(text, "width", film.width);
    line(text, "height", film.height);
    line(text, "exposure", number(film.exposure));
    line(text, "tone", quoted(film.tone.name()));
    let name = film.filter.name();
    let radius = number(film.filter.radius());
    let filter = match film.filter {
        Filter::None => quoted(name),
        Filter::Gaussian { sigma, .. } => {
            format!("{{ type = \"{name}\", radius = {radius}, sigma = {} }}", number(sigma))
        }
        Filter::Mitchell { b, c, .. } => {
            format!("{{ type = \"{name}\", radius = {radius}, b = {}, c = {} }}", number(b), number(c))
        }
        _ => format!("{{ type = \"{name}\", radius = {radius} }}"),
    };
    line(text, "filter", filter);
    if let Some(mode) = film.mode {
        line(text, "mode", quoted(FilmMode::name(mode)));
    }
}

fn camera(camera: &CameraSettings, text: &mut String) -> Result<(), String> {
    *text += "\n[camera]\n";
    let direction = |name: &str, direction: DVec3| {
        let found = sought::direction(direction);
        found.ok_or_else(|| {
            format!("the {name} of the camera, {direction}, cannot be written as decimal numbers that are read as the same value")
        })
    };
    line(text, "eye", list(&camera.eye.to_array()));
    line(text, "forward", list(&direction("forward", camera.forward)?.to_array()));
    line(text, "up", list(&direction("up", camera.up)?.to_array()));
    match camera.orthographic_height {
        Some(height) => {
            line(text, "type", "\"orthographic\"");
            line(text, "height", number(height));
        }
        None => {
            let degrees = sought::degrees(camera.vertical_fov);
            let degrees = degrees.ok_or(
                "the field of view cannot be written as decimal numbers that are read as the same value",
            )?;
            line(text, "vertical_fov", number(degrees));
        }
    }
    line(text, "near", number(camera.near));
    line(text, "focal_length", number(camera.focal_length));
    line(text, "aperture_radius", number(camera.aperture_radius));
    line(text, "focus_distance", number(camera.focus_distance));
    Ok(())
}

fn render(render: &RenderSettings, text: &mut String) {
    *text += "\n[render]\n";
    line(text, "integrator", quoted(render.integrator.name()));
    line(text, "sampler", quoted(render.sampler.name()));
    match render.max_depth {
        UNLIMITED => line(text, "max_depth", "\"unlimited\""),
        depth => line(text, "max_depth", depth),
    }
    line(text, "samples", render.samples);
    line(text, "adaptive", render.adaptive);
    line(text, "seed", render.seed);
    if render.ambient != [0.0; 3] {
        line(text, "ambient", list(&render.ambient));
    }
}

/// The lines `key = value` of the type and of all parameters, some of which are textures.
fn parameters<F: Family>(
    member: &F,
    textured: &[Textured],
    names: &Names<'_>,
) -> Result<Vec<String>, String> {
    let Some(declaration) = member.declaration() else {
        return Err("the scene has a mesh without a file".into());
    };
    let mut all = vec![format!("type = \"{}\"", declaration.name)];
    for (parameter, value) in declaration.parameters.iter().zip(member.values()) {
        let name = parameter.name;
        if let Some(textured) = textured.iter().find(|textured| textured.parameter == name) {
            all.push(format!("{name} = {}", quoted(&names.textures[textured.texture])));
            continue;
        }
        let word = |place: usize| match parameter.kind {
            ParameterKind::Word(words) | ParameterKind::Words(words) => quoted(words[place]),
            _ => String::new(),
        };
        let value = match value {
            Value::Absent => continue,
            Value::Number(whole) if matches!(parameter.kind, ParameterKind::Integer(..)) => {
                format!("{whole}")
            }
            Value::Number(value) => number(value),
            Value::Pair(pair) => list(&pair),
            Value::Colour(colour) => list(&colour),
            Value::Vector(vector) if matches!(parameter.kind, ParameterKind::Direction(_)) => {
                let found = sought::direction(vector);
                let unwritable = || {
                    format!(
                        "{name}, {vector}, cannot be written as decimal numbers that are read as the same value"
                    )
                };
                list(&found.ok_or_else(unwritable)?.to_array())
            }
            Value::Vector(vector) => list(&vector.to_array()),
            Value::Material(material) => quoted(&names.materials[material]),
            Value::Word(place) => word(place),
            Value::Words([u, v]) => format!("[{}, {}]", word(u), word(v)),
            Value::Flag(flag) => flag.to_string(),
            Value::Varying(Varying::Colour(colour)) => list(&colour),
            Value::Varying(Varying::Texture(texture)) => quoted(&names.textures[texture]),
            Value::Image(image) => quoted(&names.pictures[image.0]),
        };
        all.push(format!("{name} = {value}"));
    }
    Ok(all)
}
