//! The table for one path at a time, for tests. Each function is compiled once: inlined into every test, they took a
//! large part of the time in which the tests of the library are compiled.

use super::LightTable;
use crate::light::sample::{EmittedRay, LightSample};
use crate::math::Vec3;
use crate::math::lanes::scalar::Wrapping;

impl LightTable {
    /// [`LightTable::choose`].
    #[inline(never)]
    pub(in crate::light) fn choose_one(&self, p: Vec3<f32>, n: Vec3<f32>, u: f32) -> (Wrapping, f32) {
        self.choose(p, n, u, true)
    }

    /// [`LightTable::pmf`].
    #[inline(never)]
    pub(in crate::light) fn pmf_one(&self, p: Vec3<f32>, n: Vec3<f32>, light: Wrapping) -> f32 {
        self.pmf(p, n, light, true)
    }

    /// [`LightTable::sample`].
    #[inline(never)]
    pub(in crate::light) fn sample_one(
        &self,
        light: Wrapping,
        p: Vec3<f32>,
        u: [f32; 2],
    ) -> LightSample<f32> {
        self.sample(light, p, u)
    }

    /// [`LightTable::pdf`].
    #[inline(never)]
    pub(in crate::light) fn pdf_one(
        &self,
        light: Wrapping,
        p: Vec3<f32>,
        on: Vec3<f32>,
        t: f32,
        cos_light: f32,
    ) -> f32 {
        self.pdf(light, p, on, t, cos_light)
    }

    /// [`LightTable::emit`].
    #[inline(never)]
    pub(in crate::light) fn emit_one(&self, light: Wrapping, u: [f32; 4]) -> EmittedRay<f32> {
        self.emit(light, u)
    }
}
