//! The evaluation of textures.

use super::instruction::{END, Op};
use super::program::STACK;
use super::site::Site;
use super::table::{Has, TextureTable};
use super::{checkerboard, image, mix, noise};
use crate::math::{Float, Rgb, Uint, function};

/// The coordinates for instructions: uv, and the area of them that a pixel covers.
type Coordinates<F> = ([F; 2], F);

impl TextureTable {
    /// The values of textures at points; black for lanes without a texture.
    #[inline(always)]
    pub fn value<F: Float>(&self, texture: F::Uint, site: Site<F>) -> Rgb<F> {
        function!(F, texture_value(texture, site), {
            F::out_of_line(
                #[inline(always)]
                move || {
                    // Most programs consist of one instruction, or choose among such.
                    if self.depth <= 1 {
                        self.run::<F, 1>(texture, site)
                    } else {
                        self.run::<F, STACK>(texture, site)
                    }
                },
            )
        })
    }

    /// The values of textures that are a single image, without tiles or transformed uv, at uv and at the finest level.
    #[inline(always)]
    pub fn image_value<F: Float>(&self, texture: F::Uint, uv: [F; 2]) -> Rgb<F> {
        function!(F, image_value(texture, uv), { image::texels_at(self, texture, uv) })
    }

    /// Runs programs with a stack of `D` colours.
    #[inline(always)]
    fn run<F: Float, const D: usize>(&self, first: F::Uint, site: Site<F>) -> Rgb<F> {
        let end = F::Uint::splat(END);
        let (_, _, stack) = F::repeat(
            first.lt(end),
            (first, (site.uv, site.footprint), [Rgb::<F>::black(); D]),
            #[inline(always)]
            |(at, coordinates, stack)| {
                let (next, coordinates, stack) = self.step(at, coordinates, stack, &site);
                ((next, coordinates, stack), next.lt(end))
            },
        );
        stack[0]
    }

    /// One instruction: the next one, the coordinates there, and the stack.
    #[inline(always)]
    fn step<F: Float, const D: usize>(
        &self,
        at: F::Uint,
        (uv, footprint): Coordinates<F>,
        stack: [Rgb<F>; D],
        site: &Site<F>,
    ) -> (F::Uint, Coordinates<F>, [Rgb<F>; D]) {
        let all = &self.instructions;
        // Only textures of at least two colours need more than one place: the code of one place has no others.
        let own = &self.has;
        let has = Has {
            mix: D > 1 && own.mix,
            scale: D > 1 && own.scale,
            noise: D > 1 && own.noise,
            restore: D > 1 && own.restore,
            image: own.image,
            check: own.check,
        };
        let op = all.op(at);
        let mut next = (all.next(at), uv);
        let mut top = all.colour::<F>(at);
        if has.image {
            let active = op.eq(F::Uint::splat(Op::Image as u32));
            top = F::branch(
                active,
                top,
                #[inline(always)]
                || image::look_up(self, at, uv, footprint, &site.second, active),
            );
        }
        if has.noise {
            top = F::branch(
                op.eq(F::Uint::splat(Op::Noise as u32)),
                top,
                #[inline(always)]
                || mix::mixed(stacked(&stack, 1), stacked(&stack, 0), noise::share(all, at, site.p)),
            );
        }
        if has.check {
            next = F::branch(
                op.eq(F::Uint::splat(Op::Check as u32)),
                next,
                #[inline(always)]
                || checkerboard::choose(all, at, uv),
            );
        }
        let (next, mut next_uv) = next;
        let mut next_footprint = footprint;
        let is_check = op.eq(F::Uint::splat(Op::Check as u32));
        let is_mix = op.eq(F::Uint::splat(Op::Mix as u32));
        let is_restore = op.eq(F::Uint::splat(Op::Restore as u32));
        let is_scale = op.eq(F::Uint::splat(Op::Scale as u32));
        let takes_two = is_scale | is_restore | op.eq(F::Uint::splat(Op::Noise as u32));
        if has.mix {
            let mixed = mix::mixed(stacked(&stack, 2), stacked(&stack, 1), stacked(&stack, 0).r);
            top = Rgb::select(is_mix, mixed, top);
        }
        if has.scale {
            top = Rgb::select(is_scale, stacked(&stack, 1) * stacked(&stack, 0), top);
        }
        if has.restore {
            let is_save = op.eq(F::Uint::splat(Op::Save as u32));
            top = Rgb::select(is_save, Rgb::new(uv[0], uv[1], footprint), top);
            let (above, saved) = (stacked(&stack, 0), stacked(&stack, 1));
            top = Rgb::select(is_restore, above, top);
            next_uv =
                [F::select(is_restore, saved.r, next_uv[0]), F::select(is_restore, saved.g, next_uv[1])];
            next_footprint = F::select(is_restore, saved.b, next_footprint);
        }
        if self.has_mipmaps && has.check {
            let within = next_footprint * checkerboard::uv_area_scale::<F>(all, at);
            next_footprint = F::select(is_check, within, next_footprint);
        }
        let mut new = [top; D];
        let mut i = 0;
        while i < D {
            let below = if i == 0 { top } else { stack[i - 1] };
            let mut own = below;
            if has.scale | has.noise | has.restore {
                let above = if i == 0 { top } else { stacked(&stack, i + 1) };
                own = Rgb::select(takes_two, above, own);
            }
            if has.mix {
                let above = if i == 0 { top } else { stacked(&stack, i + 2) };
                own = Rgb::select(is_mix, above, own);
            }
            if has.check {
                own = Rgb::select(is_check, stack[i], own);
            }
            new[i] = own;
            i += 1;
        }
        (next, (next_uv, next_footprint), new)
    }
}

/// The colour at a depth of the stack, counted from the top.
#[inline(always)]
fn stacked<F: Float, const D: usize>(stack: &[Rgb<F>; D], i: usize) -> Rgb<F> {
    if i < D { stack[i] } else { Rgb::black() }
}
