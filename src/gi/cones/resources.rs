//! What the passes share: volumes, front view, globals, triangles, list items, voxels (heads), voxel cells, lights.

use std::sync::Arc;

use super::cells::{self, CellLists};
use super::uniforms::Capacities;
use super::{clearance, emitters};
use crate::Result;
use crate::layout;
use crate::memory_plan::volume_bytes;
use crate::settings::{Form, Settings, Work};
use crate::vk::{
    self, Buffer, BufferKind, BufferUsageFlags, Context, Format, Image, ImageDesc, ImageDim, ImageUsageFlags, Sampler,
};

/// Colour format of both volumes.
pub const VOLUME_FORMAT: Format = Format::R16G16B16A16_SFLOAT;
/// Faces of a volume: +x +y +z −x −y −z, isotropic.
pub const FACES: usize = 7;
/// Voxels along the edge of a brick, as in `glsl/common/constants.glsl`.
pub const BRICK: u32 = 4;
/// Edge of the front view, an empty screen for the recording pass. Pixels.
pub const FRONT_VIEW_EDGE: u32 = 128;
/// The front view's format does not matter: nothing is written.
pub const FRONT_VIEW_FORMAT: Format = Format::R8G8B8A8_UNORM;

/// One bounce's volume: seven 3D images with full mip chains.
pub struct VolumeImages {
    pub faces: [Image; FACES],
    pub edge: u32,
    pub levels: u32,
}

impl VolumeImages {
    fn new(context: &Arc<Context>, name: &str, edge: u32) -> Result<Self> {
        let levels = edge.ilog2() + 1;
        let suffixes = ["+x", "+y", "+z", "-x", "-y", "-z", "isotropic"];
        let faces: Vec<Image> = suffixes
            .iter()
            .map(|suffix| {
                Image::new(
                    context,
                    &ImageDesc {
                        label: &format!("{name} {suffix}"),
                        dim: ImageDim::D3,
                        format: VOLUME_FORMAT,
                        width: edge,
                        height: edge,
                        depth_or_layers: edge,
                        mips: levels,
                        samples: 1,
                        usage: ImageUsageFlags::COLOR_ATTACHMENT
                            | ImageUsageFlags::SAMPLED
                            | ImageUsageFlags::STORAGE
                            | ImageUsageFlags::TRANSFER_SRC
                            | ImageUsageFlags::TRANSFER_DST,
                        ..Default::default()
                    },
                )
            })
            .collect::<Result<_>>()?;
        let faces = faces.try_into().unwrap_or_else(|_| unreachable!("seven suffixes make seven faces"));
        Ok(Self { faces, edge, levels })
    }
}

/// How much of everything a scene brings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SceneCounts {
    pub triangles: u32,
    pub blended: u32,
    pub lights: u32,
    /// Pieces of lamps.
    pub emitters: u32,
}

/// Everything that the cones' passes share.
pub struct Resources {
    pub frame: Buffer,
    pub lights: Buffer,
    pub emitters: Buffer,
    pub emitter_nodes: Buffer,
    pub globals: Buffer,
    pub triangles: Buffer,
    pub items: Buffer,
    /// Per list item and side what the first bounce keeps for the second.
    pub direct_light: Buffer,
    /// Per list item what it sends, for the cells form of shading.
    pub item_lights: Buffer,
    /// Per list item who is lit for it,
    pub item_parts: Buffer,
    /// and who is lit, where triangles that are alike are lit as one.
    pub lit_items: Buffer,
    pub heads: Buffer,
    /// How far around every voxel nothing is listed (`glsl/common/clearance.glsl`).
    pub clearance: Buffer,
    pub clearance_scratch: Buffer,
    /// What is occupied in this frame,
    pub cells: CellLists,
    /// and in the one before.
    pub last_cells: CellLists,
    /// A bit per cell of every level but the first: it stands in its list.
    pub listed: Buffer,
    /// Source → 1 + place in the triangle buffer, for the blended triangles.
    pub slots: Buffer,
    /// Sources of the blended triangles, back to front.
    pub order: Buffer,
    pub front_view: Image,
    /// First and second bounce; empty without a method, one with `bounces = 1`.
    pub volumes: Vec<VolumeImages>,
    pub volume_sampler: Sampler,
}

