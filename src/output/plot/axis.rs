//! Axes: the positions of values on the page, and their tick marks.

/// A quantity along one side of a chart.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Its name and unit.
    pub label: String,
    /// The spacing of its values.
    pub scale: Scale,
}

/// The spacing of values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear, from zero on.
    Linear,
    /// Linear, from zero on, with ticks at whole numbers.
    Whole,
    /// Logarithmic, with ticks at powers of two.
    Binary,
    /// Logarithmic, with ticks at 1, 2, 5 and powers of ten.
    Decimal,
}

impl Scale {
    /// Whether the axis can show a value.
    pub(super) fn shows(self, value: f64) -> bool {
        value.is_finite() && (!self.is_logarithmic() || value > 0.0)
    }

    fn apply(self, value: f64) -> f64 {
        if self.is_logarithmic() { value.log2() } else { value }
    }

    fn is_logarithmic(self) -> bool {
        matches!(self, Scale::Binary | Scale::Decimal)
    }

    /// The interval of about [`MARKS`] ticks from one value to the other.
    fn step(self, from: f64, to: f64) -> f64 {
        let step = nice_step(from, to);
        if self == Scale::Whole { step.max(1.0) } else { step }
    }
}

/// The approximate number of ticks on an axis.
const MARKS: f64 = 6.0;
/// The fraction of a logarithmic axis that is kept free at each end.
const MARGIN: f64 = 0.05;

/// An axis with its range: a mapping from values to pixels.
#[derive(Clone, Debug)]
pub(super) struct Span {
    scale: Scale,
    from: f64,
    to: f64,
    pixels: [f64; 2],
}

