//! Scales pictures to windows: only as many pixels as the window has are tone mapped.
//!
//! A picture fits its window, or is enlarged from there: see [`Zoom`].

use crate::film::{Picture, ToneMap};

/// A rectangle of window pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// The first column.
    pub x: u32,
    /// The first row.
    pub y: u32,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The largest rectangle with a picture's proportions, centred in a window.
pub fn letterbox(picture: (u32, u32), window: (u32, u32)) -> Rect {
    let scaled = |length: u32, numerator: u32, denominator: u32| {
        let (product, denominator) =
            (u64::from(length) * u64::from(numerator), u64::from(denominator.max(1)));
        u32::try_from((product + denominator / 2) / denominator).unwrap_or(u32::MAX).max(1)
    };
    let wider = u64::from(picture.0) * u64::from(window.1) >= u64::from(window.0) * u64::from(picture.1);
    let (width, height) = if wider {
        (window.0, scaled(window.0, picture.1, picture.0).min(window.1))
    } else {
        (scaled(window.1, picture.0, picture.1).min(window.0), window.1)
    };
    Rect { x: (window.0 - width) / 2, y: (window.1 - height) / 2, width, height }
}

/// The enlargement of a picture relative to its window, and the visible part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Zoom {
    /// Steps of √2; zero fits the window.
    steps: u32,
    /// The centre of the window, as a fraction of the picture's width and height.
    centre: [f64; 2],
}

/// The rectangle of the whole picture in window pixels, which may exceed the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PictureRect {
    x: i64,
    y: i64,
    width: u64,
    height: u64,
}

/// The maximum size of a picture's pixel in window pixels.
const MOST_ENLARGED: f64 = 64.0;

impl Zoom {
    /// The scale from picture pixels to window pixels.
    pub fn scale(&self, picture: (u32, u32), window: (u32, u32)) -> f64 {
        self.place(picture, window).width as f64 / f64::from(picture.0.max(1))
    }

    /// Zooms in or out by some steps around a point of the window.
    pub fn at(&mut self, point: [f64; 2], steps: i32, picture: (u32, u32), window: (u32, u32)) {
        let before = self.place(picture, window);
        let fitted = f64::from(letterbox(picture, window).width) / f64::from(picture.0.max(1));
        let most = (2.0 * libm::log2(MOST_ENLARGED / fitted)).floor().clamp(0.0, 64.0) as u32;
        self.steps = self.steps.saturating_add_signed(steps).min(most);
        let after = self.place(picture, window);
        let under = [
            (point[0] - before.x as f64) / before.width as f64,
            (point[1] - before.y as f64) / before.height as f64,
        ];
        let middle = [f64::from(window.0) / 2.0, f64::from(window.1) / 2.0];
        self.centre = [
            under[0] + (middle[0] - point[0]) / after.width as f64,
            under[1] + (middle[1] - point[1]) / after.height as f64,
        ];
        self.settle(picture, window);
    }

    /// Moves the picture by some window pixels, up to its edges.
    pub fn pan(&mut self, by: [f64; 2], picture: (u32, u32), window: (u32, u32)) {
        let place = self.place(picture, window);
        self.centre[0] -= by[0] / place.width as f64;
        self.centre[1] -= by[1] / place.height as f64;
        self.settle(picture, window);
    }

    /// The picture's pixel under a point of the window.
    pub fn pixel_at(&self, point: [f64; 2], picture: (u32, u32), window: (u32, u32)) -> Option<(u32, u32)> {
        let place = self.place(picture, window);
        let along = |point: f64, from: i64, length: u64, pixels: u32| {
            let at = ((point.floor() - from as f64 + 0.5) / length as f64 * f64::from(pixels)).floor();
            (0.0..f64::from(pixels)).contains(&at).then_some(at as u32)
        };
        let x = along(point[0], place.x, place.width, picture.0)?;
        Some((x, along(point[1], place.y, place.height, picture.1)?))
    }

    /// Moves the centre such that the picture covers the window, if it is large enough.
    fn settle(&mut self, picture: (u32, u32), window: (u32, u32)) {
        let place = self.place(picture, window);
        let middle =
            |window: u32, at: i64, length: u64| (f64::from(window) / 2.0 - at as f64) / length as f64;
        self.centre = [middle(window.0, place.x, place.width), middle(window.1, place.y, place.height)];
    }

