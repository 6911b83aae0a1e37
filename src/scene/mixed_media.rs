//! Warnings about surfaces of dielectrics that paths may cross without crossing into or out of the medium inside.
//!
//! A path stores the medium that it enters, and removes it where it leaves (see `integrator::interiors`). This takes for
//! granted that a closed surface bounds one medium everywhere.

use super::description::{Material, MaterialKind, Scene};
use super::open_glass::Warning;
use crate::material::{Media, Row};
use crate::math::lanes::scalar::Wrapping;

/// The media on the far side of a surface of a material.
#[derive(Clone, Debug, Default)]
struct Crossed {
    /// The media inside its dielectrics, in increasing order; zero for thin sheets, which have none.
    media: Vec<u32>,
    /// Whether the medium of any of them absorbs, or decides which surfaces are interfaces.
    matters: bool,
    /// Whether light passes through a hole of a dielectric whose medium matters.
    is_holed: bool,
}

/// Why a surface does not bound one medium.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// It leads to several media.
    Several,
    /// It has holes.
    Holed,
}

impl Kind {
    /// The message for one entity, the message for several, and the remedy.
    fn words(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Kind::Several => (
                "leads to several media by mix, checkerboard or back: a path may leave another medium than it entered",
                "lead to several media by mix, checkerboard or back: a path may leave another medium than it entered",
                "give these dielectrics the same ior, absorption and priority, or let one material be opaque",
            ),
            Kind::Holed => (
                "has an opacity below 1 on a dielectric: a path that enters through a hole is not in its medium",
                "have an opacity below 1 on a dielectric: a path that enters through a hole is not in its medium",
                "remove the opacity, or the absorption and the priorities",
            ),
        }
    }
}

/// Warnings about such surfaces, one for each kind, with names in quotes. There are none in scenes whose media do not
/// matter, because no dielectric absorbs or has a priority.
pub(super) fn mixed_media(scene: &Scene, quote: impl Fn(&str) -> String) -> Vec<Warning> {
    let rows: Vec<Row> = scene.materials.iter().map(|material| material.kind.row()).collect();
    let media = Media::new(&rows);
    if media.is_empty() {
        return Vec::new();
    }
    let crossed = crossed(&scene.materials, &rows, &media);
    let mut warnings = Vec::new();
    for kind in [Kind::Several, Kind::Holed] {
        let is_meant = |material: usize| match kind {
            Kind::Several => crossed[material].media.len() > 1 && crossed[material].matters,
            Kind::Holed => crossed[material].is_holed,
        };
        let mut found = (0..scene.entities.len()).filter(|&i| is_meant(scene.entities[i].material));
        let Some(first) = found.next() else { continue };
        let name = quote(&scene.entities[first].name);
        let (one, many, help) = kind.words();
        let message = match found.count() + 1 {
            1 => format!("{name} {one}"),
            count => format!("{count} entities, {name} the first, {many}"),
        };
        warnings.push(Warning { first, message, help });
    }
    warnings
}

/// The media of each material. Materials follow those that they refer to.
fn crossed(materials: &[Material], rows: &[Row], media: &Media) -> Vec<Crossed> {
    let mut all: Vec<Crossed> = Vec::with_capacity(materials.len());
    for (index, material) in materials.iter().enumerate() {
        let mut own = Crossed::default();
        if let Some(medium) = rows[index].medium {
            own.media.push(media.medium(Wrapping(index as u32)).0);
            own.matters = media.nests() || medium.absorption != [0.0; 3];
        } else if let MaterialKind::Dielectric(_) = material.kind {
            own.media.push(0);
        }
        for named in material.named() {
            own.media.extend(&all[named].media);
            own.is_holed |= all[named].is_holed;
            own.matters |= all[named].matters;
        }
        own.media.sort_unstable();
        own.media.dedup();
        let has_hole = material.modifiers.opacity < 1.0
            || material.textures.iter().any(|textured| textured.parameter == "opacity");
        own.is_holed |= has_hole && own.matters;
        all.push(own);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse;
    use std::path::Path;

    /// The warnings about a ball of a material, among these materials.
    fn messages(materials: &str) -> Vec<String> {
        let text = format!(
            r#"
            environment = {{ radiance = [1, 1, 1] }}
            [materials]
            {materials}
            [[entities]]
            name = "ball"
            shape = {{ type = "sphere", center = [5, 0, 0], radius = 1 }}
            material = "m"
            "#
        );
        let scene = parse(&text, Path::new("a.toml")).unwrap().scene;
        mixed_media(&scene, |name| format!("\"{name}\"")).into_iter().map(|warning| warning.message).collect()
    }

    const GREEN: &str = r#"green = { type = "dielectric", ior = 1.5, absorption = [1, 0, 1] }"#;

    #[test]
    fn surfaces_of_several_media_give_a_warning() {
        let several = "\"ball\" leads to several media by mix, checkerboard or back: a path may leave another medium than it entered";
        let of = |rest: &str| messages(&format!("{GREEN}\n{rest}"));
        let clear = r#"other = { type = "glass", ior = 1.5 }"#;
        let sheet = r#"other = { type = "dielectric", ior = 1.5, thin_walled = true }"#;
        for other in [clear, sheet] {
            for m in [
                r#"m = { type = "mix", a = "green", b = "other" }"#,
                r#"m = { type = "checkerboard", even = "green", odd = "other", checks_per_unit = 4 }"#,
                r#"m = { type = "dielectric", ior = 1.5, absorption = [1, 0, 1], back = "other" }"#,
            ] {
                assert_eq!(of(&format!("{other}\n{m}")), [several], "{other} {m}");
            }
        }
        // The same medium, and a material that light does not cross.
        let same = r#"other = { type = "dielectric", ior = 1.5, absorption = [1, 0, 1], roughness = 0.3 }"#;
        let matte = r#"other = { type = "matte", reflectance = [0.5, 0.5, 0.5] }"#;
        for other in [same, matte] {
            let mix = format!("{other}\nm = {{ type = \"mix\", a = \"green\", b = \"other\" }}");
            assert_eq!(of(&mix), [""; 0], "{other}");
        }
        // Media that do not matter, beside one that does, and with a priority, by which all of them do.
        for (priority, expected) in [("", vec![]), (", priority = 1", vec![several])] {
            let clear = format!(
                r#"one = {{ type = "glass", ior = 1.3 }}
                two = {{ type = "dielectric", ior = 1.5{priority} }}
                m = {{ type = "mix", a = "one", b = "two" }}"#
            );
            assert_eq!(of(&clear), expected, "{priority}");
        }
    }

    #[test]
    fn holes_in_dielectrics_give_a_warning() {
        let holed = "\"ball\" has an opacity below 1 on a dielectric: a path that enters through a hole is not in its medium";
        let m = |rest: &str| format!("m = {{ type = \"dielectric\", ior = 1.5, {rest} }}");
        assert_eq!(messages(&m("absorption = [1, 0, 1], opacity = 0.5")), [holed]);
        assert_eq!(messages(&m("priority = 1, opacity = 0.5")), [holed]);
        assert_eq!(
            messages(&format!(
                "{GREEN}\nm = {{ type = \"mix\", a = \"green\", b = \"green\", opacity = 0.5 }}"
            )),
            [holed]
        );
        // Clear glass may have holes, beside glass that absorbs.
        assert_eq!(messages(&m("opacity = 0.5")), [""; 0]);
        assert_eq!(messages(&format!("{GREEN}\n{}", m("opacity = 0.5"))), [""; 0]);
        assert_eq!(messages(&m("absorption = [1, 0, 1]")), [""; 0]);
    }
}
