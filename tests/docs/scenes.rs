//! Scenes in the documentation, and the kinds that it describes.

use super::markdown::code_blocks;
use super::{documents, files, root, stem, text};
use serde_json::{Value, json};
use std::path::Path;
use stride::Render;
use stride::scene::{load, parse};

/// Where the files of scenes in the text are.
const FOLDER: &str = "docs/pictures/scenes/text.toml";

/// What is wrong with a block of TOML, a whole scene or a part of one; nothing if it is no part of a scene.
fn mistakes(block: &str) -> Vec<String> {
    let value: toml::Table = match toml::from_str(block) {
        Ok(value) => value,
        Err(error) => return vec![error.to_string()],
    };
    let is_whole = value.contains_key("camera") && value.contains_key("entities");
    if is_whole {
        return match parse(block, &root().join(FOLDER)) {
            Ok(loaded) => loaded.warnings.iter().map(|warning| warning.to_string()).collect(),
            Err(errors) => vec![errors.to_string()],
        };
    }
    // A part of an entity.
    let mut part = serde_json::to_value(value).expect("TOML that JSON can say");
    if part.get("shape").is_some() {
        part["material"] = json!("any");
        part = json!({ "entities": [part] });
    }
    let schema: Value = serde_json::from_str(&text("docs/scene.schema.json")).expect("JSON");
    let tables = schema["properties"].as_object().expect("the tables of a scene");
    if !part.as_object().expect("a table").keys().any(|key| tables.contains_key(key)) {
        return Vec::new();
    }
    let validator = jsonschema::draft202012::new(&schema).expect("a schema");
    validator.iter_errors(&part).map(|error| error.to_string()).collect()
}

