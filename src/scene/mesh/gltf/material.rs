//! Conversion of glTF materials to matte, conductor and glass, with notes about each approximation.

use super::extensions;
use super::fault::item;
use crate::scene::description::{Colour, ConductorParameters, MaterialKind, MatteParameters};
use crate::scene::mesh::FileMaterial;
use crate::scene::mesh::mtl::{CLAMPED_EMISSION, DARK, fraction, glass, radiance};
use crate::scene::mesh::parts::Parts;
use serde::Deserialize;
use serde::de::IgnoredAny;
use std::collections::BTreeMap;

/// A texture. Only its presence is read.
type Texture = Option<IgnoredAny>;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Material {
    name: Option<String>,
    pbr_metallic_roughness: Metallic,
    emissive_factor: [f64; 3],
    emissive_texture: Texture,
    normal_texture: Texture,
    occlusion_texture: Texture,
    alpha_mode: Option<String>,
    alpha_cutoff: Option<f64>,
    double_sided: bool,
    extensions: Extensions,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Metallic {
    base_color_factor: [f64; 4],
    metallic_factor: f64,
    roughness_factor: f64,
    base_color_texture: Texture,
    metallic_roughness_texture: Texture,
}

impl Default for Metallic {
    fn default() -> Self {
        Metallic {
            base_color_factor: [1.0; 4],
            metallic_factor: 1.0,
            roughness_factor: 1.0,
            base_color_texture: None,
            metallic_roughness_texture: None,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Extensions {
    #[serde(rename = "KHR_materials_transmission")]
    transmission: Transmission,
    #[serde(rename = "KHR_materials_ior")]
    ior: Ior,
    #[serde(rename = "KHR_materials_emissive_strength")]
    emissive_strength: Strength,
    #[serde(rename = "KHR_materials_volume")]
    volume: Volume,
    #[serde(rename = "KHR_materials_unlit")]
    unlit: Option<IgnoredAny>,
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    glossy: Option<Glossy>,
    #[serde(rename = "KHR_materials_clearcoat")]
    clearcoat: Layer,
    #[serde(rename = "KHR_materials_sheen")]
    sheen: Layer,
    #[serde(rename = "KHR_materials_iridescence")]
    iridescence: Layer,
    #[serde(rename = "KHR_materials_anisotropy")]
    anisotropy: Layer,
    #[serde(rename = "KHR_materials_diffuse_transmission")]
    diffuse_transmission: Layer,
    #[serde(rename = "KHR_materials_dispersion")]
    dispersion: Layer,
    /// Extensions that are not read.
    #[serde(flatten)]
    others: BTreeMap<String, IgnoredAny>,
}

impl Extensions {
    /// The extensions that change the appearance and are not read, by name.
    fn missing(&self) -> impl Iterator<Item = &str> {
        let layers = [
            ("KHR_materials_clearcoat", &self.clearcoat),
            ("KHR_materials_sheen", &self.sheen),
            ("KHR_materials_iridescence", &self.iridescence),
            ("KHR_materials_anisotropy", &self.anisotropy),
            ("KHR_materials_diffuse_transmission", &self.diffuse_transmission),
            ("KHR_materials_dispersion", &self.dispersion),
        ];
        let layers = layers.into_iter().filter(|(_, layer)| layer.shows()).map(|(name, _)| name);
        let others = self.others.keys().map(String::as_str);
        layers.chain(others.filter(|name| extensions::kind(name) != extensions::ExtensionKind::Nothing))
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Transmission {
    transmission_factor: f64,
    transmission_texture: Texture,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct Ior {
    ior: Option<f64>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Strength {
    emissive_strength: f64,
}

impl Default for Strength {
    fn default() -> Self {
        Strength { emissive_strength: 1.0 }
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Volume {
    thickness_factor: f64,
    attenuation_distance: Option<f64>,
    attenuation_color: Option<[f64; 3]>,
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Glossy {
    diffuse_factor: [f64; 4],
    specular_factor: [f64; 3],
    glossiness_factor: f64,
    diffuse_texture: Texture,
    specular_glossiness_texture: Texture,
}

impl Default for Glossy {
    fn default() -> Self {
        Glossy {
            diffuse_factor: [1.0; 4],
            specular_factor: [1.0; 3],
            glossiness_factor: 1.0,
            diffuse_texture: None,
            specular_glossiness_texture: None,
        }
    }
}

/// The factors of extensions that have no effect at a factor of 0, their default.
#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Layer {
    clearcoat_factor: f64,
    sheen_color_factor: [f64; 3],
    iridescence_factor: f64,
    anisotropy_strength: f64,
    diffuse_transmission_factor: f64,
    dispersion: f64,
}

impl Layer {
    fn shows(&self) -> bool {
        let Layer { clearcoat_factor, sheen_color_factor: [r, g, b], iridescence_factor, .. } = *self;
        let Layer { anisotropy_strength, diffuse_transmission_factor, dispersion, .. } = *self;
        [clearcoat_factor, r, g, b, iridescence_factor, anisotropy_strength, diffuse_transmission_factor]
            .iter()
            .any(|&factor| factor != 0.0)
            || dispersion != 0.0
    }
}

impl Material {
    /// The names of its extensions that change the appearance and are not read.
    pub(super) fn missing_extensions(&self) -> impl Iterator<Item = &str> {
        self.extensions.missing()
    }

    /// Its name in the file.
    pub(super) fn own_name(&self) -> Option<&str> {
        self.name.as_deref().filter(|name| !name.is_empty())
    }

    /// The converted material: transmissive materials become glass, metals become conductors, and all others matte.
    pub(super) fn read(&self, name: String) -> FileMaterial {
        let [r, g, b, _] = self.base();
        let base = fraction([r, g, b]);
        let kind = if self.is_glass() {
            glass(self.extensions.ior.ior, base)
        } else if let Some(glossy) = self.extensions.glossy.as_ref().filter(|glossy| glossy.is_metal()) {
            conductor(fraction(glossy.specular_factor), 1.0 - glossy.glossiness_factor)
        } else if self.is_metal() {
            conductor(base, self.pbr_metallic_roughness.roughness_factor)
        } else {
            MaterialKind::Matte(MatteParameters { reflectance: base, roughness: 0.0 })
        };
        // An emissive texture is often mostly black, so that no emission is the better approximation.
        let emission = if self.emissive_texture.is_some() { [0.0; 3] } else { radiance(self.emission()) };
        FileMaterial { name, kind, emission }
    }

    /// The base colour and its alpha.
    fn base(&self) -> [f64; 4] {
        match &self.extensions.glossy {
            Some(glossy) => glossy.diffuse_factor,
            None => self.pbr_metallic_roughness.base_color_factor,
        }
    }

    fn emission(&self) -> [f64; 3] {
        self.emissive_factor.map(|c| c * self.extensions.emissive_strength.emissive_strength)
    }

    fn is_glass(&self) -> bool {
        self.extensions.transmission.transmission_factor >= 0.5
    }

    /// Whether its factor makes it a metal. With a texture, the factor is only a maximum.
    fn is_metal(&self) -> bool {
        let Metallic { metallic_factor, metallic_roughness_texture, .. } = &self.pbr_metallic_roughness;
        let Extensions { glossy, unlit, .. } = &self.extensions;
        glossy.is_none() && unlit.is_none() && *metallic_factor >= 0.5 && metallic_roughness_texture.is_none()
    }

    /// Whether it has a texture, apart from those of extensions that are not read.
    fn has_texture(&self) -> bool {
        let Metallic { base_color_texture, metallic_roughness_texture, .. } = &self.pbr_metallic_roughness;
        let glossy = self.extensions.glossy.as_ref();
        [
            base_color_texture,
            metallic_roughness_texture,
            &self.emissive_texture,
            &self.normal_texture,
            &self.occlusion_texture,
            &self.extensions.transmission.transmission_texture,
        ]
        .into_iter()
        .chain(
            glossy.iter().flat_map(|glossy| [&glossy.diffuse_texture, &glossy.specular_glossiness_texture]),
        )
        .any(Option::is_some)
    }

    /// Whether alpha makes some of it invisible.
    fn has_alpha(&self) -> bool {
        let alpha = self.base()[3];
        let textured = match &self.extensions.glossy {
            Some(glossy) => glossy.diffuse_texture.is_some(),
            None => self.pbr_metallic_roughness.base_color_texture.is_some(),
        };
        match self.alpha_mode.as_deref() {
            Some("BLEND") => textured || alpha < 1.0,
            Some("MASK") => textured || alpha < self.alpha_cutoff.unwrap_or(0.5),
            _ => false,
        }
    }

    /// Adds notes about everything in material `i` that is approximated or left out.
    pub(super) fn note(&self, i: usize, parts: &mut Parts<'_>) {
        let mut note = |is: bool, message: &str| {
            if is {
                parts.note_of_material(message, item(format_args!("materials[{i}]")));
            }
        };
        note(self.has_texture(), "textures are not read");
        self.note_surface(&mut note);

        let emits = self.emission().iter().any(|&c| c > 0.0);
        let by_texture = self.emissive_texture.is_some();
        note(emits && by_texture, DARK);
        let emits = emits && !by_texture;
        note(emits && self.double_sided, "double-sided materials emit on their front alone");
        let most = radiance([f64::INFINITY; 3])[0];
        let out_of_range = self.emission().iter().any(|c| !(0.0..=most).contains(c));
        note(out_of_range && !by_texture, CLAMPED_EMISSION);
        note(self.has_alpha(), "alpha is not read: blended and masked materials are opaque");

        for extension in self.extensions.missing() {
            let name: String = extension.chars().take(60).collect();
            note(true, &format!("{name} is left out of materials"));
        }
    }

    /// Adds notes about reflection and transmission.
    fn note_surface(&self, note: &mut impl FnMut(bool, &str)) {
        let Extensions { transmission, ior, volume, unlit, glossy, .. } = &self.extensions;
        let Metallic { metallic_factor, roughness_factor, metallic_roughness_texture, .. } =
            &self.pbr_metallic_roughness;
        let glass = self.is_glass();
        let is_between = |factor: f64| factor > 0.0 && factor < 1.0;
        note(
            is_between(transmission.transmission_factor),
            "transmission between 0 and 1 is rounded to 0 or 1",
        );
        if glass {
            note(*roughness_factor > 0.0, "rough glass becomes perfectly smooth");
            note(volume.thickness_factor <= 0.0, "thin-walled glass becomes solid, and refracts");
            let absorbs = volume.attenuation_distance.is_some()
                && volume.attenuation_color.is_some_and(|color| color.iter().any(|&c| c < 1.0));
            note(volume.thickness_factor > 0.0 && absorbs, "absorption inside glass is left out");
            let is_odd = |ior: f64| ior == 1.0 || !(1e-3..=1e3).contains(&ior);
            note(
                ior.ior.is_some_and(is_odd),
                "indices of refraction that are 1, or out of range, become 1.5",
            );
        } else if glossy.is_some() {
            note(true, "specular-glossiness materials become matte or conductors");
        } else if unlit.is_some() {
            note(true, "unlit materials become matte, and are lit");
        } else {
            let textured = metallic_roughness_texture.is_some();
            note(!textured && is_between(*metallic_factor), "metalness between 0 and 1 is rounded to 0 or 1");
            note(
                textured && *metallic_factor > 0.0,
                "materials whose metalness and roughness are in a texture become matte",
            );
            note(!self.is_metal(), "dielectric materials become matte, without their specular reflection");
        }
        let clamped = self.base()[..3].iter().any(|c| !(0.0..=1.0).contains(c));
        note(clamped, "base colours out of the range from 0 to 1 are clamped");
    }
}

impl Glossy {
    /// Whether all of its reflection is specular, as with metals.
    fn is_metal(&self) -> bool {
        let [r, g, b, _] = self.diffuse_factor;
        [r, g, b].iter().all(|&c| c <= 0.0) && self.diffuse_texture.is_none()
    }
}

/// The largest reflectance of a converted metal. That of 1 would need an infinite k.
const MOST_REFLECTANCE: f64 = 0.999;

/// A metal of a reflectance at normal incidence, and a roughness in [0, 1], whose square is α in glTF as here.
///
/// The reflectance of η + i·k at normal incidence is ((η − 1)² + k²)/((η + 1)² + k²). With η = 1 it is k²/(4 + k²),
/// which is R for k = 2·√(R/(1 − R)). For R above 0 it rises to 1 at grazing incidence, as Schlick's approximation does,
/// which glTF prescribes. Where R is 0.002 or more, it differs from that by at most 0.14 (at 75° where R = 0.1). The
/// darker the metal, the nearer to grazing incidence it rises: the difference is up to 0.17 where R = 0.001 and 0.37
/// where R = 10⁻⁴, both above 80°. For R = 0 nothing is reflected at any angle, where glTF has a white edge.
fn conductor(reflectance: Colour, roughness: f64) -> MaterialKind {
    let k = reflectance.map(|r| {
        let r = r.min(MOST_REFLECTANCE);
        2.0 * (r / (1.0 - r)).sqrt()
    });
    let [roughness, ..] = fraction([roughness; 3]);
    let (eta, k) = (Some([1.0; 3]), Some(k));
    MaterialKind::Conductor(ConductorParameters { metal: None, eta, k, roughness: [roughness; 2] })
}
