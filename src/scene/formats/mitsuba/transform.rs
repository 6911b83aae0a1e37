//! Transforms: their elements, and their decomposition.

use super::text::{number, numbers, triple};
use glam::{DAffine3, DMat3, DMat4, DVec3, DVec4};

/// The difference from a length of one up to which an axis is a rounded unit vector: files have three decimals or more.
const ROUNDED_AXIS: f64 = 2e-3;

/// The attributes of a step's element, by name.
pub(super) type Attribute<'a> = &'a dyn Fn(&str) -> Option<&'a str>;

/// One step of a transform, by the name of its element, whose attributes have been checked; none for other elements.
pub(super) fn step(element: &str, attribute: Attribute<'_>) -> Option<Result<DMat4, String>> {
    Some(match element {
        "translate" => vector(attribute, 0.0).map(DMat4::from_translation),
        "scale" => vector(attribute, 1.0).map(DMat4::from_scale),
        "rotate" => rotate(attribute),
        "lookat" => look_at(attribute),
        "matrix" => matrix(attribute),
        _ => return None,
    })
}

/// The attributes that a step may have.
pub(super) fn attributes(element: &str) -> &'static [&'static str] {
    match element {
        "rotate" => &["value", "x", "y", "z", "angle"],
        "lookat" => &["origin", "target", "up"],
        "matrix" => &["value"],
        _ => &["value", "x", "y", "z"],
    }
}

/// The vector in `value`, or in `x`, `y` and `z`.
pub(super) fn vector(attribute: Attribute<'_>, default: f64) -> Result<DVec3, String> {
    let parts = ["x", "y", "z"].map(attribute);
    if let Some(value) = attribute("value") {
        if parts.iter().any(Option::is_some) {
            return Err("value cannot be combined with x, y or z".into());
        }
        let triple = triple(value).map(DVec3::from);
        return triple.ok_or_else(|| "value must be one number or three".into());
    }
    let mut vector = DVec3::splat(default);
    for (i, part) in parts.into_iter().enumerate() {
        if let Some(part) = part {
            vector[i] = number(part).ok_or_else(|| format!("{} is not a number", ["x", "y", "z"][i]))?;
        }
    }
    Ok(vector)
}

/// Whether a step is a rotation whose axis is not of unit length. Mitsuba does not normalise axes: such a rotation also
/// scales and shears there.
pub(super) fn has_long_axis(element: &str, attribute: Attribute<'_>) -> bool {
    element == "rotate" && vector(attribute, 0.0).is_ok_and(|axis| (axis.length() - 1.0).abs() > ROUNDED_AXIS)
}

fn rotate(attribute: Attribute<'_>) -> Result<DMat4, String> {
    let axis = vector(attribute, 0.0)?;
    let angle = attribute("angle").and_then(number).ok_or("angle must be a number of degrees")?;
    if axis == DVec3::ZERO {
        return Err("the axis of a rotation is zero".into());
    }
    Ok(DMat4::from_axis_angle(crate::parameter::unit(axis), angle.to_radians()))
}

/// The transform from a camera's space, which looks along z with y up and x to the left.
fn look_at(attribute: Attribute<'_>) -> Result<DMat4, String> {
    let point = |name: &str| {
        let given = attribute(name).and_then(numbers).and_then(|numbers| numbers.try_into().ok());
        given.map(|point: [f64; 3]| DVec3::from(point)).ok_or_else(|| format!("{name} must be three numbers"))
    };
    let (origin, target) = (point("origin")?, point("target")?);
    let up = if attribute("up").is_some() { point("up")? } else { DVec3::ZERO };
    let forward = (target - origin).normalize();
    let up = if up == DVec3::ZERO { forward.any_orthonormal_vector() } else { up };
    let left = up.cross(forward).normalize();
    let up = forward.cross(left);
    let all = [left, up, forward];
    if all.iter().any(|axis| !axis.is_finite()) {
        return Err("up is parallel to the viewing direction, or target is origin".into());
    }
    Ok(DMat4::from_cols(left.extend(0.0), up.extend(0.0), forward.extend(0.0), origin.extend(1.0)))
}

fn matrix(attribute: Attribute<'_>) -> Result<DMat4, String> {
    let given = attribute("value").and_then(numbers).ok_or("value must be numbers")?;
    let row = |i: usize, n: usize| {
        let at = |j: usize| if j < n { given[i * n + j] } else { f64::from(u8::from(i == j)) };
        DVec4::new(at(0), at(1), at(2), at(3))
    };
    match given.len() {
        16 => Ok(DMat4::from_cols(row(0, 4), row(1, 4), row(2, 4), row(3, 4)).transpose()),
        9 => Ok(DMat4::from_cols(row(0, 3), row(1, 3), row(2, 3), DVec4::W).transpose()),
        n => Err(format!("a matrix has 9 or 16 numbers, not {n}")),
    }
}

