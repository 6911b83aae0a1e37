//! The JSON Schema of scene files agrees with the reader.

use std::path::Path;
use std::{env, fs};

use jsonschema::Validator;
use serde_json::Value;
use stride::scene::{parse, toml::schema};

fn validator() -> Validator {
    jsonschema::draft202012::new(&schema()).expect("a schema")
}

fn json(text: &str) -> Value {
    toml::from_str(text).expect("TOML that JSON can say")
}

#[test]
fn the_committed_schema_is_current() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/scene.schema.json");
    if env::var_os("STRIDE_BLESS").is_some() {
        let text = serde_json::to_string_pretty(&schema()).expect("JSON");
        fs::write(&path, text + "\n").expect("written");
    }
    let committed: Value = serde_json::from_str(&fs::read_to_string(&path).expect("a file")).expect("JSON");
    assert!(committed == schema(), "run this test with STRIDE_BLESS=1 and commit {}", path.display());
}

#[test]
fn the_schema_is_valid() {
    jsonschema::draft202012::meta::validate(&schema()).expect("draft 2020-12");
}

#[test]
fn scenes_of_the_repository_are_valid() {
    let validator = validator();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    let mut scenes = 0;
    for entry in fs::read_dir(folder).expect("scenes/") {
        let path = entry.expect("an entry").path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let scene = json(&fs::read_to_string(&path).expect("text"));
            let errors: Vec<_> = validator.iter_errors(&scene).map(|error| error.to_string()).collect();
            assert!(errors.is_empty(), "{}: {errors:?}", path.display());
            scenes += 1;
        }
    }
    assert!(scenes >= 12);
}

/// Every key has a description, and no table accepts unknown keys.
#[test]
fn every_key_is_described() {
    fn check(at: &str, schema: &Value, keys: &mut usize) {
        if let Some(properties) = schema.get("properties").and_then(Value::as_object) {
            assert_eq!(schema["additionalProperties"], false, "{at}");
            for (key, value) in properties {
                let at = format!("{at}.{key}");
                assert!(value.get("const").is_some() || value["description"].is_string(), "{at}");
                *keys += 1;
                check(&at, value, keys);
            }
        }
        for part in ["items", "additionalProperties"] {
            schema.get(part).into_iter().for_each(|schema| check(at, schema, keys));
        }
        for part in ["oneOf", "anyOf"] {
            let variants = schema.get(part).and_then(Value::as_array);
            variants.into_iter().flatten().for_each(|schema| check(at, schema, keys));
        }
    }
    let mut keys = 0;
    check("", &schema(), &mut keys);
    assert!(keys > 50, "{keys}");
}

/// A scene with an example of each kind of value.
const GOOD: &str = r#"
[film]
width = 640
filter = { type = "tent", radius = 1 }
[camera]
look_at = [1, 0, 0]
vertical_fov = 60.5
aperture_radius = 0
focus_distance = 2
[render]
integrator = "path"
seed = 0
[materials.grey]
type = "matte"
reflectance = [0.5, 0.5, 1]
[materials.board]
type = "checkerboard"
even = "grey"
odd = "grey"
checks_per_unit = [1, 2]
[materials.glass]
type = "glass"
ior = 1.5
[materials.metal]
type = "conductor"
metal = "gold"
roughness = [0.1, 0.5]
[materials.index]
type = "conductor"
eta = [0.2, 0.9, 1.1]
k = [3.9, 2.4, 2.2]
[materials.frosted]
type = "dielectric"
ior = 1.3
roughness = 0.3
thin_walled = true
[[entities]]
name = "ball"
shape = { type = "sphere", center = [0, 0, 0], radius = 1 }
material = "grey"
flip_normal = false
[[entities]]
shape = { type = "plane", normal = [0, 0, 1], distance = 1 }
material = "board"
[[lights]]
type = "point"
position = [1, 2, 3]
intensity = [1, 1, 1]
[[lights]]
type = "spot"
position = [1, 2, 3]
direction = [0, 0, -2]
power = [5, 5, 5]
falloff = "angle"
[[lights]]
type = "directional"
direction = [0, 0, -1]
irradiance = [3, 3, 3]
[environment]
radiance = [0, 0, 0]
[[groups.pair.entities]]
shape = { type = "disk", center = [0, 0, 0], normal = [0, 0, 1], radius = 1, transform = { rotate = [0, 0, 45] } }
material = "grey"
[[instances]]
group = "pair"
transform = { scale = 2 }
[[groups.pairs.instances]]
group = "pair"
[[instances]]
group = "pairs"
"#;

