//! Morph targets at their default weights.

use super::accessors::Floats;
use super::buffers::Buffers;
use super::document::{Document, Primitive};
use super::room::Room;
use glam::DVec3;

/// Offsets of the vertices of a primitive.
#[derive(Default)]
pub(super) struct Offsets {
    pub(super) positions: Option<Vec<DVec3>>,
    pub(super) normals: Option<Vec<DVec3>>,
}

/// The cost of a target in bytes, which it has even at weight 0.
const TARGET: u64 = 16;

/// The cost of a vertex of a target, in bytes.
const VERTEX: u64 = 24;

/// The weighted sum of a primitive's targets; missing weights are 0.
pub(super) fn offsets(
    document: &Document,
    buffers: &mut Buffers<'_>,
    primitive: &Primitive,
    weights: &[f64],
    vertices: usize,
) -> Result<Offsets, String> {
    let mut sum = Offsets::default();
    for (i, (target, &weight)) in primitive.targets.iter().zip(weights).enumerate() {
        buffers.room.take(0, 0, TARGET)?;
        if weight == 0.0 {
            continue;
        }
        for (accessor, sum) in [(target.position, &mut sum.positions), (target.normal, &mut sum.normals)] {
            let Some(accessor) = accessor else { continue };
            let wrong = |message: String| format!("targets[{i}]: {message}");
            let moved = buffers.floats::<3>(document, accessor).map_err(wrong)?;
            if moved.count() != vertices {
                let count = moved.count();
                return Err(wrong(format!("it has {count} offsets for {vertices} vertices")));
            }
            make_room(&mut buffers.room, &moved)?;
            let sum = sum.get_or_insert_with(|| vec![DVec3::ZERO; vertices]);
            for (sum, offset) in sum.iter_mut().zip(moved.decode().map_err(wrong)?) {
                *sum += weight * wide(offset);
            }
        }
    }
    Ok(sum)
}

fn make_room(room: &mut Room, moved: &Floats<3>) -> Result<(), String> {
    room.take(0, 0, VERTEX * moved.count() as u64 + Room::replacing(moved.replacing()))
}

/// A vector in 64 bits.
pub(super) fn wide(v: [f32; 3]) -> DVec3 {
    DVec3::from(v.map(f64::from))
}
