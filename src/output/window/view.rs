//! Pictures scaled into windows: only as many pixels as the window has are ever looked at or tone mapped.

use crate::film::{Picture, ToneMap};

/// A rectangle of window pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    /// Columns left of it.
    pub x: u32,
    /// Rows above it.
    pub y: u32,
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

/// The largest rectangle of a picture's proportions in the middle of a window.
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

/// A window's size to begin with: the picture's, made smaller to fit into `most` pixels, or larger by a whole
/// number to be seen at all.
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

/// Draws the picture, letterboxed on black, as 0x00RRGGBB; `window` is the size in pixels.
///
/// Where the picture is larger than its place, each window pixel is the mean of two by two of its pixels, in
/// linear light; where it is smaller, its pixels are shown as squares, since they are what one wants to see.
pub fn draw_picture(picture: &Picture, tone: &ToneMap, window: (u32, u32), buffer: &mut Vec<u32>) {
    let pixel = |x: usize, y: usize| picture.rgb[y * picture.width as usize + x];
    draw((picture.width, picture.height), window, buffer, |columns, rows| {
        let [a, b, c, d] = [
            pixel(columns.0, rows.0),
            pixel(columns.1, rows.0),
            pixel(columns.0, rows.1),
            pixel(columns.1, rows.1),
        ];
        tone.encode([0, 1, 2].map(|i| (a[i] + b[i] + c[i] + d[i]) * 0.25))
    });
}

/// Draws the colour of each pixel's owner, letterboxed like the picture. Colours are never mixed: a mixture
/// would be another worker's.
pub fn draw_owners(
    owners: &[u32],
    size: (u32, u32),
    palette: &[[u8; 3]],
    window: (u32, u32),
    buffer: &mut Vec<u32>,
) {
    draw(size, window, buffer, |columns, rows| {
        palette[owners[rows.0 * size.0 as usize + columns.0] as usize % palette.len()]
    });
}

/// The two columns, or rows, that a window pixel is made of; the same one twice unless the picture is scaled
/// down.
type Taps = (usize, usize);

fn draw(
    picture: (u32, u32),
    window: (u32, u32),
    buffer: &mut Vec<u32>,
    colour: impl Fn(Taps, Taps) -> [u8; 3],
) {
    buffer.clear();
    buffer.resize(window.0 as usize * window.1 as usize, 0);
    if buffer.is_empty() || picture.0 == 0 || picture.1 == 0 {
        return;
    }
    let place = letterbox(picture, window);
    let columns = taps(picture.0, place.width);
    let rows = taps(picture.1, place.height);
    let lines = buffer.chunks_exact_mut(window.0 as usize).skip(place.y as usize);
    for (line, &row) in lines.zip(&rows) {
        for (out, &column) in line[place.x as usize..].iter_mut().zip(&columns) {
            let [r, g, b] = colour(column, row).map(u32::from);
            *out = r << 16 | g << 8 | b;
        }
    }
}

fn taps(from: u32, to: u32) -> Vec<Taps> {
    // Integers: a picture at its own size has to come out pixel by pixel.
    let at = |quarters: u64| (quarters * u64::from(from) / (4 * u64::from(to))) as usize;
    (0..u64::from(to))
        .map(|i| if from > to { (at(4 * i + 1), at(4 * i + 3)) } else { (at(4 * i + 2), at(4 * i + 2)) })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture of greys that count upwards from black in steps of one 8-bit code.
    fn ramp(width: u32, height: u32) -> (Picture, Vec<u32>) {
        let codes: Vec<u32> = (0..width * height).map(|i| i % 256).collect();
        let grey = |&code: &u32| [crate::film::tone::srgb_to_linear(f64::from(code) / 255.0) as f32; 3];
        let rgb = codes.iter().map(grey).collect();
        (Picture { width, height, rgb }, codes.iter().map(|code| code * 0x01_01_01).collect())
    }

    fn drawn(picture: &Picture, window: (u32, u32)) -> Vec<u32> {
        // What was in the buffer must not show.
        let mut buffer = vec![0x00ff_00ff; 7];
        draw_picture(picture, &ToneMap::new(0.0), window, &mut buffer);
        buffer
    }

    #[test]
    fn letterboxes_keep_proportions_and_the_middle() {
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
    fn first_sizes_fit_a_screen_and_can_be_seen() {
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
    fn a_picture_at_its_own_size_comes_out_pixel_by_pixel() {
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
        // Half the light of white is 188 in sRGB; the mean of the codes would be 128.
        assert_eq!(drawn(&picture, (4, 4)), [0x00bc_bcbc; 16]);
    }

    #[test]
    fn channels_are_in_their_places() {
        let picture = Picture { width: 1, height: 1, rgb: vec![[1.0, 0.0, 0.5]] };
        assert_eq!(drawn(&picture, (1, 1)), [0x00ff_00bc]);
    }

    #[test]
    fn owners_are_drawn_unmixed() {
        let palette = [[255, 0, 0], [0, 255, 0]];
        let owners: Vec<u32> = (0..64).map(|i| i % 2).collect();
        let mut buffer = Vec::new();
        draw_owners(&owners, (8, 8), &palette, (3, 5), &mut buffer);
        assert_eq!(buffer.len(), 15);
        assert!(buffer[..3].iter().all(|&pixel| pixel == 0), "the letterbox is black");
        assert!(buffer[3..12].iter().all(|pixel| [0x00ff_0000, 0x0000_ff00].contains(pixel)));
    }

    #[test]
    fn nothing_is_drawn_where_there_is_nothing() {
        let empty = Picture { width: 0, height: 0, rgb: Vec::new() };
        assert_eq!(drawn(&empty, (2, 2)), [0; 4]);
        assert!(drawn(&ramp(3, 2).0, (0, 5)).is_empty());
    }

    #[test]
    fn a_huge_picture_costs_no_more_than_the_window_s_pixels() {
        let looked_at = std::cell::Cell::new(0u32);
        let mut buffer = Vec::new();
        draw((8192, 8192), (100, 50), &mut buffer, |_, _| {
            looked_at.set(looked_at.get() + 1);
            [0; 3]
        });
        assert_eq!(looked_at.get(), 50 * 50);
    }
}
