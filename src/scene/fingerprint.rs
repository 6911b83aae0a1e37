//! What a scene is, in 32 bytes: whether two renders are of the same scene, and if they are not, what differs.
//!
//! Only what changes the bits of samples counts, by its value: not how a file spells it, whether it spells out a
//! default, what things are called, nor materials that nothing has. Film, integrator, sampler, depth, samples and
//! seed do not count either: a film names each of them itself.

use std::fmt::Write;
use std::sync::Arc;

use sha2::{Digest as _, Sha256};

use super::description::{
    CameraSettings, Entity, EnvironmentPicture, ImageFile, Instance, Integrator, Material, Modifiers, Scene,
    Shape, Textured,
};
use crate::parameter::{Family, ImageIndex, ParameterKind, Value, Varying};
use crate::shape::Mesh;

/// The meshes that a scene was read from, in any order, each with its file's name and that of its part.
///
/// Messages name them so; other files that those name, colours and buffers, count by the values that come of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources(pub Vec<(String, Arc<Mesh>)>);

/// A digest of a scene and of each of its parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingerprint {
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Part {
    /// What people call it. Does not count.
    name: String,
    digest: [u8; 32],
}

/// Scenes of more parts than this don't list them: an outline is a courtesy, and not worth megabytes.
const MOST_LISTED: usize = 2000;

/// Nor do those whose names take more bytes than this: a film's text has its limit, too.
const LONGEST_OUTLINE: usize = 1 << 16;

/// Differences that are told one by one.
const MOST_TOLD: usize = 4;

impl Fingerprint {
    /// Of a scene, with the files that its meshes come from.
    pub fn of(scene: &Scene, sources: &Sources) -> Fingerprint {
        // What is left out here, a film tells itself, or it changes no sample. A new setting has to be thought of.
        let Scene {
            film: _,
            camera,
            render,
            materials: _,
            textures: _,
            images,
            entities,
            groups: _,
            instances,
            lights,
            environment,
            environment_picture,
        } = scene;
        let mut parts = camera_parts(camera);
        parts.push(Part::new("environment.radiance", |digest| digest.numbers(environment)));
        if render.integrator == Integrator::Whitted {
            parts.push(Part::new("render.ambient", |digest| digest.numbers(&render.ambient)));
        }
        let mut meshes: Vec<&Arc<Mesh>> = Vec::new();
        let mut named = Vec::new();
        if let Some(EnvironmentPicture { file, scale, rotate, up }) = environment_picture {
            parts.push(Part::new("environment.file", |digest| digest.named_image(*file, &mut named)));
            parts.push(Part::new("environment.scale", |digest| digest.numbers(scale)));
            parts.push(Part::new("environment.rotate", |digest| digest.numbers(&[*rotate])));
            parts.push(Part::new("environment.up", |digest| digest.numbers(&up.to_array())));
        }
        for entity in entities {
            let Entity { name, shape, material, emission, emission_texture, flip_normal, within } = entity;
            parts.push(Part::new(&format!("the shape of {name}"), |digest| {
                digest.shape(shape, &mut meshes);
                digest.word(u64::from(*flip_normal));
                // Films of before there were groups are continued.
                within.iter().for_each(|&group| digest.word(group as u64));
            }));
            parts.push(Part::new(&format!("the material of {name}"), |digest| {
                digest.material(*material, scene, &mut named);
            }));
            parts.push(Part::new(&format!("the emission of {name}"), |digest| {
                digest.numbers(emission);
                if let Some(texture) = emission_texture {
                    digest.texture(*texture, scene, &mut named);
                }
            }));
        }
        for Instance { name, group, transform, within } in instances {
            parts.push(Part::new(&format!("the place of {name}"), |digest| {
                digest.word(*group as u64);
                digest.numbers(&transform.to_cols_array());
                within.iter().for_each(|&group| digest.word(group as u64));
            }));
        }
        for (i, light) in lights.iter().enumerate() {
            parts.push(Part::new(&format!("light {}", i + 1), |digest| digest.declared(light)));
        }
        for (i, mesh) in meshes.into_iter().enumerate() {
            let file = sources.0.iter().find(|(_, known)| Arc::ptr_eq(known, mesh));
            let name = file.map_or_else(|| format!("mesh {}", i + 1), |(name, _)| name.clone());
            parts.push(Part::new(&name, |digest| digest.mesh(mesh)));
        }
        for image in named {
            let image = &images[image];
            parts.push(Part::new(&image.name, |digest| digest.image(image)));
        }
        Fingerprint { parts }
    }

