//! Russian roulette.

use super::observe::{Event, Observer, rgb};
use super::vertex::State;
use crate::math::{Float, Mask, Uint, function, value};

/// Bounces that every path makes before Russian roulette may end it.
pub const ROULETTE_FROM: u32 = 2;

/// The chance to survive is this much for each unit of throughput, and certainty above its inverse: a path
/// is never ended while its throughput is a quarter or more. Measured: compared with ending paths at any
/// loss, as the report does, variance falls more than time grows, and most where samples are well spread.
pub const ROULETTE_KEEPS: f32 = 4.0;

/// From this depth on no path survives with more than [`ROULETTE_AT_MOST`], so that even one without
/// losses, between perfect mirrors for example, ends.
pub const ROULETTE_AT_MOST_FROM: u32 = 256;

/// See [`ROULETTE_AT_MOST_FROM`]. The nearer to one the better: among surfaces that reflect more at a bounce than the
/// square root of this, each further bounce adds more variance than the last, as few survivors stand for all
/// other paths.
pub const ROULETTE_AT_MOST: f32 = 0.999;

/// The outcome of Russian roulette.
#[derive(Clone, Copy)]
struct Roulette<F: Float> {
    /// The lanes that take part.
    plays: F::Mask,
    /// The lanes that end.
    ends: F::Mask,
    /// The chance to survive of those that take part.
    chance: F,
}

value!(Roulette { plays, ends, chance });

/// Russian roulette: ends paths whose throughput is below a quarter with a chance that grows as it falls, and divides
/// the throughput of the others by their chance to survive. `survival` is uniform in [0, 1). Returns the lanes that go on.
#[inline(always)]
pub(super) fn roulette<F: Float>(
    state: &mut State<F>,
    going: F::Mask,
    survival: F,
    observer: &mut Observer<'_>,
) -> F::Mask {
    let (beta, eta_scale, depth) = (state.beta, state.departure.eta_scale, state.depth);
    let Roulette { plays, ends, chance } = function!(F, roulette(beta, eta_scale, depth, going, survival), {
        let chance = beta.max_channel() * eta_scale * ROULETTE_KEEPS;
        let long = !depth.lt(F::Uint::splat(ROULETTE_AT_MOST_FROM));
        let at_most = F::splat(ROULETTE_AT_MOST);
        let chance = F::select(long & at_most.lt(chance), at_most, chance);
        let plays = going & !depth.lt(F::Uint::splat(ROULETTE_FROM)) & chance.lt(F::splat(1.0));
        // NaN is never less than anything: it survives to be counted.
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
