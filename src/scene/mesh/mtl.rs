//! Wavefront MTL: colours, as matte, mirror and glass.
//!
//! The format describes the shading of a program of 1990, and exporters often fill it in mechanically. Its materials
//! are converted by these rules:
//!
//! - **Glass** transmits light. Illumination models 4, 6, 7 and 9 say how transparency is rendered, not that there is
//!   any: Maya writes model 4 for everything that it exports. Such a material is glass only if another statement
//!   confirms it: an index `Ni` other than that of air, or a filter `Tf` other than white and black, which Maya writes
//!   for opaque materials. With any model, an opacity `d` below 0.5 makes glass.
//! - **Opacity** is `d` or, only without `d`, 1 − `Tr`, as exporters disagree about the meaning of `Tr`. Opacities from
//!   0.5 to 1 are taken for 1.
//! - **Mirrors** reflect by their `Ks`: models 3, 5 and 8, and any where `Kd` is black.
//! - All other materials are **matte** with the colour `Kd`, by default 0.8.

use super::FileMaterial;
use super::obj::{name_after, numbers, uncomment};
use super::parts::Parts;
use super::source::{FilePosition, Read_, Source, number, number_or_nan, shown, words};
use crate::scene::description::{Colour, GlassParameters, MaterialKind, MatteParameters, MirrorParameters};
use std::io::BufRead;

/// A material with the statements of the file.
#[derive(Clone)]
struct Raw {
    name: String,
    /// The line of its first statement.
    place: Option<FilePosition>,
    diffuse: Option<Colour>,
    specular: Colour,
    /// The line of its highlights.
    specular_place: Option<FilePosition>,
    emission: Colour,
    /// Whether a texture gives the emission, which is then often mostly black.
    has_emission_texture: bool,
    filter: Option<Colour>,
    ior: Option<f64>,
    opacity: Option<f64>,
    transparency: Option<f64>,
    model: u32,
}

impl Raw {
    fn new(name: String, place: Option<FilePosition>) -> Raw {
        Raw {
            name,
            place,
            diffuse: None,
            specular: [0.0; 3],
            specular_place: None,
            emission: [0.0; 3],
            has_emission_texture: false,
            filter: None,
            ior: None,
            opacity: None,
            transparency: None,
            model: 2,
        }
    }

    /// The material by the rules above, with notes about losses.
    fn material(self, parts: &mut Parts<'_>) -> FileMaterial {
        let black = self.diffuse.is_some_and(|diffuse| diffuse == [0.0; 3]);
        let shiny = self.specular.iter().any(|&c| c > 0.0);
        let opacity = self.opacity.or(self.transparency.map(|tr| 1.0 - tr)).unwrap_or(1.0);
        let refracts = self.ior.and_then(index).is_some();
        let filters = self.filter.is_some_and(|filter| filter != [0.0; 3] && filter != [1.0; 3]);
        let (whole, highlights) = (self.place.clone(), self.specular_place.clone());
        let mut note_at =
            |message, place: &Option<FilePosition>| parts.note_of_material(message, place.clone());
        let kind = match self.model {
            4 | 6 | 7 | 9 if refracts || filters => {
                if self.diffuse.is_some() && !black {
                    note_at("materials that refract are clear glass, without their diffuse colour", &whole);
                }
                glass(self.ior, self.filter.unwrap_or([1.0; 3]))
            }
            _ if opacity < 0.5 => {
                if opacity > 0.0 {
                    note_at("materials of an opacity below 0.5 are clear glass", &whole);
                }
                glass(self.ior, self.filter.unwrap_or([1.0; 3]))
            }
            3 | 5 | 8 if shiny => {
                if !black {
                    note_at(
                        "materials that reflect are perfect mirrors, without their diffuse colour",
                        &whole,
                    );
                }
                MaterialKind::Mirror(MirrorParameters { reflectance: self.specular })
            }
            _ if black && shiny => {
                note_at("black materials with highlights (Ks) are perfect mirrors", &highlights);
                MaterialKind::Mirror(MirrorParameters { reflectance: self.specular })
            }
            _ => {
                if shiny && self.model > 1 {
                    note_at("highlights (Ks) are left out of matte materials", &highlights);
                }
                if matches!(self.model, 4 | 6 | 7 | 9) {
                    note_at(
                        "materials with a transparent illum (4, 6, 7, 9) but no transmission are matte",
                        &whole,
                    );
                }
                MaterialKind::Matte(MatteParameters {
                    reflectance: self.diffuse.unwrap_or([0.8; 3]),
                    roughness: 0.0,
                })
            }
        };
        if (0.5..1.0).contains(&opacity) && !matches!(kind, MaterialKind::Glass(_)) {
            note_at("materials of an opacity from 0.5 are opaque", &whole);
        }
        if matches!(kind, MaterialKind::Glass(_)) && !refracts {
            note_at("glass whose index of refraction (Ni) is missing, 1 or out of range gets 1.5", &whole);
        }
        if self.has_emission_texture {
            note_at(DARK, &whole);
        }
        let emission = if self.has_emission_texture { [0.0; 3] } else { self.emission };
        FileMaterial { name: self.name, kind, emission }
    }
}

/// Clear glass with a tint; the index is 1.5 if the file gives none, or that of air.
pub(super) fn glass(ior: Option<f64>, transmittance: Colour) -> MaterialKind {
    let ior = ior.and_then(index).unwrap_or(1.5);
    MaterialKind::Glass(GlassParameters { ior, reflectance: [1.0; 3], transmittance })
}

