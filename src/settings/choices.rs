//! The settings that are one of a few words.

/// Closed lists of named choices: parsed from and printed as the names used in files and flags. Shaders are given the place of a choice
/// in its list.
macro_rules! choices {
    ($($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal),+ $(,)? })+) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$vdoc])* #[serde(rename = $text)] $variant),+ }

        impl $name {
            /// Every choice, in the order of the docs.
            pub const ALL: &'static [Self] = &[$(Self::$variant),+];

            /// The name used in files and flags.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$variant => $text),+ }
            }
        }

        impl std::fmt::Display for $name {
            fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str(self.name())
            }
        }

        impl From<$name> for $crate::vk::Value {
            fn from(choice: $name) -> Self {
                Self::Uint(choice as u32)
            }
        }
    )+};
}
pub(crate) use choices;

choices! {
    /// How much indirect light there is.
    Bounces {
        One = "1", Two = "2",
        /// The last frame's second volume lights the first: two more bounces per frame.
        All = "all",
    }

    /// How every voxel column that a triangle touches gets a fragment.
    Conservative {
        /// A geometry shader dilates triangles: on every device.
        GeometryShader = "geometry-shader",
        /// `VK_EXT_conservative_rasterization`, where a device has it.
        Hardware = "hardware",
    }

    /// Where the light of point, spot and directional lights is computed.
    DirectLight {
        /// At every sample: shadows' edges are anti-aliased.
        Samples = "samples",
        /// Once per pixel and surface.
        Pixels = "pixels",
    }

    /// How what is seen is shaded.
    Shading {
        /// Packed where triangles are small: where there is one for every 64 pixels of the image.
        Auto = "auto",
        /// Triangle by triangle, as the rasteriser makes fragments: as in the talk.
        Drawn = "drawn",
        /// Every pixel's fragments in a list, one beside the other.
        Packed = "packed",
    }

    /// At how many pixels diffuse light is gathered.
    GatherResolution { Full = "full", Half = "half", Quarter = "quarter" }

    /// How lights are shadowed.
    Shadows {
        None = "none",
        /// By the method: the talk's shadow cones.
        Method = "method",
        /// By exact rays.
        Rays = "rays",
    }

    /// How emissive surfaces light the scene.
    LampLight {
        /// By the method's gathering alone, as in the talk: the first gather finds a lamp's light.
        Gathered = "gathered",
        /// As area lights, shadowed by exact rays; the method does not gather their emission again.
        Sampled = "sampled",
    }
}

/// Up to so many pixels of an image per triangle of the scene, packing its fragments is no slower: measured on boxes, a gallery, a terrain and an
/// atrium.
const PIXELS_OF_SMALL: u64 = 64;

impl Shading {
    /// Whether fragments are packed in an image of such a size of a scene of so many triangles.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn packs(self, (width, height): (u32, u32), triangles: u32) -> bool {
        match self {
            Self::Auto => PIXELS_OF_SMALL * u64::from(triangles) >= u64::from(width) * u64::from(height),
            Self::Drawn => false,
            Self::Packed => true,
        }
    }
}

impl GatherResolution {
    /// Pixels of the image per gathered one, along each side.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn scale(self) -> u32 {
        match self {
            Self::Full => 1,
            Self::Half => 2,
            Self::Quarter => 4,
        }
    }
}

impl Bounces {
    /// Volumes that are filled.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn volumes(self) -> u32 {
        if self == Self::One { 1 } else { 2 }
    }
}
