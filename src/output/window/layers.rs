//! Converts layers with values of any range to pictures.

use crate::film::layers::NO_DEPTH;
use crate::film::tone::srgb_to_linear;
use crate::film::{Channel, Picture, Snapshot};

/// A layer as shown in the window.
#[derive(Clone, Debug, PartialEq)]
pub struct LayerView {
    /// Its name: "albedo".
    pub name: String,
    /// The picture to show, in linear light from black to white.
    pub picture: Picture,
    /// The values of each pixel, one vector per channel.
    pub values: Vec<Vec<f32>>,
}

/// The relative error of a pixel that is shown as white.
const WHITE_ERROR: f64 = 0.25;

/// The layers of these channels, grouped by the part of their names before the last dot.
pub fn views(channels: &[Channel], width: u32, height: u32) -> Vec<LayerView> {
    let name = |channel: &Channel| channel.name.rsplit_once('.').map_or("", |(layer, _)| layer).to_owned();
    let mut views: Vec<LayerView> = Vec::new();
    let mut rest = channels;
    while let [first, ..] = rest {
        let layer = name(first);
        let count = rest.iter().take_while(|channel| name(channel) == layer).count();
        let (own, others) = rest.split_at(count);
        let values: Vec<Vec<f32>> = own.iter().map(|channel| channel.values.clone()).collect();
        let rgb = shown(&layer, &values);
        views.push(LayerView { name: layer, picture: Picture { width, height, rgb }, values });
        rest = others;
    }
    views
}

fn shown(layer: &str, values: &[Vec<f32>]) -> Vec<[f32; 3]> {
    let pixels = values.first().map_or(0, Vec::len);
    let code = |value: f32| srgb_to_linear(f64::from(value).clamp(0.0, 1.0)) as f32;
    let of = |channel: usize, i: usize| values.get(channel).map_or(0.0, |values| values[i]);
    let each = |colour: &dyn Fn(usize) -> [f32; 3]| (0..pixels).map(colour).collect();
    match layer {
        // Colours are shown unchanged, directions around grey, coordinates by their fractions.
        "albedo" => each(&|i| [of(0, i), of(1, i), of(2, i)]),
        "normal" => each(&|i| [0, 1, 2].map(|c| code(of(c, i) * 0.5 + 0.5))),
        "uv" => each(&|i| [code(of(0, i).rem_euclid(1.0)), code(of(1, i).rem_euclid(1.0)), 0.0]),
        // All others range from their minimum to their maximum; near depths are bright.
        _ => {
            let far = |v: &f32| v.is_finite() && *v < NO_DEPTH;
            let range = |values: &Vec<f32>| {
                let there = || values.iter().copied().filter(far);
                (there().fold(f32::INFINITY, f32::min), there().fold(f32::NEG_INFINITY, f32::max))
            };
            let ranges: Vec<(f32, f32)> = values.iter().map(range).collect();
            let scaled = |c: usize, i: usize| {
                let (least, most) = ranges[c];
                let value = of(c, i);
                let part = if most > least { (value - least) / (most - least) } else { 0.5 };
                if !far(&value) { 0.0 } else { code(if layer == "depth" { 1.0 - part } else { part }) }
            };
            match values.len() {
                1 => each(&|i| [scaled(0, i); 3]),
                count => each(&|i| [0, 1, 2].map(|c| if c < count { scaled(c, i) } else { 0.0 })),
            }
        }
    }
}

/// The estimated error of a pixel's mean, absolute and relative to its radiance, if it is known.
pub fn error_of(snapshot: &Snapshot, pixel: usize) -> Option<[f64; 2]> {
    let error = f64::from(*snapshot.statistics.variances.get(pixel)?).sqrt();
    let radiance = snapshot.picture.rgb[pixel].iter().map(|&c| f64::from(c).powi(2)).sum::<f64>().sqrt();
    Some([error, if error > 0.0 { error / radiance } else { 0.0 }])
}

/// The error as a layer: white is a quarter of the radiance or more.
pub fn errors(snapshot: &Snapshot) -> LayerView {
    let Picture { width, height, ref rgb } = snapshot.picture;
    let part = |pixel| error_of(snapshot, pixel).map_or(0.0, |[_, part]| (part / WHITE_ERROR).min(1.0));
    let rgb = (0..rgb.len()).map(|pixel| [srgb_to_linear(part(pixel)) as f32; 3]).collect();
    LayerView { name: "error".into(), picture: Picture { width, height, rgb }, values: Vec::new() }
}

/// The numbers of samples as a layer: white is the maximum.
pub fn samples(snapshot: &Snapshot) -> LayerView {
    let Picture { width, height, .. } = snapshot.picture;
    let most = snapshot.statistics.counts.iter().max().copied().unwrap_or(0).max(1);
    let grey = |&count: &u32| [srgb_to_linear(f64::from(count) / f64::from(most)) as f32; 3];
    let rgb = snapshot.statistics.counts.iter().map(grey).collect();
    LayerView { name: "samples".into(), picture: Picture { width, height, rgb }, values: Vec::new() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(name: &str, values: [f32; 3]) -> Channel {
        Channel { name: name.into(), values: values.to_vec() }
    }

    #[test]
    fn layers_are_scaled_to_their_range() {
        let channels = [
            channel("albedo.R", [0.5, 0.0, 1.0]),
            channel("albedo.G", [0.25, 0.0, 1.0]),
            channel("albedo.B", [0.125, 0.0, 1.0]),
            channel("normal.X", [1.0, 0.0, -1.0]),
            channel("normal.Y", [0.0, 0.0, 0.0]),
            channel("normal.Z", [0.0, 0.0, 0.0]),
            channel("depth.Z", [2.0, 4.0, NO_DEPTH]),
            channel("uv.U", [0.25, 1.25, -0.75]),
            channel("uv.V", [0.0, 0.0, 0.0]),
            channel("x.A", [f32::NAN, 7.0, 7.0]),
            channel("x.B", [1.0, 2.0, 3.0]),
        ];
        let views = views(&channels, 3, 1);
        assert_eq!(
            views.iter().map(|view| view.name.as_str()).collect::<Vec<_>>(),
            ["albedo", "normal", "depth", "uv", "x"]
        );
        let half = srgb_to_linear(0.5) as f32;
        assert_eq!(views[0].picture.rgb[0], [0.5, 0.25, 0.125]);
        assert_eq!(views[1].picture.rgb, [[1.0, half, half], [half; 3], [0.0, half, half]]);
        // Near depths are bright; misses are black, and so is the farthest depth.
        assert_eq!(views[2].picture.rgb, [[1.0; 3], [0.0; 3], [0.0; 3]]);
        let quarter = srgb_to_linear(0.25) as f32;
        assert_eq!(views[3].picture.rgb, [[quarter, 0.0, 0.0]; 3]);
        assert_eq!(views[4].picture.rgb, [[0.0, 0.0, 0.0], [half, half, 0.0], [half, 1.0, 0.0]]);
        assert_eq!(views[2].values, [[2.0, 4.0, NO_DEPTH]]);
    }
}
