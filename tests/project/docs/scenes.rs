//! Scenes in the documentation, and the kinds that it describes.

use super::markdown::{code_blocks, without_code};
use super::{documents, files, root, stem, text};
use serde_json::{Value, json};
use std::collections::BTreeSet;
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

/// The sections of a chapter: each heading with the text up to the next one.
fn sections(chapter: &str) -> Vec<String> {
    let mut sections = vec![String::new()];
    let mut is_code = false;
    for line in chapter.lines() {
        is_code ^= line.starts_with("```");
        if line.starts_with('#') && !is_code {
            sections.push(String::new());
        }
        let section = sections.last_mut().expect("a section");
        *section += line;
        section.push('\n');
    }
    sections
}

/// Those of some pieces of TOML that no section shows together with a picture.
fn undescribed(chapter: &str, pieces: &[String]) -> Vec<String> {
    let sections: Vec<_> = sections(chapter).into_iter().filter(|section| section.contains("\n![")).collect();
    let shows = |piece: &String| {
        let mut blocks = sections.iter().flat_map(|section| code_blocks(section));
        blocks.any(|block| block.language == "toml" && block.text.contains(piece))
    };
    pieces.iter().filter(|piece| !shows(piece)).cloned().collect()
}

/// The keys that all of some kinds have.
fn common_keys(schema: &Value) -> Vec<String> {
    let alternatives = schema["oneOf"].as_array().expect("alternatives");
    let keys =
        |kind: &Value| kind["properties"].as_object().expect("keys").keys().cloned().collect::<Vec<_>>();
    let common = keys(&alternatives[0]).into_iter();
    common.filter(|key| alternatives.iter().all(|kind| keys(kind).contains(key))).collect()
}

#[test]
fn every_kind_has_a_section_with_a_picture() {
    let schema: Value = serde_json::from_str(&text("docs/scene.schema.json")).expect("JSON");
    let tables = &schema["properties"];
    let materials = &tables["materials"]["additionalProperties"];
    let parts = [
        ("docs/shapes.md", kinds(&tables["entities"]["items"]["properties"]["shape"])),
        ("docs/materials.md", kinds(materials)),
        ("docs/textures.md", kinds(&tables["textures"]["additionalProperties"])),
        ("docs/lights.md", kinds(&tables["lights"]["items"])),
        ("docs/scene-format.md", vec!["orthographic".to_owned()]),
    ];
    for (path, kinds) in parts {
        let pieces: Vec<_> = kinds.iter().map(|kind| format!("type = \"{kind}\"")).collect();
        assert!(!pieces.is_empty(), "{path}");
        assert_eq!(undescribed(&text(path), &pieces), [""; 0], "{path}");
    }
    // The parameters of all materials; scales are parts of their maps.
    let modifiers =
        common_keys(materials).into_iter().filter(|key| key != "type" && !key.ends_with("_scale"));
    let pieces: Vec<_> = modifiers.map(|key| format!("\n{key} = ")).collect();
    assert!(pieces.len() >= 4, "{pieces:?}");
    assert_eq!(undescribed(&text("docs/materials.md"), &pieces), [""; 0]);
    for (path, piece) in [
        ("docs/shapes.md", "[[instances]]"),
        ("docs/shapes.md", "transform = {"),
        ("docs/lights.md", "[environment]\nradiance"),
        ("docs/lights.md", "[environment]\nfile"),
        ("docs/lights.md", "emission = ["),
        ("docs/lights.md", "emission = \""),
        ("docs/scene-format.md", "aperture_radius"),
    ] {
        assert_eq!(undescribed(&text(path), &[piece.to_owned()]), [""; 0], "{path}");
    }
    let filters = kinds(&tables["film"]["properties"]["filter"]["anyOf"][1]);
    for filter in filters {
        let picture = format!("(pictures/filter-{filter}.png)");
        assert!(text("docs/filters.md").contains(&picture), "docs/filters.md lacks {filter}");
    }
    let chapter = "## A\n![](a.png)\n```toml\na = 1\n```\n## B\n```toml\nb = 1\n```";
    assert_eq!(undescribed(chapter, &["a = 1".to_owned(), "b = 1".to_owned()]), ["b = 1"]);
}

/// The names of all keys in a schema.
fn keys(schema: &Value, found: &mut BTreeSet<String>) {
    if let Some(properties) = schema["properties"].as_object() {
        found.extend(properties.keys().cloned());
    }
    match schema {
        Value::Object(members) => members.values().for_each(|member| keys(member, found)),
        Value::Array(items) => items.iter().for_each(|item| keys(item, found)),
        _ => {}
    }
}

/// The words in the code of a chapter, in blocks of TOML and in lines.
fn words_of_code(chapter: &str) -> BTreeSet<String> {
    let blocks =
        code_blocks(chapter).into_iter().filter(|block| block.language == "toml").map(|block| block.text);
    let prose = without_code(chapter);
    let inline = prose.lines().flat_map(|line| line.split('`').skip(1).step_by(2)).map(str::to_owned);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let words = blocks
        .chain(inline)
        .flat_map(|code| code.split(|c| !is_word(c)).map(str::to_owned).collect::<Vec<_>>());
    words.collect()
}

#[test]
fn every_key_is_described() {
    let schema: Value = serde_json::from_str(&text("docs/scene.schema.json")).expect("JSON");
    let mut known = BTreeSet::new();
    keys(&schema, &mut known);
    assert!(known.len() > 50 && known.contains("penumbra_angle"));
    let chapters = ["scene-format", "shapes", "materials", "textures", "lights", "filters"];
    let described: BTreeSet<_> =
        chapters.iter().flat_map(|chapter| words_of_code(&text(&format!("docs/{chapter}.md")))).collect();
    assert_eq!(known.difference(&described).collect::<Vec<_>>(), [""; 0]);
    let words = words_of_code("a `b = 1` c\n```toml\nd = 1\n```\n```sh\ne\n```");
    assert_eq!(words.iter().filter(|word| !word.is_empty()).collect::<Vec<_>>(), ["1", "b", "d"]);
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
