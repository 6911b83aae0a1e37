//! Vectors and colours of lanes.

use super::lanes::Float;
use std::ops::{Add, Mul, Neg, Sub};

/// A point, direction or normal in three dimensions, one a lane.
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
    /// The same vector in every lane.
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
        Vec3::new(F::gather(x.as_ref(), index), F::gather(y.as_ref(), index), F::gather(z.as_ref(), index))
    }
    /// Writes the lanes to the front of three slices, one for each coordinate.
    #[inline(always)]
    pub fn store<T: AsMut<[f32]>>(self, into: &mut [T; 3]) {
        let [x, y, z] = into;
        self.x.store(x.as_mut());
        self.y.store(y.as_mut());
        self.z.store(z.as_mut());
    }
    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, other: Self) -> F {
        self.x * other.x + self.y * other.y + self.z * other.z
    }
    /// The vector product.
    #[inline(always)]
    pub fn cross(self, other: Self) -> Self {
        Vec3::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }
    /// The Euclidean length.
    #[inline(always)]
    pub fn length(self) -> F {
        self.dot(self).sqrt()
    }
    /// The vector over its length.
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
        Vec3::new(F::select(mask, a.x, b.x), F::select(mask, a.y, b.y), F::select(mask, a.z, b.z))
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
        Vec3::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<F: Float> Sub for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Vec3::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<F: Float> Mul<F> for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: F) -> Self {
        Vec3::new(self.x * k, self.y * k, self.z * k)
    }
}

impl<F: Float> Neg for Vec3<F> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Vec3::new(-self.x, -self.y, -self.z)
    }
}

/// Linear Rec. 709 red, green and blue: radiance, reflectance or throughput, one a lane.
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
    /// The same colour in every lane.
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
        Rgb::new(F::gather(&table[0], index), F::gather(&table[1], index), F::gather(&table[2], index))
    }
    /// `a` where the mask holds, `b` elsewhere.
    #[inline(always)]
    pub fn select(mask: F::Mask, a: Self, b: Self) -> Self {
        Rgb::new(F::select(mask, a.r, b.r), F::select(mask, a.g, b.g), F::select(mask, a.b, b.b))
    }
    /// The colour where the mask holds, black elsewhere.
    #[inline(always)]
    pub fn only(self, mask: F::Mask) -> Self {
        Rgb::new(self.r.only(mask), self.g.only(mask), self.b.only(mask))
    }
    /// The largest channel.
    #[inline(always)]
    pub fn max_channel(self) -> F {
        self.r.max(self.g).max(self.b)
    }
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
        Rgb::new(self.r + other.r, self.g + other.g, self.b + other.b)
    }
}

impl<F: Float> Mul for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Rgb::new(self.r * other.r, self.g * other.g, self.b * other.b)
    }
}

impl<F: Float> Mul<F> for Rgb<F> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, k: F) -> Self {
        Rgb::new(self.r * k, self.g * k, self.b * k)
    }
}
