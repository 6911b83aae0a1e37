//! The depth of trees, and the surfaces outside of them. `tests/transport/trees.rs` compares hits with those of an exhaustive
//! search.

use super::build::{Below, Item, LEAF, MAX_DEPTH, Split, build};
use crate::math::{Bounds, Ray, Vec3};
use crate::sampling::Stream;
use crate::shape::{NOTHING, Quad, Sphere};
use crate::world::{AcceleratorChoice, Simple, World};
use glam::DVec3;
use rand::RngExt;

#[test]
fn shapes_without_finite_bounds_stay_outside_the_tree() {
    let mut bounded = Simple::default();
    bounded.spheres.push((Sphere::new(DVec3::X * 3e38, 2e38), 0));
    bounded.spheres.push((Sphere::new(DVec3::X * 5.0, 1.0), 1));
    bounded.quads.push((Quad::new(DVec3::splat(3e38), DVec3::X * 3e38, DVec3::Y), 2));
    let tree = World::new(&bounded, AcceleratorChoice::Bvh);
    assert_eq!((tree.simple.spheres.len(), tree.simple.quads.len()), (1, 1));
    let ray = Ray::new(Vec3::zero(), Vec3::<f32>::splat([1.0, 0.0, 0.0]));
    let hit = tree.intersect(&ray, true);
    assert_eq!((hit.t, hit.surface.0), (4.0, 1));
}

#[test]
fn an_empty_tree_has_no_hits() {
    let tree = World::new(&Simple::default(), AcceleratorChoice::Bvh);
    let ray = Ray::new(Vec3::zero(), Vec3::<f32>::splat([1.0, 0.0, 0.0]));
    assert!(!tree.intersect(&ray, true).is_some() && !tree.occluded(&ray, NOTHING, true, false));
}

/// The depth of a tree. Checks that every box contains those below it, that every primitive is in exactly one leaf, and
/// that leaves hold a single kind.
fn check(splits: &[Split], items: &[Item]) -> usize {
    fn walk(at: usize, splits: &[Split], items: &[Item], seen: &mut Vec<bool>) -> usize {
        let Split { bounds, below } = splits[at];
        match below {
            Below::Two { second } => {
                let children = [at + 1, second as usize];
                for child in children {
                    assert_eq!(bounds, bounds.with(&splits[child].bounds));
                }
                1 + children.map(|child| walk(child, splits, items, seen)).into_iter().max().unwrap_or(0)
            }
            Below::Leaf { first, count } => {
                assert!((1..=LEAF as u32).contains(&count));
                for i in first..first + count {
                    let item = &items[i as usize];
                    assert!(!std::mem::replace(&mut seen[i as usize], true), "twice");
                    assert_eq!(bounds, bounds.with(&item.bounds()));
                    assert_eq!(item.kind(), items[first as usize].kind());
                }
                0
            }
        }
    }
    let mut seen = vec![false; items.len()];
    let depth = walk(0, splits, items, &mut seen);
    assert!(seen.iter().all(|&seen| seen), "a primitive is in no leaf");
    depth
}

#[test]
fn no_tree_is_deeper_than_the_stack() {
    let stream = &mut Stream::new(13, 0, 0);
    let point = |x: f32, y: f32| Bounds::of([[x, y, 0.0]]);
    // Random positions; coincident positions; positions that halve down to the smallest floats.
    let anywhere: Vec<_> = (0..60_000).map(|_| point(stream.random(), stream.random())).collect();
    let heap = vec![point(1.0, 1.0); 3000];
    let halves: Vec<_> = (0..2000).map(|i| point(0.5_f32.powi(i % 150), 0.0)).collect();
    for (boxes, deepest) in [(anywhere, 40), (heap, 12), (halves, MAX_DEPTH)] {
        let make = |(index, bounds)| Item::new(bounds, index as u32 % 2, index as u32);
        let mut items: Vec<_> = boxes.iter().enumerate().map(make).collect();
        let unsorted = items.clone();
        let splits = build(&mut items, 1);
        // The number of threads does not change the tree.
        for threads in [2, 3, 16] {
            let mut copy = unsorted.clone();
            assert!(build(&mut copy, threads) == splits, "{threads} threads");
        }
        let depth = check(&splits, &items);
        assert!(depth <= deepest, "{depth} levels");
    }
}
