//! Picture files, in the format of the extension.

use std::fmt;
use std::io::{self, Seek, Write};
use std::path::{Path, PathBuf};

use super::error::OutputError;
use super::options::PictureOptions;
use super::{atomic, exr, hdr, png};
use crate::film::{Picture, ToneMap};

/// A picture file's format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8-bit sRGB, for viewing.
    Png,
    /// Lossless linear 32-bit floats, for editing.
    Exr,
    /// Radiance RGBE: linear with 8-bit mantissas, for programs that do not read EXR.
    Hdr,
}

impl Format {
    /// All formats.
    pub const ALL: [Self; 3] = [Self::Png, Self::Exr, Self::Hdr];

    /// The extension, without the dot.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Exr => "exr",
            Self::Hdr => "hdr",
        }
    }

    /// The format for a file name; the extension is case-insensitive.
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        Self::ALL.into_iter().find(|format| extension.eq_ignore_ascii_case(format.extension())).ok_or_else(
            || OutputError::UnknownFormat {
                path: path.to_path_buf(),
                extension: extension.to_string(),
                known: known(&Self::ALL),
            },
        )
    }
}

impl fmt::Display for Format {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, ".{}", self.extension())
    }
}

/// ".png, .exr or .hdr"
fn known(formats: &[Format]) -> String {
    match formats {
        [] => String::new(),
        [only] => only.to_string(),
        [all @ .., last] => {
            let all: Vec<_> = all.iter().map(Format::to_string).collect();
            format!("{} or {last}", all.join(", "))
        }
    }
}

/// Checks before a render that a picture can be written to `path`, and returns its format. Leaves no file behind.
pub fn check_writable(path: &Path) -> Result<Format, OutputError> {
    let format = Format::of(path)?;
    atomic::check_place(path)?;
    Ok(format)
}

/// Writes a picture in the format of the extension, completely or not at all. Equal pictures give equal
/// files.
pub fn write_picture(
    path: &Path,
    picture: &Picture,
    options: &PictureOptions<'_>,
) -> Result<(), OutputError> {
    let format = Format::of(path)?;
    atomic::write_atomically(path, |out| encode(format, picture, options, out))
}

/// Writes a picture's file to a seekable writer.
///
/// # Panics
/// If the picture does not have `width × height` pixels.
pub fn encode(
    format: Format,
    picture: &Picture,
    options: &PictureOptions<'_>,
    out: &mut (impl Write + Seek),
) -> io::Result<()> {
    assert_eq!(picture.rgb.len(), picture.width as usize * picture.height as usize, "a picture with holes");
    match format {
        Format::Png => {
            let tone = ToneMap::new(options.view.of_file());
            let pixels: Vec<_> = picture.rgb.iter().map(|&rgb| tone.encode(rgb)).collect();
            png::encode(picture.width, picture.height, &pixels, out)
        }
        Format::Exr => exr::encode(picture, options, out),
        Format::Hdr => hdr::encode(picture, out),
    }
}

/// The path of the picture at `spp` samples per pixel: `cover.png` becomes `cover-10.png`.
pub fn numbered_path(path: &Path, spp: u32) -> PathBuf {
    suffixed_path(path, &spp.to_string())
}

/// The path with a suffix: `cover.png` becomes `cover-view-1.png`.
pub fn suffixed_path(path: &Path, suffix: &str) -> PathBuf {
    let mut name = path.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("-{suffix}"));
    if let Some(extension) = path.extension() {
        name.push(".");
        name.push(extension);
    }
    path.with_file_name(name)
}

#[cfg(test)]
pub(super) mod tests {
    use std::fs;
    use std::io::Cursor;

    use super::*;
    use crate::film::ViewTransform;
    use crate::scene::Tone;

    /// The sizes at which each format is tested.
    pub(crate) const SIZES: [(u32, u32); 5] = [(1, 1), (3, 2), (17, 5), (1, 40), (64, 33)];

