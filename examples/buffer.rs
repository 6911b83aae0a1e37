//! Renders a scene that is built in code to memory, and writes it to standard output as a PPM picture:
//!
//! ```sh
//! cargo run --release --example buffer > ball.ppm
//! ```

use std::io::Write;
use stride::scene::{CameraSettings, MatteParameters, MirrorParameters, PlaneParameters, SphereParameters};
use stride::{Error, Render, Scene};

/// A copper ball on a white floor, under a lamp and a blue sky.
pub fn scene() -> Scene {
    let sphere = |center: [f64; 3], radius| SphereParameters { center: center.into(), radius };
    let camera = CameraSettings::looking_at([0.0, -6.0, 2.5], [0.0, 0.0, 0.9]);
    let camera = CameraSettings { vertical_fov: 40.0_f64.to_radians(), ..camera };
    let mut scene = Scene { camera, environment: [0.15, 0.2, 0.3], ..Scene::default() };
    let white = scene.add_material("white", MatteParameters { reflectance: [0.8; 3], roughness: 0.0 });
    let copper = scene.add_material("copper", MirrorParameters { reflectance: [0.9, 0.6, 0.4] });
    scene.add_entity("floor", PlaneParameters { normal: [0.0, 0.0, 1.0].into(), distance: 0.0 }, white);
    scene.add_entity("ball", sphere([0.0, 0.0, 1.0], 1.0), copper);
    scene.add_entity("lamp", sphere([2.0, -2.0, 4.0], 0.7), white).emission = [12.0, 11.0, 9.0];
    scene
}

/// A picture of a scene with `samples` samples per pixel, as a PPM file.
pub fn ppm(scene: &Scene, samples: u32) -> Result<Vec<u8>, Error> {
    let report = Render::new(scene).size((320, 240)).samples(samples).run()?;
    let mut file = b"P6\n320 240\n255\n".to_vec();
    report.srgb().iter().for_each(|pixel| file.extend(pixel));
    Ok(file)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    Ok(std::io::stdout().write_all(&ppm(&scene(), 64)?)?)
}
