//! A table of glTF extensions: those that are read, those that may be ignored, and those that make a file unreadable.
//!
//! A required extension is an error only if it may change the triangles. This module handles the lists of extensions
//! that a document uses and requires; notes about single materials, nodes and primitives are added by their readers.

use super::fault::{Fault, item};
use crate::scene::mesh::parts::Parts;
use std::collections::HashSet;

/// The effect of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ExtensionKind {
    /// The extension is read, with notes about each material that it changes in a way that is lost; or it is a
    /// compression, which is an error only where it has no fallback.
    Read,
    /// Textures, which are not read.
    Textures,
    /// Properties of materials that are not read.
    Materials,
    /// Lights, which are not read: a scene has its own.
    Lights,
    /// No visible effect in the rest pose: metadata, sound, physics, behaviour.
    Nothing,
    /// The triangles or their positions.
    Geometry,
    /// Unknown: it may change the triangles.
    Unknown,
}

/// Extensions by name: those of Khronos (ratified and candidate), those with the prefix EXT, and common vendor
/// extensions.
const KINDS: [(&str, ExtensionKind); 77] = [
    ("ADOBE_materials_clearcoat_specular", ExtensionKind::Materials),
    ("ADOBE_materials_clearcoat_tint", ExtensionKind::Materials),
    ("ADOBE_materials_thin_transparency", ExtensionKind::Materials),
    // Its initial state is that of the nodes.
    ("AGI_articulations", ExtensionKind::Nothing),
    ("AGI_stk_metadata", ExtensionKind::Nothing),
    // Edges to draw as lines.
    ("CESIUM_primitive_outline", ExtensionKind::Nothing),
    // A translation of the whole model.
    ("CESIUM_RTC", ExtensionKind::Geometry),
    ("EXT_feature_metadata", ExtensionKind::Nothing),
    ("EXT_instance_features", ExtensionKind::Nothing),
    ("EXT_lights_ies", ExtensionKind::Lights),
    ("EXT_lights_image_based", ExtensionKind::Lights),
    ("EXT_materials_bump", ExtensionKind::Materials),
    ("EXT_mesh_features", ExtensionKind::Nothing),
    ("EXT_mesh_gpu_instancing", ExtensionKind::Read),
    // Topology of the same triangles.
    ("EXT_mesh_manifold", ExtensionKind::Nothing),
    ("EXT_mesh_primitive_edge_visibility", ExtensionKind::Nothing),
    ("EXT_mesh_primitive_restart", ExtensionKind::Geometry),
    ("EXT_meshopt_compression", ExtensionKind::Read),
    ("EXT_primitive_voxels", ExtensionKind::Geometry),
    ("EXT_property_attributes", ExtensionKind::Nothing),
    ("EXT_property_tables", ExtensionKind::Nothing),
    ("EXT_structural_metadata", ExtensionKind::Nothing),
    ("EXT_texture_avif", ExtensionKind::Textures),
    ("EXT_texture_webp", ExtensionKind::Textures),
    ("FB_geometry_metadata", ExtensionKind::Nothing),
    ("GODOT_single_root", ExtensionKind::Nothing),
    ("GRIFFEL_bim_data", ExtensionKind::Nothing),
    // Positions of 64 bits.
    ("KHR_accessor_float64", ExtensionKind::Geometry),
    ("KHR_animation_pointer", ExtensionKind::Nothing),
    ("KHR_audio_emitter", ExtensionKind::Nothing),
    // Collision shapes, and bodies made of them.
    ("KHR_collision_shapes", ExtensionKind::Nothing),
    ("KHR_draco_mesh_compression", ExtensionKind::Read),
    ("KHR_gaussian_splatting", ExtensionKind::Geometry),
    ("KHR_implicit_shapes", ExtensionKind::Nothing),
    ("KHR_interactivity", ExtensionKind::Nothing),
    ("KHR_lights_punctual", ExtensionKind::Lights),
    ("KHR_materials_anisotropy", ExtensionKind::Read),
    ("KHR_materials_clearcoat", ExtensionKind::Read),
    ("KHR_materials_diffuse_transmission", ExtensionKind::Read),
    ("KHR_materials_dispersion", ExtensionKind::Read),
    ("KHR_materials_emissive_strength", ExtensionKind::Read),
    ("KHR_materials_ior", ExtensionKind::Read),
    ("KHR_materials_iridescence", ExtensionKind::Read),
    ("KHR_materials_pbrSpecularGlossiness", ExtensionKind::Read),
    ("KHR_materials_sheen", ExtensionKind::Read),
    ("KHR_materials_transmission", ExtensionKind::Read),
    ("KHR_materials_unlit", ExtensionKind::Read),
    ("KHR_materials_volume", ExtensionKind::Read),
    ("KHR_mesh_primitive_restart", ExtensionKind::Geometry),
    ("KHR_mesh_quantization", ExtensionKind::Read),
    ("KHR_meshopt_compression", ExtensionKind::Read),
    ("KHR_node_hoverability", ExtensionKind::Nothing),
    ("KHR_node_selectability", ExtensionKind::Nothing),
    ("KHR_node_visibility", ExtensionKind::Read),
    ("KHR_physics_rigid_bodies", ExtensionKind::Nothing),
    ("KHR_rigid_bodies", ExtensionKind::Nothing),
    ("KHR_techniques_webgl", ExtensionKind::Materials),
    ("KHR_xmp", ExtensionKind::Nothing),
    ("KHR_xmp_json_ld", ExtensionKind::Nothing),
    ("MOZ_hubs_components", ExtensionKind::Nothing),
    // Coarser levels of detail; the nodes have the finest.
    ("MSFT_lod", ExtensionKind::Nothing),
    ("MSFT_audio_emitter", ExtensionKind::Nothing),
    ("MSFT_packing_normalRoughnessMetallic", ExtensionKind::Textures),
    ("MSFT_packing_occlusionRoughnessMetallic", ExtensionKind::Textures),
    ("OMI_audio_emitter", ExtensionKind::Nothing),
    ("OMI_collider", ExtensionKind::Nothing),
    ("OMI_link", ExtensionKind::Nothing),
    ("OMI_physics_body", ExtensionKind::Nothing),
    ("OMI_physics_shape", ExtensionKind::Nothing),
    ("OMI_seat", ExtensionKind::Nothing),
    ("OMI_spawn_point", ExtensionKind::Nothing),
    // Metadata and motion of avatars.
    ("VRM", ExtensionKind::Nothing),
    ("VRMC_node_constraint", ExtensionKind::Nothing),
    ("VRMC_springBone", ExtensionKind::Nothing),
    ("VRMC_vrm", ExtensionKind::Nothing),
    ("VRMC_vrm_animation", ExtensionKind::Nothing),
    ("WEB3D_quantized_attributes", ExtensionKind::Geometry),
];

