//! The scene description: names, units, source positions. One file per format.
//!
//! | file | contents |
//! |---|---|
//! | `building` | building scenes in code |
//! | [`check`] | the invariants of a scene |
//! | `dark_lights` | warnings about lights that can reach no surface |
//! | [`description`] | the scene as plain data |
//! | [`diagnostic`] | errors and warnings with their positions |
//! | [`fingerprint`] | digests of scenes, and their differences |
//! | [`formats`] | the readers of scene files by their extensions, and those of other programs' formats |
//! | [`groups`] | instances of groups, and the invariants about them |
//! | `images` | the image files of a scene |
//! | `interfaces` | the invariant about overlapping dielectrics |
//! | [`mesh`] | the readers of mesh files |
//! | `mixed_media` | warnings about surfaces that bound several media |
//! | [`names`] | names of materials and textures, and their topological order |
//! | `open_glass` | warnings about glass that encloses no volume |
//! | `placement` | the limits of transforms of meshes and groups |
//! | `second_uv` | the invariant about the second set of uv |
//! | `spelling` | the nearest spelling of a name |
//! | `textures` | the invariants about textures |
//! | [`toml`] | the reader of TOML scene files, and their JSON Schema |
//! | [`viewpoint`] | a camera by the point that it looks at |
//! | [`writing`] | scenes as TOML, with meshes and pictures beside them |
//!
//! A [`Scene`] is the checked content of a file: every name is resolved to an index, and every number is in range.
//! [`crate::world`] compiles it for rendering.
//!
//! ```
//! let loaded = stride::scene::parse("[film]\nwidth = 320", "small.toml".as_ref())?;
//! assert_eq!(loaded.scene.film.width, 320);
//!
//! let errors = stride::scene::parse("[film]\nwidht = 320", "small.toml".as_ref()).unwrap_err();
//! let text = "small.toml:2:1: unknown key \"widht\" in the film; did you mean \"width\"?";
//! assert_eq!(errors.to_string(), text);
//! # Ok::<(), stride::scene::SceneErrors>(())
//! ```

mod building;
pub mod check;
mod dark_lights;
pub mod description;
pub mod diagnostic;
pub mod fingerprint;
pub mod formats;
pub mod groups;
mod images;
mod interfaces;
pub mod mesh;
mod mixed_media;
pub mod names;
mod open_glass;
pub(crate) mod placement;
mod second_uv;
mod spelling;
mod synonyms;
mod textures;
pub mod toml;
pub mod viewpoint;
pub mod writing;

pub use check::SceneProblem;
pub use description::*;
pub use diagnostic::{Diagnostic, Position, SceneErrors};
pub use fingerprint::{Fingerprint, Sources};
pub use formats::{LoadOptions, load, load_watched, load_with};
#[doc(no_inline)]
pub use glam::{DAffine3, DVec3};
pub use groups::{GroupPlace, MOST_PLACES};
pub use mesh::cache::Watch;
pub use toml::{Loaded, parse};
pub use viewpoint::Viewpoint;