impl Resources {
    pub fn new(
        context: &Arc<Context>,
        scene: SceneCounts,
        settings: &Settings,
        volumes: u32,
        capacities: Capacities,
    ) -> Result<Self> {
        let plan = plan(scene, settings, volumes, capacities);
        let buffer = |name: &'static str| {
            Buffer::new(context, name, plan_bytes(&plan, name), BufferKind::Device, BufferUsageFlags::empty())
        };
        let lists_edge = if settings.uses_cells() { settings.voxels } else { 1 };
        let lists = |name: &'static str| CellLists::new(context, (name, plan_bytes(&plan, name)), lists_edge);
        let names = ["first bounce", "second bounce"];
        let border = settings.ledger.d11 == Form::Right;
        Ok(Self {
            frame: buffer("frame")?,
            lights: buffer("lights")?,
            emitters: buffer("emitters")?,
            emitter_nodes: buffer("emitter nodes")?,
            globals: buffer("globals")?,
            triangles: buffer("triangles")?,
            items: buffer("list items")?,
            direct_light: buffer("direct light")?,
            item_lights: buffer("item lights")?,
            item_parts: buffer("item parts")?,
            lit_items: buffer("lit items")?,
            heads: buffer("voxels")?,
            clearance: buffer("clearance")?,
            clearance_scratch: buffer("clearance scratch")?,
            cells: lists("voxel cells")?,
            last_cells: lists("last voxel cells")?,
            listed: buffer("listed parents")?,
            slots: buffer("blended slots")?,
            order: buffer("blend order")?,
            front_view: Image::new(
                context,
                &ImageDesc {
                    label: "front view",
                    dim: ImageDim::D2,
                    format: FRONT_VIEW_FORMAT,
                    width: FRONT_VIEW_EDGE,
                    height: FRONT_VIEW_EDGE,
                    usage: ImageUsageFlags::COLOR_ATTACHMENT,
                    ..Default::default()
                },
            )?,
            volumes: names[..volumes as usize]
                .iter()
                .map(|name| VolumeImages::new(context, name, settings.voxels))
                .collect::<Result<_>>()?,
            // D11: outside the volume there is nothing; printed, its edge voxels go on for ever.
            volume_sampler: Sampler::new(
                context,
                vk::Filter::LINEAR,
                vk::SamplerMipmapMode::LINEAR,
                if border { vk::SamplerAddressMode::CLAMP_TO_BORDER } else { vk::SamplerAddressMode::CLAMP_TO_EDGE },
                vk::BorderColor::FLOAT_TRANSPARENT_BLACK,
            )?,
        })
    }

    /// A new frame: its lists take the place of those of the frame before the last.
    pub fn turn(&mut self) {
        std::mem::swap(&mut self.cells, &mut self.last_cells);
    }

    /// Makes the triangle, item and cell buffers anew, with other capacities.
    pub fn grow(
        &mut self,
        context: &Arc<Context>,
        scene: SceneCounts,
        settings: &Settings,
        volumes: u32,
        capacities: Capacities,
    ) -> Result<()> {
        let plan = plan(scene, settings, volumes, capacities);
        let (cells, last_cells) = (&mut self.cells.cells, &mut self.last_cells.cells);
        let lights = [&mut self.direct_light, &mut self.item_lights, &mut self.item_parts, &mut self.lit_items];
        for buffer in [&mut self.triangles, &mut self.items, cells, last_cells].into_iter().chain(lights) {
            let bytes = plan_bytes(&plan, buffer.label());
            if bytes > buffer.bytes() {
                let label = buffer.label().to_owned();
                *buffer = Buffer::new(context, &label, bytes, BufferKind::Device, BufferUsageFlags::empty())?;
            }
        }
        Ok(())
    }
}

fn plan_bytes(plan: &[(&'static str, u64)], name: &str) -> u64 {
    plan.iter().find(|row| row.0 == name).expect("every buffer stands in the plan").1
}

/// (name, bytes) of every resource that [`Resources::new`] makes.
pub fn plan(scene: SceneCounts, settings: &Settings, volumes: u32, capacities: Capacities) -> Vec<(&'static str, u64)> {
    fn array<T>(count: u32) -> u64 {
        u64::from(count.max(1)) * size_of::<T>() as u64
    }
    let voxels = settings.voxels.pow(3);
    let items = |needed: bool| if needed { capacities.items } else { 1 };
    let parts = items(volumes > 0 && settings.lights_alike());
    let lists_edge = if settings.uses_cells() { settings.voxels } else { 1 };
    let mut rows = vec![
        ("frame", array::<layout::Frame>(1)),
        ("lights", array::<layout::Light>(scene.lights)),
        ("emitters", array::<layout::Emitter>(scene.emitters)),
        ("emitter nodes", array::<layout::EmitterNode>(emitters::node_count(scene.emitters))),
        ("globals", array::<layout::Globals>(1)),
        ("triangles", array::<layout::Triangle>(capacities.triangles)),
        ("list items", array::<layout::ListItem>(capacities.items)),
        ("item lights", array::<layout::ItemLight>(items(volumes > 0 && settings.shading == Work::Cells))),
        ("item parts", array::<layout::ItemPart>(parts)),
        ("lit items", array::<u32>(parts)),
        ("direct light", array::<[[f32; 3]; 2]>(items(volumes > 0 && settings.keeps_direct()))),
        ("voxels", array::<u32>(voxels)),
        ("clearance", if settings.traces_rays() { clearance::bytes(settings.voxels) } else { 4 }),
        ("clearance scratch", if settings.traces_rays() { clearance::scratch_bytes(settings.voxels) } else { 4 }),
        ("voxel cells", array::<u32>(capacities.cells)),
        ("last voxel cells", array::<u32>(if settings.uses_cells() { capacities.cells } else { 1 })),
        ("listed parents", cells::listed_bytes(lists_edge)),
        ("parent cells", 2 * (cells::parents_bytes(lists_edge) + cells::counts_bytes())),
        ("blended slots", array::<u32>(if scene.blended == 0 { 1 } else { scene.triangles })),
        ("blend order", array::<u32>(scene.blended)),
        ("front view", u64::from(FRONT_VIEW_EDGE).pow(2) * 4),
    ];
    let names = ["first bounce's volume", "second bounce's volume"];
    rows.extend(names[..volumes as usize].iter().map(|&name| (name, volume_bytes(settings.voxels))));
    rows
}
