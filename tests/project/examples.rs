//! The programs in `examples/` work, with few samples.

#[allow(dead_code, unreachable_pub, reason = "a program, of which a part is called here")]
#[path = "../../examples/buffer.rs"]
pub(super) mod buffer;
#[allow(dead_code, unreachable_pub, reason = "a program, of which a part is called here")]
#[path = "../../examples/histogram.rs"]
mod histogram;
#[allow(dead_code, unreachable_pub, reason = "a program, of which a part is called here")]
#[path = "../../examples/progress.rs"]
mod progress;

use stride::{Render, Scene};

fn cover() -> Scene {
    Scene::load("scenes/cover.toml").expect("a scene")
}

#[test]
fn the_buffer_example_shows_the_ball() {
    let file = buffer::ppm(&buffer::scene(), 2).expect("a picture");
    let pixels = file.strip_prefix(b"P6\n320 240\n255\n").expect("the header of a PPM file");
    assert_eq!(pixels.len(), 320 * 240 * 3);
    let pixel = |x: usize, y: usize| &pixels[3 * (y * 320 + x)..][..3];
    // The sky is the darkest blue; copper reflects more red than blue of the white floor.
    assert!(pixel(10, 2)[2] > pixel(10, 2)[0], "{:?}", pixel(10, 2));
    assert!(pixel(160, 160)[0] > pixel(160, 160)[2], "{:?}", pixel(160, 160));
}

#[test]
fn the_progress_example_ends_and_stops_an_endless_render() {
    let mut out = Vec::new();
    let render = Render::new(&cover()).size((32, 24)).samples(8).threads(2);
    let report = progress::watch(render.start().expect("a render"), 60.0, &mut out).expect("a picture");
    let said = String::from_utf8(out).expect("text");
    assert!(report.whole && said.ends_with('\n') && said.contains("8 spp in "), "{said}");

    // Many minutes of samples: the end is requested at the first progress.
    const SAMPLES: u32 = 1 << 24;
    let long = Render::new(&cover()).size((32, 24)).samples(SAMPLES).threads(2);
    let report = progress::watch(long.start().expect("a render"), 0.0, &mut Vec::new()).expect("a picture");
    assert!(report.spp_range[0] < u64::from(SAMPLES), "{:?}", report.totals);
}

#[test]
fn the_histogram_counts_every_sample_once() {
    let (counts, black) = histogram::histogram(&cover(), 3).expect("samples");
    assert_eq!(counts.iter().sum::<u64>() + black, 160 * 120 * 3);
    assert!(counts.iter().filter(|&&count| count > 0).count() > 5, "{counts:?}");
}
