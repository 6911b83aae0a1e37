//! Estimators of the same radiance agree tile by tile: Russian roulette on and off, and `path` with
//! `path-naive`.
//!
//! Results are at the significance level stated in `common::tiles`; the seeds of the two sides are independent.

use crate::common::scenes::{
    COVER_LIGHT, cover, emitting, glass, matte, mirror, plane, quad, scene, sized, sphere, v,
};
use crate::common::tiles::{Replicates, Verdict, welch};
use crate::common::tracers::{Method, NUMBERS, Numbers, replicates};
use glam::DVec3;
use stride::scene::{Filter, Scene};

/// A closed white room with paths of ten bounces and more, with mirror, glass and a light: a scene in which roulette
/// matters.
fn bright_room() -> Scene {
    let materials = vec![matte([0.85; 3]), mirror([0.9; 3]), glass(1.5), matte([0.7, 0.8, 0.9])];
    let entities = vec![
        plane(v(0.0, 1.0, 0.0), -3.0, 0),
        plane(v(0.0, -1.0, 0.0), -3.0, 3),
        plane(v(0.0, 0.0, -1.0), -3.0, 0),
        plane(v(0.0, 0.0, 1.0), -2.0, 0),
        plane(v(-1.0, 0.0, 0.0), -8.0, 0),
        plane(v(1.0, 0.0, 0.0), -1.0, 0),
        sphere(v(5.0, 1.5, -1.0), 1.0, 1),
        sphere(v(4.0, -1.2, -1.0), 0.9, 2),
        emitting(quad(v(4.0, -1.0, 2.9), DVec3::Y * 2.0, DVec3::X * 2.0, 0), 2.0),
    ];
    let mut scene = sized(scene(materials, entities), 64, 48);
    scene.film.filter = Filter::Tent { radius: 1.0 };
    scene.render.max_depth = 40;
    scene
}

/// A scene with the emission multiplied by `factor`.
fn brighter(mut scene: Scene, factor: f64) -> Scene {
    for entity in &mut scene.entities {
        entity.emission = entity.emission.map(|e| e * factor);
    }
    scene
}

/// Whether the comparison passes: `None` if it does, otherwise its result and the means for the message.
fn disagreement(a: &Replicates, b: &Replicates, comparisons: usize) -> Option<String> {
    let verdict: Verdict = welch(a, b);
    let told = format!("{verdict}; means {} and {}", a.mean(), b.mean());
    println!("{told}");
    (!verdict.agrees(comparisons)).then_some(told)
}

#[test]
fn russian_roulette_preserves_the_mean_and_two_percent_are_detected() {
    let scene = bright_room();
    for numbers in NUMBERS {
        let samples = 16;
        let with = replicates(Method::Path, numbers, &scene, samples, 100);
        let without = replicates(Method::PathWithoutRoulette, numbers, &scene, samples, 200);
        assert_eq!(disagreement(&with, &without, NUMBERS.len()), None, "{numbers:?}");
        let wrong = replicates(Method::Path, numbers, &brighter(scene.clone(), 1.02), samples, 300);
        assert!(
            disagreement(&wrong, &without, 1_000_000).is_some(),
            "{numbers:?}: an error of 2% is not detected"
        );
    }
}

#[test]
fn on_the_cover_next_event_estimation_matches_naive_paths_and_two_percent_are_detected() {
    let scene = cover(64, 48);
    assert_eq!(scene.entities[COVER_LIGHT].emission, [1.0; 3]);
    // Reflections of the light are infrequent and bright: with fewer samples a tile is not nearly normal.
    let by_chance = replicates(Method::PathNaive, Numbers::Independent, &scene, 256, 400);
    for numbers in NUMBERS {
        let asking = replicates(Method::Path, numbers, &scene, 128, 500);
        assert_eq!(disagreement(&asking, &by_chance, NUMBERS.len()), None, "{numbers:?}");
        let wrong = replicates(Method::Path, numbers, &brighter(scene.clone(), 1.02), 128, 600);
        assert!(
            disagreement(&wrong, &by_chance, 1_000_000).is_some(),
            "{numbers:?}: an error of 2% is not detected"
        );
    }
}

#[test]
fn equal_estimators_agree_at_the_rate_of_the_level() {
    let mut scene = sized(bright_room(), 32, 24);
    scene.render.max_depth = 5;
    let sides: Vec<Replicates> = (0..12)
        .map(|side| replicates(Method::Path, Numbers::Independent, &scene, 16, 1000 + 50 * side))
        .collect();
    let failed = sides.chunks(2).filter(|pair| disagreement(&pair[0], &pair[1], 1).is_some()).count();
    // Each fails once in a hundred times; two of six, once in 700.
    assert!(failed < 2, "{failed} of 6 comparisons of a scene with itself failed");
}
