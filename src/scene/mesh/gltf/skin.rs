//! Skins in their rest pose.

use super::buffers::Buffers;
use super::document::{Document, Primitive, Skin};
use super::fault::{Fault, only};
use super::place::Rest;
use super::room::Room;
use glam::{DAffine3, DMat3, DMat4, DVec3};
use std::collections::HashMap;
use std::rc::Rc;

/// The cost of a joint, in bytes.
const JOINT: u64 = 128;

/// The cost of a vertex, in bytes, for each set of four joints.
const VERTEX: u64 = 32;

/// The largest deviation of a sum of weights from 1 that rounding explains, even for weights in bytes.
const ROUNDING: f64 = 0.02;

/// Skins, each computed on first use.
pub(super) struct Skins<'d> {
    document: &'d Document,
    rest: Option<Rest<'d>>,
    ready: HashMap<usize, Rc<Vec<DAffine3>>>,
}

impl<'d> Skins<'d> {
    pub(super) fn new(document: &'d Document) -> Self {
        Skins { document, rest: None, ready: HashMap::new() }
    }

    /// The transform of each joint of a skin, from the mesh's space to the file's.
    pub(super) fn joints(
        &mut self,
        buffers: &mut Buffers<'_>,
        index: usize,
    ) -> Result<Rc<Vec<DAffine3>>, Fault> {
        if let Some(ready) = self.ready.get(&index) {
            return Ok(Rc::clone(ready));
        }
        let document = self.document;
        let wrong = |message: String| Fault::at(format_args!("skins[{index}]"), message);
        let Some(Skin { joints, inverse_bind_matrices }) = document.skins.get(index) else {
            return Err(wrong(format!("it is not a skin: {}", only(document.skins.len()))));
        };
        if joints.is_empty() {
            return Err(wrong("it has no joints".into()));
        }
        buffers.room.take(0, 0, JOINT * joints.len() as u64).map_err(wrong)?;
        let unbound = match inverse_bind_matrices {
            None => Vec::new(),
            Some(accessor) => {
                let matrices = buffers.floats::<16>(document, *accessor).map_err(wrong)?;
                if matrices.count() < joints.len() {
                    let (have, need) = (matrices.count(), joints.len());
                    return Err(wrong(format!("it has {have} inverse bind matrices for {need} joints")));
                }
                buffers.room.take(0, 0, Room::replacing(matrices.replacing())).map_err(wrong)?;
                matrices.decode_first(joints.len()).map_err(wrong)?
            }
        };
        let rest = self.rest.get_or_insert_with(|| Rest::of(document));
        let mut all = Vec::with_capacity(joints.len());
        for (i, &joint) in joints.iter().enumerate() {
            let mut carries = rest.place(joint).map_err(|fault| fault.of(format_args!("skins[{index}]")))?;
            if let Some(matrix) = unbound.get(i) {
                carries *= DAffine3::from_mat4(DMat4::from_cols_array(&matrix.map(f64::from)));
            }
            if !carries.is_finite() {
                return Err(wrong(format!("joint {i} has an inverse bind matrix that is not finite")));
            }
            all.push(carries);
        }
        let all = Rc::new(all);
        self.ready.insert(index, Rc::clone(&all));
        Ok(all)
    }
}

/// A primitive with a skin.
pub(super) struct Skinned {
    joints: Rc<Vec<DAffine3>>,
    sets: Vec<Set>,
}

/// Four joints and their weights for each vertex.
struct Set {
    joints: Vec<[f32; 4]>,
    weights: Vec<[f32; 4]>,
}

/// A repair of the weights of a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Repair {
    /// The weights are scaled so that their sum is 1.
    Scaled,
    /// Weights that are negative or not a number are replaced by 0.
    Cleaned,
    /// All weights are 0, and that of the first joint is replaced by 1.
    Replaced,
}

impl Repair {
    pub(super) fn message(self) -> &'static str {
        match self {
            Repair::Scaled => "vertices whose skin weights do not add up to 1 have them scaled",
            Repair::Cleaned => "vertices with skin weights that are negative or not numbers have 0 for these",
            Repair::Replaced => "vertices whose skin weights are all 0 follow their first joint",
        }
    }
}

impl Skinned {
    /// Reads the joints and weights of a primitive; `None` if it has none.
    pub(super) fn of(
        document: &Document,
        buffers: &mut Buffers<'_>,
        primitive: &Primitive,
        vertices: usize,
        joints: Rc<Vec<DAffine3>>,
    ) -> Result<Option<Skinned>, String> {
        let mut sets = Vec::new();
        for set in 0.. {
            let names = [format!("JOINTS_{set}"), format!("WEIGHTS_{set}")];
            let [followed, weights] = names.each_ref().map(|name| primitive.attributes.get(name).copied());
            let (followed, weights) = match (followed, weights) {
                (Some(followed), Some(weights)) => (followed, weights),
                (None, None) => break,
                _ => return Err(format!("it has only one of {} and {}", names[0], names[1])),
            };
            let mut followed = buffers.floats::<4>(document, followed)?;
            // Joints are integers even if the accessor claims to be normalised.
            followed.normalized = false;
            let weights = buffers.floats::<4>(document, weights)?;
            if [followed.count(), weights.count()] != [vertices; 2] {
                return Err(format!("it has {vertices} positions, but not as many joints or weights"));
            }
            let replacing = Room::replacing(followed.replacing()) + Room::replacing(weights.replacing());
            buffers.room.take(0, 0, VERTEX * vertices as u64 + replacing)?;
            sets.push(Set { joints: followed.decode()?, weights: weights.decode()? });
        }
        Ok((!sets.is_empty()).then_some(Skinned { joints, sets }))
    }

    /// The transform of a vertex, and the repair of its weights.
    pub(super) fn carries(&self, vertex: usize) -> Result<(DAffine3, Option<Repair>), String> {
        let mut repair = None;
        let mut total = 0.0;
        let mut sum = DAffine3 { matrix3: DMat3::ZERO, translation: DVec3::ZERO };
        let mut add = |joint: f32, weight: f64| {
            let carries = usize::try_from(joint as i64).ok().filter(|&i| i as f32 == joint);
            let Some(carries) = carries.and_then(|i| self.joints.get(i)) else {
                let joints = self.joints.len();
                return Err(format!(
                    "vertex {vertex} follows joint {joint}, but its skin has only {joints} (counted from 0)"
                ));
            };
            sum.matrix3 += carries.matrix3 * weight;
            sum.translation += carries.translation * weight;
            Ok(())
        };
        for Set { joints, weights } in &self.sets {
            for (&joint, &weight) in joints[vertex].iter().zip(&weights[vertex]) {
                if weight > 0.0 && weight.is_finite() {
                    total += f64::from(weight);
                    add(joint, f64::from(weight))?;
                } else if weight != 0.0 {
                    repair = Some(Repair::Cleaned);
                }
            }
        }
        if total == 0.0 {
            add(self.sets[0].joints[vertex][0], 1.0)?;
            return Ok((sum, repair.or(Some(Repair::Replaced))));
        }
        if total != 1.0 {
            sum.matrix3 *= 1.0 / total;
            sum.translation /= total;
        }
        let scaled = ((total - 1.0).abs() > ROUNDING).then_some(Repair::Scaled);
        Ok((sum, repair.or(scaled)))
    }
}