    /// A picture in [0, 1) without two equal rows, columns or channels; about a seventh of it is black.
    pub(crate) fn speckle(width: u32, height: u32) -> Picture {
        let mut state = 0x9e37_79b9u32;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 17;
            state ^= state << 5;
            if state.is_multiple_of(7) { 0.0 } else { (state >> 8) as f32 / (1 << 24) as f32 }
        };
        let rgb = (0..width * height).map(|_| [next(), next(), next()]).collect();
        Picture { width, height, rgb }
    }

    pub(crate) fn bytes(format: Format, picture: &Picture, exposure: f64) -> Vec<u8> {
        let mut out = Cursor::new(Vec::new());
        encode(
            format,
            picture,
            &PictureOptions { view: ViewTransform::exposed(exposure), ..PictureOptions::default() },
            &mut out,
        )
        .unwrap();
        out.into_inner()
    }

    #[test]
    fn extensions_are_case_insensitive() {
        assert_eq!(Format::of(Path::new("a/b.png")).unwrap(), Format::Png);
        assert_eq!(Format::of(Path::new("B.v2.EXR")).unwrap(), Format::Exr);
        assert_eq!(Format::of(Path::new("b.Hdr")).unwrap(), Format::Hdr);
    }

    #[test]
    fn unknown_extensions_are_refused_with_a_list_of_the_known_ones() {
        for (name, said) in [
            ("a.jpg", "the extension .jpg is not known; use .png, .exr or .hdr"),
            ("a", "its name has no extension to determine the format; use .png, .exr or .hdr"),
            (".png", "its name has no extension"),
            ("a.png/", ""),
            ("", "no extension"),
        ] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join(name);
            match check_writable(&path) {
                Err(error) => assert!(error.to_string().contains(said), "{name}: {error}"),
                // A slash after a name is removed by the rules of paths.
                Ok(format) => assert_eq!((name, format), ("a.png/", Format::Png)),
            }
            assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
        }
    }

    #[test]
    fn equal_pictures_give_equal_files_and_different_ones_do_not() {
        for format in Format::ALL {
            for (width, height) in SIZES {
                let picture = speckle(width, height);
                let file = bytes(format, &picture, -0.5);
                assert_eq!(file, bytes(format, &picture, -0.5), "{format} {width}×{height}");

                let mut other = picture.clone();
                let last = other.rgb.len() - 1;
                other.rgb[last][2] = other.rgb[last][2] * 0.5 + 0.1;
                assert_ne!(file, bytes(format, &other, -0.5), "{format} {width}×{height}");
            }
        }
    }

    #[test]
    fn a_png_applies_the_tone_curve_and_is_always_srgb() {
        let picture = speckle(17, 5);
        let file = |tone| {
            let (mut out, view) = (Cursor::new(Vec::new()), ViewTransform { exposure: 0.0, tone });
            encode(Format::Png, &picture, &PictureOptions { view, ..PictureOptions::default() }, &mut out)
                .unwrap();
            out.into_inner()
        };
        assert_ne!(file(Tone::Filmic), file(Tone::Srgb));
        assert_eq!(file(Tone::Linear), file(Tone::Srgb));
    }

    #[test]
    fn only_png_depends_on_the_exposure() {
        let picture = speckle(17, 5);
        for format in Format::ALL {
            let same = bytes(format, &picture, 0.0) == bytes(format, &picture, -3.0);
            assert_eq!(same, format != Format::Png, "{format}");
        }
    }

    #[test]
    fn files_on_disk_are_the_encoded_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let picture = speckle(17, 5);
        for format in Format::ALL {
            let path = folder.path().join(format!("a{format}"));
            assert_eq!(check_writable(&path).unwrap(), format);
            write_picture(
                &path,
                &picture,
                &PictureOptions { view: ViewTransform::exposed(1.0), ..PictureOptions::default() },
            )
            .unwrap();
            assert_eq!(fs::read(&path).unwrap(), bytes(format, &picture, 1.0));
        }
    }

    #[test]
    fn a_full_disk_is_an_error_in_every_format() {
        let Ok(full) = fs::File::options().write(true).open("/dev/full") else {
            println!("skipped: no /dev/full");
            return;
        };
        for format in Format::ALL {
            let mut out = io::BufWriter::with_capacity(64, &full);
            let error = encode(format, &speckle(64, 33), &PictureOptions::default(), &mut out).unwrap_err();
            let error = OutputError::from_io(Path::new("a"), error);
            assert!(matches!(error, OutputError::DiskFull { .. }), "{format}: {error}");
            // The buffer still contains bytes that cannot be written.
            let _ = out.into_parts();
        }
    }

    #[test]
    fn numbers_precede_the_extension() {
        for (path, numbered) in
            [("cover.png", "cover-10.png"), ("a/b.v2.exr", "a/b.v2-10.exr"), ("a", "a-10")]
        {
            assert_eq!(numbered_path(Path::new(path), 10), Path::new(numbered));
        }
    }
}