/// The index of refraction, if it is valid and not that of air.
fn index(ior: f64) -> Option<f64> {
    (ior != 1.0 && (1e-3..=1e3).contains(&ior)).then_some(ior)
}

/// A reflectance, clamped to [0, 1].
pub(super) fn fraction(c: [f64; 3]) -> Colour {
    c.map(|x| clamped(x, 1.0))
}

/// Radiance, clamped to the film's range.
pub(super) fn radiance(c: [f64; 3]) -> Colour {
    c.map(|x| clamped(x, f64::from(1_u32 << 30)))
}

/// The nearest number from 0 to `most`; 0 for NaN and for numbers that round to 0 in 32 bits.
fn clamped(x: f64, most: f64) -> f64 {
    if x as f32 > 0.0 { x.min(most) } else { 0.0 }
}

/// The location in a library, for a note about the mesh that uses it.
pub(super) fn place<R>(source: &Source<'_, R>, line: u64) -> Option<FilePosition> {
    let name = source.name().file_name().unwrap_or_default().to_string_lossy();
    Some(FilePosition::Item(format!("line {line} of {name}")))
}

/// The note about materials whose emission is in a texture.
pub(super) const DARK: &str = "materials with an emission texture do not emit";

/// The note about emissions that a film does not hold.
pub(super) const CLAMPED_EMISSION: &str = "emissions below 0 or above 2³⁰ are clamped";

/// Reads an MTL file, and adds its materials.
pub(super) fn read<R: BufRead>(
    source: &mut Source<'_, R>,
    parts: &mut Parts<'_>,
    materials: &mut Vec<FileMaterial>,
) -> Read_<()> {
    let mut line = Vec::new();
    let mut open: Option<Raw> = None;
    while source.next_line(&mut line)? {
        uncomment(&mut line, 0);
        let mut given = words(&line);
        let Some(key) = given.next() else { continue };
        let here = || place(source, source.lines());
        if key == b"newmtl" {
            let done = open.replace(Raw::new(name_after(&line), here()));
            materials.extend(done.map(|raw| raw.material(parts)));
            continue;
        }
        let Some(raw) = &mut open else {
            parts.note_of_material("statements before the first material are ignored", here());
            continue;
        };
        match key {
            b"Kd" | b"Ks" | b"Ke" | b"Tf" => {
                if [Some(&b"spectral"[..]), Some(b"xyz")].contains(&given.clone().next()) {
                    parts.note_of_material("spectral curves and CIE colours are not read", here());
                    continue;
                }
                let given = colour(source, given)?;
                match key {
                    b"Ke" if radiance(given) != given => parts.note_of_material(CLAMPED_EMISSION, here()),
                    b"Kd" | b"Ks" | b"Tf" if fraction(given) != given => {
                        parts.note_of_material(
                            "colours (Kd, Ks, Tf) out of the range from 0 to 1 are clamped",
                            here(),
                        );
                    }
                    _ => {}
                }
                match key {
                    b"Kd" => raw.diffuse = Some(fraction(given)),
                    b"Ks" => {
                        raw.specular = fraction(given);
                        raw.specular_place = here();
                    }
                    b"Ke" => raw.emission = radiance(given),
                    _ => raw.filter = Some(fraction(given)),
                }
            }
            b"Ni" => raw.ior = Some(f64::from(numbers::<_, 1>(source, given)?[0])),
            b"d" => {
                // "d -halo 0.5" fades towards the silhouette.
                let word = given.find(|word| *word != b"-halo").unwrap_or_default();
                raw.opacity = Some(value(source, word)?);
            }
            b"Tr" => raw.transparency = Some(f64::from(numbers::<_, 1>(source, given)?[0])),
            b"illum" => {
                let word = given.next().unwrap_or_default();
                raw.model = number(word)
                    .ok_or_else(|| source.on_line(format!("{} is not an illumination model", shown(word))))?;
            }
            b"Pr" | b"Pm" | b"Ps" | b"Pc" | b"Pcr" | b"aniso" => {
                // Written by all exporters.
                if given.next().and_then(number_or_nan).is_some_and(|value: f64| value != 0.0) {
                    parts.note_of_material(
                        "roughness, metalness, sheen and coats (Pr, Pm, Ps, Pc, aniso) are not read",
                        here(),
                    );
                }
            }
            b"bump" | b"disp" | b"decal" | b"refl" | b"norm" => {
                parts.note_of_material("textures are not read", here())
            }
            _ if key.starts_with(b"map_") => {
                raw.has_emission_texture |= key == b"map_Ke";
                parts.note_of_material("textures are not read", here());
            }
            // The ambient colour; the sharpness of highlights and reflections; the direction of brushing.
            b"Ka" | b"Ns" | b"sharpness" | b"anisor" => {}
            _ => parts.note_of_material("unknown statements are ignored", here()),
        }
    }
    materials.extend(open.map(|raw| raw.material(parts)));
    Ok(())
}

fn value<R: BufRead>(source: &Source<'_, R>, word: &[u8]) -> Read_<f64> {
    number_or_nan(word).ok_or_else(|| source.on_line(format!("{} is not a number", shown(word))))
}

/// Three numbers, or one for all.
fn colour<'w, R: BufRead>(
    source: &Source<'_, R>,
    words: impl Iterator<Item = &'w [u8]> + Clone,
) -> Read_<[f64; 3]> {
    match words.clone().count() {
        1 => Ok([f64::from(numbers::<_, 1>(source, words)?[0]); 3]),
        _ => Ok(numbers::<_, 3>(source, words)?.map(f64::from)),
    }
}
