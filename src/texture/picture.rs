//! Pictures in memory.

/// The number format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub enum Depth {
    /// Bytes; 255 represents one.
    Bits8,
    /// 16 bits; 65535 represents one.
    Bits16,
    /// Floats of 16 bits.
    Half,
    /// Floats of 32 bits.
    Float,
}

impl Depth {
    /// The number of bytes of a number.
    pub fn bytes(self) -> usize {
        match self {
            Depth::Bits8 => 1,
            Depth::Bits16 | Depth::Half => 2,
            Depth::Float => 4,
        }
    }

    /// "8-bit".
    pub fn name(self) -> &'static str {
        match self {
            Depth::Bits8 => "8-bit",
            Depth::Bits16 => "16-bit",
            Depth::Half => "half float",
            Depth::Float => "float",
        }
    }
}

/// A picture: rows of texels, the lowest row first, with one or three numbers per texel.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    width: u32,
    height: u32,
    channels: u32,
    depth: Depth,
    /// The numbers, with the first ones in the lower bits, padded with zeros: the layout of devices.
    words: Vec<[u32; 4]>,
    /// The number of values that were not finite.
    repaired: u64,
}

impl Picture {
    /// Makes a picture of numbers in little-endian bytes, with the uppermost row first, as in files. The first
    /// `channels` of each texel's `stored` numbers are kept. Floats that are not finite are replaced: NaN by zero,
    /// infinities by the largest finite number of their sign.
    ///
    /// # Panics
    ///
    /// If the number of bytes is not that of `width` × `height` × `stored` numbers, or if there are other than one or
    /// three channels.
    pub fn new(
        [width, height]: [u32; 2],
        [channels, stored]: [u32; 2],
        depth: Depth,
        bytes: &[u8],
    ) -> Picture {
        assert!(matches!(channels, 1 | 3) && channels <= stored, "one or three channels of {stored}");
        let texel = stored as usize * depth.bytes();
        let line = width as usize * texel;
        assert_eq!(bytes.len(), height as usize * line, "a picture of {width}×{height}");
        let kept = channels as usize * depth.bytes();
        let per_line = width as usize * kept;
        let mut words = vec![[0; 4]; (height as usize * per_line).div_ceil(16)];
        let numbers = words.as_flattened_mut();
        let mut repaired = 0;
        for (row, line) in bytes.chunks_exact(line.max(1)).rev().enumerate() {
            let mut at = row * per_line;
            for texel in line.chunks_exact(texel) {
                for number in texel[..kept].chunks_exact(depth.bytes()) {
                    let mut bits = [0; 4];
                    bits[..number.len()].copy_from_slice(number);
                    let given = u32::from_le_bytes(bits);
                    let bits = finite(depth, given);
                    repaired += u64::from(bits != given);
                    numbers[at / 4] |= bits << (8 * (at % 4));
                    at += depth.bytes();
                }
            }
        }
        Picture { width, height, channels, depth, words, repaired }
    }

    /// One black texel.
    pub fn black() -> Picture {
        Picture::new([1, 1], [1, 1], Depth::Bits8, &[0])
    }

    /// The number of texels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// The number of rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Numbers per texel: one (grey) or three (red, green, blue).
    pub fn channels(&self) -> u32 {
        self.channels
    }

    /// The number format.
    pub fn depth(&self) -> Depth {
        self.depth
    }

    /// The numbers as words of sixteen bytes.
    pub fn words(&self) -> &[[u32; 4]] {
        &self.words
    }

    /// The number of values that were not finite when the picture was made.
    pub fn repaired_numbers(&self) -> u64 {
        self.repaired
    }

    /// The number of values below zero.
    pub fn negative_numbers(&self) -> u64 {
        let sign = match self.depth {
            Depth::Bits8 | Depth::Bits16 => return 0,
            Depth::Half => 0x8000,
            Depth::Float => 0x8000_0000,
        };
        let numbers = 0..self.texels() * self.channels as usize;
        numbers.filter(|&i| self.number(i) > sign).count() as u64
    }

    /// The number of texels.
    pub(super) fn texels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Its size in memory, in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(self.words.as_slice())
    }

    /// The bits of a number, counted from the lower left.
    #[inline(always)]
    pub(super) fn number(&self, i: usize) -> u32 {
        let words = self.words.as_flattened();
        match self.depth {
            Depth::Bits8 => words[i / 4] >> (8 * (i % 4)) & 0xff,
            Depth::Bits16 | Depth::Half => words[i / 2] >> (16 * (i % 2)) & 0xffff,
            Depth::Float => words[i],
        }
    }
}

/// The bits of a number, or of its finite replacement.
fn finite(depth: Depth, bits: u32) -> u32 {
    let (exponent, largest, sign) = match depth {
        Depth::Bits8 | Depth::Bits16 => return bits,
        Depth::Half => (0x7c00, 0x7bff, 0x8000),
        Depth::Float => (0x7f80_0000, 0x7f7f_ffff, 0x8000_0000),
    };
    if bits & exponent != exponent {
        bits
    } else if bits & !sign == exponent {
        bits & sign | largest
    } else {
        0
    }
}
