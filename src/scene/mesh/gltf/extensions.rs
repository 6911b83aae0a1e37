//! A table of glTF extensions: those that are read, those that may be ignored, and those that make a file unreadable.
//!
//! A required extension is an error only if it may change the triangles. This module handles the lists of extensions
//! that a document uses and requires; notes about single materials, nodes and primitives are added by their readers.

use super::fault::{Fault, item};
use crate::scene::mesh::parts::Parts;

/// The subject of an extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// The extension is read; or it is a compression, which is an error only where it has no fallback.
    Read,
    /// Textures, which are not read.
    Textures,
    /// Properties of materials that are not read.
    Materials,
    /// Lights, which are not read: a scene has its own.
    Lights,
    /// Nothing visible in the rest pose: metadata, sound, physics, behaviour.
    Nothing,
    /// The triangles or their positions.
    Geometry,
    /// Unknown: it may change the triangles.
    Unknown,
}

/// Extensions by name: those of Khronos (ratified and candidate), those with the prefix EXT, and common vendor
/// extensions.
const KINDS: [(&str, Kind); 68] = [
    ("ADOBE_materials_clearcoat_specular", Kind::Materials),
    ("ADOBE_materials_clearcoat_tint", Kind::Materials),
    ("ADOBE_materials_thin_transparency", Kind::Materials),
    // Its initial state is that of the nodes.
    ("AGI_articulations", Kind::Nothing),
    ("AGI_stk_metadata", Kind::Nothing),
    // Edges to draw as lines.
    ("CESIUM_primitive_outline", Kind::Nothing),
    // A translation of the whole model.
    ("CESIUM_RTC", Kind::Geometry),
    ("EXT_feature_metadata", Kind::Nothing),
    ("EXT_instance_features", Kind::Nothing),
    ("EXT_lights_ies", Kind::Lights),
    ("EXT_lights_image_based", Kind::Lights),
    ("EXT_materials_bump", Kind::Materials),
    ("EXT_mesh_features", Kind::Nothing),
    ("EXT_mesh_gpu_instancing", Kind::Read),
    // Topology of the same triangles.
    ("EXT_mesh_manifold", Kind::Nothing),
    ("EXT_mesh_primitive_edge_visibility", Kind::Nothing),
    ("EXT_mesh_primitive_restart", Kind::Geometry),
    ("EXT_meshopt_compression", Kind::Read),
    ("EXT_primitive_voxels", Kind::Geometry),
    ("EXT_property_attributes", Kind::Nothing),
    ("EXT_property_tables", Kind::Nothing),
    ("EXT_structural_metadata", Kind::Nothing),
    ("EXT_texture_avif", Kind::Textures),
    ("EXT_texture_webp", Kind::Textures),
    ("FB_geometry_metadata", Kind::Nothing),
    ("GODOT_single_root", Kind::Nothing),
    ("GRIFFEL_bim_data", Kind::Nothing),
    // Positions of 64 bits.
    ("KHR_accessor_float64", Kind::Geometry),
    ("KHR_animation_pointer", Kind::Nothing),
    ("KHR_audio_emitter", Kind::Nothing),
    // Shapes to collide with, and bodies made of them.
    ("KHR_collision_shapes", Kind::Nothing),
    ("KHR_draco_mesh_compression", Kind::Read),
    ("KHR_gaussian_splatting", Kind::Geometry),
    ("KHR_implicit_shapes", Kind::Nothing),
    ("KHR_interactivity", Kind::Nothing),
    ("KHR_lights_punctual", Kind::Lights),
    ("KHR_materials_emissive_strength", Kind::Read),
    ("KHR_materials_ior", Kind::Read),
    ("KHR_materials_transmission", Kind::Read),
    ("KHR_mesh_primitive_restart", Kind::Geometry),
    ("KHR_mesh_quantization", Kind::Read),
    ("KHR_meshopt_compression", Kind::Read),
    ("KHR_node_hoverability", Kind::Nothing),
    ("KHR_node_selectability", Kind::Nothing),
    ("KHR_node_visibility", Kind::Read),
    ("KHR_physics_rigid_bodies", Kind::Nothing),
    ("KHR_rigid_bodies", Kind::Nothing),
    ("KHR_techniques_webgl", Kind::Materials),
    ("KHR_xmp", Kind::Nothing),
    ("KHR_xmp_json_ld", Kind::Nothing),
    ("MOZ_hubs_components", Kind::Nothing),
    // Coarser levels of detail; the nodes have the finest.
    ("MSFT_lod", Kind::Nothing),
    ("MSFT_audio_emitter", Kind::Nothing),
    ("MSFT_packing_normalRoughnessMetallic", Kind::Textures),
    ("MSFT_packing_occlusionRoughnessMetallic", Kind::Textures),
    ("OMI_audio_emitter", Kind::Nothing),
    ("OMI_collider", Kind::Nothing),
    ("OMI_link", Kind::Nothing),
    ("OMI_physics_body", Kind::Nothing),
    ("OMI_physics_shape", Kind::Nothing),
    ("OMI_seat", Kind::Nothing),
    ("OMI_spawn_point", Kind::Nothing),
    // Metadata and motion of avatars.
    ("VRM", Kind::Nothing),
    ("VRMC_node_constraint", Kind::Nothing),
    ("VRMC_springBone", Kind::Nothing),
    ("VRMC_vrm", Kind::Nothing),
    ("VRMC_vrm_animation", Kind::Nothing),
    ("WEB3D_quantized_attributes", Kind::Geometry),
];

