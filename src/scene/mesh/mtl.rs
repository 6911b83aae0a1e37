//! Wavefront MTL: colours, as matte, mirror and glass.

use super::FileMaterial;
use super::obj::{name_after, numbers};
use super::parts::Parts;
use super::source::{Read_, Source, number, shown, words};
use crate::scene::description::{Colour, MaterialKind};
use std::io::BufRead;

/// What a material of the file says.
#[derive(Clone)]
struct Raw {
    name: String,
    diffuse: Option<Colour>,
    specular: Colour,
    emission: Colour,
    /// Whether a texture says where it shines, often at a few places of many.
    has_emission_texture: bool,
    filter: Colour,
    ior: Option<f64>,
    opacity: f64,
    model: u32,
}

impl Raw {
    fn new(name: String) -> Raw {
        Raw {
            name,
            diffuse: None,
            specular: [0.0; 3],
            emission: [0.0; 3],
            has_emission_texture: false,
            filter: [1.0; 3],
            ior: None,
            opacity: 1.0,
            model: 2,
        }
    }

    /// Models 4, 6, 7 and 9 are transparent, 3, 5 and 8 reflect; of the others what can be seen through is glass,
    /// and what is black but for its highlight a mirror. The rest is matte.
    fn material(self) -> FileMaterial {
        let black = self.diffuse.is_some_and(|diffuse| diffuse.iter().all(|&c| c == 0.0));
        let shiny = self.specular.iter().any(|&c| c > 0.0);
        let kind = match self.model {
            4 | 6 | 7 | 9 => glass(self.ior, self.filter),
            _ if self.opacity < 0.5 => glass(self.ior, self.filter),
            3 | 5 | 8 if shiny => MaterialKind::Mirror { reflectance: self.specular },
            _ if black && shiny => MaterialKind::Mirror { reflectance: self.specular },
            _ => MaterialKind::Matte { reflectance: self.diffuse.unwrap_or([0.8; 3]) },
        };
        let emission = if self.has_emission_texture { [0.0; 3] } else { self.emission };
        FileMaterial { name: self.name, kind, emission }
    }
}

/// Clear glass of a tint; 1.5 where the file gives no index, or that of air.
pub(super) fn glass(ior: Option<f64>, transmittance: Colour) -> MaterialKind {
    let ior = ior.filter(|&ior| ior != 1.0 && (1e-3..=1e3).contains(&ior)).unwrap_or(1.5);
    MaterialKind::Glass { ior, reflectance: [1.0; 3], transmittance }
}

/// A reflectance: what is outside of 0 to 1 is no fraction.
pub(super) fn fraction(c: [f64; 3]) -> Colour {
    c.map(|x| if x > 0.0 { x.min(1.0) } else { 0.0 })
}

/// Radiance, as far as the film holds it.
pub(super) fn radiance(c: [f64; 3]) -> Colour {
    c.map(|x| if x > 0.0 { x.min(f64::from(1_u32 << 30)) } else { 0.0 })
}

/// Reads an MTL file, and adds its materials.
pub(super) fn read<R: BufRead>(
    source: &mut Source<'_, R>,
    parts: &mut Parts<'_>,
    materials: &mut Vec<FileMaterial>,
) -> Read_<()> {
    let mut line = Vec::new();
    let mut open: Option<Raw> = None;
    while source.next_line(&mut line)? {
        let mut given = words(&line);
        let Some(key) = given.next() else { continue };
        if key == b"newmtl" {
            materials.extend(open.replace(Raw::new(name_after(&line))).map(Raw::material));
            continue;
        }
        let Some(raw) = &mut open else { continue };
        match key {
            b"Kd" => raw.diffuse = Some(fraction(colour(source, given)?)),
            b"Ks" => raw.specular = fraction(colour(source, given)?),
            b"Ke" => raw.emission = radiance(colour(source, given)?),
            b"Tf" => raw.filter = fraction(colour(source, given)?),
            b"Ni" => raw.ior = Some(f64::from(numbers::<_, 1>(source, given)?[0])),
            b"d" => {
                // "d -halo 0.5" fades towards the rim.
                let word = given.find(|word| *word != b"-halo").unwrap_or_default();
                raw.opacity = value(source, word)?;
            }
            b"Tr" => raw.opacity = 1.0 - f64::from(numbers::<_, 1>(source, given)?[0]),
            b"illum" => {
                let word = given.next().unwrap_or_default();
                raw.model = number(word)
                    .ok_or_else(|| source.on_line(format!("{} is no illumination model", shown(word))))?;
            }
            _ if key.starts_with(b"map_") => {
                raw.has_emission_texture |= key == b"map_Ke";
                parts.note("textures are not read", source.line());
            }
            _ => {}
        }
    }
    materials.extend(open.map(Raw::material));
    Ok(())
}

fn value<R: BufRead>(source: &Source<'_, R>, word: &[u8]) -> Read_<f64> {
    number(word).ok_or_else(|| source.on_line(format!("{} is no number", shown(word))))
}

/// Three numbers, or one for all. Spectral curves and CIE colours are no numbers.
fn colour<'w, R: BufRead>(
    source: &Source<'_, R>,
    words: impl Iterator<Item = &'w [u8]> + Clone,
) -> Read_<[f64; 3]> {
    match words.clone().count() {
        1 => Ok([f64::from(numbers::<_, 1>(source, words)?[0]); 3]),
        _ => Ok(numbers::<_, 3>(source, words)?.map(f64::from)),
    }
}
