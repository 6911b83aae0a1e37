//! Conversion of materials, and the notes about it.

use super::*;
use crate::scene::description::ConductorParameters;

/// The converted material, its emission, and the notes about it.
#[track_caller]
fn read(material: Value) -> (MaterialKind, [f64; 3], Vec<String>) {
    let mut growing = Growing::triangle([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [1.0, 1.0, 0.0]]);
    // Unused materials give no notes.
    let unused =
        json!({ "alphaMode": "BLEND", "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    growing.json["materials"] = json!([unused, material]);
    growing.json["meshes"][0]["primitives"][0]["material"] = 1.into();
    let file = read_split("a.glb", &growing.file(), &Split::Materials).expect("a mesh");
    let notes = file.notes.iter().map(|note| {
        assert_eq!((note.count, &note.first), (1, &Some(FilePosition::Item("materials[1]".into()))));
        note.message.clone()
    });
    (file.materials[1].kind.clone(), file.materials[1].emission, notes.collect())
}

const RED: [f64; 3] = [0.5, 0.25, 0.125];

fn metallic(metal: f64, rough: f64) -> Value {
    json!({ "baseColorFactor": [0.5, 0.25, 0.125, 1], "metallicFactor": metal, "roughnessFactor": rough })
}

/// The converted metal of these coefficients k. η is 1.
fn conductor(k: [f64; 3], roughness: f64) -> MaterialKind {
    let (eta, k) = (Some([1.0; 3]), Some(k));
    ConductorParameters { metal: None, eta, k, roughness: [roughness; 2] }.into()
}

/// The coefficients k of a metal that reflects [`RED`].
fn red() -> [f64; 3] {
    [2.0, 2.0 * (0.25_f64 / 0.75).sqrt(), 2.0 * (0.125_f64 / 0.875).sqrt()]
}

#[test]
fn metals_are_conductors_and_the_rest_is_matte_with_a_note() {
    let matte = MaterialKind::Matte(MatteParameters { reflectance: RED, roughness: 0.0 });
    let between = "metalness between 0 and 1 is rounded to 0 or 1";
    let dielectric = "dielectric materials become matte, without their specular reflection";
    for (metal, rough, kind, right) in [
        (1.0, 0.0, &conductor(red(), 0.0), &[][..]),
        (1.0, 0.5, &conductor(red(), 0.5), &[]),
        (0.75, 0.0, &conductor(red(), 0.0), &[between]),
        (0.75, 1.0, &conductor(red(), 1.0), &[between]),
        (1.0, 1.5, &conductor(red(), 1.0), &[]),
        (1.0, -0.5, &conductor(red(), 0.0), &[]),
        (0.25, 1.0, &matte, &[between, dielectric]),
        (0.0, 1.0, &matte, &[dielectric]),
    ] {
        let (is, _, notes) = read(json!({ "pbrMetallicRoughness": metallic(metal, rough) }));
        assert_eq!((&is, &notes[..]), (kind, &right.iter().map(|&r| r.to_owned()).collect::<Vec<_>>()[..]));
    }
    // The default material is a rough metal that reflects everything, which no conductor does.
    let (kind, _, notes) = read(json!({}));
    assert_eq!((kind, notes), (conductor([2.0 * (0.999_f64 / (1.0 - 0.999)).sqrt(); 3], 1.0), vec![]));
    let mut textured = metallic(1.0, 0.0);
    textured["metallicRoughnessTexture"] = json!({ "index": 0 });
    let (kind, _, notes) = read(json!({ "pbrMetallicRoughness": textured }));
    assert_eq!(kind, matte);
    assert_eq!(
        notes,
        [
            "textures are not read",
            "materials whose metalness and roughness are in a texture become matte",
            dielectric
        ]
    );
    // Of a metal with a texture of colours, the factor remains.
    let mut textured = metallic(1.0, 0.25);
    textured["baseColorTexture"] = json!({ "index": 0 });
    let (kind, _, notes) = read(json!({ "pbrMetallicRoughness": textured }));
    assert_eq!((kind, &notes[..]), (conductor(red(), 0.25), &["textures are not read".to_owned()][..]));
}

/// Fresnel's equations at normal incidence, (|η + i·k − 1| / |η + i·k + 1|)², give the base colour.
#[test]
fn metals_reflect_their_base_colour_at_normal_incidence() {
    for r in [0.0, 1e-6, 0.04, 0.25, 0.5, 0.75, 0.9, 0.999, 0.9999, 1.0] {
        let metal = json!({ "baseColorFactor": [r, r * 0.5, 1.0 - r, 1] });
        let (kind, _, _) = read(json!({ "pbrMetallicRoughness": metal }));
        let MaterialKind::Conductor(ConductorParameters { eta: Some(eta), k: Some(k), .. }) = kind else {
            panic!("{kind:?} is not a conductor of eta and k")
        };
        for (i, expected) in [r, r * 0.5, 1.0 - r].into_iter().enumerate() {
            let reflected = ((eta[i] - 1.0).powi(2) + k[i] * k[i]) / ((eta[i] + 1.0).powi(2) + k[i] * k[i]);
            let expected = f64::min(expected, 0.999);
            assert!((reflected - expected).abs() < 1e-14, "{reflected} is not {expected}");
        }
    }
}

/// The notes about a smooth metal, which has none by itself, with more properties.
#[track_caller]
fn notes_of(more: Value) -> Vec<String> {
    let mut material = json!({ "pbrMetallicRoughness": metallic(1.0, 0.0) });
    material.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
    read(material).2
}

#[test]
fn alpha_that_has_an_effect_is_noted() {
    let note = "alpha is not read: blended and masked materials are opaque";
    let with = |mode: &str, alpha: f64, texture: bool| {
        let mut metal = metallic(1.0, 0.0);
        metal["baseColorFactor"][3] = alpha.into();
        if texture {
            metal["baseColorTexture"] = json!({ "index": 0 });
        }
        let notes = notes_of(json!({ "alphaMode": mode, "pbrMetallicRoughness": metal }));
        notes.iter().any(|n| n == note)
    };
    assert!(with("BLEND", 0.5, false) && with("BLEND", 1.0, true) && with("MASK", 1.0, true));
    assert!(with("MASK", 0.25, false));
    assert!(!with("BLEND", 1.0, false) && !with("MASK", 0.75, false) && !with("OPAQUE", 0.5, true));
    let cut = json!({ "baseColorFactor": [1, 1, 1, 0.75], "roughnessFactor": 0 });
    assert_eq!(
        notes_of(json!({ "alphaMode": "MASK", "alphaCutoff": 0.9, "pbrMetallicRoughness": cut })),
        [note]
    );
}

#[test]
fn extensions_that_have_an_effect_are_noted() {
    assert_eq!(notes_of(json!({})), [""; 0]);
    for (name, off, on) in [
        ("KHR_materials_clearcoat", json!({}), json!({ "clearcoatFactor": 0.5 })),
        (
            "KHR_materials_sheen",
            json!({ "sheenRoughnessFactor": 1 }),
            json!({ "sheenColorFactor": [0, 0, 1] }),
        ),
        ("KHR_materials_iridescence", json!({ "iridescenceFactor": 0 }), json!({ "iridescenceFactor": 1 })),
        ("KHR_materials_anisotropy", json!({}), json!({ "anisotropyStrength": -0.5 })),
        ("KHR_materials_diffuse_transmission", json!({}), json!({ "diffuseTransmissionFactor": 0.1 })),
        ("KHR_materials_dispersion", json!({}), json!({ "dispersion": 0.1 })),
        ("KHR_xmp_json_ld", json!({ "packet": 0 }), json!(null)),
        ("KHR_materials_ior", json!({ "ior": 1.4 }), json!(null)),
        ("KHR_materials_specular", json!(null), json!({})),
        ("ACME_materials_fur", json!(null), json!([1, { "a": "b" }])),
    ] {
        let note = format!("{name} is left out of materials");
        if !off.is_null() {
            assert_eq!(notes_of(json!({ "extensions": { name: off } })), [""; 0], "{name}");
        }
        if !on.is_null() {
            assert_eq!(notes_of(json!({ "extensions": { name: on } })), [note], "{name}");
        }
    }
}

#[test]
fn glass_is_smooth_and_solid_with_notes() {
    let glass = |rough: f64, transmission: f64, more: Value| {
        let mut extensions = json!({ "KHR_materials_transmission": { "transmissionFactor": transmission } });
        extensions.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        read(json!({ "pbrMetallicRoughness": metallic(0.0, rough), "extensions": extensions }))
    };
    let solid = json!({ "KHR_materials_volume": { "thicknessFactor": 1 } });
    let (kind, _, notes) = glass(0.0, 1.0, solid.clone());
    assert_eq!(
        kind,
        MaterialKind::Glass(GlassParameters { ior: 1.5, reflectance: [1.0; 3], transmittance: RED })
    );
    assert_eq!(notes, [""; 0]);
    let partial = "transmission between 0 and 1 is rounded to 0 or 1";
    let rough = "rough glass becomes perfectly smooth";
    assert_eq!(glass(0.5, 0.75, solid.clone()).2, [partial, rough]);
    assert_eq!(glass(0.0, 1.0, json!({})).2, ["thin-walled glass becomes solid, and refracts"]);
    let absorbing = json!({ "KHR_materials_volume": {
        "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 1],
    } });
    assert_eq!(glass(0.0, 1.0, absorbing).2, ["absorption inside glass is left out"]);
    let (kind, _, notes) = glass(0.0, 0.25, solid.clone());
    assert_eq!(kind, MaterialKind::Matte(MatteParameters { reflectance: RED, roughness: 0.0 }));
    assert_eq!(notes[0], partial);
    let mut air = solid;
    air["KHR_materials_ior"] = json!({ "ior": 1 });
    assert_eq!(glass(0.0, 1.0, air).2, ["indices of refraction that are 1, or out of range, become 1.5"]);
}

#[test]
fn specular_glossiness_and_unlit_materials_are_approximated_with_notes() {
    let glossy = |diffuse: Value| {
        let glossy = json!({
            "diffuseFactor": diffuse,
            "specularFactor": [0.5, 0.25, 0.125],
            "glossinessFactor": 0.75,
        });
        read(json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": glossy } }))
    };
    let note = "specular-glossiness materials become matte or conductors";
    let (kind, _, notes) = glossy(json!([0.25, 0.5, 0.75, 1]));
    assert_eq!(kind, MaterialKind::Matte(MatteParameters { reflectance: [0.25, 0.5, 0.75], roughness: 0.0 }));
    assert_eq!(notes, [note]);
    let (kind, _, notes) = glossy(json!([0, 0, 0, 1]));
    assert_eq!((kind, &notes[..]), (conductor(red(), 0.25), &[note.to_owned()][..]));
    let unlit = json!({ "KHR_materials_unlit": {} });
    let (kind, _, notes) = read(json!({ "pbrMetallicRoughness": metallic(1.0, 1.0), "extensions": unlit }));
    assert_eq!(kind, MaterialKind::Matte(MatteParameters { reflectance: RED, roughness: 0.0 }));
    assert_eq!(notes, ["unlit materials become matte, and are lit"]);
}

#[test]
fn changes_of_emission_are_noted() {
    let double = "double-sided materials emit on their front alone";
    assert_eq!(notes_of(json!({ "doubleSided": true })), [""; 0]);
    assert_eq!(notes_of(json!({ "doubleSided": true, "emissiveFactor": [0, 1, 0] })), [double]);
    let texture = json!({ "emissiveFactor": [1, 1, 1], "emissiveTexture": { "index": 0 } });
    assert_eq!(
        notes_of(texture),
        ["textures are not read", "materials with an emission texture do not emit"]
    );
    let (_, emission, notes) = read(json!({
        "pbrMetallicRoughness": metallic(1.0, 0.0),
        "emissiveFactor": [1, -1, 0.5],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 1e12 } },
    }));
    let most = f64::from(1_u32 << 30);
    assert_eq!(emission, [most, 0.0, most]);
    assert_eq!(notes, ["emissions below 0 or above 2³⁰ are clamped"]);
    // Less than 32 bits hold is nothing.
    let (_, emission, _) = read(json!({
        "emissiveFactor": [1e-30, 1, 0],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 1e-20 } },
    }));
    assert_eq!(emission, [0.0, 1e-20, 0.0]);
    for texture in ["normalTexture", "occlusionTexture"] {
        assert_eq!(notes_of(json!({ texture: { "index": 0 } })), ["textures are not read"]);
    }
    let bright = json!({ "baseColorFactor": [2, 1, 1, 1], "roughnessFactor": 0 });
    let note = "base colours out of the range from 0 to 1 are clamped";
    assert_eq!(notes_of(json!({ "pbrMetallicRoughness": bright })), [note]);
}
