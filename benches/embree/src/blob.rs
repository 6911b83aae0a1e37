//! Meshes by formula: a sphere with several octaves of bumps.

use glam::DVec3;
use rand::RngExt;
use std::collections::HashMap;
use stride::sampling::Stream;
use stride::shape::Mesh;

/// A sphere of 20·4ⁿ triangles: an icosahedron whose triangles are divided into four n times.
pub struct Icosphere {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
}

impl Icosphere {
    pub fn new(level: u32) -> Icosphere {
        let g = (1.0 + 5.0_f64.sqrt()) / 2.0;
        let mut vertices: Vec<DVec3> = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)]
            .into_iter()
            .flat_map(|(a, b)| [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)])
            .map(DVec3::normalize)
            .collect();
        // Edges are the shortest pairs; outward is away from the centre.
        let near = |a: usize, b: usize| vertices[a].dot(vertices[b]) > 0.4;
        let mut triangles = Vec::new();
        for a in 0..12 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    if near(a, b) && near(b, c) && near(c, a) {
                        let outward =
                            (vertices[b] - vertices[a]).cross(vertices[c] - vertices[a]).dot(vertices[a]);
                        triangles.push(if outward > 0.0 { [a, b, c] } else { [a, c, b] }.map(|i| i as u32));
                    }
                }
            }
        }
        for _ in 0..level {
            let mut middles = HashMap::new();
            let mut finer = Vec::with_capacity(4 * triangles.len());
            for &[a, b, c] in &triangles {
                let mut middle = |a: u32, b: u32| {
                    *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                        vertices.push((vertices[a as usize] + vertices[b as usize]).normalize());
                        vertices.len() as u32 - 1
                    })
                };
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
            }
            triangles = finer;
        }
        Icosphere { vertices, triangles }
    }

    /// A blob of about radius one around the origin: seven octaves of four waves each.
    pub fn blob(&self, seed: u32) -> Mesh {
        let stream = &mut Stream::new(seed, 0, 0);
        let mut waves = Vec::new();
        let (mut height, mut frequency) = (0.16, 2.2);
        for _ in 0..7 {
            for _ in 0..4 {
                let k = direction(stream) * frequency * std::f64::consts::PI;
                waves.push((k, stream.random_range(0.0..std::f64::consts::TAU), height / 4.0));
            }
            (height, frequency) = (height * 0.55, frequency * 2.05);
        }
        let displaced = self.vertices.iter().map(|v| {
            let bump: f64 = waves.iter().map(|(k, phase, height)| height * (v.dot(*k) + phase).sin()).sum();
            (*v * (1.0 + bump)).to_array().map(|x| x as f32)
        });
        Mesh { positions: displaced.collect(), triangles: self.triangles.clone(), ..Mesh::default() }
    }
}

/// A uniformly distributed direction.
pub fn direction(stream: &mut Stream) -> DVec3 {
    let z = stream.random_range(-1.0..1.0_f64);
    let (sin, cos) = stream.random_range(0.0..std::f64::consts::TAU).sin_cos();
    let r = (1.0 - z * z).sqrt();
    DVec3::new(r * cos, r * sin, z)
}
