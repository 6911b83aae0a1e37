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
    // Each object once, a black material, and one that is black on the back.
    assert_eq!(super::read(&doubled(14)).scene.materials.len(), 17);
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
    let message = errors(&whole(&"<path value=\"a\"/>\n".repeat(100_000)));
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
