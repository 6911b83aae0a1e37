//! Prints a histogram of the brightness of a scene's samples:
//!
//! ```sh
//! cargo run --release --example histogram -- scenes/cover.toml
//! ```

use stride::{Error, Render, Scene};

/// The exponents of the histogram's bins: the lowest one, and their number.
const LEAST: i32 = -12;
const POWERS: usize = 24;

/// The number of samples whose brightest channel is from 2ⁿ to 2ⁿ⁺¹ W·m⁻²·sr⁻¹, for n from [`LEAST`] on, and the number
/// of black samples.
pub fn histogram(scene: &Scene, samples: u32) -> Result<([u64; POWERS], u64), Error> {
    let (mut counts, mut black) = ([0; POWERS], 0);
    Render::new(scene).size((160, 120)).samples(samples).run_with_samples(|samples| {
        for sample in samples {
            let brightest = sample.radiance.into_iter().fold(0.0, f32::max);
            let power = (brightest.log2().floor() as i32).saturating_sub(LEAST);
            match brightest > 0.0 {
                true => counts[power.clamp(0, POWERS as i32 - 1) as usize] += 1,
                false => black += 1,
            }
        }
    })?;
    Ok((counts, black))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name a scene")?;
    let (counts, black) = histogram(&Scene::load(path)?, 64)?;
    let most = counts.iter().copied().max().unwrap_or(0).max(1);
    for (power, count) in (LEAST..).zip(counts) {
        println!("2^{power:<3} {}", "#".repeat((60 * count / most) as usize));
    }
    println!("black {black}");
    Ok(())
}
