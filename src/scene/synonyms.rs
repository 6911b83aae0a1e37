//! Words of other programs for keys and types of scene files, and their counterparts here.

/// Words that have a counterpart of the same meaning, in lower case.
pub(super) const WORDS: &[(&str, &str)] = &[
    ("albedo", "reflectance"),
    ("background", "environment"),
    ("base_color", "reflectance"),
    ("bounces", "max_depth"),
    ("color", "reflectance"),
    ("colour", "reflectance"),
    ("cube", "box"),
    ("cuboid", "box"),
    ("diffuse", "matte"),
    ("distant", "directional"),
    ("emit", "emission"),
    ("entity", "entities"),
    ("index_of_refraction", "ior"),
    ("lambert", "matte"),
    ("lambertian", "matte"),
    ("location", "translate"),
    ("location", "position"),
    ("location", "eye"),
    ("max_bounces", "max_depth"),
    ("metal", "conductor"),
    ("object", "entities"),
    ("objects", "entities"),
    ("origin", "eye"),
    ("paddedsobol", "sobol"),
    ("pos", "position"),
    ("position", "center"),
    ("position", "eye"),
    ("random", "independent"),
    ("rectangle", "quad"),
    ("rotation", "rotate"),
    ("sky", "environment"),
    ("specular", "mirror"),
    ("spotlight", "spot"),
    ("spp", "samples"),
    ("sun", "directional"),
    ("target", "look_at"),
    ("world", "environment"),
];

/// Types and keys without a counterpart of the same kind: a term for the family in messages, words as [`plain`] writes
/// them, and advice. The family of a key is the item that it describes, or `"key"` for any.
const OTHERS: &[(&str, &[&str], &str)] = &[
    (
        "a conductor",
        &["albedo", "basecolor", "color", "colour", "reflectance", "tint"],
        "a metal that reflects the fraction R has eta = [1, 1, 1] and k = 2·√(R / (1 − R)), for each channel",
    ),
    (
        "key",
        &["denoise", "denoiser", "denoising"],
        "there is no denoiser; render with --layers albedo,normal, which other denoisers need",
    ),
    (
        "key",
        &["transparent", "filmtransparent", "transparentbackground"],
        "pictures have no alpha; see opacity and \"dielectric\" for transparent surfaces",
    ),
    (
        "key",
        &["clamp", "clampdirect", "clampindirect"],
        "nothing is clamped, because that would darken the picture",
    ),
    (
        "key",
        &["fstop", "aperturefstop", "fnumber"],
        "aperture_radius is the focal length divided by twice the f-number, in the scene's unit of length",
    ),
    (
        "light type",
        &[
            "area",
            "emitter",
            "emissive",
            "emission",
            "surface",
            "mesh",
            "quad",
            "rectangle",
            "disk",
            "sphere",
            "diffuse",
        ],
        "an area light is an entity with emission: [[entities]] with shape = { type = \"sphere\", center = [0, 0, 3], \
         radius = 0.5 }, a material, and emission = [10, 10, 10]",
    ),
    (
        "light type",
        &[
            "environment",
            "envmap",
            "constant",
            "infinite",
            "background",
            "world",
            "dome",
            "sky",
            "hdri",
            "ambient",
        ],
        "light from all directions is the table [environment] with radiance = [1, 1, 1], or with file = \"sky.exr\"",
    ),
    (
        "material type",
        &["roughconductor", "roughmetal", "ggx"],
        "a rough metal is a \"conductor\" with roughness",
    ),
    (
        "material type",
        &["roughdielectric", "roughglass", "frosted", "frostedglass"],
        "rough glass is a \"dielectric\" with roughness",
    ),
    (
        "material type",
        &["thindielectric", "thinglass"],
        "a thin sheet of glass is a \"dielectric\" with thin_walled = true",
    ),
    ("material type", &["transparent", "refraction", "water"], "did you mean \"dielectric\"?"),
    ("material type", &["orennayar", "roughdiffuse", "clay"], "rough clay is a \"matte\" with roughness"),
    (
        "material type",
        &["plastic", "roughplastic", "glossy", "coated", "coateddiffuse", "phong", "blinn", "blinnphong"],
        "there is no plastic; a \"mix\" of a \"matte\" and a \"conductor\" material is similar",
    ),
    (
        "material type",
        &["principled", "disney", "standardsurface", "openpbr", "uber", "pbr", "layered"],
        "there is no layered material: use \"conductor\" for metal, \"dielectric\" for glass, and \"matte\" or a \"mix\" \
         for the rest",
    ),
    ("material type", &["mask", "alpha"], "holes are the key opacity of any material"),
    ("material type", &["blend", "blendmaterial"], "did you mean \"mix\"?"),
    (
        "material type",
        &["emission", "emissive", "emitter", "area"],
        "a material does not emit: write emission = [10, 10, 10] in the entity",
    ),
    (
        "shape type",
        &["obj", "ply", "gltf", "glb", "trianglemesh", "model", "file"],
        "a shape from a file is { type = \"mesh\", file = \"NAME.obj\" }",
    ),
    (
        "sampler",
        &["zsobol", "halton", "pmj02bn", "stratified", "multijitter", "orthogonal", "ldsampler"],
        "there is \"sobol\", which is pbrt's paddedsobol, and \"independent\"",
    ),
    ("texture type", &["bitmap", "imagemap", "imagetexture", "picture"], "did you mean \"image\"?"),
];

/// Endings that other programs give to names of types.
const ENDINGS: [&str; 5] = ["bsdf", "light", "material", "shape", "texture"];

/// A word in lower case without anything but letters and digits: "Area Light" and "area_light" are "arealight".
fn plain(word: &str) -> String {
    word.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// Advice about an unknown `word` for a type or a key of the family that messages call `what`.
pub(super) fn advice(what: &str, word: &str) -> Option<&'static str> {
    const LONGEST: usize = 64;
    if word.len() > LONGEST {
        return None;
    }
    let word = plain(word);
    let stem = ENDINGS.iter().find_map(|ending| word.strip_suffix(ending));
    let is_meant = |theirs: &&str| *theirs == word || Some(*theirs) == stem;
    let found = OTHERS.iter().find(|(family, words, _)| *family == what && words.iter().any(is_meant));
    found.map(|(_, _, advice)| *advice)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_types_are_known_in_any_spelling_within_their_family() {
        let area = advice("light type", "area").unwrap();
        assert!(area.contains("emission = "), "{area}");
        for word in ["Area", "area_light", "AreaLight", "emissive"] {
            assert_eq!(advice("light type", word), Some(area), "{word}");
        }
        assert!(advice("material type", "Principled BSDF").unwrap().contains("\"conductor\""));
        assert!(advice("a conductor", "base_color").unwrap().contains("eta"));
        assert!(advice("key", "film_transparent").unwrap().contains("alpha"));
        assert!(advice("sampler", "zsobol").unwrap().contains("paddedsobol"));
        for (what, word) in [
            ("shape type", "area"),
            ("light type", "principled"),
            ("light type", "light"),
            ("light type", ""),
            ("key", "area"),
        ] {
            assert_eq!(advice(what, word), None, "{what} {word}");
        }
        assert_eq!(advice("light type", &"area".repeat(1 << 20)), None);
    }

    #[test]
    fn no_word_is_in_two_rows_of_a_family() {
        let all: Vec<_> =
            OTHERS.iter().flat_map(|(what, words, _)| words.iter().map(move |w| (what, w))).collect();
        for (i, row) in all.iter().enumerate() {
            assert!(!all[..i].contains(row), "{row:?}");
            assert_eq!(plain(row.1), **row.1);
        }
    }
}
