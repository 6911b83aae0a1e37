//! Materials of the plugins of the tag `bsdf`.
//!
//! Each bsdf that contains others has a function. `mask`, `bumpmap`, `normalmap` and `twosided` with two sides copy the
//! inner material and set one of the modifiers that all materials have; `blendbsdf` becomes a mix.

use super::builder::Builder;
use super::indices;
use super::object::{Object, Tag, Value};
use super::report::{Place, Read};
use super::shade::Shade;
use super::spectrum::Of;
use crate::scene::description::{
    ConductorParameters, DielectricParameters, GlassParameters, Material, MaterialKind, MatteParameters,
    MirrorParameters, MixParameters, Modifiers, Named, Textured,
};
use crate::scene::spelling::{instead, quote};

/// The parameters of a material that are textures, collected while its numbers are read.
#[derive(Default)]
struct Bound(Vec<Textured>);

impl Bound {
    /// The colour of a parameter. A texture is recorded, and `stand_in` returned.
    fn colour(&mut self, parameter: &'static str, shade: Shade, stand_in: f64) -> [f64; 3] {
        if let Shade::Texture(texture) = shade {
            self.0.push(Textured { parameter, texture });
        }
        shade.colour_or([stand_in; 3])
    }
}

/// The factor that a colour is, if it is grey and at most white. Spectra become colours with rounding errors.
fn grey(colour: [f64; 3]) -> Option<f64> {
    let [red, green, blue] = colour;
    let is_grey = (red - green).abs().max((blue - green).abs()) <= 1e-6;
    (is_grey && (0.0..=1.0 + 1e-6).contains(&green)).then(|| green.min(1.0))
}

impl Builder<'_, '_> {
    /// The material of a shape: that of its bsdf, or the default.
    pub(super) fn material_of(&mut self, shape: &Object, emits: bool) -> Read<usize> {
        let children = self.document.children(shape, Tag::Bsdf);
        match children[..] {
            [] => {
                // An emitter without a bsdf reflects no light.
                Ok(self.plain(emits, shape.place))
            }
            [first, ..] => {
                if children.len() > 1 {
                    let what = "a second bsdf in a shape";
                    self.reports.lacks(shape.place, what, "the first one is used");
                }
                self.bsdf(first)
            }
        }
    }

    /// A grey or a black material. It is made once.
    fn plain(&mut self, is_black: bool, place: Place) -> usize {
        if let Some(known) = self.plain[usize::from(is_black)] {
            return known;
        }
        let reflectance = [if is_black { 0.0 } else { 0.5 }; 3];
        let made =
            self.add_material(None, place, MatteParameters { reflectance, roughness: 0.0 }, Vec::new());
        self.plain[usize::from(is_black)] = Some(made);
        made
    }

    /// The material of a bsdf. It is made once.
    fn bsdf(&mut self, index: usize) -> Read<usize> {
        if let Some(&known) = self.materials.get(&index) {
            return known;
        }
        let object = self.object(index);
        let material = match object.plugin.as_str() {
            "diffuse" => self.diffuse(object),
            "conductor" => self.conductor(object, false),
            "roughconductor" => self.conductor(object, true),
            "dielectric" => self.glass(object),
            "roughdielectric" => self.dielectric(object, false),
            "thindielectric" => self.dielectric(object, true),
            "twosided" => self.two_sided(object),
            "mask" => self.mask(object),
            "bumpmap" => self.bump_map(object),
            "normalmap" => self.normal_map(object),
            "blendbsdf" => self.blend(object),
            "null" => Ok(self.invisible(object)),
            other => self.another(object, other),
        };
        self.materials.insert(index, material);
        material
    }

    /// The bsdf inside another bsdf.
    fn inner(&mut self, object: &Object) -> Read<usize> {
        match self.document.children(object, Tag::Bsdf)[..] {
            [first, ..] => self.bsdf(first),
            [] => Err(self.reports.error(object.place, format!("{} has no bsdf in it", object.what()))),
        }
    }

    fn diffuse(&mut self, object: &Object) -> Read<usize> {
        let mut bound = Bound::default();
        let reflectance = self.shade(object, "reflectance", 0.5, Of::Reflectance)?;
        let reflectance = bound.colour("reflectance", reflectance, 0.5);
        let matte = MatteParameters { reflectance, roughness: 0.0 };
        Ok(self.add_material(Some(object), object.place, matte, bound.0))
    }

