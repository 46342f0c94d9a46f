//! A rendered image and its auxiliary layers, linear, in float32. [`crate::output::exr`] reads and writes them.

use crate::settings::choices;

choices! {
    /// A layer of an image ("arbitrary output variable"), in the order of files. Its name is used in flags and before the
    /// OpenEXR channels.
    Aov {
        /// Radiance: the image itself.
        Beauty = "beauty",
        /// Share of the pixel that surfaces cover; three equal channels. OpenEXR's channel A, and with it colours are premultiplied.
        Alpha = "alpha",
        /// Radiance of emission and direct light.
        Direct = "direct",
        /// Radiance of all other light: beauty − direct.
        Indirect = "indirect",
        /// Ambient occlusion: 1 is unoccluded, 0 is fully occluded; three equal channels.
        Ao = "ao",
        /// Shading normal in world space, unit length on surfaces.
        Normal = "normal",
        /// Distance along the view's forward axis in metres, +∞ on the sky; three equal channels.
        Depth = "depth",
        /// The surface's base colour.
        Albedo = "albedo",
        /// Share of the surface that is neither metallic nor transmitting, 0 to 1: (1 − metallic) · (1 − transmission). 0 on
        /// the sky and on unlit surfaces; three equal channels.
        Diffuse = "diffuse",
    }
}

/// An image with its layers. Rows from the top, `width · height` pixels each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Layers {
    pub width: u32,
    pub height: u32,
    /// [`Aov::Beauty`] is always first.
    pub layers: Vec<(Aov, Vec<[f32; 3]>)>,
}

impl Layers {
    /// An image with one layer.
    pub fn new(width: u32, height: u32, beauty: Vec<[f32; 3]>) -> Self {
        Self { width, height, layers: vec![(Aov::Beauty, beauty)] }
    }

    /// The pixels of one layer; `None` if it is absent.
    pub fn get(&self, aov: Aov) -> Option<&[[f32; 3]]> {
        self.layers.iter().find(|(a, _)| *a == aov).map(|(_, pixels)| pixels.as_slice())
    }

    /// The image itself; empty if absent.
    pub fn beauty(&self) -> &[[f32; 3]] {
        self.get(Aov::Beauty).unwrap_or_default()
    }
}
