//! Numbers for users: rates, durations, exposures.

/// "7.9 Msamples/s": a rate in samples per second, with at most three digits.
pub fn samples_per_second(rate: f64) -> String {
    let (value, prefix) = [(1e9, "G"), (1e6, "M"), (1e3, "k")]
        .into_iter()
        // A value that would round to 1000 of one unit is 1 of the next.
        .find(|&(unit, _)| rate >= unit * 0.9995)
        .map_or((rate, ""), |(unit, prefix)| (rate / unit, prefix));
    format!("{} {prefix}samples/s", short(value))
}

/// "7.2 s", "41 s", "1 min 12 s", "2 h 05 min", "3 d 4 h".
pub fn duration(seconds: f64) -> String {
    if seconds < 9.95 {
        return format!("{} s", tenths(seconds.max(0.0)));
    }
    let whole = seconds.round() as u64;
    let (minutes, hours) = (whole / 60, whole / 3600);
    match whole {
        0..60 => format!("{whole} s"),
        60..3600 => format!("{minutes} min {:02} s", whole % 60),
        3600..86_400 => format!("{hours} h {:02} min", minutes % 60),
        _ => format!("{} d {} h", hours / 24, hours % 24),
    }
}

/// "+1.5 EV": an exposure in stops.
pub fn exposure(stops: f64) -> String {
    let sign = if stops < 0.0 { "−" } else { "+" };
    format!("{sign}{} EV", hundredths(stops.abs()))
}

/// "0.2500", "12.50", "3.142e-9": a number with this many significant digits.
pub fn significant(value: f64, digits: usize) -> String {
    let after = digits.saturating_sub(1);
    let scientific = format!("{value:.after$e}");
    let exponent = scientific.split_once('e').and_then(|(_, exponent)| exponent.parse::<i32>().ok());
    match exponent {
        // NaN, an infinity, or zero.
        None => format!("{value}"),
        Some(_) if value == 0.0 => "0".to_owned(),
        Some(exponent @ -4..=5) => {
            let decimals = (after as i32 - exponent).max(0) as usize;
            format!("{value:.decimals$}")
        }
        Some(_) => scientific,
    }
}

/// "128", or "3.4" below 10: samples per pixel. Never rounded up: 500 appears only when it is reached.
pub fn samples_per_pixel(spp: f64) -> String {
    if spp < 10.0 { tenths((spp * 10.0).floor() / 10.0) } else { format!("{}", spp.floor()) }
}

/// At most three digits, if possible.
fn short(value: f64) -> String {
    if value < 9.95 { tenths(value) } else { format!("{value:.0}") }
}

/// One decimal, or none if it is 0.
fn tenths(value: f64) -> String {
    trimmed(format!("{value:.1}"))
}

fn hundredths(value: f64) -> String {
    trimmed(format!("{value:.2}"))
}

fn trimmed(text: String) -> String {
    text.trim_end_matches('0').trim_end_matches('.').to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates() {
        for (rate, said) in [
            (0.0, "0 samples/s"),
            (0.25, "0.2 samples/s"),
            (950.0, "950 samples/s"),
            (999.4, "999 samples/s"),
            (999.6, "1 ksamples/s"),
            (7_900_000.0, "7.9 Msamples/s"),
            (12_345_678.0, "12 Msamples/s"),
            (123_456_789.0, "123 Msamples/s"),
            (2.5e9, "2.5 Gsamples/s"),
        ] {
            assert_eq!(samples_per_second(rate), said);
        }
    }

    #[test]
    fn durations() {
        for (seconds, said) in [
            (0.0, "0 s"),
            (0.04, "0 s"),
            (7.25, "7.2 s"),
            (9.96, "10 s"),
            (41.2, "41 s"),
            (59.7, "1 min 00 s"),
            (72.0, "1 min 12 s"),
            (3599.6, "1 h 00 min"),
            (7500.0, "2 h 05 min"),
            (273_600.0, "3 d 4 h"),
        ] {
            assert_eq!(duration(seconds), said);
        }
    }

    #[test]
    fn significant_digits() {
        for (value, digits, said) in [
            (0.25, 4, "0.2500"),
            (12.5, 4, "12.50"),
            (0.099_999_999, 2, "0.10"),
            (99_999.9, 3, "100000"),
            (1.5e7, 2, "1.5e7"),
            (-3.141_59e-9, 4, "-3.142e-9"),
            (0.0, 3, "0"),
            (f64::INFINITY, 3, "inf"),
            (f64::NAN, 3, "NaN"),
        ] {
            assert_eq!(significant(value, digits), said);
        }
    }

    #[test]
    fn exposures() {
        for (stops, said) in
            [(0.0, "+0 EV"), (1.5, "+1.5 EV"), (-0.5, "−0.5 EV"), (10.0, "+10 EV"), (0.25, "+0.25 EV")]
        {
            assert_eq!(exposure(stops), said);
        }
    }

    #[test]
    fn samples_are_never_rounded_up() {
        for (spp, said) in [
            (0.0, "0"),
            (0.99, "0.9"),
            (1.0, "1"),
            (9.99, "9.9"),
            (10.0, "10"),
            (499.999, "499"),
            (500.0, "500"),
        ] {
            assert_eq!(samples_per_pixel(spp), said);
        }
    }
}
