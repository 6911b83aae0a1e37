//! The layers of a film as channels of a picture file.

use super::Film;
use super::cryptomatte::Mattes;
use super::layers::{Channel, Layer};

impl Film {
    /// The channels of a layer, with the names of entities and materials; empty if the film does not store the layer.
    pub fn channels(&self, layer: Layer, mattes: &Mattes) -> Vec<Channel> {
        let layout = self.layout();
        let pixels = layout.places();
        let values = match layer {
            Layer::Variance => pixels.map(|pixel| self.variance(pixel) as f32).collect(),
            Layer::Samples => pixels.map(|pixel| self.count(pixel) as f32).collect(),
            _ => return self.first_hits().channels(layer, pixels, layer.names(mattes)),
        };
        let channel = |name| Channel { name, values: Vec::clone(&values) };
        layer.channels().into_iter().map(channel).collect()
    }
}
