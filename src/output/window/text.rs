//! Draws text over a picture.

use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};

const HEIGHT: RasterHeight = RasterHeight::Size16;
const WEIGHT: FontWeight = FontWeight::Regular;
/// The margin between the text and its box.
const MARGIN: usize = 6;

/// The size of the box for lines of text, in pixels.
pub fn box_size(lines: &[String]) -> (usize, usize) {
    let longest = lines.iter().map(|line| line.chars().count()).max().unwrap_or(0);
    let width = longest * get_raster_width(WEIGHT, HEIGHT) + 2 * MARGIN;
    (width, lines.len() * HEIGHT.val() + 2 * MARGIN)
}

/// Draws lines in white onto a box of the darkened picture whose top left corner is at `at`, clipped to the
/// window.
pub fn draw(lines: &[String], at: (usize, usize), window: (u32, u32), buffer: &mut [u32]) {
    let (width, height) = box_size(lines);
    let (columns, rows) = (window.0 as usize, window.1 as usize);
    for y in at.1..rows.min(at.1 + height) {
        for pixel in &mut buffer[y * columns..][at.0.min(columns)..columns.min(at.0 + width)] {
            // A quarter of the code: dark enough for white text, but the picture stays recognisable.
            *pixel = (*pixel >> 2) & 0x003f_3f3f;
        }
    }
    let advance = get_raster_width(WEIGHT, HEIGHT);
    for (row, line) in lines.iter().enumerate() {
        for (column, letter) in line.chars().enumerate() {
            let Some(raster) = get_raster(letter, WEIGHT, HEIGHT).or_else(|| get_raster('?', WEIGHT, HEIGHT))
            else {
                continue;
            };
            let (left, top) = (at.0 + MARGIN + column * advance, at.1 + MARGIN + row * HEIGHT.val());
            for (y, line) in raster.rows().enumerate().filter(|(y, _)| top + y < rows) {
                for (x, &ink) in line.iter().enumerate().filter(|(x, _)| left + x < columns) {
                    let pixel = &mut buffer[(top + y) * columns + left + x];
                    let mix = |under: u32| under + (255 - under) * u32::from(ink) / 255;
                    let [_, r, g, b] = pixel.to_be_bytes().map(u32::from);
                    *pixel = mix(r) << 16 | mix(g) << 8 | mix(b);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<String> {
        text.lines().map(str::to_owned).collect()
    }

    fn drawn(text: &str, at: (usize, usize)) -> Vec<u32> {
        let mut buffer = vec![0x0080_8080; 120 * 60];
        draw(&lines(text), at, (120, 60), &mut buffer);
        buffer
    }

    #[test]
    fn letters_are_bright_in_a_dark_box_and_nothing_else_changes() {
        let shown = drawn("ab", (10, 5));
        let (width, height) = box_size(&lines("ab"));
        assert_eq!((width, height), (2 * get_raster_width(WEIGHT, HEIGHT) + 12, 28));
        for (i, &pixel) in shown.iter().enumerate() {
            let within = (10..10 + width).contains(&(i % 120)) && (5..5 + height).contains(&(i / 120));
            assert!(within || pixel == 0x0080_8080, "at {i}");
        }
        // The edge of a letter may have the brightness of the picture.
        let changed = shown.iter().filter(|&&pixel| pixel != 0x0080_8080).count();
        assert!(changed > width * height * 9 / 10, "{changed} of {}", width * height);
        assert!(shown.iter().filter(|&&pixel| pixel > 0x00c0_c0c0).count() > 20, "there are letters");
        assert_ne!(shown, drawn("ba", (10, 5)));
        assert_eq!(drawn("é±·×°", (0, 0)).len(), 120 * 60);
        assert_ne!(drawn("±", (0, 0)), drawn("?", (0, 0)));
        assert_eq!(drawn("\u{1F600}", (0, 0)), drawn("?", (0, 0)), "unknown letters are question marks");
    }

    #[test]
    fn text_that_does_not_fit_is_cut() {
        for at in [(100, 50), (119, 59), (120, 60), (500, 500), (0, 0)] {
            drawn("much longer than the window has room for, by far\nand\nmore\nlines", at);
        }
    }
}
