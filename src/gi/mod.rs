//! Global illumination: the methods of the list in `src/settings/methods/mod.rs`, and their interface.

mod bounces;
mod cascades;
mod light_sums;

use std::sync::Arc;

use glam::Vec3;

use crate::Result;
use crate::ground::constants::Features;
use crate::ground::grid::GridPlace;
use crate::ground::memory_plan::MemoryRow;
use crate::ground::volume::LightVolume;
pub use crate::ground::wants::{CoarseLight, OnDemand, Wants};
use crate::ground::{Counts, Ground};
pub use crate::settings::Method;
use crate::settings::Settings;
use crate::vk::{Bind, Constant, Context, Image, Recorder};

/// Declares the modules of the list of methods, and the functions of a [`Method`].
macro_rules! dispatch {
    ($($(#[$doc:meta])* $variant:ident = $name:literal in $module:ident),+ $(,)?) => {
        $(pub mod $module;)+

        impl Method {
            /// Requests of the method to the ground.
            pub fn wants(self, settings: &Settings) -> Wants {
                match self { $(Self::$variant => <$module::Lighting as IndirectMethod>::wants(settings)),+ }
            }

            /// Memory of the method's resources, before they are created.
            pub fn plan(self, settings: &Settings) -> Vec<MemoryRow> {
                match self { $(Self::$variant => <$module::Lighting as IndirectMethod>::plan(settings)),+ }
            }

            /// Compiles the method's passes and creates its volumes.
            ///
            /// # Errors
            /// Too little memory, or a lost device.
            pub fn make(self, maker: &Maker) -> Result<Box<dyn IndirectMethod>> {
                Ok(match self { $(Self::$variant => Box::new(<$module::Lighting as IndirectMethod>::new(maker)?)),+ })
            }

            /// The unit of work of the method's passes, by the beginnings of their names.
            pub fn pass_units(self) -> &'static [(&'static str, PassUnit)] {
                match self { $(Self::$variant => $module::PASS_UNITS),+ }
            }
        }
    };
}
crate::settings::methods!(dispatch);

/// A method of lighting surfaces by other surfaces. It computes its light from the ground, and its GLSL
/// (`glsl/gi/<name>/look_up.glsl`) returns the light that a surface receives from other surfaces:
/// - `vec4 look_up_diffuse(Surface s, uvec3 place)`: irradiance/π in stored radiance, including the sky, and the
///   unoccluded share of the hemisphere; directions may depend on `place`, which is a pixel or a voxel;
/// - `METHOD_GATHERS_LOBES` and `vec4 look_up_for_view(Surface s, vec3 view, uvec3 place, out vec3 mirrored)`, with
///   [`Wants::gathers_lobes`]: in addition, the stored radiance that a rough lobe reflects to a viewer;
/// - `void add_glossy(inout Outgoing sent, Surface s, Viewed v)`: adds the light that the surface reflects specularly
///   and transmits;
/// - `const bool FINDS_LAMPS`: whether `add_glossy` also finds sampled lamps;
/// - `vec3 look_up_specular(Surface s)`, if it is used to light list items: specular light of a glossy surface without
///   a viewer;
/// - `METHOD_SHADOWS` and `float method_shadow(…)`, if the method has its own shadows.
///
/// A method does not depend on windows, files, charts or other methods.
pub trait IndirectMethod: Send {
    /// Requests of the method to the ground.
    fn wants(settings: &Settings) -> Wants
    where
        Self: Sized;

    /// Memory of [`IndirectMethod::new`].
    fn plan(settings: &Settings) -> Vec<MemoryRow>
    where
        Self: Sized;

    /// # Errors
    /// Too little memory, or a lost device.
    fn new(maker: &Maker) -> Result<Self>
    where
        Self: Sized;

    /// The places of the further grids that it requested, for this frame. `eye` is in voxels of the base grid.
    fn grids(&self, _eye: Vec3) -> Vec<GridPlace> {
        Vec::new()
    }

    /// Records the passes that compute its light from this frame's lists.
    fn update(&self, recorder: &mut Recorder, ground: &Ground, update: &Update);

    /// The method, if it lights items on demand; `None` if `update` lights all.
    fn on_demand(&self) -> Option<&dyn OnDemand> {
        None
    }

    /// Constants of its look-up, in addition to the ground's.
    fn constants(&self) -> &[Constant];

    /// Bindings of its look-up: resources of the method and of the ground.
    fn binds<'a>(&'a self, ground: &'a Ground) -> Vec<Bind<'a>>;

    /// Its volumes of faces, one per bounce.
    fn volumes(&self) -> &[LightVolume] {
        &[]
    }

    /// All images that store its light.
    fn images(&self) -> Vec<&Image> {
        self.volumes().iter().flat_map(|volume| &volume.images).collect()
    }

    /// Numbers that coarsely represent all light of the method: feedback has settled once they no longer change.
    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.volumes().last().map(LightVolume::coarse)
    }
}

/// The description from which a method is made.
pub struct Maker<'a> {
    pub context: &'a Arc<Context>,
    pub settings: &'a Settings,
    pub features: Features,
    pub counts: &'a Counts,
}

/// Changes since the last frame that affect the method's light.
#[derive(Clone, Copy, Debug)]
pub struct Update {
    /// The lists or the method are new; otherwise both are those of the previous frame.
    pub lists: bool,
    /// The method has the light of the previous frame, and continues from it.
    pub history: bool,
    /// The method only holds values that the previous frame wrote.
    pub known: bool,
    /// Whether [`IndirectMethod::coarse_light`] will be read.
    pub measured: bool,
    /// Whether the sky emits light.
    pub sky: bool,
    /// Passes that the light went through before this one, since it was last forgotten.
    pub passes: u32,
    /// Which of the passes of a mean this one is, from 1 on; 0 before feedback has settled.
    pub mean_pass: u32,
}

/// The unit of work of a pass, per which its time is also reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassUnit {
    /// Occupied voxels.
    Voxels,
    /// List items that the pass makes (and the voxels that it finds occupied).
    MadeItems,
    /// List items that the pass visits, and the voxels that list them.
    WalkedItems,
    Pixels,
}
