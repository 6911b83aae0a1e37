//! Russian roulette.

use super::observe::{Event, Observer, rgb};
use super::vertex::State;
use crate::math::{Float, Mask, Uint, function, value};

/// The number of bounces before Russian roulette may end a path.
pub const ROULETTE_FROM: u32 = 2;

/// The survival probability per unit of throughput, at most 1: a path is never ended while its throughput is at least a
/// quarter. Compared with ending paths at any loss, as in the report, measured variance falls more than time grows,
/// most of all with well-distributed samples.
pub const ROULETTE_KEEPS: f32 = 4.0;

/// From this depth the survival probability is at most [`ROULETTE_AT_MOST`], so that even a path without losses ends,
/// for example between perfect mirrors.
pub const ROULETTE_AT_MOST_FROM: u32 = 256;

/// See [`ROULETTE_AT_MOST_FROM`]. The closer to one, the better: between surfaces whose reflectance exceeds its square
/// root, each further bounce adds more variance than the last, as few survivors represent all other paths.
pub const ROULETTE_AT_MOST: f32 = 0.999;

/// The outcome of Russian roulette.
#[derive(Clone, Copy)]
struct Roulette<F: Float> {
    /// The lanes that take part.
    plays: F::Mask,
    /// The lanes that end.
    ends: F::Mask,
    /// The survival probability of the lanes that take part.
    chance: F,
}

value!(Roulette { plays, ends, chance });

/// Russian roulette: ends paths whose throughput is below a quarter with a probability that grows as it falls, and
/// divides the throughput of the others by their survival probability. `survival` is uniform in [0, 1). Returns the
/// lanes that continue.
#[inline(always)]
pub(super) fn roulette<F: Float>(
    state: &mut State<F>,
    going: F::Mask,
    survival: F,
    observer: &mut Observer<'_>,
) -> F::Mask {
    let (beta, eta_scale, depth) = (state.beta, state.previous.eta_scale, state.depth);
    let Roulette { plays, ends, chance } = function!(F, roulette(beta, eta_scale, depth, going, survival), {
        let chance = beta.max_channel() * eta_scale * ROULETTE_KEEPS;
        let long = !depth.lt(F::Uint::splat(ROULETTE_AT_MOST_FROM));
        let at_most = F::splat(ROULETTE_AT_MOST);
        let chance = F::select(long & at_most.lt(chance), at_most, chance);
        let plays = going & !depth.lt(F::Uint::splat(ROULETTE_FROM)) & chance.lt(F::splat(1.0));
        // NaN is never less than anything: such a path survives and is counted.
        Roulette { plays, ends: plays & chance.le(survival), chance }
    });
    let reward = F::select(plays, F::splat(1.0) / chance, F::splat(1.0));
    state.beta = state.beta * reward;
    if observer.listens::<F>() && (plays & !ends).first() {
        observer.event::<F>(|| Event::Survive { chance: chance.first(), throughput: rgb(state.beta) });
    }
    if observer.listens::<F>() && ends.first() {
        observer.event::<F>(|| Event::End { reason: "Russian roulette", radiance: rgb(state.l) });
    }
    going & !ends
}