/// The kind of an extension: by the table, or by the word after the vendor's prefix (`KHR_materials_sheen`,
/// `MSFT_texture_dds`).
pub(super) fn kind(name: &str) -> ExtensionKind {
    if let Some((_, kind)) = KINDS.iter().find(|(known, _)| *known == name) {
        return *kind;
    }
    let about = name.split_once('_').map_or("", |(_, rest)| rest);
    let families = [
        ("materials_", ExtensionKind::Materials),
        ("texture_", ExtensionKind::Textures),
        ("lights_", ExtensionKind::Lights),
    ];
    families
        .iter()
        .find(|(word, _)| about.starts_with(word))
        .map_or(ExtensionKind::Unknown, |(_, kind)| *kind)
}

/// A name in quotation marks, shortened if it is long.
fn quoted(name: &str) -> String {
    format!("{:?}", name.chars().take(60).collect::<String>())
}

/// Returns an error if the document requires an extension that is not read and may change its triangles. Adds notes
/// about other extensions that are not read, except those in `noted`, about which there are notes on materials.
pub(super) fn check(
    used: &[String],
    required: &[String],
    noted: &HashSet<&str>,
    parts: &mut Parts<'_>,
) -> Result<(), Fault> {
    for (i, name) in required.iter().enumerate().filter(|(_, name)| !noted.contains(name.as_str())) {
        let about = match kind(name) {
            ExtensionKind::Read => continue,
            ExtensionKind::Textures => "for textures",
            ExtensionKind::Materials => "for materials",
            ExtensionKind::Lights => "for lights",
            ExtensionKind::Nothing => "which does not change the rest pose",
            ExtensionKind::Geometry | ExtensionKind::Unknown => {
                return Err(Fault::at(
                    format_args!("extensionsRequired[{i}]"),
                    format!(
                        "the required extension {} is not read and may change the triangles; write the file without it",
                        quoted(name)
                    ),
                ));
            }
        };
        let message = format!("the required extension {}, {about}, is not read", quoted(name));
        parts.note(&message, item(format_args!("extensionsRequired[{i}]")));
    }
    for (i, name) in used.iter().enumerate() {
        if matches!(kind(name), ExtensionKind::Geometry | ExtensionKind::Unknown) {
            let message =
                format!("the extension {}, which may change the triangles, is not read", quoted(name));
            parts.note(&message, item(format_args!("extensionsUsed[{i}]")));
        }
    }
    Ok(())
}

/// The error message about compressed data.
pub(super) fn compressed(by: &str) -> String {
    format!(
        "it is compressed by {by}, which stride does not read; write the file without compression, for example \
         with `gltf-transform copy IN OUT`, or by Blender"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_extension_is_in_the_table_once() {
        for (i, (name, _)) in KINDS.iter().enumerate() {
            assert!(KINDS[..i].iter().all(|(other, _)| other != name), "{name}");
        }
    }

    #[test]
    fn prefixes_classify_textures_materials_and_lights() {
        assert_eq!(kind("KHR_texture_transform"), ExtensionKind::Textures);
        assert_eq!(kind("KHR_texture_basisu"), ExtensionKind::Textures);
        assert_eq!(kind("MSFT_texture_dds"), ExtensionKind::Textures);
        assert_eq!(kind("KHR_materials_variants"), ExtensionKind::Materials);
        assert_eq!(kind("VRMC_materials_mtoon"), ExtensionKind::Materials);
        assert_eq!(kind("KHR_materials_ior"), ExtensionKind::Read);
        assert_eq!(kind("KHR_lights_punctual"), ExtensionKind::Lights);
        assert_eq!(kind("KHR_xmp_json_ld"), ExtensionKind::Nothing);
        assert_eq!(kind("KHR_gaussian_splatting"), ExtensionKind::Geometry);
        for name in ["", "KHR", "KHR_displaced_materials_", "EXT_nurbs", "texture_a", "KHR_"] {
            assert_eq!(kind(name), ExtensionKind::Unknown, "{name}");
        }
    }
}
