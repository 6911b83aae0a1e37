//! The parts of a glTF document's JSON that are read, under the names of its specification.
//!
//! Fields that the specification requires are required, so that no element is much larger in memory than in the file.
//! Elements without required fields are limited in number. Elements that are only counted store no content.

use super::material::Material;
use serde::de::{Error, IgnoredAny, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::{BTreeMap, HashMap};
use std::fmt;
use std::marker::PhantomData;

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
pub(super) struct Document {
    pub(super) asset: Asset,
    pub(super) extensions_used: Vec<String>,
    pub(super) extensions_required: Vec<String>,
    pub(super) scene: Option<usize>,
    pub(super) scenes: Vec<Scene>,
    #[serde(deserialize_with = "few")]
    pub(super) nodes: Vec<Node>,
    pub(super) meshes: Vec<Mesh>,
    pub(super) skins: Vec<Skin>,
    pub(super) animations: Vec<Animation>,
    #[serde(deserialize_with = "few")]
    pub(super) materials: Vec<Material>,
    pub(super) accessors: Vec<Accessor>,
    pub(super) buffer_views: Vec<BufferView>,
    pub(super) buffers: Vec<Buffer>,
}

/// The maximum number of nodes, and of materials: an empty one takes three bytes in a file and 400 in memory.
const MOST: usize = 1 << 20;

/// A list of at most [`MOST`].
fn few<'de, D: Deserializer<'de>, T: Deserialize<'de>>(deserializer: D) -> Result<Vec<T>, D::Error> {
    struct Few<T>(PhantomData<T>);

    impl<'de, T: Deserialize<'de>> Visitor<'de> for Few<T> {
        type Value = Vec<T>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "a list")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Vec<T>, A::Error> {
            let mut all = Vec::new();
            while let Some(element) = list.next_element()? {
                if all.len() == MOST {
                    return Err(A::Error::custom(format!("more than the maximum of {MOST}")));
                }
                all.push(element);
            }
            Ok(all)
        }
    }

    deserializer.deserialize_seq(Few(PhantomData))
}

impl Document {
    /// The name of each material, or its index if it has none. glTF allows repeated names: the first material keeps its
    /// name, and the others get a number that makes it unique.
    pub(super) fn material_names(&self) -> Vec<String> {
        // Whether the first has been seen, and the last number that was added.
        let mut given: HashMap<&str, (bool, usize)> =
            self.materials.iter().filter_map(Material::own_name).map(|name| (name, (false, 1))).collect();
        let mut names = Vec::with_capacity(self.materials.len());
        for (i, material) in self.materials.iter().enumerate() {
            let numbered = format!("material {i}");
            let own = material.own_name();
            let name = own.unwrap_or(&numbered);
            let (is_taken, mut last) = given.get(name).copied().unwrap_or((false, 1));
            let is_first = if own.is_some() { !is_taken } else { !given.contains_key(name) };
            let mut unique = name.to_owned();
            while !is_first && given.contains_key(unique.as_str()) {
                last += 1;
                unique = format!("{name} ({last})");
            }
            if let Some(state) = given.get_mut(name) {
                *state = (is_taken || own.is_some(), last);
            }
            names.push(unique);
        }
        names
    }
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Asset {
    pub(super) version: Option<String>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Scene {
    pub(super) nodes: Vec<usize>,
    pub(super) extensions: SceneExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct SceneExtensions {
    #[serde(rename = "EXT_lights_image_based")]
    pub(super) environment: Option<IgnoredAny>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct Node {
    pub(super) name: Option<String>,
    pub(super) children: Vec<usize>,
    pub(super) mesh: Option<usize>,
    /// Column by column.
    pub(super) matrix: Option<[f64; 16]>,
    pub(super) translation: Option<[f64; 3]>,
    /// x, y, z and w of a quaternion.
    pub(super) rotation: Option<[f64; 4]>,
    pub(super) scale: Option<[f64; 3]>,
    pub(super) skin: Option<usize>,
    /// Weights of morph targets, which override those of the mesh.
    pub(super) weights: Option<Vec<f64>>,
    pub(super) camera: Option<IgnoredAny>,
    pub(super) extensions: NodeExtensions,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    pub(super) copies: Option<Copies>,
    #[serde(rename = "KHR_lights_punctual")]
    pub(super) light: Option<IgnoredAny>,
    #[serde(rename = "KHR_node_visibility")]
    pub(super) visibility: Visibility,
}

/// `EXT_mesh_gpu_instancing`.
#[derive(Deserialize)]
pub(super) struct Copies {
    pub(super) attributes: BTreeMap<String, usize>,
}

/// `KHR_node_visibility`.
#[derive(Deserialize)]
#[serde(default)]
pub(super) struct Visibility {
    pub(super) visible: bool,
}

impl Default for Visibility {
    fn default() -> Self {
        Visibility { visible: true }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Skin {
    pub(super) inverse_bind_matrices: Option<usize>,
    pub(super) joints: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Animation {
    /// Only their number is kept.
    pub(super) channels: Vec<IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub(super) name: Option<String>,
    pub(super) primitives: Vec<Primitive>,
    /// Default weights of the primitives' morph targets.
    #[serde(default)]
    pub(super) weights: Vec<f64>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub(super) attributes: BTreeMap<String, usize>,
    pub(super) indices: Option<usize>,
    pub(super) material: Option<usize>,
    pub(super) mode: Option<u32>,
    #[serde(default)]
    pub(super) targets: Vec<Target>,
    #[serde(default)]
    pub(super) extensions: PrimitiveExtensions,
}

/// A morph target: offsets that are added to a primitive's attributes, times a weight.
#[derive(Deserialize)]
pub(super) struct Target {
    #[serde(rename = "POSITION")]
    pub(super) position: Option<usize>,
    #[serde(rename = "NORMAL")]
    pub(super) normal: Option<usize>,
}

#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct PrimitiveExtensions {
    #[serde(rename = "KHR_draco_mesh_compression")]
    pub(super) draco: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub(super) buffer_view: Option<usize>,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
    #[serde(default)]
    pub(super) normalized: bool,
    pub(super) count: u64,
    #[serde(rename = "type")]
    pub(super) kind: String,
    pub(super) sparse: Option<Sparse>,
}

#[derive(Deserialize)]
pub(super) struct Sparse {
    pub(super) count: u64,
    pub(super) indices: SparseIndices,
    pub(super) values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub(super) buffer_view: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView {
    pub(super) buffer: usize,
    #[serde(default)]
    pub(super) byte_offset: u64,
    pub(super) byte_length: u64,
    pub(super) byte_stride: Option<u64>,
    #[serde(default)]
    pub(super) extensions: BufferExtensions,
}

/// Extensions of a buffer view or buffer whose bytes are stored elsewhere in compressed form.
#[derive(Default, Deserialize)]
#[serde(default)]
pub(super) struct BufferExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    ext_meshopt: Option<IgnoredAny>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr_meshopt: Option<IgnoredAny>,
}

impl BufferExtensions {
    /// The name of the compression, if there is one.
    pub(super) fn compression(&self) -> Option<&'static str> {
        let named =
            [(&self.ext_meshopt, "EXT_meshopt_compression"), (&self.khr_meshopt, "KHR_meshopt_compression")];
        named.into_iter().find_map(|(is, name)| is.as_ref().map(|_| name))
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub(super) byte_length: u64,
    pub(super) uri: Option<String>,
    #[serde(default)]
    pub(super) extensions: BufferExtensions,
}
