//! Numbers whose conversion by the reader gives a certain value: the reader converts degrees to radians, and normalises
//! directions.

use crate::parameter::unit;
use glam::DVec3;

/// An angle in degrees that is read as exactly `radians`.
pub(super) fn degrees(radians: f64) -> Option<f64> {
    let near = radians.to_degrees();
    let (mut up, mut down) = (near, near);
    for _ in 0..8 {
        if let Some(found) = [up, down].into_iter().find(|degrees| degrees.to_radians() == radians) {
            return Some(found);
        }
        (up, down) = (up.next_up(), down.next_down());
    }
    None
}

/// A vector whose normalisation is exactly `direction`.
pub(super) fn direction(direction: DVec3) -> Option<DVec3> {
    // Vectors of other lengths round differently.
    let lengths = (0..4096).map(|i| 1.0 + f64::from(i) / 64.0);
    lengths.map(|length| direction * length).find(|vector| unit(*vector) == direction)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_and_directions_are_found() {
        let mut state = 1_u64;
        let mut random = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for _ in 0..10_000 {
            let angle = (random() * 180.0).to_radians();
            assert_eq!(degrees(angle).map(f64::to_radians), Some(angle));
            let own = unit(DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5));
            assert_eq!(direction(own).map(unit), Some(own));
        }
        assert_eq!(direction(DVec3::new(0.5, 0.0, 0.0)), None);
    }
}