#[test]
fn scenes_in_the_text_are_valid() {
    let (mut wrong, mut whole) = (Vec::new(), 0);
    for path in documents() {
        for block in code_blocks(&text(&path)).iter().filter(|block| block.language == "toml") {
            whole += usize::from(block.text.contains("camera") && block.text.contains("entities"));
            wrong.extend(mistakes(&block.text).iter().map(|what| format!("{path}:{}: {what}", block.line)));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(whole >= 2);
}

#[test]
fn wrong_scenes_in_the_text_are_found() {
    assert_eq!(mistakes("shape = { type = \"sphere\", center = [0, 0, 0], radius = 1 }"), [""; 0]);
    assert_eq!(mistakes("roughness = 1"), [""; 0], "it says nothing of where it belongs");
    for wrong in [
        "shape = { type = \"ball\", center = [0, 0, 0], radius = 1 }",
        "[film]\nwidht = 3",
        "[film",
        "camera = { vertical_fov = 40 }\nentities = [{ shape = { type = \"sphere\" } }]",
        // Legal, but nobody means it: there is no light.
        "camera = { eye = [0, 0, 0] }\nentities = []",
    ] {
        assert!(!mistakes(wrong).is_empty(), "{wrong}");
    }
}

/// Every scene of a picture loads without a warning, renders, says how to render it, and begins like the others of its
/// kind.
#[test]
fn scenes_of_pictures_are_fine() {
    let scenes = files("docs/pictures/scenes", "toml");
    assert!(scenes.len() >= 40);
    let mut studios: Vec<(&str, String)> = Vec::new();
    for path in &scenes {
        let loaded = load(&root().join(path)).unwrap_or_else(|errors| panic!("{errors}"));
        assert_eq!(loaded.warnings, [], "{path}");
        let report = Render::new(&loaded.scene).size((16, 12)).samples(2).threads(1).run();
        let report = report.unwrap_or_else(|error| panic!("{path}: {error}"));
        assert!(report.picture.rgb.iter().flatten().sum::<f32>() > 0.0, "{path} is black");
        let text = text(path);
        assert!(text.starts_with("#:schema ../../scene.schema.json\n"), "{path}");
        assert!(text.contains(&format!("stride render {path}\n")), "{path} does not say how to render it");
        for marker in ["# The studio:", "# The empty studio:"] {
            if let Some((_, rest)) = text.split_once(marker) {
                let studio = rest.split_once("# The subject.").expect("a subject").0.to_owned();
                studios.push((marker, studio));
            }
        }
    }
    assert!(studios.len() >= 30);
    for marker in ["# The studio:", "# The empty studio:"] {
        let of_marker: Vec<_> = studios.iter().filter(|(other, _)| *other == marker).collect();
        assert!(of_marker.windows(2).all(|pair| pair[0] == pair[1]), "{marker} differs between scenes");
    }
}

/// The values of `type` that the schema allows in a part of a scene.
fn kinds(schema: &Value) -> Vec<String> {
    let alternatives = schema["oneOf"].as_array().expect("alternatives");
    let types = alternatives.iter().map(|kind| kind["properties"]["type"]["const"].as_str().expect("a type"));
    types.map(str::to_owned).collect()
}

/// What is missing in a chapter: blocks of TOML that show each kind.
fn undescribed(chapter: &str, kinds: &[String]) -> Vec<String> {
    let blocks = code_blocks(chapter);
    let shows = |kind: &str| blocks.iter().any(|block| block.text.contains(&format!("type = \"{kind}\"")));
    kinds.iter().filter(|kind| !shows(kind)).cloned().collect()
}

#[test]
fn every_kind_has_a_section() {
    let schema: Value = serde_json::from_str(&text("docs/scene.schema.json")).expect("JSON");
    let tables = &schema["properties"];
    let parts = [
        ("docs/shapes.md", kinds(&tables["entities"]["items"]["properties"]["shape"])),
        ("docs/materials.md", kinds(&tables["materials"]["additionalProperties"])),
        ("docs/textures.md", kinds(&tables["textures"]["additionalProperties"])),
        ("docs/lights.md", kinds(&tables["lights"]["items"])),
    ];
    for (path, kinds) in parts {
        assert!(kinds.len() >= 3, "{path}");
        assert_eq!(undescribed(&text(path), &kinds), [""; 0], "{path}");
    }
    let filters = kinds(&tables["film"]["properties"]["filter"]["anyOf"][1]);
    for filter in filters {
        let picture = format!("(pictures/filter-{filter}.png)");
        assert!(text("docs/filters.md").contains(&picture), "docs/filters.md lacks {filter}");
    }
    let missing = undescribed("```toml\ntype = \"a\"\n```", &["a".to_owned(), "b".to_owned()]);
    assert_eq!(missing, ["b"]);
}

#[test]
fn every_scene_of_a_picture_is_linked() {
    let guide: String = documents().iter().map(|path| text(path)).collect();
    for path in files("docs/pictures/scenes", "toml") {
        let file = Path::new(&path).file_name().expect("a name").to_string_lossy();
        let is_named = guide.contains(&*file) || guide.contains(&format!("/{}.png", stem(&path)));
        assert!(is_named, "no chapter names {path}");
    }
}

/// The scenes with a path that commands in blocks of code name, and that do not exist.
fn lost_scenes(document: &str) -> Vec<String> {
    let shell = code_blocks(document).into_iter().filter(|block| block.language == "sh");
    let words: Vec<_> =
        shell.flat_map(|b| b.text.split_whitespace().map(str::to_owned).collect::<Vec<_>>()).collect();
    let is_scene = |word: &String| word.contains('/') && word.ends_with(".toml");
    words.into_iter().filter(|word| is_scene(word) && !root().join(word).exists()).collect()
}

#[test]
fn commands_name_scenes_that_exist() {
    for path in documents() {
        assert_eq!(lost_scenes(&text(&path)), [""; 0], "{path}");
    }
    assert_eq!(
        lost_scenes("```sh\nstride check scenes/none.toml scenes/cover.toml\n```"),
        ["scenes/none.toml"]
    );
}