    fn place(&self, picture: (u32, u32), window: (u32, u32)) -> PictureRect {
        let fit = letterbox(picture, window);
        if self.steps == 0 {
            let (x, y) = (fit.x.into(), fit.y.into());
            return PictureRect { x, y, width: fit.width.into(), height: fit.height.into() };
        }
        let factor = libm::exp2(f64::from(self.steps) / 2.0);
        let along = |fit: u32, window: u32, centre: f64| {
            let length = (f64::from(fit) * factor).round() as u64;
            let window = i64::from(window);
            let most = window - length as i64;
            let at = (window as f64 / 2.0 - centre * length as f64).round() as i64;
            // No black border beside a picture larger than the window; a smaller one is centred.
            (if most >= 0 { most / 2 } else { at.clamp(most, 0) }, length)
        };
        let (x, width) = along(fit.width, window.0, self.centre[0]);
        let (y, height) = along(fit.height, window.1, self.centre[1]);
        PictureRect { x, y, width, height }
    }
}

/// The initial size of a window: that of the picture, reduced to at most `most` pixels, or enlarged by a whole
/// number if it is tiny.
pub fn first_size(picture: (u32, u32), most: (u32, u32)) -> (u32, u32) {
    const LEAST: u32 = 320;
    if picture.0 > most.0 || picture.1 > most.1 {
        let fitted = letterbox(picture, most);
        return (fitted.width, fitted.height);
    }
    let zoom = |least: u32| (least / picture.0.max(picture.1).max(1)).max(1);
    let zoom = zoom(LEAST.min(most.0).min(most.1));
    (picture.0.max(1) * zoom, picture.1.max(1) * zoom)
}

/// Draws the picture on black as 0x00RRGGBB; `window` is the size in pixels.
///
/// If the picture is reduced, each window pixel is the mean of two by two of its pixels, in
/// linear light; if it is enlarged, its pixels are drawn as squares, so that they can be inspected.
pub fn draw_picture(
    picture: &Picture,
    tone: &ToneMap,
    zoom: &Zoom,
    window: (u32, u32),
    buffer: &mut Vec<u32>,
) {
    let pixel = |x: usize, y: usize| picture.rgb[y * picture.width as usize + x];
    draw((picture.width, picture.height), zoom, window, buffer, |columns, rows| {
        let [a, b, c, d] = [
            pixel(columns.0, rows.0),
            pixel(columns.1, rows.0),
            pixel(columns.0, rows.1),
            pixel(columns.1, rows.1),
        ];
        tone.encode([0, 1, 2].map(|i| (a[i] + b[i] + c[i] + d[i]) * 0.25))
    });
}

/// Draws the colour of each pixel's owner, in the picture's rectangle. Colours are not interpolated: a mixture
/// would be the colour of another worker.
pub fn draw_owners(
    owners: &[u32],
    size: (u32, u32),
    palette: &[[u8; 3]],
    zoom: &Zoom,
    window: (u32, u32),
    buffer: &mut Vec<u32>,
) {
    draw(size, zoom, window, buffer, |columns, rows| {
        palette[owners[rows.0 * size.0 as usize + columns.0] as usize % palette.len()]
    });
}

/// The two columns, or rows, that a window pixel is the mean of; both are the same unless the picture is reduced.
type Taps = (usize, usize);

fn draw(
    picture: (u32, u32),
    zoom: &Zoom,
    window: (u32, u32),
    buffer: &mut Vec<u32>,
    colour: impl Fn(Taps, Taps) -> [u8; 3],
) {
    buffer.clear();
    buffer.resize(window.0 as usize * window.1 as usize, 0);
    if buffer.is_empty() || picture.0 == 0 || picture.1 == 0 {
        return;
    }
    let place = zoom.place(picture, window);
    let (left, columns) = taps(picture.0, place.x, place.width, window.0);
    let (above, rows) = taps(picture.1, place.y, place.height, window.1);
    let lines = buffer.chunks_exact_mut(window.0 as usize).skip(above);
    for (line, &row) in lines.zip(&rows) {
        for (out, &column) in line[left..].iter_mut().zip(&columns) {
            let [r, g, b] = colour(column, row).map(u32::from);
            *out = r << 16 | g << 8 | b;
        }
    }
}

