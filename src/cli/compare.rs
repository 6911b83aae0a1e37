//! `stride compare`: the difference between two pictures.

use super::failure::Failure;
use super::print::print;
use crate::film::compare::{Comparison, Flip, FlipKind, compare};
use crate::output::human;
use crate::output::{Format, read_picture};
use anyhow::Context;
use serde_json::json;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

const AFTER_HELP: &str = "\
Figures:
  MSE            Mean of (A − B)² over pixels and channels.
  relMSE         Mean of (A − B)² / (B² + 0.01).
  relMSE_scaled  Mean of (A − B)² / (B² + 0.01·m²), where m is the mean of B
                 without its brightest 0.5% of pixels.
  noise          √relMSE_scaled without the worst 0.5% of pixels.
  FLIP           Perceived difference from 0 to 1 (Andersson et al. 2020, 2021).";

#[derive(Debug, clap::Args)]
#[command(after_help = AFTER_HELP)]
pub(super) struct CompareArguments {
    /// Picture: .png, .exr or .hdr
    a: PathBuf,
    /// Reference picture; relative errors are relative to this one
    b: PathBuf,
    /// Print one JSON object; infinite figures are null
    #[arg(long)]
    json: bool,
}

pub(super) fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    let (format_a, a) = read_picture(&arguments.a)?;
    let (format_b, b) = read_picture(&arguments.b)?;
    // If one picture is made for a screen, radiance is compared as a screen would show it.
    let screen = format_a == Format::Png || format_b == Format::Png;
    if screen && format_a != format_b {
        let for_screens = if format_a == Format::Png { &arguments.a } else { &arguments.b };
        let _ = writeln!(
            io::stderr(),
            "warning: {} is clamped at white and has an exposure and a tone curve; the other picture holds radiance, \
             so part of the difference may be due to that",
            for_screens.display()
        );
    }
    let kind = if screen { FlipKind::Ldr } else { FlipKind::Hdr };
    let found = compare(&a, &b, kind)
        .with_context(|| format!("{} and {}", arguments.a.display(), arguments.b.display()))?;
    let text = if arguments.json {
        json(arguments, [a.width, a.height], &found)
    } else {
        words(&arguments.a, &arguments.b, &found)
    };
    Ok(print(&text)?)
}

fn words(a: &Path, b: &Path, found: &Comparison) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(text, "{:<14}{:>13}{:>13}{:>13}", "", "red", "green", "blue");
    for (name, path, means) in [("mean A", a, found.means[0]), ("mean B", b, found.means[1])] {
        let [red, green, blue] = means.map(figure);
        let _ = writeln!(text, "{name:<14}{red:>13}{green:>13}{blue:>13}   {}", path.display());
    }
    let _ = writeln!(text, "{:<14}{:>13}", "MSE", figure(found.mse));
    let _ =
        writeln!(text, "{:<14}{:>13}   mean of (A − B)² / (B² + 0.01)", "relMSE", figure(found.relative_mse));
    let _ = writeln!(
        text,
        "{:<14}{:>13}   with brightness {} of B: its mean without the brightest 0.5% of pixels",
        "relMSE_scaled",
        figure(found.relative_mse_scaled),
        figure(found.brightness)
    );
    let _ = writeln!(
        text,
        "{:<14}{:>13}   √relMSE_scaled without the worst 0.5% of pixels",
        "noise",
        figure(found.noise)
    );
    let _ = match found.flip {
        Flip::Ldr(mean) => {
            writeln!(text, "{:<14}{:>13}   LDR-FLIP of the pictures clamped to 0…1", "FLIP", figure(mean))
        }
        Flip::Hdr(flip) => writeln!(
            text,
            "{:<14}{:>13}   HDR-FLIP through ACES at {} exposures from {} to {}",
            "FLIP",
            figure(flip.mean),
            flip.exposures,
            human::exposure(flip.start),
            human::exposure(flip.stop)
        ),
    };
    for (name, count) in [("A", found.non_finite[0]), ("B", found.non_finite[1])] {
        if count > 0 {
            let (pixels, are) = if count == 1 { ("pixel", "is") } else { ("pixels", "are") };
            let _ = writeln!(text, "{count} {pixels} of {name} {are} NaN or infinite and not compared");
        }
    }
    text
}

/// Formats a number of any magnitude with six digits.
fn figure(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if size.is_infinite() {
        "infinite".to_owned()
    } else if (1e-3..1e6).contains(&size) {
        let digits = 5 - size.log10().floor() as i32;
        format!("{value:.*}", digits.max(0) as usize)
    } else {
        format!("{value:.5e}")
    }
}

fn json(arguments: &CompareArguments, [width, height]: [u32; 2], found: &Comparison) -> String {
    let picture = |path: &Path, index: usize| {
        json!({
            "file": path.to_string_lossy(),
            "mean": found.means[index],
            "non_finite_pixels": found.non_finite[index],
        })
    };
    let (kind, flip, exposures) = match found.flip {
        Flip::Ldr(mean) => ("ldr", mean, None),
        Flip::Hdr(flip) => {
            let exposures = json!({ "start": flip.start, "stop": flip.stop, "count": flip.exposures });
            ("hdr", flip.mean, Some(exposures))
        }
    };
    let object = json!({
        "a": picture(&arguments.a, 0),
        "b": picture(&arguments.b, 1),
        "width": width,
        "height": height,
        "compared_pixels": found.compared,
        "mse": found.mse,
        "relmse": found.relative_mse,
        "relmse_scaled": found.relative_mse_scaled,
        "brightness": found.brightness,
        "noise": found.noise,
        "flip": flip,
        "flip_kind": kind,
        "flip_exposures": exposures,
    });
    format!("{object:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_have_six_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.123_456_78, "0.123457"),
            (12.345_678_9, "12.3457"),
            (123_456.7, "123457"),
            (-0.5, "-0.500000"),
            (1.234_567e-7, "1.23457e-7"),
            (2e9, "2.00000e9"),
            (f64::INFINITY, "infinite"),
        ] {
            assert_eq!(figure(value), text);
        }
    }
}
