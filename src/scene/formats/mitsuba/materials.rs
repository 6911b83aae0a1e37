//! Materials of the plugins of the tag `bsdf`.
//!
//! What wraps a bsdf is a function each: `mask`, `bumpmap`, `normalmap` and `twosided` with two sides make another material of
//! the inner one, by what every material may have, and `blendbsdf` a mix.

use super::builder::Builder;
use super::indices;
use super::object::{Object, Tag, Value};
use super::report::Read;
use super::spectrum::Of;
use super::textures::Shade;
use crate::scene::description::{
    ConductorParameters, DielectricParameters, GlassParameters, MaterialKind, MatteParameters,
    MirrorParameters, MixParameters, Modifiers, Named, Textured,
};
use crate::scene::spelling::{instead, quote};
use std::collections::HashSet;

/// Parameters that become textures of a material while its numbers are read.
#[derive(Default)]
struct Bound(Vec<Textured>);

impl Bound {
    /// The colour of a parameter, which may become a texture.
    fn colour(&mut self, parameter: &'static str, shade: Shade, stand_in: f64) -> [f64; 3] {
        if let Shade::Texture(texture) = shade {
            self.0.push(Textured { parameter, texture });
        }
        shade.colour_or([stand_in; 3])
    }
}

impl Builder<'_, '_> {
    /// The material of a shape: that of its bsdf, or what is there without one.
    pub(super) fn material_of(&mut self, shape: &Object, emits: bool) -> Read<usize> {
        let children = self.document.children(shape, Tag::Bsdf);
        match children[..] {
            [] => {
                // A light without a bsdf reflects nothing.
                let reflectance = [if emits { 0.0 } else { 0.5 }; 3];
                let matte = MatteParameters { reflectance, roughness: 0.0 };
                Ok(self.add_material(None, shape.place, matte, Vec::new()))
            }
            [first, ..] => {
                if children.len() > 1 {
                    let what = "a second bsdf in a shape";
                    self.reports.lacks(shape.place, what, "the first one counts");
                }
                self.bsdf(first)
            }
        }
    }

