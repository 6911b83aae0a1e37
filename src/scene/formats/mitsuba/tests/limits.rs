//! Limits on the size of a scene.

use super::super::limits::{MOST_ELEMENTS, MOST_NESTING};
use super::{errors, whole};

#[test]
fn the_depth_of_elements_is_limited() {
    let nested = |depth: usize| {
        let (open, close) = ("<bsdf type=\"twosided\">".repeat(depth), "</bsdf>".repeat(depth));
        whole(&format!("<shape type=\"sphere\">{open}{close}</shape>"))
    };
    let message = errors(&nested(MOST_NESTING));
    assert!(message[0].ends_with("elements are nested more than 64 deep"), "{message:?}");
    let message = errors(&nested(MOST_NESTING - 1));
    assert!(message[0].ends_with("has no bsdf in it"), "{message:?}");
    // Recursion this deep would overflow the stack.
    let message = errors(&nested(100_000));
    assert!(message[0].ends_with("elements are nested more than 64 deep"), "{message:?}");
}

#[test]
fn the_depth_of_references_is_limited() {
    let chain = |length: usize| {
        let link =
            |i: usize| format!("<bsdf type=\"twosided\" id=\"b{i}\"><ref id=\"b{}\"/></bsdf>\n", i + 1);
        let links: String = (0..length).map(link).collect();
        whole(&format!(
            "{links}<bsdf type=\"diffuse\" id=\"b{length}\"/><shape type=\"sphere\"><ref id=\"b0\"/></shape>"
        ))
    };
    assert_eq!(super::read(&chain(MOST_NESTING - 3)).scene.materials.len(), 1);
    let message = errors(&chain(100_000));
    assert!(message[0].ends_with("objects are nested more than 64 deep"), "{message:?}");
}

#[test]
fn nested_references_take_linear_time() {
    let link = |i: usize| {
        format!(
            "<bsdf type=\"blendbsdf\" id=\"b{i}\"><float name=\"weight\" value=\"0.5\"/><ref id=\"b{0}\"/><ref id=\"b{0}\"/></bsdf>\n",
            i + 1
        )
    };
    let doubled = |depth: usize| {
        let links: String = (0..depth).map(link).collect();
        let shape = "<shape type=\"disk\"><ref id=\"b0\"/></shape>";
        whole(&format!("{links}<bsdf type=\"diffuse\" id=\"b{depth}\"/>{shape}"))
    };
    // Each object once, of the first one a copy that is black on the back, and a black material.
    assert_eq!(super::read(&doubled(14)).scene.materials.len(), 16);
    let message = errors(&doubled(60));
    assert!(message[0].ends_with("it is nested more than 16 levels deep"), "{message:?}");
}

#[test]
fn the_number_of_elements_is_limited() {
    let message = errors(&whole(&"<default name=\"a\" value=\"1\"/>".repeat(MOST_ELEMENTS + 1)));
    assert!(message[0].ends_with("the scene has more than 1048576 elements"), "{}", message[0]);
}

#[test]
fn the_number_of_folders_is_limited() {
    let message =
        errors(&whole(&(0..100_000).map(|i| format!("<path value=\"a{i}\"/>\n")).collect::<String>()));
    assert!(message[0].contains("files are searched for in more than 64 folders"), "{}", message[0]);
}

#[test]
fn the_length_of_values_is_limited() {
    let mut body = format!("<default name=\"a0\" value=\"{}\"/>\n", "x".repeat(1000));
    for i in 0..30 {
        body += &format!("<default name=\"a{}\" value=\"{}\"/>\n", i + 1, format!("$a{i}").repeat(10));
    }
    let message = errors(&whole(&body));
    assert!(message[0].ends_with("value is too long with the values of its variables"), "{message:?}");
}

#[test]
fn values_of_variables_take_only_so_much_room() {
    let long = format!("<default name=\"a\" value=\"{}\"/>", "x".repeat(1 << 16));
    let text = |count: usize| whole(&format!("{long}{}", "<path value=\"$a\"/>\n".repeat(count)));
    assert_eq!(super::read(&text(16)).scene.entities.len(), 0);
    let told = "the values of variables take more room than all files of the scene";
    let message = errors(&text(18));
    assert!(message[0].ends_with(told), "{message:?}");
}

/// Quadratic work on these numbers would take minutes.
const MANY: usize = 200_000;

#[test]
fn references_to_nothing_take_no_time() {
    let ids: String = (0..MANY).map(|i| format!("<bsdf type=\"diffuse\" id=\"{i:065}\"/>\n")).collect();
    let references: String = (0..MANY).map(|i| format!("<ref id=\"{i:064}\"/>\n")).collect();
    let errors = errors(&whole(&(ids + &references)));
    assert_eq!(errors.len(), 101, "a hundred errors, and how many more there are");
}

#[test]
fn many_properties_of_an_object_take_no_time() {
    let numbers: String = (0..MANY).map(|i| format!("<float name=\"n{i}\" value=\"0\"/>\n")).collect();
    let shape =
        format!("<shape type=\"sphere\" id=\"s\">{numbers}<float name=\"radius\" value=\"3\"/></shape>");
    let named = "<shape type=\"merge\"><ref id=\"s\"/></shape>\n".repeat(MANY / 2);
    let loaded = super::read(&whole(&(shape + &named)));
    assert_eq!(loaded.scene.entities.len(), MANY / 2 + 1);
    let last = loaded.warnings.last().expect("warnings").to_string();
    assert_eq!(last, format!("a.xml: and {} more features without a counterpart", MANY - 50));
    // Each name twice.
    let twice = format!("<shape type=\"sphere\">{numbers}{numbers}</shape>");
    let first = errors(&whole(&twice)).swap_remove(0);
    assert!(first.ends_with("\"n0\" is given twice"), "{first}");
}

/// Each shape reads its bsdf, which contains many others.
#[test]
fn a_large_bsdf_of_many_shapes_takes_no_time() {
    let inner = "<ref id=\"m\"/>".repeat(MANY);
    let mask = format!("<bsdf type=\"diffuse\" id=\"m\"/><bsdf type=\"mask\" id=\"b\">{inner}</bsdf>");
    let shapes = "<shape type=\"disk\"><ref id=\"b\"/></shape>".repeat(MANY / 2);
    assert_eq!(super::read(&whole(&(mask + &shapes))).scene.entities.len(), MANY / 2);
}

/// Whether a group is empty is known without reading all others.
#[test]
fn groups_of_nothing_take_no_time() {
    let spheres = "<shape type=\"sphere\"/>".repeat(MANY / 2);
    let group = |i: usize| {
        format!("<shape type=\"shapegroup\" id=\"g{i}\"/><shape type=\"instance\"><ref id=\"g{i}\"/></shape>")
    };
    let groups: String = (0..MANY / 4).map(group).collect();
    let scene = super::read(&whole(&(spheres + &groups))).scene;
    assert_eq!((scene.entities.len(), scene.groups.len()), (MANY / 2, 0));
}
