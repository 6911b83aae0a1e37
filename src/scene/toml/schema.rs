//! The JSON Schema of scene files, from the same tables as the reader.

use serde_json::{Value, json};

use super::form::ValueForm;
use super::scene::SCENE;

/// The JSON Schema (draft 2020-12) of scene files. `docs/scene.schema.json` contains it for editors.
///
/// It covers single values and the presence of keys. Only the reader checks relations between values (names, parallel
/// vectors, cycles). JSON Schema accepts 640.0 as an integer, the reader does not.
pub fn schema() -> Value {
    let mut schema = SCENE.schema();
    schema["$schema"] = "https://json-schema.org/draft/2020-12/schema".into();
    schema["title"] = "stride scene".into();
    schema["description"] = json!(
        "A scene for stride, in TOML. Lengths are the scene's own unit, angles are degrees, colours are linear \
         Rec. 709, space is right-handed."
    );
    schema
}