/// Changes to [`GOOD`] that both must reject.
const WRONG: &[(&str, &str)] = &[
    ("[film]", "[flim]"),
    ("width = 640", "widht = 640"),
    ("width = 640", "width = 0"),
    ("width = 640", "width = 65537"),
    ("width = 640", "width = 640.5"),
    ("width = 640", "width = \"640\""),
    ("{ type = \"tent\", radius = 1 }", "\"gausian\""),
    ("{ type = \"tent\", radius = 1 }", "{ radius = 1 }"),
    ("{ type = \"tent\", radius = 1 }", "{ type = \"none\", radius = 1 }"),
    ("{ type = \"tent\", radius = 1 }", "{ type = \"tent\", radius = 17 }"),
    ("{ type = \"tent\", radius = 1 }", "1"),
    ("look_at = [1, 0, 0]", "look_at = [1, 0, 0]\nforward = [1, 0, 0]"),
    ("look_at = [1, 0, 0]", "look_at = [1, 0]"),
    ("look_at = [1, 0, 0]", "forward = [0, 0, 0]"),
    ("vertical_fov = 60.5", "vertical_fov = 180"),
    ("vertical_fov = 60.5", "vertical_fov = 0"),
    ("focus_distance = 2", ""),
    ("focus_distance = 2", "focus_distance = 0"),
    ("integrator = \"path\"", "integrator = \"pth\""),
    ("seed = 0", "seed = -1"),
    ("seed = 0", "seed = 4294967296"),
    ("seed = 0", "samples = 0"),
    ("reflectance = [0.5, 0.5, 1]", "reflectance = [0.5, 0.5, 1.5]"),
    ("reflectance = [0.5, 0.5, 1]", "reflectance = 0.5"),
    ("reflectance = [0.5, 0.5, 1]", ""),
    ("type = \"matte\"", "type = \"mate\""),
    ("type = \"matte\"", ""),
    ("even = \"grey\"", "even = \"\""),
    ("checks_per_unit = [1, 2]", "checks_per_unit = [1, 2, 3]"),
    ("checks_per_unit = [1, 2]", "checks_per_unit = 0"),
    ("ior = 1.5", ""),
    ("ior = 1.5", "ior = 0"),
    ("name = \"ball\"", "name = 3"),
    ("type = \"sphere\"", "type = \"mesh\""),
    ("center", "centre"),
    ("radius = 1 }\nmaterial", "radius = 0 }\nmaterial"),
    ("radius = 1 }\nmaterial", "radius = 1, u = 1 }\nmaterial"),
    ("material = \"grey\"", ""),
    ("flip_normal = false", "flip_normal = 0"),
    ("normal = [0, 0, 1]", "normal = [0, 0, 0]"),
    ("distance = 1 }", "distance = 2e18 }"),
    ("metal = \"gold\"", ""),
    ("metal = \"gold\"", "metal = \"golld\""),
    ("metal = \"gold\"", "metal = \"gold\"\nk = [1, 1, 1]"),
    ("metal = \"gold\"", "eta = [1, 1, 1]"),
    ("roughness = [0.1, 0.5]", "roughness = [0.1, 1.5]"),
    ("k = [3.9, 2.4, 2.2]", ""),
    ("k = [3.9, 2.4, 2.2]", "k = [3.9, 2.4, -2.2]"),
    ("ior = 1.3", ""),
    ("thin_walled = true", "thin_walled = 1"),
    ("power = [5, 5, 5]", ""),
    ("power = [5, 5, 5]", "power = [5, 5, 5]\nintensity = [1, 1, 1]"),
    ("falloff = \"angle\"", "falloff = \"linear\""),
    ("irradiance = [3, 3, 3]", ""),
    ("intensity = [1, 1, 1]", ""),
    ("flip_normal = false", "emission = [1, 1, 1]\npower = [1, 1, 1]"),
    ("vertical_fov = 60.5", "type = \"orthographic\""),
    ("vertical_fov = 60.5", "vertical_fov = 60.5\nheight = 4"),
    ("vertical_fov = 60.5", "type = \"orthographic\"\nheight = 4\nvertical_fov = 60.5"),
    ("[environment]", "[[environment]]"),
    ("type = \"point\"", "type = \"spot\""),
    ("intensity = [1, 1, 1]", "intensity = [1, 1, -1]"),
    ("radiance = [0, 0, 0]", "radiance = [0, 0, 2e9]"),
    ("[[groups.pair.entities]]", "[[groups.pair.things]]"),
    ("[[groups.pairs.instances]]", "[groups.pairs.instances]"),
    ("rotate = [0, 0, 45]", "rotate = 45"),
    ("rotate = [0, 0, 45]", "turn = [0, 0, 45]"),
    ("distance = 1 }", "distance = 1, transform = { scale = 2 } }"),
    ("scale = 2", "scale = [1, 2]"),
    ("group = \"pair\"", ""),
    ("group = \"pair\"", "group = 3"),
    ("group = \"pair\"", "group = \"pair\"\nmaterial = \"grey\""),
];

#[test]
fn reader_and_schema_accept_and_reject_the_same() {
    let validator = validator();
    let takes = |text: &str| (parse(text, "box.toml".as_ref()).is_ok(), validator.is_valid(&json(text)));
    assert_eq!(takes(GOOD), (true, true));
    assert_eq!(takes(""), (true, true));
    for (right, wrong) in WRONG {
        assert!(GOOD.contains(right), "{right}");
        assert_eq!(takes(&GOOD.replacen(right, wrong, 1)), (false, false), "{wrong:?} for {right:?}");
    }
}
