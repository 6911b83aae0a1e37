//! Axis-aligned bounding boxes.

/// All X with low ≤ X ≤ high in each coordinate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// The corner with the least coordinates.
    pub low: [f32; 3],
    /// The corner with the greatest coordinates.
    pub high: [f32; 3],
}

impl Bounds {
    /// The empty box: the neutral element of [`Bounds::with`].
    pub const NOTHING: Bounds = Bounds { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };
    /// The box that contains all points.
    pub const EVERYTHING: Bounds = Bounds { low: [f32::NEG_INFINITY; 3], high: [f32::INFINITY; 3] };

    /// The smallest box around some points.
    pub fn of(points: impl IntoIterator<Item = [f32; 3]>) -> Bounds {
        points.into_iter().fold(Bounds::NOTHING, |bounds, p| bounds.with(&Bounds { low: p, high: p }))
    }

    /// The smallest box around two boxes.
    #[inline]
    pub fn with(&self, other: &Bounds) -> Bounds {
        let each = |f: fn(f32, f32) -> f32, a: [f32; 3], b: [f32; 3]| [0, 1, 2].map(|i| f(a[i], b[i]));
        let (min, max) =
            (|a: f32, b: f32| if a < b { a } else { b }, |a: f32, b: f32| if a > b { a } else { b });
        Bounds { low: each(min, self.low, other.low), high: each(max, self.high, other.high) }
    }

    /// The box extended on every side by this fraction of its largest coordinate.
    pub fn grown(&self, share: f32) -> Bounds {
        let largest = self.low.iter().chain(&self.high).fold(0.0_f32, |m, x| m.max(x.abs()));
        let margin = largest * share + f32::MIN_POSITIVE;
        Bounds { low: self.low.map(|x| x - margin), high: self.high.map(|x| x + margin) }
    }

    /// Half its surface area; zero for the empty box.
    #[inline]
    pub fn half_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|i| (f64::from(self.high[i]) - f64::from(self.low[i])).max(0.0));
        x * y + y * z + z * x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_contains_its_points_and_the_empty_box_contains_none() {
        let bounds = Bounds::of([[1.0, -2.0, 0.5], [0.0, 4.0, 0.5]]);
        assert_eq!(bounds, Bounds { low: [0.0, -2.0, 0.5], high: [1.0, 4.0, 0.5] });
        assert_eq!(bounds.half_area(), 6.0);
        assert_eq!(Bounds::of([]), Bounds::NOTHING);
        assert_eq!(Bounds::NOTHING.with(&bounds), bounds);
        assert_eq!(Bounds::NOTHING.half_area(), 0.0);
        let grown = bounds.grown(0.25);
        assert_eq!(grown, Bounds { low: [-1.0, -3.0, -0.5], high: [2.0, 5.0, 1.5] });
    }
}
