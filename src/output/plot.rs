//! Line charts as SVG, for benchmarks.
//!
//! Written by hand, because charting crates measure text with the system's fonts, so that
//! every machine would draw a different chart. Here the viewer chooses the font, and the layout fits any.

use std::fmt::Write;

mod axis;

pub use axis::{Axis, Scale};
use axis::{Span, number};

/// A chart of a few series of measurements against one quantity.
#[derive(Clone, Debug)]
pub struct Chart {
    /// A short title.
    pub title: String,
    /// The conditions of the measurement, in one line or several.
    pub subtitle: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The lines, in the order of the legend.
    pub series: Vec<Series>,
}

/// A line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// Its text in the legend.
    pub label: String,
    /// Its points, in the order in which they are joined.
    pub points: Vec<Point>,
    /// Its style.
    pub style: Style,
}

/// The style of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Measurements: a coloured line with a dot at each point, and notes above the points.
    Measured,
    /// Measurements with notes below the points.
    MeasuredNotesBelow,
    /// A reference: a dashed grey line, clipped at the chart's border.
    Guide,
}

/// A measurement.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Point {
    /// Horizontal position.
    pub x: f64,
    /// Vertical position.
    pub y: f64,
    /// The minimum and the maximum measured y, drawn as a whisker.
    pub range: Option<[f64; 2]>,
    /// A short text beside it, which is omitted if it does not fit.
    pub note: String,
}

impl Point {
    /// A point without whisker and note.
    pub fn at(x: f64, y: f64) -> Point {
        Point { x, y, ..Point::default() }
    }

    /// The range of y that it covers: that of its whisker, or its own.
    fn reach(&self) -> [f64; 2] {
        self.range.unwrap_or([self.y, self.y])
    }
}

const WIDTH: f64 = 840.0;
const HEIGHT: f64 = 540.0;
const LEFT: f64 = 88.0;
const RIGHT: f64 = WIDTH - 40.0;
const BOTTOM: f64 = HEIGHT - 72.0;
/// Baseline of the subtitle's first line.
const SUBTITLE: f64 = 66.0;
const SUBTITLE_LINE: f64 = 19.0;
/// Distance of the legend's first baseline from the subtitle's last one.
const LEGEND: f64 = 32.0;
const LEGEND_LINE: f64 = 22.0;
/// The width of a letter in the legend, with a margin: texts must not overlap in any font.
const LETTER: f64 = 7.6;
/// The width of the line before a legend's text, with the gaps around it.
const SWATCH: f64 = 34.0;
/// The minimum distance of notes; closer ones would overlap.
const NOTE_WIDTH: f64 = 46.0;

const INK: &str = "#1f2933";
const MUTED: &str = "#52606d";
const GRID: &str = "#e4e7eb";
const FAINT: &str = "#f1f3f5";
const GUIDE: &str = "#8a949e";
/// Colours that are distinguishable with red-green colour blindness (Okabe and Ito 2008).
const COLOURS: [&str; 4] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7"];