    fn conductor(&mut self, object: &Object, is_rough: bool) -> Read<usize> {
        let mut bound = Bound::default();
        let named = match object.text("material", self.reports)? {
            Some((name, place)) => {
                let known = indices::conductor(name);
                let unknown = || {
                    let message = format!("no conductor is called {}", quote(name));
                    self.reports.error_with(place, message, || instead(name, indices::conductors()))
                };
                Some(known.ok_or_else(unknown)?)
            }
            None => None,
        };
        let [eta, k] = match named {
            Some(named) if object.find("eta").is_none() => named,
            _ => {
                let eta = self.shade(object, "eta", 0.0, Of::Number)?;
                let k = self.shade(object, "k", 1.0, Of::Number)?;
                [bound.colour("eta", eta, 1.5), bound.colour("k", k, 1.0)]
            }
        };
        if !is_rough && (eta, k) == ([0.0; 3], [1.0; 3]) && bound.0.is_empty() {
            // The material `none`: a perfect mirror.
            let tint = self.shade(object, "specular_reflectance", 1.0, Of::Reflectance)?;
            let mirror = MirrorParameters { reflectance: bound.colour("reflectance", tint, 1.0) };
            return Ok(self.add_material(Some(object), object.place, mirror, bound.0));
        }
        // Only the squares of η and k count, and fits of spectra may be below 0; the least η here reflects nearly everything.
        let (eta, k) = (eta.map(|eta| eta.abs().max(1e-3)), k.map(f64::abs));
        let tint = self.colour(object, "specular_reflectance", 1.0, Of::Reflectance)?;
        let grey = grey(tint);
        if grey.is_none() {
            let what = format!("specular_reflectance of {}", object.what());
            self.reports.lacks(object.place, what, "its reflectance follows from eta and k");
        }
        let roughness = if is_rough { self.widths(object, &mut bound)? } else { [0.0; 2] };
        let conductor = ConductorParameters { metal: None, eta: Some(eta), k: Some(k), roughness };
        let made = self.add_material(Some(object), object.place, conductor, bound.0);
        Ok(match grey {
            Some(factor) if factor < 1.0 => self.darkened(object, made, factor),
            _ => made,
        })
    }

    /// A material of which a factor reduces the reflectance: the fraction that it is of a mix with black.
    fn darkened(&mut self, object: &Object, material: usize, factor: f64) -> usize {
        let black = self.plain(true, object.place);
        let mix = MixParameters { a: black, b: material, amount: factor };
        let mix = self.add_material(Some(object), object.place, mix, Vec::new());
        self.scene.materials[material].name.push_str(", undimmed");
        mix
    }

    /// The roughness along u and along v of a microfacet bsdf: α = roughness².
    fn widths(&mut self, object: &Object, bound: &mut Bound) -> Read<[f64; 2]> {
        object.ignore(&["sample_visible"]);
        let distributions = [("beckmann", false), ("ggx", true)];
        if !object.word("distribution", &distributions, self.reports)? {
            let what = format!("the beckmann distribution of {}", object.what());
            self.reports.lacks(object.place, what, "ggx of the same alpha is rendered instead");
        }
        let parts = ["alpha_u", "alpha_v"].map(|name| object.find(name).is_some());
        match (parts, object.find("alpha")) {
            ([false, false], _) => {
                let roughness = self.roughness(object, "alpha", 0.1)?;
                Ok([bound.colour("roughness", roughness, 0.5)[0]; 2])
            }
            ([true, true], None) => {
                let along_u = self.roughness(object, "alpha_u", 0.1)?;
                let along_v = self.roughness(object, "alpha_v", 0.1)?;
                if let (Shade::Colour(along_u), Shade::Colour(along_v)) = (along_u, along_v) {
                    return Ok([along_u[0], along_v[0]]);
                }
                if along_u != along_v {
                    let what = "a texture for only one of alpha_u and alpha_v";
                    self.reports.lacks(object.place, what, "alpha_u is used for both");
                }
                Ok([bound.colour("roughness", along_u, 0.5)[0]; 2])
            }
            _ => {
                let message = format!("{} has either alpha, or both alpha_u and alpha_v", object.what());
                Err(self.reports.error(object.place, message))
            }
        }
    }

    /// The factors on light that a dielectric reflects and transmits.
    fn tints(&mut self, object: &Object, bound: &mut Bound) -> Read<[[f64; 3]; 2]> {
        let reflectance = self.shade(object, "specular_reflectance", 1.0, Of::Reflectance)?;
        let transmittance = self.shade(object, "specular_transmittance", 1.0, Of::Reflectance)?;
        Ok([bound.colour("reflectance", reflectance, 1.0), bound.colour("transmittance", transmittance, 1.0)])
    }

    fn glass(&mut self, object: &Object) -> Read<usize> {
        let mut bound = Bound::default();
        let ior = self.index(object, "bk7")?;
        let [reflectance, transmittance] = self.tints(object, &mut bound)?;
        let glass = GlassParameters { ior, reflectance, transmittance };
        Ok(self.add_material(Some(object), object.place, glass, bound.0))
    }

