//! Global illumination: the methods of the list in `src/settings/methods/mod.rs`, and what a method is to the rest of
//! the house.

mod bounces;
mod cascades;

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

/// Makes the modules of the list of methods, and what a [`Method`] does by itself.
macro_rules! dispatch {
    ($($(#[$doc:meta])* $variant:ident = $name:literal in $module:ident),+ $(,)?) => {
        $(pub mod $module;)+

        impl Method {
            /// Requests of the method to the ground.
            pub fn wants(self, settings: &Settings) -> Wants {
                match self { $(Self::$variant => <$module::Lighting as Gi>::wants(settings)),+ }
            }

            /// Bytes of everything that it makes, before anything is made.
            pub fn plan(self, settings: &Settings) -> Vec<MemoryRow> {
                match self { $(Self::$variant => <$module::Lighting as Gi>::plan(settings)),+ }
            }

            /// Compiles its passes and makes its volumes.
            ///
            /// # Errors
            /// Too little memory, or a lost device.
            pub fn make(self, maker: &Maker) -> Result<Box<dyn Gi>> {
                Ok(match self { $(Self::$variant => Box::new(<$module::Lighting as Gi>::new(maker)?)),+ })
            }

            /// The unit of work of the method's passes, by the start of their names.
            pub fn pass_units(self) -> &'static [(&'static str, PassUnit)] {
                match self { $(Self::$variant => $module::PASS_UNITS),+ }
            }
        }
    };
}
crate::settings::methods!(dispatch);

/// A way to light surfaces by other surfaces. It fills what it likes from the ground, and answers in GLSL
/// (`glsl/gi/<name>/look_up.glsl`) what light reaches a surface from elsewhere:
/// - `vec4 look_up_diffuse(Surface s, uvec3 place)`: irradiance/π in stored radiance, the sky included, and the open
///   share of the hemisphere; `place` is a pixel or a voxel, by which directions may differ;
/// - `METHOD_GATHERS_LOBES` and `vec4 look_up_for_view(Surface s, vec3 view, uvec3 place, out vec3 mirrored)`, with
///   [`Wants::gathers_lobes`]: the same, and the stored radiance that a rough lobe mirrors of it towards a viewer;
/// - `void add_glossy(inout Outgoing sent, Surface s, Viewed v)`: adds the light that the surface mirrors and lets
///   through;
/// - `const bool FINDS_LAMPS`: whether `add_glossy` also finds sampled lamps;
/// - `vec3 look_up_specular(Surface s)`, where list items are lit with it: light from where a glossy surface that has
///   no viewer reflects;
/// - `METHOD_SHADOWS` and `float method_shadow(…)`, where it has shadows of its own.
///
/// It knows nothing of windows, files, charts, other methods.
pub trait Gi: Send {
    /// Requests of the method to the ground.
    fn wants(settings: &Settings) -> Wants
    where
        Self: Sized;

    /// Bytes of everything that [`Gi::new`] makes.
    fn plan(settings: &Settings) -> Vec<MemoryRow>
    where
        Self: Sized;

    /// # Errors
    /// Too little memory, or a lost device.
    fn new(maker: &Maker) -> Result<Self>
    where
        Self: Sized;

    /// Where its further grids stand this frame, as many as it asked for. `eye`: in voxels of the base grid.
    fn grids(&self, _eye: Vec3) -> Vec<GridPlace> {
        Vec::new()
    }

    /// Records the passes from this frame's lists to its light.
    fn update(&self, recorder: &mut Recorder, ground: &Ground, update: &Update);

    /// The method, where it lights items on demand; `None` where `update` lights all.
    fn on_demand(&self) -> Option<&dyn OnDemand> {
        None
    }

    /// Constants that its look-up is compiled with, in addition to the ground's.
    fn constants(&self) -> &[Constant];

    /// Bindings of its look-up: resources of the method and of the ground.
    fn binds<'a>(&'a self, ground: &'a Ground) -> Vec<Bind<'a>>;

    /// The volumes of faces that it holds, one per bounce.
    fn volumes(&self) -> &[LightVolume] {
        &[]
    }

    /// All images that hold its light.
    fn images(&self) -> Vec<&Image> {
        self.volumes().iter().flat_map(|volume| &volume.images).collect()
    }

    /// Numbers that represent, coarsely, all light that the method holds: feedback has settled once they do not change.
    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.volumes().last().map(LightVolume::coarse)
    }
}

/// Inputs from which a method is made.
pub struct Maker<'a> {
    pub context: &'a Arc<Context>,
    pub settings: &'a Settings,
    pub features: Features,
    pub counts: &'a Counts,
}

/// Changes since the last frame that a method must know of when it lights this one.
#[derive(Clone, Copy, Debug)]
pub struct Update {
    /// The lists, or the method, are new; else both are those of the frame before.
    pub lists: bool,
    /// The method holds the light of the frame before, and continues from it.
    pub history: bool,
    /// The method holds only values that the frame before wrote.
    pub known: bool,
    /// Whether [`Gi::coarse_light`] is going to be asked.
    pub measured: bool,
    /// Whether light comes from beyond the scene.
    pub sky: bool,
    /// Passes that the light went through before this one, since it was last forgotten.
    pub passes: u32,
    /// Which of the passes of a mean this one is, from 1 on; 0 before feedback has settled.
    pub mean_pass: u32,
}

/// The unit of work of a pass. Its time is also given per unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PassUnit {
    /// Occupied voxels.
    Voxels,
    /// List items that it makes (and the voxels that it finds occupied).
    MadeItems,
    /// List items that it walks, and the voxels whose lists they are.
    WalkedItems,
    Pixels,
}