/// The transform as an affine one, if it is affine.
pub(super) fn affine(transform: &DMat4) -> Option<DAffine3> {
    let last = transform.row(3);
    (last == DVec4::W && transform.is_finite()).then(|| DAffine3::from_mat4(*transform))
}

/// The factor by which a transform scales all lengths, if it is the same in all directions.
pub(super) fn uniform_scale(linear: &DMat3) -> Option<f64> {
    let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
    let scale = x.length();
    let tolerance = 1e-4 * scale;
    let alike = [y, z].iter().all(|axis| (axis.length() - scale).abs() <= tolerance);
    let square = [x.dot(y), y.dot(z), z.dot(x)].iter().all(|dot| dot.abs() <= tolerance * scale);
    (alike && square && scale > 0.0).then_some(scale)
}

/// The unit normal of a transformed surface.
pub(super) fn normal(linear: &DMat3, normal: DVec3) -> DVec3 {
    crate::parameter::unit(linear.inverse().transpose() * normal)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(element: &str, attributes: &[(&str, &str)]) -> Result<DMat4, String> {
        let attribute = |name: &str| attributes.iter().find(|(known, _)| *known == name).map(|(_, v)| *v);
        step(element, &attribute).expect("a step")
    }

    #[test]
    fn steps_are_matrices() {
        let at = |step: DMat4, p: [f64; 3]| step.transform_point3(DVec3::from(p)).to_array();
        assert_eq!(at(of("translate", &[("x", "1"), ("z", "-2")]).unwrap(), [1.0; 3]), [2.0, 1.0, -1.0]);
        assert_eq!(at(of("scale", &[("value", "2")]).unwrap(), [1.0; 3]), [2.0; 3]);
        assert_eq!(at(of("scale", &[("y", "3")]).unwrap(), [1.0; 3]), [1.0, 3.0, 1.0]);
        let turned = at(of("rotate", &[("z", "2"), ("angle", "90")]).unwrap(), [1.0, 0.0, 0.0]);
        assert!((turned[1] - 1.0).abs() < 1e-12 && turned[0].abs() < 1e-12);
        let moved = "1 0 0 5 0 1 0 6 0 0 1 7 0 0 0 1";
        assert_eq!(at(of("matrix", &[("value", moved)]).unwrap(), [0.0; 3]), [5.0, 6.0, 7.0]);
        assert_eq!(
            at(of("matrix", &[("value", "0 1 0 1 0 0 0 0 1")]).unwrap(), [1.0, 2.0, 3.0]),
            [2.0, 1.0, 3.0]
        );
        assert!(step("shear", &|_| None).is_none());
    }

    #[test]
    fn axes_with_rounded_numbers_have_unit_length() {
        let is_long = |element: &str, axis: &str| {
            has_long_axis(element, &|name: &str| (name == "value").then_some(axis))
        };
        assert!(is_long("rotate", "0 1 1") && is_long("rotate", "0 0 0.99") && is_long("rotate", "2"));
        assert!(!is_long("rotate", "0.577 0.577 0.577") && !is_long("rotate", "0 -1 0"));
        assert!(!is_long("translate", "0 1 1") && !is_long("rotate", "no number"));
    }

    #[test]
    fn a_camera_looks_along_z_with_x_to_the_left() {
        let view = of("lookat", &[("origin", "0 -5 0"), ("target", "0, 0, 0"), ("up", "0 0 1")]).unwrap();
        let [left, up, forward] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| view.transform_vector3(axis));
        assert_eq!((left, up, forward), (DVec3::NEG_X, DVec3::Z, DVec3::Y));
        assert_eq!(view.transform_point3(DVec3::ZERO), DVec3::new(0.0, -5.0, 0.0));
        assert!(of("lookat", &[("origin", "0 0 0"), ("target", "0 0 0"), ("up", "0 0 1")]).is_err());
        assert!(of("lookat", &[("origin", "0 0 0"), ("target", "0 0 1"), ("up", "0 0 1")]).is_err());
        assert!(of("lookat", &[("origin", "0 0 0"), ("target", "0 0 1")]).is_ok());
    }

    #[test]
    fn similarities_are_told_from_others() {
        let of = |x: DVec3| DMat3::from_diagonal(x);
        assert_eq!(uniform_scale(&of(DVec3::new(2.0, -2.0, 2.0))), Some(2.0));
        assert_eq!(uniform_scale(&of(DVec3::new(2.0, 3.0, 2.0))), None);
        assert_eq!(uniform_scale(&DMat3::ZERO), None);
        let normal = normal(&of(DVec3::new(1.0, 4.0, -1.0)), DVec3::Z);
        assert_eq!(normal, DVec3::NEG_Z);
    }
}
