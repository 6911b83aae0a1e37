//! Rays and their hits.

use glam::DVec3;
use stride::math::lanes::{Kernel, Level, dispatch};
use stride::math::{LaneFloat, LaneUint, Mask, Ray, Vec3};
use stride::world::World;

/// Rays, one column for each coordinate. Their number is a multiple of sixteen.
pub struct Rays {
    pub o: [Vec<f32>; 3],
    pub d: [Vec<f32>; 3],
}

/// The distances and surfaces of rays' hits.
pub struct Answers {
    pub t: Vec<f32>,
    pub primitive: Vec<u32>,
}

impl Rays {
    pub fn new(rays: impl Iterator<Item = (DVec3, DVec3)>) -> Rays {
        let (mut o, mut d) = ([const { Vec::new() }; 3], [const { Vec::new() }; 3]);
        for (origin, direction) in rays {
            for axis in 0..3 {
                o[axis].push(origin[axis] as f32);
                d[axis].push(direction[axis] as f32);
            }
        }
        let whole = o[0].len() & !15;
        o.iter_mut().chain(&mut d).for_each(|column| column.truncate(whole));
        Rays { o, d }
    }

    pub fn len(&self) -> usize {
        self.o[0].len()
    }

    pub fn answers(&self) -> Answers {
        Answers { t: vec![0.0; self.len()], primitive: vec![0; self.len()] }
    }

    /// A ray's origin and direction.
    pub fn get(&self, i: usize) -> (DVec3, DVec3) {
        let wide = |columns: &[Vec<f32>; 3]| DVec3::from([0, 1, 2].map(|axis| f64::from(columns[axis][i])));
        (wide(&self.o), wide(&self.d))
    }

    /// The first hit of each ray.
    pub fn closest(&self, level: Level, world: &World, answers: &mut Answers) {
        dispatch(level, Ask::<true> { world, rays: self, answers });
    }

    /// Whether each ray has a hit. Its distance is −∞ if so.
    pub fn any(&self, level: Level, world: &World, answers: &mut Answers) {
        dispatch(level, Ask::<false> { world, rays: self, answers });
    }
}

struct Ask<'a, const CLOSEST: bool> {
    world: &'a World,
    rays: &'a Rays,
    answers: &'a mut Answers,
}

impl<const CLOSEST: bool> Kernel for Ask<'_, CLOSEST> {
    type Output = ();

    #[inline(always)]
    fn run<F: LaneFloat>(self) {
        let Rays { o, d } = self.rays;
        let all = F::Mask::splat(true);
        for i in (0..self.rays.len()).step_by(F::LANES) {
            let ray = Ray::new(
                Vec3::new(F::load(&o[0][i..]), F::load(&o[1][i..]), F::load(&o[2][i..])),
                Vec3::new(F::load(&d[0][i..]), F::load(&d[1][i..]), F::load(&d[2][i..])),
            );
            if CLOSEST {
                let hit = self.world.intersect(&ray, all);
                hit.t.store(&mut self.answers.t[i..]);
                hit.surface.store(&mut self.answers.primitive[i..]);
            } else {
                let met = self.world.occluded(&ray, F::splat(f32::INFINITY), all, F::Mask::splat(false));
                let t = F::select(met, F::splat(f32::NEG_INFINITY), F::splat(f32::INFINITY));
                t.store(&mut self.answers.t[i..]);
            }
        }
    }
}