/// The kind of an extension: by the table, or by the word after the vendor's prefix (`KHR_materials_sheen`,
/// `MSFT_texture_dds`).
pub(super) fn kind(name: &str) -> Kind {
    if let Some((_, kind)) = KINDS.iter().find(|(known, _)| *known == name) {
        return *kind;
    }
    let about = name.split_once('_').map_or("", |(_, rest)| rest);
    let families = [("materials_", Kind::Materials), ("texture_", Kind::Textures), ("lights_", Kind::Lights)];
    families.iter().find(|(word, _)| about.starts_with(word)).map_or(Kind::Unknown, |(_, kind)| *kind)
}

/// A name in quotation marks, shortened if it is long.
fn quoted(name: &str) -> String {
    format!("{:?}", name.chars().take(60).collect::<String>())
}

/// Returns an error if the document requires an extension that is not read and may change its triangles; adds notes
/// about the others that are not read.
pub(super) fn check(used: &[String], required: &[String], parts: &mut Parts<'_>) -> Result<(), Fault> {
    for (i, name) in required.iter().enumerate() {
        let about = match kind(name) {
            Kind::Read => continue,
            Kind::Textures => "for textures",
            Kind::Materials => "for materials",
            Kind::Lights => "for lights",
            Kind::Nothing => "which does not change the picture at rest",
            Kind::Geometry | Kind::Unknown => {
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
        if matches!(kind(name), Kind::Geometry | Kind::Unknown) {
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
        assert_eq!(kind("KHR_texture_transform"), Kind::Textures);
        assert_eq!(kind("KHR_texture_basisu"), Kind::Textures);
        assert_eq!(kind("MSFT_texture_dds"), Kind::Textures);
        assert_eq!(kind("KHR_materials_variants"), Kind::Materials);
        assert_eq!(kind("VRMC_materials_mtoon"), Kind::Materials);
        assert_eq!(kind("KHR_materials_ior"), Kind::Read);
        assert_eq!(kind("KHR_lights_punctual"), Kind::Lights);
        assert_eq!(kind("KHR_xmp_json_ld"), Kind::Nothing);
        assert_eq!(kind("KHR_gaussian_splatting"), Kind::Geometry);
        for name in ["", "KHR", "KHR_displaced_materials_", "EXT_nurbs", "texture_a", "KHR_"] {
            assert_eq!(kind(name), Kind::Unknown, "{name}");
        }
    }
}