    /// The digest of it all, in hexadecimal digits.
    pub fn digits(&self) -> String {
        let mut all = Sha256::new();
        self.parts.iter().for_each(|part| all.update(part.digest));
        hexadecimal(&all.finalize())
    }

    /// Its parts on one line, in short, for [`differing`]; none of a scene of thousands, or of endless names.
    pub fn outline(&self) -> Option<String> {
        if self.parts.len() > MOST_LISTED {
            return None;
        }
        let mut line = String::new();
        for part in &self.parts {
            let name = part.name.replace(SEPARATOR, ",");
            // Writing to a string can't fail.
            let _ = write!(line, "{}{name}{SEPARATOR}", hexadecimal(&part.digest[..4]));
        }
        (line.len() <= LONGEST_OUTLINE).then_some(line)
    }
}

/// What ends a part of an outline.
const SEPARATOR: char = ';';

/// What differs between two scenes, by their outlines.
pub fn differing(ours: &str, theirs: &str) -> String {
    fn parts(outline: &str) -> Vec<(&str, &str)> {
        outline.split_terminator(SEPARATOR).filter_map(|part| part.split_at_checked(8)).collect()
    }
    let (ours, theirs) = (parts(ours), parts(theirs));
    let mut names: Vec<&str> = ours.iter().filter(|part| !theirs.contains(part)).map(|part| part.1).collect();
    let gone = theirs.iter().filter(|part| ours.iter().all(|ours| ours.1 != part.1));
    names.extend(gone.map(|part| part.1));
    match names.len() {
        0 => "the order of its entities".to_owned(),
        n if n > MOST_TOLD => format!("{} and {} more", names[..MOST_TOLD].join(", "), n - MOST_TOLD),
        _ => names.join(", "),
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn camera_parts(camera: &CameraSettings) -> Vec<Part> {
    let CameraSettings {
        eye,
        forward,
        up,
        vertical_fov,
        orthographic_height,
        focal_length,
        near,
        aperture_radius,
        focus_distance,
    } = camera;
    let vectors = [("eye", eye), ("forward", forward), ("up", up)];
    let numbers = [
        ("vertical_fov", vertical_fov),
        ("focal_length", focal_length),
        ("near", near),
        ("aperture_radius", aperture_radius),
        ("focus_distance", focus_distance),
    ];
    let vector = |(name, v): (&str, &glam::DVec3)| {
        Part::new(&format!("camera.{name}"), |digest| digest.numbers(&v.to_array()))
    };
    let number = |(name, &x): (&str, &f64)| Part::new(&format!("camera.{name}"), |d| d.numbers(&[x]));
    let height = orthographic_height.map(|height| number(("height", &height)));
    vectors.map(vector).into_iter().chain(numbers.map(number)).chain(height).collect()
}

impl Part {
    fn new(name: &str, fill: impl FnOnce(&mut Digest)) -> Part {
        let mut digest = Digest(Sha256::new());
        fill(&mut digest);
        Part { name: name.to_owned(), digest: digest.0.finalize().into() }
    }
}

/// Values go in with their number or a tag before them, so that no two lists of them look alike.
struct Digest(Sha256);

impl Digest {
    fn word(&mut self, word: u64) {
        self.0.update(word.to_le_bytes());
    }

    fn tag(&mut self, tag: &str) {
        self.word(tag.len() as u64);
        self.0.update(tag);
    }

    fn numbers(&mut self, numbers: &[f64]) {
        self.word(numbers.len() as u64);
        // −0 and 0 are the same number.
        numbers.iter().for_each(|x| self.word((x + 0.0).to_bits()));
    }

    /// Meshes go by their place among those that shapes name, in order: what is in them counts once.
    fn shape<'s>(&mut self, shape: &'s Shape, meshes: &mut Vec<&'s Arc<Mesh>>) {
        match shape {
            Shape::Mesh { mesh, transform } => {
                self.tag("mesh");
                let known = meshes.iter().position(|known| Arc::ptr_eq(known, mesh));
                let place = known.unwrap_or_else(|| {
                    meshes.push(mesh);
                    meshes.len() - 1
                });
                self.word(place as u64);
                self.numbers(&transform.to_cols_array());
            }
            declared => self.declared(declared),
        }
    }

    /// The name and the values of what is declared, but for those that do not count: what follows one of them goes by its
    /// name. Materials, textures and images have more to them than their index.
    fn declared(&mut self, declared: &impl Family) {
        let declaration = declared.declaration();
        self.tag(declaration.map_or("", |declaration| declaration.name));
        let kinds = declaration.into_iter().flat_map(|declaration| declaration.parameters);
        let mut is_named = false;
        for (value, parameter) in declared.values().into_iter().zip(kinds) {
            if value == Value::Absent || Some(value) == parameter.uncounted {
                is_named = true;
                continue;
            }
            if is_named {
                self.tag(parameter.name);
            }
            let word = |place: usize| match parameter.kind {
                ParameterKind::Word(words) | ParameterKind::Words(words) => words.get(place).unwrap_or(&""),
                _ => unreachable!("{} is no word", parameter.name),
            };
            match value {
                Value::Number(number) => self.numbers(&[number]),
                Value::Pair(pair) => self.numbers(&pair),
                Value::Colour(colour) => self.numbers(&colour),
                Value::Vector(vector) => self.numbers(&vector.to_array()),
                Value::Varying(Varying::Colour(colour)) => self.numbers(&colour),
                Value::Flag(flag) => self.word(u64::from(flag)),
                Value::Word(place) => self.tag(word(place)),
                Value::Words(places) => places.into_iter().for_each(|place| self.tag(word(place))),
                Value::Absent
                | Value::Material(_)
                | Value::Varying(Varying::Texture(_))
                | Value::Image(_) => {}
            }
        }
    }

    /// A material, its textures, and the materials that it names after it, in order. They come before it in the scene, so
    /// that this ends. Images go by their place among those that are named.
    fn material(&mut self, index: usize, scene: &Scene, images: &mut Vec<usize>) {
        let material = &scene.materials[index];
        let Material { name: _, kind: _, textures, modifiers } = material;
        self.declared(&material.textured_kind());
        for Textured { parameter, texture } in textures {
            self.tag(parameter);
            self.texture(*texture, scene, images);
        }
        if *modifiers != Modifiers::default() {
            self.declared(modifiers);
        }
        material.named().for_each(|named| self.material(named, scene, images));
    }

    /// A texture likewise.
    fn texture(&mut self, index: usize, scene: &Scene, images: &mut Vec<usize>) {
        let kind = &scene.textures[index].kind;
        self.declared(kind);
        let parameters = kind.declaration().into_iter().flat_map(|declaration| declaration.parameters);
        for (value, parameter) in kind.values().into_iter().zip(parameters) {
            match value {
                Value::Varying(Varying::Texture(named)) => {
                    self.tag(parameter.name);
                    self.texture(named, scene, images);
                }
                Value::Image(image) => self.named_image(image, images),
                _ => {}
            }
        }
    }

    /// An image by its place among those that are named: what is in it counts once.
    fn named_image(&mut self, image: ImageIndex, images: &mut Vec<usize>) {
        let known = images.iter().position(|known| *known == image.0);
        let place = known.unwrap_or_else(|| {
            images.push(image.0);
            images.len() - 1
        });
        self.word(place as u64);
    }

    fn image(&mut self, image: &ImageFile) {
        let ImageFile { name: _, is_tiled, tiles } = image;
        self.word(u64::from(*is_tiled));
        for tile in tiles {
            let picture = &tile.picture;
            let about = [tile.number, picture.width(), picture.height(), picture.channels()];
            about.into_iter().for_each(|number| self.word(number.into()));
            self.tag(picture.depth().name());
            self.flat(picture.words().as_flattened(), |word| word);
        }
    }

    fn mesh(&mut self, mesh: &Mesh) {
        let Mesh { positions, normals, uv, triangles } = mesh;
        self.flat(positions.as_flattened(), |x| (x + 0.0).to_bits());
        self.flat(normals.as_flattened(), |x| (x + 0.0).to_bits());
        self.flat(uv.as_flattened(), |x| (x + 0.0).to_bits());
        self.flat(triangles.as_flattened(), |index| index);
    }

    /// Millions of words, a piece at a time.
    fn flat<T: Copy>(&mut self, values: &[T], word: impl Fn(T) -> u32) {
        self.word(values.len() as u64);
        let mut bytes = Vec::with_capacity(1 << 14);
        for piece in values.chunks(1 << 12) {
            bytes.clear();
            piece.iter().for_each(|&value| bytes.extend_from_slice(&word(value).to_le_bytes()));
            self.0.update(&bytes);
        }
    }
}

#[cfg(test)]
mod tests;