    /// The material of a bsdf, which is made once.
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
            "roughdielectric" => self.dielectric(object),
            "thindielectric" => self.thin_dielectric(object),
            "twosided" => self.two_sided(object),
            "mask" => self.mask(object),
            "bumpmap" => self.bump_map(object),
            "normalmap" => self.normal_map(object),
            "blendbsdf" => self.blend(object),
            other => self.another(object, other),
        };
        self.materials.insert(index, material);
        material
    }

    /// The bsdf inside of another.
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
                    self.reports.error_with(place, message, instead(name, indices::conductors()))
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
            // It reflects everything.
            let tint = self.shade(object, "specular_reflectance", 1.0, Of::Reflectance)?;
            let mirror = MirrorParameters { reflectance: bound.colour("reflectance", tint, 1.0) };
            return Ok(self.add_material(Some(object), object.place, mirror, bound.0));
        }
        // Only the squares of η and k count, and fits of spectra may be below 0; the least η here reflects nearly everything.
        let (eta, k) = (eta.map(|eta| eta.abs().max(1e-3)), k.map(f64::abs));
        let tint = self.colour(object, "specular_reflectance", 1.0, Of::Reflectance)?;
        if tint != [1.0; 3] {
            let what = format!("specular_reflectance of {}", object.what());
            self.reports.lacks(object.place, what, "the metal reflects what its eta and k say");
        }
        let roughness = if is_rough { self.widths(object, &mut bound)? } else { [0.0; 2] };
        let conductor = ConductorParameters { metal: None, eta: Some(eta), k: Some(k), roughness };
        Ok(self.add_material(Some(object), object.place, conductor, bound.0))
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
                    let what = "alpha_u and alpha_v of which one is a texture";
                    self.reports.lacks(object.place, what, "alpha_u is rendered for both");
                }
                Ok([bound.colour("roughness", along_u, 0.5)[0]; 2])
            }
            _ => {
                let message = format!("{} has either alpha, or both alpha_u and alpha_v", object.what());
                Err(self.reports.error(object.place, message))
            }
        }
    }

    /// Tints of what a dielectric reflects and lets through.
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

    fn dielectric(&mut self, object: &Object) -> Read<usize> {
        let mut bound = Bound::default();
        let ior = self.index(object, "bk7")?;
        let [reflectance, transmittance] = self.tints(object, &mut bound)?;
        let roughness = self.widths(object, &mut bound)?;
        let dielectric = DielectricParameters {
            ior,
            roughness,
            thin_walled: false,
            absorption: [0.0; 3],
            priority: 0.0,
            reflectance,
            transmittance,
        };
        Ok(self.add_material(Some(object), object.place, dielectric, bound.0))
    }

    fn thin_dielectric(&mut self, object: &Object) -> Read<usize> {
        let mut bound = Bound::default();
        let ior = self.index(object, "bk7")?;
        let [reflectance, transmittance] = self.tints(object, &mut bound)?;
        let dielectric = DielectricParameters {
            ior,
            roughness: [0.0; 2],
            thin_walled: true,
            absorption: [0.0; 3],
            priority: 0.0,
            reflectance,
            transmittance,
        };
        Ok(self.add_material(Some(object), object.place, dielectric, bound.0))
    }

    /// The index inside over that outside of a dielectric, each a number or a name.
    fn index(&mut self, object: &Object, default: &str) -> Read<f64> {
        let mut of = |name: &str, default: &str| match object
            .find(name)
            .map(|property| (&property.value, property.place))
        {
            Some((Value::Text(word), place)) => indices::dielectric(word).ok_or_else(|| {
                let message = format!("no dielectric is called {}", quote(word));
                self.reports.error_with(place, message, instead(word, indices::dielectrics()))
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

    /// Two sides that are the same, as all materials have here that let no light through; or two materials.
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

    /// Holes. To pass through one is no bounce here, where it is one in Mitsuba.
    fn mask(&mut self, object: &Object) -> Read<usize> {
        let opacity = self.shade(object, "opacity", 0.5, Of::Number)?;
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

    /// Mitsuba weakens grazing light on a tilted normal by the shadowing of microfacets (Estevez et al. 2019), unless it is
    /// told not to.
    fn note_shadowing(&mut self, object: &Object) -> Read<()> {
        object.ignore(&["flip_invalid_normals"]);
        if object.flag("use_shadowing_function", true, self.reports)? {
            let what = format!("the shadowing function of {}", object.what());
            self.reports.lacks(object.place, what, "grazing light is not weakened");
        }
        Ok(())
    }

    /// A bsdf with a map of normals or heights.
    fn with_map(
        &mut self,
        object: &Object,
        parameter: &'static str,
        texture: usize,
        set: impl FnOnce(&mut Modifiers),
    ) -> Read<usize> {
        let inner = self.inner(object)?;
        if self.scene.materials[inner].textures.iter().any(|textured| textured.parameter == parameter) {
            self.reports.lacks(object.place, format!("{} in itself", object.what()), "the inner one counts");
            return Ok(inner);
        }
        Ok(self.add_changed(object, inner, |material| {
            set(&mut material.modifiers);
            material.textures.push(Textured { parameter, texture });
        }))
    }

    /// A mix of two materials: a weight of 0 is the first.
    fn blend(&mut self, object: &Object) -> Read<usize> {
        let amount = self.shade(object, "weight", 0.5, Of::Number)?;
        let [a, b] = self.document.children(object, Tag::Bsdf)[..] else {
            return Err(self.reports.error(object.place, "bsdf \"blendbsdf\" needs two bsdfs in it"));
        };
        let (a, b) = (self.bsdf(a)?, self.bsdf(b)?);
        let mut bound = Bound::default();
        let [amount, ..] = bound.colour("amount", amount, 0.5);
        Ok(self.add_material(Some(object), object.place, MixParameters { a, b, amount }, bound.0))
    }

    /// A bsdf without a counterpart: a matte one of the colour that comes nearest to it.
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

    /// Whether a bsdf that stands on a surface with two sides to be seen shows nothing on its back in Mitsuba, but the same
    /// as on its front here.
    pub(super) fn is_one_sided(&self, shape: &Object) -> bool {
        let mut open = self.document.children(shape, Tag::Bsdf);
        open.truncate(1);
        // What is named twice is looked at once: blends may double at each step.
        let mut seen = HashSet::new();
        while let Some(index) = open.pop() {
            if !seen.insert(index) {
                continue;
            }
            let object = &self.document.objects[index];
            match object.plugin.as_str() {
                "mask" | "bumpmap" | "normalmap" | "blendbsdf" => {
                    open.extend(self.document.children(object, Tag::Bsdf));
                }
                "diffuse" | "conductor" | "roughconductor" | "plastic" | "roughplastic" => {}
                _ => return false,
            }
        }
        true
    }

    /// The material that is the same from the front, and black from behind.
    pub(super) fn one_sided(&mut self, object: &Object, material: usize) -> usize {
        if let Some(&known) = self.one_sided.get(&material) {
            return known;
        }
        let black = MatteParameters { reflectance: [0.0; 3], roughness: 0.0 };
        let black = self.add_material(None, object.place, black, Vec::new());
        let name = format!("{}, one-sided", self.scene.materials[material].name);
        let own = self.add_changed(object, material, |material| {
            material.modifiers.back = Some(black);
            material.name = name;
        });
        self.one_sided.insert(material, own);
        own
    }

    /// Whether a material looks at uv, or one that it names.
    pub(super) fn looks_at_uv(&self, material: usize) -> bool {
        let mut open = vec![material];
        let mut seen = HashSet::new();
        while let Some(index) = open.pop() {
            let Some(material) = self.scene.materials.get(index).filter(|_| seen.insert(index)) else {
                continue;
            };
            let anisotropic = match material.kind {
                MaterialKind::Conductor(ConductorParameters { roughness: [u, v], .. }) => u != v,
                MaterialKind::Dielectric(DielectricParameters { roughness: [u, v], .. }) => u != v,
                _ => false,
            };
            if anisotropic || !material.textures.is_empty() {
                return true;
            }
            open.extend(material.named());
        }
        false
    }
}
