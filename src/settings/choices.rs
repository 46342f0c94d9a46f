//! The settings that are one of a few words.

/// Closed lists of named choices: parsed from and printed as the names used in files and flags. Shaders are given the
/// place of a choice in its list.
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
        /// Each frame starts from the stored light of the last one.
        All = "all",
    }

    /// How triangles are recorded, and how every voxel that one touches is found.
    #[derive(Default)]
    Conservative {
        #[default]
        /// Compute passes go through the columns of voxels about each triangle: on every device.
        Compute = "compute",
        /// As in the talk: a geometry shader dilates triangles, whose pixels are columns of voxels.
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

    /// At how many pixels diffuse light is gathered.
    GatherResolution { Full = "full", Half = "half", Quarter = "quarter" }

    /// How exact rays find triangles.
    #[derive(Default)]
    Tracer {
        #[default]
        /// By queries where the device has them, else through the tree.
        Auto = "auto",
        /// Through a tree of boxes, by shaders: on every device.
        Tree = "tree",
        /// By `VK_KHR_ray_query`.
        Query = "query",
    }

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
    /// Bounces whose light a method stores.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn stored(self) -> u32 {
        if self == Self::One { 1 } else { 2 }
    }
}

impl Conservative {
    /// The names, in the Vulkan specification, of what a device must have for it beside what every device must.
    pub fn needs(self) -> &'static [&'static str] {
        match self {
            Self::Compute => &[],
            Self::GeometryShader => &["geometryShader"],
            Self::Hardware => &["geometryShader", "VK_EXT_conservative_rasterization"],
        }
    }
}
