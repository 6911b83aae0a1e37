//! The scene's description: names, units, source lines. One file per format.
//!
//! | file | what is in it |
//! |---|---|
//! | `building` | scenes from code |
//! | [`check`] | the promises of a scene, and what breaks them |
//! | [`description`] | the scene as plain data |
//! | [`diagnostic`] | errors and warnings with their places |
//! | [`fingerprint`] | whether two scenes are the same, and what differs |
//! | [`formats`] | the readers of scene files by their extensions, and those of other programs' formats |
//! | [`groups`] | where groups of surfaces stand, and the promises of a scene about them |
//! | `images` | the image files of a scene, each read once |
//! | `interfaces` | the promise of a scene about dielectrics that overlap |
//! | [`mesh`] | the readers of mesh files |
//! | [`names`] | names of materials and textures, and an order of those that name others |
//! | `open_glass` | glass that bounds no solid |
//! | `placement` | where meshes and groups may be placed |
//! | `spelling` | the nearest spelling of a name |
//! | `textures` | the promises of a scene about its textures |
//! | [`toml`] | the reader of TOML scene files, and their JSON Schema |
//! | [`viewpoint`] | a camera by the point that it looks at |
//! | [`writing`] | scenes as TOML, with meshes and pictures beside them |
//!
//! A [`Scene`] is what a file says, checked: every name is resolved to an index, every number is finite and
//! possible. [`crate::world`] compiles it into what rays meet.
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
pub mod description;
pub mod diagnostic;
pub mod fingerprint;
pub mod formats;
pub mod groups;
mod images;
mod interfaces;
pub mod mesh;
pub mod names;
mod open_glass;
pub(crate) mod placement;
mod spelling;
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