impl Span {
    /// An axis that shows all `values` between two positions on the page.
    pub(super) fn new(scale: Scale, values: impl Iterator<Item = f64>, pixels: [f64; 2]) -> Span {
        let (low, high) = values
            .filter(|&value| scale.shows(value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
        let (from, to) = match scale {
            // Without values the axis is empty.
            _ if low > high => (1.0, 2.0),
            Scale::Linear | Scale::Whole => {
                let (low, high) = (low.min(0.0), high.max(0.0));
                let step = scale.step(low, if high > low { high } else { low + 1.0 });
                ((low / step).floor() * step, ((high / step).ceil().max((low / step).floor() + 1.0)) * step)
            }
            Scale::Binary | Scale::Decimal => {
                let margin = if high > low { (high / low).powf(MARGIN) } else { 2.0 };
                (low / margin, high * margin)
            }
        };
        Span { scale, from, to, pixels }
    }

    /// The position of a value, in pixels.
    pub(super) fn place(&self, value: f64) -> f64 {
        let [from, to, value] = [self.from, self.to, value].map(|value| self.scale.apply(value));
        let [start, end] = self.pixels;
        start + (end - start) * (value - from) / (to - from)
    }

    /// The values with a number beside the axis.
    pub(super) fn ticks(&self) -> Vec<f64> {
        let marks = match self.scale {
            Scale::Linear | Scale::Whole => Vec::new(),
            Scale::Binary => self.powers(2.0, &[1.0], 12.0),
            Scale::Decimal if self.decades() < 2.5 => self.powers(10.0, &[1.0, 2.0, 5.0], MARKS),
            Scale::Decimal => self.powers(10.0, &[1.0], 8.0),
        };
        // A logarithmic axis with a small range contains few powers.
        if marks.len() >= 3 { marks } else { self.even_ticks() }
    }

    /// Values with a line but without a number.
    pub(super) fn minor_ticks(&self) -> Vec<f64> {
        let all: Vec<f64> = (1..10).map(f64::from).collect();
        let wanted = self.scale == Scale::Decimal && self.decades() < 6.0;
        if wanted { self.powers(10.0, &all, f64::INFINITY) } else { Vec::new() }
    }

    fn decades(&self) -> f64 {
        (self.to / self.from).log10()
    }

    fn even_ticks(&self) -> Vec<f64> {
        let step = self.scale.step(self.from, self.to);
        let (first, last) = ((self.from / step).ceil() as i64, (self.to / step + 1e-9).floor() as i64);
        (first..=last).map(|n| n as f64 * step).collect()
    }

    /// Multiples of powers on the axis. If there would be more than `most` powers, only every second, third … is used.
    fn powers(&self, base: f64, multiples: &[f64], most: f64) -> Vec<f64> {
        let exponent = |value: f64| value.ln() / base.ln();
        let (first, last) = (exponent(self.from).floor(), exponent(self.to).ceil());
        let stride = ((last - first) / most).ceil().max(1.0) as i64;
        (first as i64..=last as i64)
            .filter(|power| power % stride == 0)
            .flat_map(|power| multiples.iter().map(move |multiple| multiple * base.powi(power as i32)))
            .filter(|value| (self.from..=self.to).contains(value))
            .collect()
    }
}

/// 1, 2 or 5 times a power of ten, so that about [`MARKS`] steps span from one value to the other.
fn nice_step(from: f64, to: f64) -> f64 {
    let rough = (to - from) / MARKS;
    let power = 10f64.powf(rough.log10().floor());
    let multiple = [1.0, 2.0, 5.0].into_iter().find(|multiple| multiple * power >= rough * 0.999);
    multiple.unwrap_or(10.0) * power
}

/// A number in decimal notation if that is short, as a power of ten otherwise.
pub(super) fn number(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        // Twelve digits hide the errors of binary fractions.
        let digits = (11 - size.max(1e-3).log10().floor() as i64).max(0) as usize;
        let text = format!("{value:.digits$}");
        let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
        return text.replace('-', "−");
    }
    let text = format!("{value:e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let raised: String = exponent.chars().map(superscript).collect();
    let ten = format!("10{raised}");
    if digits == "1" { ten } else { format!("{}·{ten}", digits.replace('-', "−")) }
}

fn superscript(c: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    c.to_digit(10).map_or('⁻', |digit| DIGITS[digit as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn span(scale: Scale, values: &[f64]) -> Span {
        Span::new(scale, values.iter().copied(), [0.0, 100.0])
    }

    #[test]
    fn a_linear_axis_begins_at_zero_and_ends_at_a_round_value() {
        let threads = span(Scale::Linear, &[1.0, 2.0, 4.0, 8.0]);
        assert_eq!(threads.ticks(), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!((threads.place(0.0), threads.place(8.0)), (0.0, 100.0));
        assert_eq!(span(Scale::Linear, &[2.0]).ticks(), [0.0, 0.5, 1.0, 1.5, 2.0]);
        assert_eq!(span(Scale::Whole, &[2.0]).ticks(), [0.0, 1.0, 2.0]);
        assert_eq!(span(Scale::Linear, &[0.31]).ticks().len(), 5);
        assert!(span(Scale::Linear, &[0.31]).place(0.31) <= 100.0);
    }

    #[test]
    fn equal_ratios_are_equally_far_apart_on_a_logarithmic_axis() {
        for scale in [Scale::Binary, Scale::Decimal] {
            let span = span(scale, &[1.0, 64.0]);
            let step = span.place(2.0) - span.place(1.0);
            assert!((span.place(64.0) - span.place(32.0) - step).abs() < 1e-9);
            assert!(span.place(1.0) > 0.0 && span.place(64.0) < 100.0);
        }
    }

    #[test]
    fn marks_are_round_and_on_the_axis() {
        assert_eq!(span(Scale::Binary, &[1.0, 32.0]).ticks(), [1.0, 2.0, 4.0, 8.0, 16.0, 32.0]);
        assert_eq!(
            span(Scale::Binary, &[1.0, 65_536.0]).ticks(),
            [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0, 4096.0, 16_384.0, 65_536.0]
        );
        let decimal = span(Scale::Decimal, &[0.012, 0.3]).ticks();
        assert_eq!(decimal.iter().map(|&v| number(v)).collect::<Vec<_>>(), ["0.02", "0.05", "0.1", "0.2"]);
        let narrow = span(Scale::Decimal, &[0.11, 0.14]);
        assert!(narrow.ticks().len() >= 3, "{:?}", narrow.ticks());
    }

    #[test]
    fn an_axis_for_one_value_or_none_has_a_range() {
        for scale in [Scale::Linear, Scale::Whole, Scale::Binary, Scale::Decimal] {
            for values in [&[][..], &[3.0], &[f64::NAN, f64::INFINITY], &[0.0]] {
                let span = span(scale, values);
                assert!(span.from < span.to && span.from.is_finite() && span.to.is_finite(), "{span:?}");
                assert!(!span.ticks().is_empty(), "{span:?}");
            }
        }
    }

    #[test]
    fn numbers_are_readable() {
        for (value, text) in [
            (0.0, "0"),
            (8.0, "8"),
            (0.1 + 0.2, "0.3"),
            (-1.5, "−1.5"),
            (50_000.0, "50000"),
            (1e5, "10⁵"),
            (0.001, "0.001"),
            (2e-4, "2·10⁻⁴"),
            (1e-12, "10⁻¹²"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
