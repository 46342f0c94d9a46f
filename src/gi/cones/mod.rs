//! Voxel cone tracing with two bounces, mirroring the talk's pipeline: one file per pass; their order is `src/frame.rs`.
//!
//! The talk: BeRo and urs, "How to use Voxel Cone Tracing with two bounces for everything instead of just Global
//! Illumination" (listings CC0).

pub mod alike;
pub mod cells;
pub mod clearance;
pub mod constants;
pub mod emitters;
pub mod gather;
pub mod mips;
pub mod record;
pub mod render;
pub mod reset;
pub mod resources;
pub mod shade;
pub mod uniforms;
pub mod voxelise;

use crate::gpu_scene::GpuScene;
use crate::vk::{Bind, ColorTarget, Compute, Format, Load, Raster, RenderTarget, Sampler, ZoneKind};
use resources::{FACES, Resources, VolumeImages};

/// Which volume a pass fills.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bounce {
    First,
    Second,
}

impl Bounce {
    pub fn pick<T>(self, first: T, second: T) -> T {
        match self {
            Self::First => first,
            Self::Second => second,
        }
    }
}

/// What a pass over a volume goes through (`settings::Work`), compiled; by cells, a pass may take several shaders.
enum Form<ByCells = Compute> {
    Raster(Raster),
    Cells(ByCells),
}

impl<ByCells> Form<ByCells> {
    fn kind(&self) -> ZoneKind {
        match self {
            Self::Raster(_) => ZoneKind::Raster,
            Self::Cells(_) => ZoneKind::Compute,
        }
    }

    /// Bytes that the pass writes where all cells together have `whole`: of lists, only the device knows (0).
    fn bytes(&self, whole: u64) -> u64 {
        match self {
            Self::Raster(_) => whole,
            Self::Cells(_) => 0,
        }
    }
}

/// What every shading pass reads (`glsl/cones/bindings.glsl`).
fn shading_binds<'a>(scene: &'a GpuScene, resources: &'a Resources) -> Vec<Bind<'a>> {
    vec![
        Bind::buffer("frame", &resources.frame),
        Bind::buffer("globals", &resources.globals),
        Bind::buffer("triangles", &resources.triangles),
        Bind::buffer("list_items", &resources.items),
        Bind::buffer("heads", &resources.heads),
        Bind::buffer("clearance", &resources.clearance),
        Bind::buffer("materials", &scene.materials),
        Bind::buffer("lights", &resources.lights),
        Bind::buffer("emitters", &resources.emitters),
        Bind::buffer("emitter_nodes", &resources.emitter_nodes),
        Bind::buffer("texture_entries", &scene.texture_entries),
        Bind::buffer("texture_levels", &scene.texture_levels),
        Bind::image("atlas_linear", scene.atlas.view(), &scene.texel_sampler),
        Bind::image("atlas_srgb", scene.atlas.view_as(Format::R8G8B8A8_SRGB), &scene.texel_sampler),
    ]
}

/// What every pass over the image reads: what shading does, the order of blended triangles, and the volume, if any.
fn image_binds<'a>(scene: &'a GpuScene, resources: &'a Resources, volume: Option<&'a VolumeImages>) -> Vec<Bind<'a>> {
    let mut binds = shading_binds(scene, resources);
    binds.push(Bind::buffer("slots", &resources.slots));
    binds.push(Bind::buffer("order", &resources.order));
    if let Some(volume) = volume {
        binds.extend(volume_binds(volume, &resources.volume_sampler));
    }
    binds
}

/// A volume to gather from (`glsl/cones/volumes.glsl`).
fn volume_binds<'a>(volume: &'a VolumeImages, sampler: &'a Sampler) -> impl Iterator<Item = Bind<'a>> {
    const NAMES: [&str; FACES] = ["volume_0", "volume_1", "volume_2", "volume_3", "volume_4", "volume_5", "volume_6"];
    NAMES.iter().zip(&volume.faces).map(move |(name, face)| Bind::image(name, face.view(), sampler))
}

/// All seven faces of a level, to be stored to (`glsl/cones/faces.glsl`).
fn face_binds(volume: &VolumeImages, level: u32) -> [Bind<'_>; FACES] {
    const NAMES: [&str; FACES] = ["faces_0", "faces_1", "faces_2", "faces_3", "faces_4", "faces_5", "faces_6"];
    std::array::from_fn(|face| Bind::storage_image(NAMES[face], volume.faces[face].mip_view(level)))
}

impl VolumeImages {
    /// All seven faces of a level as layered colour targets; every texel is written.
    fn colors(&self, level: u32) -> [ColorTarget<'_>; FACES] {
        std::array::from_fn(|face| ColorTarget {
            view: self.faces[face].attachment_view(level),
            resolve: None,
            load: Load::DontCare,
            store: true,
        })
    }
}

/// `edge` slices of `edge`² texels.
fn layered_target<'a>(colors: &'a [ColorTarget<'a>], edge: u32) -> RenderTarget<'a> {
    RenderTarget { colors, width: edge, height: edge, layers: edge, ..Default::default() }
}