    /// A rough dielectric, or a smooth thin one.
    fn dielectric(&mut self, object: &Object, is_thin: bool) -> Read<usize> {
        let mut bound = Bound::default();
        let ior = self.index(object, "bk7")?;
        let [reflectance, transmittance] = self.tints(object, &mut bound)?;
        let roughness = if is_thin { [0.0; 2] } else { self.widths(object, &mut bound)? };
        let dielectric = DielectricParameters {
            ior,
            roughness,
            thin_walled: is_thin,
            absorption: [0.0; 3],
            priority: 0.0,
            reflectance,
            transmittance,
        };
        Ok(self.add_material(Some(object), object.place, dielectric, bound.0))
    }

    /// The index of refraction of the inside of a dielectric relative to the outside. Each is a number or a name.
    fn index(&mut self, object: &Object, default: &str) -> Read<f64> {
        let mut of = |name: &str, default: &str| match object
            .find(name)
            .map(|property| (&property.value, property.place))
        {
            Some((Value::Text(word), place)) => indices::dielectric(word).ok_or_else(|| {
                let message = format!("no dielectric is called {}", quote(word));
                self.reports.error_with(place, message, || instead(word, indices::dielectrics()))
            }),
            _ => object.number(name, indices::dielectric(default).unwrap_or(1.0), self.reports),
        };
        let (inside, outside) = (of("int_ior", default)?, of("ext_ior", "air")?);
        if !(inside > 0.0 && outside > 0.0) {
            let message = format!("the indices of {} must be above 0", object.what());
            return Err(self.reports.error(object.place, message));
        }
        Ok(inside / outside)
    }

    /// A two-sided bsdf: the inner bsdf, as opaque materials have two sides in stride, or a pair of materials.
    fn two_sided(&mut self, object: &Object) -> Read<usize> {
        object.ignore(&["allow_transmission"]);
        match self.document.children(object, Tag::Bsdf)[..] {
            [front, back] => {
                let (front, back) = (self.bsdf(front)?, self.bsdf(back)?);
                Ok(self.add_changed(object, front, |material| material.modifiers.back = Some(back)))
            }
            _ => self.inner(object),
        }
    }

    /// A mask. Passing through it is not a bounce in stride, but is one in Mitsuba.
    fn mask(&mut self, object: &Object) -> Read<usize> {
        let opacity = self.scalar(object, "opacity", 0.5)?;
        let inner = self.inner(object)?;
        let has_holes = self.scene.materials[inner].modifiers.opacity < 1.0
            || self.scene.materials[inner].textures.iter().any(|textured| textured.parameter == "opacity");
        if has_holes {
            self.reports.lacks(object.place, "a mask in a mask", "the outer one is left out");
            return Ok(inner);
        }
        Ok(self.add_changed(object, inner, |material| match opacity {
            Shade::Colour([opacity, ..]) => material.modifiers.opacity = opacity,
            Shade::Texture(texture) => material.textures.push(Textured { parameter: "opacity", texture }),
        }))
    }

    /// The boundary of a medium that has the index of the outside: a hole.
    fn invisible(&mut self, object: &Object) -> usize {
        let matte = MatteParameters { reflectance: [0.0; 3], roughness: 0.0 };
        let material = self.add_material(Some(object), object.place, matte, Vec::new());
        self.scene.materials[material].modifiers.opacity = 0.0;
        material
    }

    fn bump_map(&mut self, object: &Object) -> Read<usize> {
        self.note_shadowing(object)?;
        let scale = object.number("scale", 1.0, self.reports)?;
        let Some(&map) = self.document.children(object, Tag::Texture).first() else {
            return Err(self.reports.error(object.place, "bsdf \"bumpmap\" has no texture in it"));
        };
        let map = self.map(map)?;
        self.with_map(object, "bump_map", map, |modifiers| {
            modifiers.bump_map = Some(Named);
            modifiers.bump_scale = scale;
        })
    }

    fn normal_map(&mut self, object: &Object) -> Read<usize> {
        self.note_shadowing(object)?;
        let map = match object.find("normalmap").map(|property| &property.value) {
            Some(&Value::Object(map)) => self.map(map)?,
            _ => {
                return Err(self.reports.error(object.place, "bsdf \"normalmap\" has no texture normalmap"));
            }
        };
        self.with_map(object, "normal_map", map, |modifiers| modifiers.normal_map = Some(Named))
    }