impl Chart {
    /// The chart as an SVG document.
    ///
    /// Points that are not finite, or not above zero on a logarithmic axis, are left out.
    pub fn svg(&self) -> String {
        let (legend, top) = self.legend();
        let measured = || self.series.iter().filter(|series| series.style != Style::Guide);
        let points = || measured().flat_map(|series| &series.points).filter(|point| self.shows(point));
        let ys = points().flat_map(|point| point.reach());
        let x = Span::new(self.x.scale, points().map(|point| point.x), [LEFT, RIGHT - NOTE_WIDTH / 2.0]);
        let y = Span::new(self.y.scale, ys, [BOTTOM, top]);

        let mut svg = head(&self.title, &self.subtitle, top);
        self.draw_axes(&mut svg, &x, &y, top);
        svg += &legend;
        let shown = |series: &'_ Series| -> Vec<Point> {
            series.points.iter().filter(|point| self.shows(point)).cloned().collect()
        };
        // References are drawn first: they must not cover measurements.
        for guide in self.series.iter().filter(|series| series.style == Style::Guide) {
            draw_guide(&mut svg, &shown(guide), &x, &y);
        }
        for (series, colour) in measured().zip(COLOURS.iter().cycle()) {
            let notes_below = series.style == Style::MeasuredNotesBelow;
            draw_measured(&mut svg, &shown(series), &x, &y, colour, notes_below);
        }
        svg += "</svg>\n";
        svg
    }

    fn shows(&self, point: &Point) -> bool {
        self.x.scale.shows(point.x) && self.y.scale.shows(point.y)
    }

    /// The legend, and the top of the chart's own area below it.
    fn legend(&self) -> (String, f64) {
        let mut svg = String::new();
        let lines = self.subtitle.lines().count().max(1);
        let (mut x, mut y) = (LEFT, SUBTITLE + SUBTITLE_LINE * (lines - 1) as f64 + LEGEND);
        let mut colours = COLOURS.iter().cycle();
        for series in &self.series {
            let width = SWATCH + series.label.chars().count() as f64 * LETTER;
            if x > LEFT && x + width > RIGHT {
                (x, y) = (LEFT, y + LEGEND_LINE);
            }
            let (line, from, to) = (y - 4.5, x, x + 24.0);
            let _ = match series.style {
                Style::Guide => writeln!(svg, r#"<path class="guide" d="M{from} {line}H{to}"/>"#),
                _ => {
                    let colour = colours.next().unwrap_or(&INK);
                    let middle = x + 12.0;
                    writeln!(
                        svg,
                        r#"<path class="line" stroke="{colour}" d="M{from} {line}H{to}"/><circle cx="{middle}" cy="{line}" r="4" fill="{colour}"/>"#
                    )
                }
            };
            let _ = writeln!(
                svg,
                r#"<text class="legend" x="{}" y="{y}">{}</text>"#,
                x + SWATCH,
                escaped(&series.label)
            );
            x += width + 24.0;
        }
        (svg, y + 26.0)
    }

    fn draw_axes(&self, svg: &mut String, x: &Span, y: &Span, top: f64) {
        for at in x.minor_ticks().into_iter().map(|value| x.place(value)) {
            let _ = writeln!(svg, r#"<path stroke="{FAINT}" d="M{at:.1} {top:.1}V{BOTTOM}"/>"#);
        }
        for at in y.minor_ticks().into_iter().map(|value| y.place(value)) {
            let _ = writeln!(svg, r#"<path stroke="{FAINT}" d="M{LEFT} {at:.1}H{RIGHT}"/>"#);
        }
        for value in x.ticks() {
            let at = x.place(value);
            let _ = writeln!(svg, r#"<path stroke="{GRID}" d="M{at:.1} {top:.1}V{BOTTOM}"/>"#);
            let text = number(value);
            let _ = writeln!(
                svg,
                r#"<text class="tick" text-anchor="middle" x="{at:.1}" y="{}">{text}</text>"#,
                BOTTOM + 22.0
            );
        }
        for value in y.ticks() {
            let at = y.place(value);
            let _ = writeln!(svg, r#"<path stroke="{GRID}" d="M{LEFT} {at:.1}H{RIGHT}"/>"#);
            let text = number(value);
            let _ = writeln!(
                svg,
                r#"<text class="tick" text-anchor="end" x="{}" y="{:.1}">{text}</text>"#,
                LEFT - 10.0,
                at + 4.5
            );
        }
        let _ =
            writeln!(svg, r#"<path stroke="{MUTED}" fill="none" d="M{LEFT} {top:.1}V{BOTTOM}H{RIGHT}"/>"#);
        let (across, down) = ((LEFT + RIGHT) / 2.0, (top + BOTTOM) / 2.0);
        let _ = writeln!(
            svg,
            r#"<text class="label" text-anchor="middle" x="{across}" y="{}">{}</text>"#,
            BOTTOM + 50.0,
            escaped(&self.x.label)
        );
        let _ = writeln!(
            svg,
            r#"<text class="label" text-anchor="middle" transform="translate(26 {down:.1}) rotate(-90)">{}</text>"#,
            escaped(&self.y.label)
        );
    }
}

/// The start of the document: text for screen readers, styles, title.
fn head(title: &str, subtitle: &str, top: f64) -> String {
    let (title, description) = (escaped(title), escaped(&subtitle.replace('\n', " · ")));
    let (width, height) = (RIGHT - LEFT, BOTTOM - top);
    let mut head = format!(
        r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" role="img">
<title>{title}</title>
<desc>{description}</desc>
<style>
text {{ font-family: Inter, "Segoe UI", "Helvetica Neue", Helvetica, Arial, "Liberation Sans", sans-serif; fill: {MUTED} }}
.title {{ font-size: 21px; font-weight: 600; fill: {INK} }}
.subtitle {{ font-size: 13.5px }}
.legend {{ font-size: 13.5px; fill: {INK} }}
.tick {{ font-size: 13px }}
.label {{ font-size: 14px; fill: {INK} }}
.note {{ font-size: 12.5px; fill: {INK}; stroke: #fff; stroke-width: 4px; stroke-linejoin: round; paint-order: stroke }}
.line {{ fill: none; stroke-width: 2.5; stroke-linejoin: round; stroke-linecap: round }}
.guide {{ fill: none; stroke: {GUIDE}; stroke-width: 1.75; stroke-dasharray: 6 5 }}
</style>
<clipPath id="area"><rect x="{LEFT}" y="{top:.1}" width="{width}" height="{height:.1}"/></clipPath>
<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>
<text class="title" x="{LEFT}" y="42">{title}</text>
"##
    );
    for (i, line) in subtitle.lines().enumerate() {
        let y = SUBTITLE + SUBTITLE_LINE * i as f64;
        let _ = writeln!(head, r#"<text class="subtitle" x="{LEFT}" y="{y}">{}</text>"#, escaped(line));
    }
    head
}

fn path(points: &[Point], x: &Span, y: &Span) -> String {
    let place = |point: &Point| format!("{:.1} {:.1}", x.place(point.x), y.place(point.y));
    let places: Vec<String> = points.iter().map(place).collect();
    if places.is_empty() { String::new() } else { format!("M{}", places.join("L")) }
}

fn draw_guide(svg: &mut String, points: &[Point], x: &Span, y: &Span) {
    let _ = writeln!(svg, r#"<path class="guide" clip-path="url(#area)" d="{}"/>"#, path(points, x, y));
}

fn draw_measured(svg: &mut String, points: &[Point], x: &Span, y: &Span, colour: &str, notes_below: bool) {
    let _ = writeln!(svg, r#"<path class="line" stroke="{colour}" d="{}"/>"#, path(points, x, y));
    for point in points {
        let (at, height) = (x.place(point.x), y.place(point.y));
        if let Some([low, high]) = point.range.map(|range| range.map(|value| y.place(value))) {
            let (left, right) = (at - 5.0, at + 5.0);
            let _ = writeln!(
                svg,
                r#"<path stroke="{colour}" stroke-width="1.25" fill="none" d="M{left:.1} {low:.1}H{right:.1}M{at:.1} {low:.1}V{high:.1}M{left:.1} {high:.1}H{right:.1}"/>"#
            );
        }
        // Shown when the pointer is over the dot.
        let (told_x, told_y) = (number(point.x), number(rounded(point.y)));
        let _ = writeln!(
            svg,
            r##"<circle cx="{at:.1}" cy="{height:.1}" r="4.5" fill="{colour}" stroke="#fff" stroke-width="1.5"><title>{told_x}: {told_y}</title></circle>"##
        );
    }
    let fits = points.windows(2).all(|pair| (x.place(pair[0].x) - x.place(pair[1].x)).abs() >= NOTE_WIDTH);
    for point in points.iter().filter(|point| fits && !point.note.is_empty()) {
        // Outside the whisker.
        let range = point.reach().map(|value| y.place(value));
        let height = if notes_below { range[0].max(range[1]) + 23.0 } else { range[0].min(range[1]) - 13.0 };
        let _ = writeln!(
            svg,
            r#"<text class="note" text-anchor="middle" x="{:.1}" y="{height:.1}">{}</text>"#,
            x.place(point.x),
            escaped(&point.note)
        );
    }
}

/// Rounds to four digits, which exceeds the precision of measurements.
fn rounded(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// Escapes text for XML.
fn escaped(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            // Control characters, which file names may contain, are forbidden in XML 1.0 in any form.
            c if c.is_control() || matches!(c, '\u{fffe}' | '\u{ffff}') => out.push('\u{fffd}'),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(scale: Scale, points: Vec<Point>) -> Chart {
        let axis = |label: &str| Axis { label: label.into(), scale };
        let guide = Series { label: "guide".into(), points: points.clone(), style: Style::Guide };
        let series = Series { label: "measured".into(), points, style: Style::Measured };
        Chart {
            title: "t".into(),
            subtitle: "s".into(),
            x: axis("x"),
            y: axis("y"),
            series: vec![series, guide],
        }
    }

    fn dots(svg: &str) -> usize {
        svg.matches("<circle").count() - 1
    }

    #[test]
    fn every_point_on_the_axes_gets_a_dot() {
        let points =
            vec![Point::at(1.0, 2.0), Point::at(2.0, f64::NAN), Point::at(0.0, 1.0), Point::at(3.0, 4.0)];
        for (scale, expected) in [(Scale::Linear, 3), (Scale::Binary, 2), (Scale::Decimal, 2)] {
            let svg = chart(scale, points.clone()).svg();
            assert_eq!(dots(&svg), expected);
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
        assert_eq!(dots(&chart(Scale::Linear, vec![]).svg()), 0);
    }

    #[test]
    fn text_is_escaped() {
        let mut odd = chart(Scale::Linear, vec![Point { note: "<&>".into(), ..Point::at(1.0, 1.0) }]);
        odd.title = "a<b> & \"c\" \u{7}".into();
        let svg = odd.svg();
        assert!(svg.contains("a&lt;b&gt; &amp; &quot;c&quot; \u{fffd}"));
        assert!(svg.contains("&lt;&amp;&gt;"));
    }

    #[test]
    fn a_long_legend_continues_on_the_next_line() {
        let mut wide = chart(Scale::Linear, vec![Point::at(1.0, 1.0)]);
        let short = wide.legend().1;
        wide.series.iter_mut().for_each(|series| series.label = "long ".repeat(12));
        assert!(wide.legend().1 > short);
    }

    #[test]
    fn a_second_line_of_the_subtitle_moves_the_legend_down() {
        let mut two = chart(Scale::Linear, vec![Point::at(1.0, 1.0)]);
        let one = two.legend().1;
        two.subtitle = "s\nreference <r>".into();
        assert_eq!(two.legend().1, one + SUBTITLE_LINE);
        let svg = two.svg();
        assert!(svg.contains("<desc>s · reference &lt;r&gt;</desc>"), "{svg}");
        assert!(svg.contains("y=\"66\">s</text>") && svg.contains("y=\"85\">reference &lt;r&gt;</text>"));
    }

    #[test]
    fn overlapping_notes_are_omitted() {
        let noted = |x| Point { note: "note".into(), ..Point::at(x, 1.0) };
        let notes = |points| chart(Scale::Linear, points).svg().matches(r#"class="note""#).count();
        assert_eq!(notes((0..4).map(|i| noted(f64::from(i))).collect()), 4);
        assert_eq!(notes((0..40).map(|i| noted(f64::from(i))).collect()), 0);
    }
}
