//! Settings with a closed list of named values.

/// Closed lists of named choices, parsed from and printed as the names of files and flags. Shaders receive the index of
/// a choice in its list.
macro_rules! choices {
    ($($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $text:literal),+ $(,)? })+) => {$(
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize)]
        pub enum $name { $($(#[$vdoc])* #[serde(rename = $text)] $variant),+ }

        impl $name {
            /// All choices in the order of the documentation.
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
    /// The number of indirect bounces.
    Bounces {
        One = "1", Two = "2",
        /// Each frame continues from the stored light of the previous one.
        All = "all",
    }

    /// The way in which triangles are recorded, and in which every voxel that a triangle touches is found.
    #[derive(Default)]
    Conservative {
        #[default]
        /// Compute passes visit the columns of voxels around each triangle, on every device.
        Compute = "compute",
        /// As in the talk, a geometry shader dilates triangles; pixels are columns of voxels.
        GeometryShader = "geometry-shader",
        /// `VK_EXT_conservative_rasterization`, if the device supports it.
        Hardware = "hardware",
    }

    /// Where the light of point, spot and directional lights is computed.
    DirectLight {
        /// At every sample, so that edges of shadows are anti-aliased.
        Samples = "samples",
        /// Once per pixel and surface.
        Pixels = "pixels",
    }

    /// The resolution at which diffuse light is gathered.
    GatherResolution { Full = "full", Half = "half", Quarter = "quarter" }

    /// The way in which exact rays find triangles.
    #[derive(Default)]
    Tracer {
        #[default]
        /// By ray queries if the device supports them, else through the tree.
        Auto = "auto",
        /// By shaders through the program's own bounding volume hierarchy, on every device.
        Tree = "tree",
        /// By `VK_KHR_ray_query`.
        Query = "query",
    }

    /// Shadows of lights.
    Shadows {
        None = "none",
        /// By the method, such as the talk's shadow cones.
        Method = "method",
        /// By exact rays.
        Rays = "rays",
    }

    /// Light of emissive surfaces.
    LampLight {
        /// By the method's gathering alone, as in the talk: the first gather finds a lamp's light.
        Gathered = "gathered",
        /// As area lights with shadows by exact rays; the method does not gather their emission again.
        Sampled = "sampled",
    }
}

impl GatherResolution {
    /// Pixels of the image per gathered pixel, along each side.
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
    /// The number of bounces whose light a method stores.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn stored(self) -> u32 {
        if self == Self::One { 1 } else { 2 }
    }

    /// The number of bounces that a ray may take, for shaders; `all` is more than any ray takes.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn limit(self) -> u32 {
        if self == Self::All { 1 << 30 } else { self.stored() }
    }
}

impl Conservative {
    /// Names from the Vulkan specification of features that the choice needs in addition to those of every device.
    pub fn needs(self) -> &'static [&'static str] {
        match self {
            Self::Compute => &[],
            Self::GeometryShader => &["geometryShader"],
            Self::Hardware => &["geometryShader", "VK_EXT_conservative_rasterization"],
        }
    }
}