/// The number of window pixels before the picture, and the taps of those that show it.
fn taps(from: u32, at: i64, to: u64, window: u32) -> (usize, Vec<Taps>) {
    // Integer arithmetic: a picture at its own size must be reproduced exactly.
    let tap = |quarters: u64| (quarters * u64::from(from) / (4 * to)) as usize;
    let (before, hidden) = (at.max(0) as u64, (-at).max(0) as u64);
    let seen = hidden..to.min(hidden + u64::from(window).saturating_sub(before));
    let smaller = u64::from(from) > to;
    let taps = seen
        .map(|i| if smaller { (tap(4 * i + 1), tap(4 * i + 3)) } else { (tap(4 * i + 2), tap(4 * i + 2)) })
        .collect();
    (before as usize, taps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::film::ViewTransform;

    /// A picture of greys that increase from black in steps of one 8-bit code.
    fn ramp(width: u32, height: u32) -> (Picture, Vec<u32>) {
        let codes: Vec<u32> = (0..width * height).map(|i| i % 256).collect();
        let grey = |&code: &u32| [crate::film::tone::srgb_to_linear(f64::from(code) / 255.0) as f32; 3];
        let rgb = codes.iter().map(grey).collect();
        (Picture { width, height, rgb }, codes.iter().map(|code| code * 0x01_01_01).collect())
    }

    fn drawn(picture: &Picture, window: (u32, u32)) -> Vec<u32> {
        // The previous contents of the buffer must be overwritten.
        let mut buffer = vec![0x00ff_00ff; 7];
        draw_zoomed(picture, &Zoom::default(), window, &mut buffer);
        buffer
    }

    fn draw_zoomed(picture: &Picture, zoom: &Zoom, window: (u32, u32), buffer: &mut Vec<u32>) {
        draw_picture(picture, &ToneMap::new(ViewTransform::default()), zoom, window, buffer);
    }

    #[test]
    fn zooming_keeps_the_point_under_the_pointer() {
        let (size, window) = ((64, 48), (100, 90));
        let (picture, codes) = ramp(64, 48);
        let mut zoom = Zoom::default();
        let point = [70.0, 30.0];
        let under = zoom.pixel_at(point, size, window).expect("a pixel");
        for _ in 0..6 {
            zoom.at(point, 1, size, window);
            // Down to window pixels, which are smaller than the picture's.
            let now = zoom.pixel_at(point, size, window).expect("a pixel");
            assert!(now.0.abs_diff(under.0) <= 1 && now.1.abs_diff(under.1) <= 1, "{now:?} for {under:?}");
            let mut buffer = Vec::new();
            draw_zoomed(&picture, &zoom, window, &mut buffer);
            assert_eq!(buffer[30 * 100 + 70], codes[(now.1 * 64 + now.0) as usize]);
            // Every window pixel shows the picture's pixel under it.
            for (i, &shown) in buffer.iter().enumerate().step_by(7) {
                let there = zoom.pixel_at([(i % 100) as f64, (i / 100) as f64], size, window);
                assert_eq!(shown, there.map_or(0, |(x, y)| codes[(y * 64 + x) as usize]));
            }
        }
        assert!((zoom.scale(size, window) / 12.5 - 1.0).abs() < 0.01);
        // Negative control: another point moves.
        let other = zoom.pixel_at([10.0, 80.0], size, window);
        zoom.at(point, -2, size, window);
        assert_ne!(zoom.pixel_at([10.0, 80.0], size, window), other);
        zoom.at(point, -100, size, window);
        assert_eq!(zoom.place(size, window), Zoom::default().place(size, window));
    }

    #[test]
    fn panning_and_zooming_are_limited() {
        let (size, window) = ((64, 48), (64, 48));
        let mut zoom = Zoom::default();
        zoom.pan([10.0, 10.0], size, window);
        assert_eq!(zoom.place(size, window), PictureRect { x: 0, y: 0, width: 64, height: 48 });
        zoom.at([0.0, 0.0], 2, size, window);
        assert_eq!(zoom.place(size, window), PictureRect { x: 0, y: 0, width: 128, height: 96 });
        zoom.pan([-10.0, -7.0], size, window);
        assert_eq!(zoom.place(size, window), PictureRect { x: -10, y: -7, width: 128, height: 96 });
        zoom.pan([-1000.0, -1000.0], size, window);
        assert_eq!(zoom.place(size, window), PictureRect { x: -64, y: -48, width: 128, height: 96 });
        // Movement beyond the edge is not accumulated.
        zoom.pan([1.0, 1.0], size, window);
        assert_eq!(zoom.place(size, window), PictureRect { x: -63, y: -47, width: 128, height: 96 });
        zoom.at([32.0, 24.0], 1000, size, window);
        assert_eq!(zoom.scale(size, window), 64.0);
        assert!(zoom.pixel_at([-1.0, 500.0], size, window).is_some());
        assert_eq!(Zoom::default().pixel_at([64.0, 0.0], size, window), None);
        assert_eq!(Zoom::default().pixel_at([0.0, -1.0], size, window), None);
    }

    #[test]
    fn letterboxes_are_centred_and_keep_proportions() {
        for (picture, window, expected) in [
            ((640, 480), (640, 480), (0, 0, 640, 480)),
            ((640, 480), (1000, 480), (180, 0, 640, 480)),
            ((640, 480), (640, 1000), (0, 260, 640, 480)),
            ((8192, 8192), (300, 200), (50, 0, 200, 200)),
            ((1, 1), (3, 2), (0, 0, 2, 2)),
            ((10_000, 1), (100, 100), (0, 49, 100, 1)),
            ((1, 10_000), (100, 100), (49, 0, 1, 100)),
            ((u32::MAX, 2), (4000, 4000), (0, 1999, 4000, 1)),
        ] {
            let (x, y, width, height) = expected;
            assert_eq!(letterbox(picture, window), Rect { x, y, width, height }, "{picture:?} in {window:?}");
        }
    }

    #[test]
    fn initial_sizes_fit_the_screen_and_are_visible() {
        for (picture, expected) in [
            ((640, 480), (640, 480)),
            ((1280, 800), (1280, 800)),
            ((8192, 8192), (800, 800)),
            ((1920, 1080), (1280, 720)),
            ((16, 16), (320, 320)),
            ((160, 120), (320, 240)),
            ((200, 120), (200, 120)),
            ((1, 1), (320, 320)),
            ((100_000, 1), (1280, 1)),
        ] {
            assert_eq!(first_size(picture, (1280, 800)), expected, "{picture:?}");
        }
        assert_eq!(first_size((16, 16), (100, 64)), (64, 64));
        assert_eq!(first_size((640, 480), (100, 64)), (85, 64));
    }

    #[test]
    fn a_picture_at_its_own_size_is_reproduced_exactly() {
        for (width, height) in [(1, 1), (3, 2), (17, 5), (640, 3)] {
            let (picture, expected) = ramp(width, height);
            assert_eq!(drawn(&picture, (width, height)), expected);
            let mut other = expected.clone();
            other[0] ^= 1;
            assert_ne!(drawn(&picture, (width, height)), other);
        }
    }

    #[test]
    fn a_small_picture_becomes_squares_on_black() {
        let (picture, codes) = ramp(2, 1);
        let (black, white) = (codes[0], codes[1]);
        assert_eq!(
            drawn(&picture, (4, 4)),
            [[0; 4], [black, black, white, white], [black, black, white, white], [0; 4]].as_flattened()
        );
    }

    #[test]
    fn a_large_picture_is_averaged_in_linear_light() {
        let light = |x: usize, y: usize| if (x + y).is_multiple_of(2) { 1.0 } else { 0.0 };
        let rgb = (0..64).map(|i| [light(i % 8, i / 8); 3]).collect();
        let picture = Picture { width: 8, height: 8, rgb };
        // Half the linear value of white is 188 in sRGB; the mean of the codes would be 128.
        assert_eq!(drawn(&picture, (4, 4)), [0x00bc_bcbc; 16]);
    }

    #[test]
    fn channels_are_in_order() {
        let picture = Picture { width: 1, height: 1, rgb: vec![[1.0, 0.0, 0.5]] };
        assert_eq!(drawn(&picture, (1, 1)), [0x00ff_00bc]);
    }

    #[test]
    fn owner_colours_are_not_interpolated() {
        let palette = [[255, 0, 0], [0, 255, 0]];
        let owners: Vec<u32> = (0..64).map(|i| i % 2).collect();
        let mut buffer = Vec::new();
        draw_owners(&owners, (8, 8), &palette, &Zoom::default(), (3, 5), &mut buffer);
        assert_eq!(buffer.len(), 15);
        assert!(buffer[..3].iter().all(|&pixel| pixel == 0), "the letterbox is black");
        assert!(buffer[3..12].iter().all(|pixel| [0x00ff_0000, 0x0000_ff00].contains(pixel)));
    }

    #[test]
    fn empty_pictures_and_windows_are_accepted() {
        let empty = Picture { width: 0, height: 0, rgb: Vec::new() };
        assert_eq!(drawn(&empty, (2, 2)), [0; 4]);
        assert!(drawn(&ramp(3, 2).0, (0, 5)).is_empty());
    }

    #[test]
    fn the_cost_of_a_huge_picture_depends_on_the_window() {
        let looked_at = std::cell::Cell::new(0u32);
        let mut buffer = Vec::new();
        draw((8192, 8192), &Zoom::default(), (100, 50), &mut buffer, |_, _| {
            looked_at.set(looked_at.get() + 1);
            [0; 3]
        });
        assert_eq!(looked_at.get(), 50 * 50);
    }
}
