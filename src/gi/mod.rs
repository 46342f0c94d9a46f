//! Global illumination: the closed list of methods, and what a method is to the rest of the house.

mod bounces;
pub mod ledger;

use std::sync::Arc;

use glam::Vec3;

use crate::Result;
use crate::ground::constants::Features;
use crate::ground::faces::FaceVolume;
use crate::ground::grid::GridPlace;
use crate::ground::memory_plan::MemoryRow;
use crate::ground::{Counts, Ground};
use crate::settings::Settings;
use crate::vk::{Bind, Buffer, Constant, Context, Image, Recorder};

/// The list of methods: a variant, its name, which is the name of its folders too, and what it is.
macro_rules! methods {
    ($($(#[$doc:meta])* $variant:ident = $name:literal in $module:ident),+ $(,)?) => {
        $(pub mod $module;)+

        crate::settings::choices! {
            /// How light from elsewhere is found.
            Method { $($(#[$doc])* $variant = $name),+ }
        }

        /// The settings of every method, each a table under the method's name.
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default)]
        pub struct Tables { $(pub $module: $module::Settings),+ }

        /// The keys of all tables.
        pub(crate) fn tables_keys() -> impl Iterator<Item = &'static crate::settings::Key> {
            [$($module::KEYS),+].into_iter().flatten().flat_map(|keys| keys.iter())
        }

        impl Method {
            /// What the method asks of the ground.
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

            /// What the method's passes work on, by the start of their names.
            pub fn pass_units(self) -> &'static [(&'static str, PassUnit)] {
                match self { $(Self::$variant => $module::PASS_UNITS),+ }
            }
        }
    };
}

methods! {
    /// Direct light alone.
    None = "none" in none,
    /// Voxel cone tracing, as in the talk.
    Cones = "cones" in cones,
    /// Exact rays that find what the voxels shade, shared among neighbours.
    Rays = "rays" in rays,
    /// Light propagation volumes: light that travels from cell to cell of a coarse grid.
    Lpv = "lpv" in lpv,
    /// Voxel cone tracing derived from photon mapping: a voxel sends its photons' light in sixteen directions.
    Photons = "photons" in photons,
}

/// A way to light surfaces by other surfaces. It fills what it likes from the ground, and answers in GLSL
/// (`glsl/gi/<name>/look_up.glsl`) what light reaches a surface from elsewhere:
/// - `vec4 look_up_diffuse(Surface s, uvec3 place)`: irradiance/π in stored radiance, the sky included, and the open share of
///   the hemisphere; `place` is a pixel or a voxel, by which directions may differ;
/// - `METHOD_GATHERS_LOBES` and `vec4 look_up_for_view(Surface s, vec3 view, uvec3 place, out vec3 mirrored)`, with
///   [`Wants::gathers_lobes`]: the same, and the stored radiance that a rough lobe mirrors of it towards a viewer;
/// - `void add_glossy(inout Outgoing sent, Surface s, Viewed v)`: what the surface mirrors and lets through;
/// - `const bool FINDS_LAMPS`: whether `add_glossy` also finds sampled lamps;
/// - `vec3 look_up_specular(Surface s)`, where list items are lit with it: what a glossy surface meets that has no viewer;
/// - `METHOD_SHADOWS` and `float method_shadow(…)`, where it has shadows of its own.
///
/// It knows nothing of windows, files, charts, other methods.
pub trait Gi: Send {
    /// What it asks of the ground.
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

    /// What its look-up is compiled with, beside the ground's.
    fn constants(&self) -> &[Constant];

    /// What its look-up binds, of its own and of the ground.
    fn binds<'a>(&'a self, ground: &'a Ground) -> Vec<Bind<'a>>;

    /// The volumes of faces that it holds, one per bounce.
    fn volumes(&self) -> &[FaceVolume] {
        &[]
    }

    /// All images that hold its light.
    fn images(&self) -> Vec<&Image> {
        self.volumes().iter().flat_map(|volume| &volume.faces).collect()
    }

    /// What shows, coarsely, all light that it holds: feedback has settled once it does not change.
    fn coarse_light(&self) -> Option<CoarseLight<'_>> {
        self.volumes().last().map(FaceVolume::coarse)
    }
}

/// Numbers that show, coarsely, all light that a method holds.
pub enum CoarseLight<'a> {
    /// Red, green and blue of a level of an RGBA16F image.
    Image(&'a Image, u32),
    /// The same of an RGBA32F image.
    Full(&'a Image),
    /// Whole numbers of 64 bits.
    Sums(&'a Buffer),
}

/// What a method asks of the ground. The ground makes nothing that is not asked for.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wants {
    /// The lists of the base grid,
    pub lists: bool,
    /// of what the dilated triangles touch: more than the triangles do;
    pub dilated: bool,
    /// or of the voxels into which samples of a multisampled raster fall, so many a pixel: fewer. With
    /// [`Wants::item_samples`], which the ground then counts.
    pub sampled: Option<u32>,
    /// Exact rays, through a tree of boxes about the triangles.
    pub rays: bool,
    /// Lists of its occupied cells, level by level,
    pub cells: bool,
    /// and those of the lists before: what was filled there is emptied.
    pub last_cells: bool,
    /// Boxes of finer voxels within the base grid, where it would not hold the scene.
    pub nested: bool,
    /// List items lit, one by one,
    pub lit_items: bool,
    /// one for all that are alike,
    pub alike: bool,
    /// and two where another surface cuts the part of an item that is lit.
    pub split: bool,
    /// How many samples of a multisampled raster fall on each list item's part of its triangle: the method counts them,
    /// unless the lists are made of them.
    pub item_samples: bool,
    /// Words of 32 bits for the specular lobe in which each side of a list item sends direct light.
    pub lobe_words: u32,
    /// Whether direct light is kept from one pass of a frame to the next,
    pub kept_direct_light: bool,
    /// beside each lit item the light that others see of it,
    pub seen_lights: bool,
    /// which new lists take over from those before them.
    pub carried_light: bool,
    /// Lists of further grids,
    pub grids: Vec<GridPlace>,
    /// and of their occupied cells, with items that are lit and direct light that is kept.
    pub lit_grids: bool,
    /// Whether its diffuse look-up is worth gathering apart from the image,
    pub diffuse: bool,
    /// and what it finds for rough lobes on the way beside it.
    pub gathers_lobes: bool,
    /// Whether it has shadows of its own.
    pub shadows: bool,
    /// Whether its random numbers turn with the time of the animation, so that its light does too.
    pub turns: bool,
    /// With feedback: once it has settled, the mean of so many further passes is its light, which then stays.
    pub mean_passes: Option<u32>,
}

/// What a method is made from.
pub struct Maker<'a> {
    pub context: &'a Arc<Context>,
    pub settings: &'a Settings,
    pub features: Features,
    pub counts: &'a Counts,
}

/// What is new in the frame that a method lights.
#[derive(Clone, Copy, Debug)]
pub struct Update {
    /// The lists, or the method, are new; else both are those of the frame before.
    pub lists: bool,
    /// What the method holds is the light of the frame before, to go on from.
    pub history: bool,
    /// What the method holds is what the frame before filled, and nothing else.
    pub known: bool,
    /// Whether the pass is one of those whose mean is the light: [`Wants::mean_passes`].
    pub averages: bool,
    /// Whether [`Gi::coarse_light`] is going to be asked.
    pub measured: bool,
    /// Whether light comes from beyond the scene.
    pub sky: bool,
}

/// What a pass works on; its time is given per unit too.
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
