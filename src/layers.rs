//! A rendered image and its auxiliary layers, linear, in float32. [`crate::output::exr`] reads and writes them.

/// A layer of an image ("arbitrary output variable").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Aov {
    /// Radiance: the image itself.
    Beauty,
    /// Radiance of emission and direct light.
    Direct,
    /// Radiance of all other light: beauty − direct.
    Indirect,
    /// Ambient occlusion: 1 is unoccluded, 0 is fully occluded; three equal channels.
    Ao,
    /// Shading normal in world space, unit length on surfaces.
    Normal,
    /// Distance along the view's forward axis in metres, +∞ on the sky; three equal channels.
    Depth,
    /// The surface's base colour.
    Albedo,
    /// Share of the surface that is neither metallic nor transmitting, 0 to 1: (1 − metallic) · (1 − transmission). 0 on
    /// the sky and on unlit surfaces; three equal channels.
    Diffuse,
}

impl Aov {
    /// Every layer, in the order of files.
    pub const ALL: &'static [Self] =
        &[Self::Beauty, Self::Direct, Self::Indirect, Self::Ao, Self::Normal, Self::Depth, Self::Albedo, Self::Diffuse];

    /// The name in flags and the prefix of OpenEXR channels.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Beauty => "beauty",
            Self::Direct => "direct",
            Self::Indirect => "indirect",
            Self::Ao => "ao",
            Self::Normal => "normal",
            Self::Depth => "depth",
            Self::Albedo => "albedo",
            Self::Diffuse => "diffuse",
        }
    }

    /// The layer with this name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|a| a.name() == name)
    }
}

impl std::fmt::Display for Aov {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.name())
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
