//! A digest of a scene, in 32 bytes, which tells whether two renders are of the same scene and what differs.
//!
//! It depends on everything that changes the bits of samples, by value. Spelling, defaults that are written out, names
//! and unused materials have no effect. Film, integrator, sampler, depth, samples and seed are excluded, because a film
//! stores them itself.

use std::fmt::Write;
use std::sync::Arc;

use sha2::{Digest as _, Sha256};

use super::description::{
    CameraSettings, Entity, EnvironmentPicture, ImageFile, Instance, Integrator, Material, Modifiers, Scene,
    Shape, Textured,
};
use crate::parameter::{Family, ImageIndex, ParameterKind, Value, Varying};
use crate::shape::Mesh;
use crate::texture::uses_of_second_uv;

/// The meshes that a scene was read from, in any order, each with the names of its file and part.
///
/// Messages use these names, which do not depend on the path of the scene. Files that mesh files refer to, with colours
/// or buffers, count by the resulting values.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Sources(pub Vec<(String, Arc<Mesh>)>);

/// A digest of a scene and of each of its parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fingerprint {
    parts: Vec<Part>,
}

#[derive(Clone, Debug, PartialEq, Eq)]
struct Part {
    /// The part's name in messages. It does not affect the digest.
    name: String,
    digest: [u8; 32],
}

/// Scenes with more parts have no outline, which would take megabytes.
const MOST_LISTED: usize = 2000;

/// Scenes whose names take more bytes have no outline, because the text in a film is limited.
const LONGEST_OUTLINE: usize = 1 << 16;

/// The maximum number of differences that are listed.
const MOST_TOLD: usize = 4;

impl Fingerprint {
    /// The fingerprint of a scene, with the files of its meshes.
    pub fn of(scene: &Scene, sources: &Sources) -> Fingerprint {
        // Fields that are ignored here are stored in films, or change no sample. The pattern is exhaustive, so that new
        // settings are considered.
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
                // Keeps the fingerprints of scenes without groups from earlier versions.
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
        let kinds: Vec<_> = scene.textures.iter().map(|texture| texture.kind.clone()).collect();
        let uses_second_uv = uses_of_second_uv(&kinds).contains(&true);
        for (i, mesh) in meshes.into_iter().enumerate() {
            let file = sources.0.iter().find(|(_, known)| Arc::ptr_eq(known, mesh));
            let name = file.map_or_else(|| format!("mesh {}", i + 1), |(name, _)| name.clone());
            parts.push(Part::new(&name, |digest| digest.mesh(mesh, uses_second_uv)));
        }
        for image in named {
            let image = &images[image];
            parts.push(Part::new(&image.name, |digest| digest.image(image)));
        }
        Fingerprint { parts }
    }

    /// The digest of the entire scene, in hexadecimal digits.
    pub fn digits(&self) -> String {
        let mut all = Sha256::new();
        self.parts.iter().for_each(|part| all.update(part.digest));
        hexadecimal(&all.finalize())
    }

    /// The digests of its parts on one line, for [`differing`]; `None` for too many parts or too long names.
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

/// The separator of an outline's parts.
const SEPARATOR: char = ';';

/// The differences between two scenes, from their outlines.
pub fn differing(ours: &str, theirs: &str) -> String {
    fn parts(outline: &str) -> Vec<(&str, &str)> {
        outline.split_terminator(SEPARATOR).filter_map(|part| part.split_at_checked(8)).collect()
    }
    // Films of earlier builds have the path of the scene's folder before names of files.
    fn is_same(a: &str, b: &str) -> bool {
        let is_end = |long: &str, short: &str| {
            long.strip_suffix(short).is_some_and(|folder| folder.is_empty() || folder.ends_with(['/', '\\']))
        };
        is_end(a, b) || is_end(b, a)
    }
    let (ours, theirs) = (parts(ours), parts(theirs));
    let is_kept = |part: &(&str, &str)| theirs.iter().any(|it| it.0 == part.0 && is_same(it.1, part.1));
    let mut names: Vec<&str> = ours.iter().filter(|part| !is_kept(part)).map(|part| part.1).collect();
    let gone = theirs.iter().filter(|part| ours.iter().all(|ours| !is_same(ours.1, part.1)));
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

/// Values are preceded by their count or a tag, so that different lists never give the same bytes.
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

    /// Meshes are numbered in the order in which shapes refer to them; the contents of each are hashed once.
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

    /// The name and values of a declaration. References to materials, textures and images are skipped, as the caller
    /// hashes their targets.
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

    /// A material, its textures, and then the materials that it refers to, in order. These precede it in the scene, so
    /// that the recursion ends. Images are numbered in the order of reference.
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

    /// A texture, in the same way.
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

    /// An image by its number in the order of reference; its contents are hashed once.
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

    fn mesh(&mut self, mesh: &Mesh, uses_second_uv: bool) {
        let Mesh { positions, normals, uv, second_uv, triangles } = mesh;
        self.flat(positions.as_flattened(), |x| (x + 0.0).to_bits());
        self.flat(normals.as_flattened(), |x| (x + 0.0).to_bits());
        self.flat(uv.as_flattened(), |x| (x + 0.0).to_bits());
        self.flat(triangles.as_flattened(), |index| index);
        // Counted only if textures use it, so that films of scenes without it can be resumed.
        if uses_second_uv && !second_uv.is_empty() {
            self.flat(second_uv.as_flattened(), |x| (x + 0.0).to_bits());
        }
    }

    /// Millions of words, hashed in pieces.
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
