//! Vectors and colours of lanes.

use super::lanes::{Float, LaneFloat, Layout, Part, Value};
use std::ops::{Add, Mul, Neg, Sub};

/// A point, direction or normal in three dimensions, one per lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vec3<F> {
    /// First coordinate.
    pub x: F,
    /// Second coordinate.
    pub y: F,
    /// Third coordinate.
    pub z: F,
}

impl<F: Float> Vec3<F> {
    /// A vector from its coordinates.
    #[inline(always)]
    pub fn new(x: F, y: F, z: F) -> Self {
        Vec3 { x, y, z }
    }
    /// A vector from its coordinates in an array.
    #[inline(always)]
    pub fn of([x, y, z]: [F; 3]) -> Self {
        Vec3 { x, y, z }
    }
    /// The coordinates.
    #[inline(always)]
    pub fn coordinates(self) -> [F; 3] {
        [self.x, self.y, self.z]
    }
    /// A vector of the scene or of the settings in every lane: see [`Float::given`].
    #[inline(always)]
    pub fn given([x, y, z]: &[f32; 3]) -> Self {
        Vec3::new(F::given(x), F::given(y), F::given(z))
    }
    /// The same vector in every lane, a constant of the program.
    #[inline(always)]
    pub fn splat(v: [f32; 3]) -> Self {
        Vec3::new(F::splat(v[0]), F::splat(v[1]), F::splat(v[2]))
    }
    /// The zero vector.
    #[inline(always)]
    pub fn zero() -> Self {
        Vec3::splat([0.0; 3])
    }
    /// `table[index]` for each lane, from one table for each coordinate.
    #[inline(always)]
    pub fn gather<T: AsRef<[f32]>>(table: &[T; 3], index: F::Uint) -> Self {
        let [x, y, z] = table;
        let [x, y, z] = F::gather_all([x.as_ref(), y.as_ref(), z.as_ref()], index);
        Vec3::new(x, y, z)
    }
    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        F::dot3(self.coordinates(), other.coordinates())
    }
    /// The vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Vec3::of(F::cross3(self.coordinates(), other.coordinates()))
    }
    /// The Euclidean length.
    #[inline(always)]
    pub fn length(self) -> F {
        self.dot(self).sqrt()
    }
    /// The normalised vector.
    #[inline(always)]
    pub fn normalized(self) -> Self {
        self * (F::splat(1.0) / self.length())
    }
    /// The largest magnitude among the coordinates.
    #[inline(always)]
    pub fn max_abs(self) -> F {
        self.x.abs().max(self.y.abs()).max(self.z.abs())
    }
    /// `a` where the mask holds, `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        Vec3::of(F::select3(mask, a.coordinates(), b.coordinates()))
    }
}

impl<F: LaneFloat> Vec3<F> {
    /// Writes the lanes to the front of three slices, one for each coordinate.
    #[inline(always)]
    pub fn store<T: AsMut<[f32]>>(self, into: &mut [T; 3]) {
        let [x, y, z] = into;
        self.x.store(x.as_mut());
        self.y.store(y.as_mut());
        self.z.store(z.as_mut());
    }
    /// One lane's vector.
    #[inline(always)]
    pub fn lane(self, i: usize) -> [f32; 3] {
        [self.x.lane(i), self.y.lane(i), self.z.lane(i)]
    }
}

impl<F: Float> Add for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Vec3::of(F::add3(self.coordinates(), other.coordinates()))
    }
}

impl<F: Float> Sub for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Vec3::of(F::sub3(self.coordinates(), other.coordinates()))
    }
}

impl<F: Float> Mul<F> for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: F) -> Self {
        Vec3::of(F::scale3(self.coordinates(), k))
    }
}

impl<F: Float> Neg for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3::of(F::neg3(self.coordinates()))
    }
}

/// Linear Rec. 709 red, green and blue: radiance, reflectance or throughput, one per lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rgb<F> {
    /// Red.
    pub r: F,
    /// Green.
    pub g: F,
    /// Blue.
    pub b: F,
}

impl<F: Float> Rgb<F> {
    /// A colour from its channels.
    #[inline(always)]
    pub fn new(r: F, g: F, b: F) -> Self {
        Rgb { r, g, b }
    }
    /// A colour from its channels in an array.
    #[inline(always)]
    pub fn of([r, g, b]: [F; 3]) -> Self {
        Rgb { r, g, b }
    }
    /// The channels.
    #[inline(always)]
    pub fn channels(self) -> [F; 3] {
        [self.r, self.g, self.b]
    }
    /// A colour of the scene or of the settings in every lane: see [`Float::given`].
    #[inline(always)]
    pub fn given([r, g, b]: &[f32; 3]) -> Self {
        Rgb::new(F::given(r), F::given(g), F::given(b))
    }
    /// The same colour in every lane, a constant of the program.
    #[inline(always)]
    pub fn splat(c: [f32; 3]) -> Self {
        Rgb::new(F::splat(c[0]), F::splat(c[1]), F::splat(c[2]))
    }
    /// Black.
    #[inline(always)]
    pub fn black() -> Self {
        Rgb::splat([0.0; 3])
    }
    /// `table[index]` for each lane, from one table for each channel.
    #[inline(always)]
    pub fn gather(table: &[Vec<f32>; 3], index: F::Uint) -> Self {
        let [r, g, b] = F::gather_all([&table[0], &table[1], &table[2]], index);
        Rgb::new(r, g, b)
    }
    /// `a` where the mask holds, `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        Rgb::of(F::select3(mask, a.channels(), b.channels()))
    }
    /// The colour where the mask holds, black elsewhere.
    #[inline(always)]
    pub fn only(self, mask: F::Mask) -> Self {
        Rgb::select(mask, self, Rgb::black())
    }
    /// The largest channel.
    #[inline(always)]
    pub fn max_channel(self) -> F {
        self.r.max(self.g).max(self.b)
    }
}

impl<F: LaneFloat> Rgb<F> {
    /// One lane's colour.
    #[inline(always)]
    pub fn lane(self, i: usize) -> [f32; 3] {
        [self.r.lane(i), self.g.lane(i), self.b.lane(i)]
    }
}

impl<F: Float> Add for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Rgb::of(F::add3(self.channels(), other.channels()))
    }
}

impl<F: Float> Mul for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Rgb::of(F::mul3(self.channels(), other.channels()))
    }
}

impl<F: Float> Mul<F> for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: F) -> Self {
        Rgb::of(F::scale3(self.channels(), k))
    }
}

/// Vectors and colours are values of three floats.
macro_rules! vector {
    ($Type:ident { $x:ident, $y:ident, $z:ident }) => {
        impl<F: Float> Value<F> for $Type<F> {
            #[inline(always)]
            fn blend(mask: F::Mask, a: Self, b: Self) -> Self {
                $Type::select(mask, a, b)
            }
            fn layout() -> Layout {
                Layout::Vector
            }
            fn parts(&self, parts: &mut Vec<Part<F>>) {
                parts.extend([self.$x, self.$y, self.$z].map(Part::Float));
            }
            fn of_parts(parts: &mut impl Iterator<Item = Part<F>>) -> Self {
                $Type::of(Value::<F>::of_parts(parts))
            }
        }
    };
}
vector!(Vec3 { x, y, z });
vector!(Rgb { r, g, b });
