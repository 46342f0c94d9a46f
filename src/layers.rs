//! What a renderer hands back: an image and its auxiliary layers, linear, in float32.
//!
//! Reading and writing OpenEXR is in [`crate::output::exr`].

/// A layer of an image ("arbitrary output variable").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Aov {
    /// Radiance: the image itself.
    Beauty,
    /// Radiance of emission and direct light alone.
    Direct,
    /// Radiance of everything else: beauty − direct.
    Indirect,
    /// Ambient occlusion: 1 is open, 0 is closed; three equal channels.
    Ao,
    /// Shading normal in world space, unit length where something is hit.
    Normal,
    /// Distance along the view's forward axis in metres, +∞ on the sky; three equal channels.
    Depth,
    /// The surface's base colour.
    Albedo,
    /// Share of the surface that is neither metal nor transmits, 0 to 1: (1 − metallic) · (1 − transmission). 0 on the sky
    /// and where a surface is unlit; three equal channels.
    Diffuse,
}

impl Aov {
    /// Every layer, in the order in which files hold them.
    pub const ALL: &'static [Self] =
        &[Self::Beauty, Self::Direct, Self::Indirect, Self::Ao, Self::Normal, Self::Depth, Self::Albedo, Self::Diffuse];

    /// The name used in flags and as the prefix of OpenEXR channels.
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

    /// The layer called `name`.
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
    /// An image without further layers.
    pub fn new(width: u32, height: u32, beauty: Vec<[f32; 3]>) -> Self {
        Self { width, height, layers: vec![(Aov::Beauty, beauty)] }
    }

    /// The pixels of one layer, if it is there.
    pub fn get(&self, aov: Aov) -> Option<&[[f32; 3]]> {
        self.layers.iter().find(|(a, _)| *a == aov).map(|(_, pixels)| pixels.as_slice())
    }

    /// The image itself; empty if there is none.
    pub fn beauty(&self) -> &[[f32; 3]] {
        self.get(Aov::Beauty).unwrap_or_default()
    }
}
