//! Intensities given by power.

use crate::parameter::limits::INTENSITY;
use crate::parameter::{Colour, Problem};

/// The intensity in W/sr of a light with either an intensity or a power in W. `solid_angle` is the ratio of its power
/// to its intensity on the axis.
///
/// # Errors
/// If it has both or neither, or an intensity above the limit.
pub(super) fn intensity(
    what: &'static str,
    intensity: Option<Colour>,
    power: Option<Colour>,
    solid_angle: f64,
) -> Result<Colour, Problem> {
    let problem =
        |parameter, message, help: &str| Err(Problem { parameter, message, help: Some(help.into()) });
    let is_unknown = |colour: Colour| colour.iter().any(|channel| channel.is_nan());
    match (intensity, power) {
        (Some(intensity), None) => Ok(intensity),
        (Some(intensity), Some(power)) if is_unknown(intensity) || is_unknown(power) => Ok(intensity),
        (None, Some(power)) => {
            let intensity = power.map(|power| power / solid_angle);
            match intensity.iter().copied().find(|&channel| channel > INTENSITY.most) {
                Some(most) => {
                    let message =
                        format!("power gives an intensity of {most:.2e} W/sr, above {:e}", INTENSITY.most);
                    problem("power", message, "give less power, or a wider cone")
                }
                None => Ok(intensity),
            }
        }
        (Some(_), Some(_)) => {
            problem("power", format!("{what} has both intensity and power"), "keep one of them")
        }
        (None, None) => problem(
            "intensity",
            format!("{what} needs either intensity or power"),
            "for example: intensity = [1, 1, 1]",
        ),
    }
}

/// The intensity of a light that has been checked, or of one constructed by a program; black without either.
pub(super) fn given(intensity: Option<Colour>, power: Option<Colour>, solid_angle: f64) -> Colour {
    self::intensity("the light", intensity, power, solid_angle).unwrap_or_default()
}