    /// Reports that grazing light is brighter than in Mitsuba, which multiplies it by microfacet shadowing on tilted
    /// normals (Estevez et al. 2019), unless the file turns that off.
    fn note_shadowing(&mut self, object: &Object) -> Read<()> {
        object.ignore(&["flip_invalid_normals"]);
        if object.flag("use_shadowing_function", true, self.reports)? {
            let what = format!("the shadowing function of {}", object.what());
            self.reports.lacks(object.place, what, "light at grazing angles is brighter");
        }
        Ok(())
    }

    /// A bsdf with a normal map or a bump map.
    fn with_map(
        &mut self,
        object: &Object,
        parameter: &'static str,
        texture: usize,
        set: impl FnOnce(&mut Modifiers),
    ) -> Read<usize> {
        let inner = self.inner(object)?;
        if self.scene.materials[inner].textures.iter().any(|textured| textured.parameter == parameter) {
            self.reports.lacks(object.place, format!("{} in itself", object.what()), "the inner one is used");
            return Ok(inner);
        }
        Ok(self.add_changed(object, inner, |material| {
            set(&mut material.modifiers);
            material.textures.push(Textured { parameter, texture });
        }))
    }

    /// A mix of two materials. A weight of 0 is the first one.
    fn blend(&mut self, object: &Object) -> Read<usize> {
        let amount = self.scalar(object, "weight", 0.5)?;
        let [a, b] = self.document.children(object, Tag::Bsdf)[..] else {
            return Err(self.reports.error(object.place, "bsdf \"blendbsdf\" needs two bsdfs in it"));
        };
        let (a, b) = (self.bsdf(a)?, self.bsdf(b)?);
        let mut bound = Bound::default();
        let [amount, ..] = bound.colour("amount", amount, 0.5);
        Ok(self.add_material(Some(object), object.place, MixParameters { a, b, amount }, bound.0))
    }

    /// A bsdf without a counterpart: a matte material of the most similar colour.
    fn another(&mut self, object: &Object, plugin: &str) -> Read<usize> {
        let (parameter, default) = match plugin {
            "plastic" | "roughplastic" | "pplastic" => ("diffuse_reflectance", 0.5),
            "principled" | "principledthin" => ("base_color", 0.5),
            _ => ("reflectance", 0.5),
        };
        let instead = format!("a matte material of its {parameter} is rendered instead");
        self.reports.lacks(object.place, object.what(), &instead);
        object.ignore_all();
        let mut bound = Bound::default();
        let reflectance = self.shade(object, parameter, default, Of::Reflectance)?;
        let reflectance = bound.colour("reflectance", reflectance, default);
        let matte = MatteParameters { reflectance, roughness: 0.0 };
        Ok(self.add_material(Some(object), object.place, matte, bound.0))
    }

    /// Whether the shape's bsdf is black on the back in Mitsuba.
    pub(super) fn is_one_sided(&mut self, shape: &Object) -> bool {
        let first = self.document.children(shape, Tag::Bsdf).first();
        first.is_none_or(|&bsdf| self.is_bsdf_one_sided(bsdf))
    }

    /// Whether a bsdf is black on the back. The result is stored, because nested blends could take exponential time.
    fn is_bsdf_one_sided(&mut self, index: usize) -> bool {
        if let Some(&known) = self.are_one_sided.get(&index) {
            return known;
        }
        let object = &self.document.objects[index];
        let answer = match object.plugin.as_str() {
            "mask" | "bumpmap" | "normalmap" | "blendbsdf" => {
                self.document.children(object, Tag::Bsdf).iter().all(|&inner| self.is_bsdf_one_sided(inner))
            }
            plugin => ["diffuse", "conductor", "roughconductor", "plastic", "roughplastic"].contains(&plugin),
        };
        self.are_one_sided.insert(index, answer);
        answer
    }

    /// A copy of a material that is black on the back.
    pub(super) fn one_sided(&mut self, object: &Object, material: usize) -> usize {
        if let Some(&known) = self.one_sided.get(&material) {
            return known;
        }
        let black = self.plain(true, object.place);
        let name = format!("{}, one-sided", self.scene.materials[material].name);
        let own = self.add_changed(object, material, |material| {
            material.modifiers.back = Some(black);
            material.name = name;
        });
        self.one_sided.insert(material, own);
        own
    }

    /// Whether a material, or a material that it refers to, depends on uv.
    pub(super) fn is_placed_by_uv(&self, material: &Material) -> bool {
        let is_anisotropic = match material.kind {
            MaterialKind::Conductor(ConductorParameters { roughness: [u, v], .. }) => u != v,
            MaterialKind::Dielectric(DielectricParameters { roughness: [u, v], .. }) => u != v,
            _ => false,
        };
        let mut named = material.named();
        is_anisotropic || !material.textures.is_empty() || named.any(|inner| self.looks_at_uv[inner])
    }
}
