//! A volume of seven faces, which holds what is seen along a ray that travels along +x +y +z −x −y −z, and on average, with
//! all mips; and the passes that fill it from lit list items, by lists of occupied cells.

use std::sync::Arc;

use super::Ground;
use super::constants::{DIRECT, with};
use super::memory_plan::MemoryRow;
use crate::Result;
use crate::gi::CoarseLight;
use crate::settings::Settings;
use crate::vk::{
    Bind, ColorTarget, Compute, ComputeDesc, Context, Filter, Format, Image, ImageDesc, ImageDim, ImageUsageFlags,
    Load, Recorder, Sampler, SamplerAddressMode, ZoneKind,
};

pub const FACE_FORMAT: Format = Format::R16G16B16A16_SFLOAT;
/// +x +y +z −x −y −z, isotropic.
pub const FACES: usize = 7;
/// Workgroups of 64 threads; each goes through many cells, most of which are occupied again.
const EMPTYING_GROUPS: u32 = 16;

/// Seven 3D images with full mip chains.
pub struct FaceVolume {
    pub faces: [Image; FACES],
    pub edge: u32,
    pub levels: u32,
    sampler: Sampler,
    /// 0 or 1.
    bounce: usize,
}

impl FaceVolume {
    /// Of bounce 0 or 1, of `edge`³ voxels. `outside`: what a look-up finds there.
    ///
    /// # Errors
    /// Too little memory.
    pub fn new(context: &Arc<Context>, bounce: usize, edge: u32, outside: SamplerAddressMode) -> Result<Self> {
        let name = ["first bounce", "second bounce"][bounce];
        let levels = edge.ilog2() + 1;
        let face = |suffix: &str| {
            Image::new(
                context,
                &ImageDesc {
                    label: &format!("{name} {suffix}"),
                    dim: ImageDim::D3,
                    format: FACE_FORMAT,
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
        };
        let suffixes = ["+x", "+y", "+z", "-x", "-y", "-z", "isotropic"];
        let faces: Vec<Image> = suffixes.into_iter().map(face).collect::<Result<_>>()?;
        let faces = faces.try_into().unwrap_or_else(|_| unreachable!("seven suffixes make seven faces"));
        Ok(Self { faces, edge, levels, sampler: Sampler::new(context, Filter::LINEAR, outside)?, bounce })
    }

    /// One for each bounce that is stored. `outside`: what a look-up finds there.
    ///
    /// # Errors
    /// Too little memory.
    pub fn per_bounce(context: &Arc<Context>, settings: &Settings, outside: SamplerAddressMode) -> Result<Vec<Self>> {
        let count = settings.bounces.volumes() as usize;
        (0..count).map(|bounce| Self::new(context, bounce, settings.voxels, outside)).collect()
    }

    /// Bytes of a volume of `edge`³ with all its mips.
    pub fn bytes(edge: u32) -> u64 {
        let texels: u64 = (0..=edge.ilog2()).map(|level| u64::from(edge >> level).pow(3)).sum();
        FACES as u64 * 8 * texels
    }

    /// Bytes of [`FaceVolume::per_bounce`].
    pub fn plan(settings: &Settings) -> Vec<MemoryRow> {
        let names = ["first bounce's volume", "second bounce's volume"];
        let count = settings.bounces.volumes() as usize;
        names[..count].iter().map(|name| (*name, Self::bytes(settings.voxels))).collect()
    }

    /// To be looked up (`glsl/ground/faces/look_up.glsl`).
    pub fn binds(&self) -> impl Iterator<Item = Bind<'_>> {
        const NAMES: [&str; FACES] =
            ["volume_0", "volume_1", "volume_2", "volume_3", "volume_4", "volume_5", "volume_6"];
        NAMES.iter().zip(&self.faces).map(|(name, face)| Bind::image(name, face.view(), &self.sampler))
    }

    /// The level below `level`, to be read by the mips (`glsl/ground/faces/mips.glsl`).
    pub fn sources(&self, level: u32) -> impl Iterator<Item = Bind<'_>> {
        const NAMES: [&str; FACES] =
            ["source_0", "source_1", "source_2", "source_3", "source_4", "source_5", "source_6"];
        NAMES
            .iter()
            .zip(&self.faces)
            .map(move |(name, face)| Bind::image(name, face.mip_view(level - 1), &self.sampler))
    }

    /// A level, to be stored to (`glsl/ground/faces/store.glsl`).
    pub fn targets(&self, level: u32) -> [Bind<'_>; FACES] {
        const NAMES: [&str; FACES] = ["faces_0", "faces_1", "faces_2", "faces_3", "faces_4", "faces_5", "faces_6"];
        std::array::from_fn(|face| Bind::storage_image(NAMES[face], self.faces[face].mip_view(level)))
    }

    /// A level as layered colour targets; every texel is written.
    pub fn colors(&self, level: u32) -> [ColorTarget<'_>; FACES] {
        std::array::from_fn(|face| ColorTarget {
            view: self.faces[face].attachment_view(level),
            resolve: None,
            load: Load::DontCare,
            store: true,
        })
    }

    /// What the pass is called that makes its mips.
    pub fn mips_zone(&self) -> &'static str {
        ["mips 1", "mips 2"][self.bounce]
    }

    /// All light that it holds, coarsely: the isotropic face's level of 8³ texels.
    pub fn coarse(&self) -> CoarseLight<'_> {
        CoarseLight::Image(&self.faces[FACES - 1], self.levels - 4)
    }
}

/// Empties what the frame before filled and this one does not. Reads: both frames' cells. Writes: a volume.
pub struct EmptyFaces {
    empty: Compute,
}

impl EmptyFaces {
    pub fn new(context: &Arc<Context>, constants: &[(u32, u32)]) -> Result<Self> {
        let desc = ComputeDesc { label: "empty", shader: "ground/faces/empty.comp", constants };
        Ok(Self { empty: Compute::new(context, &desc)? })
    }

    /// `known`: whether the volume holds what the frame before filled and nothing else; else all of it is emptied.
    pub fn record(&self, r: &mut Recorder, ground: &Ground, volume: &FaceVolume, known: bool) {
        let lists = ground.base();
        r.zone(["empty 1", "empty 2"][volume.bounce], ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the cells are listed; the volume may have been read
            if !known {
                volume.faces.iter().for_each(|face| r.clear(face));
                return;
            }
            for level in 0..volume.levels {
                let (list, push) = lists.last_cells.level(level, volume.edge);
                let binds = [
                    list,
                    Bind::buffer("cell_counts", &lists.last_cells.counts),
                    Bind::buffer("heads", &lists.heads),
                    Bind::buffer("listed", &lists.listed),
                ];
                let binds: Vec<Bind> = binds.into_iter().chain(volume.targets(level)).collect();
                r.dispatch(&self.empty, &binds, &push, [EMPTYING_GROUPS, 1, 1]);
            }
        });
    }
}

/// Lights the lists' items, then fills the occupied voxels. Reads: lists, triangles, materials, lights, lamps, kept direct
/// light, and what a look-up binds. Writes: item lights, kept direct light, level 0 of a volume.
/// Twin of the fill: `tests/twins/shade.rs`.
pub struct FillFaces {
    light: Compute,
    fill: Compute,
    label: &'static str,
}

/// What shades voxels.
#[derive(Clone, Copy)]
pub struct FillDesc<'a> {
    pub label: &'static str,
    /// The method's: of `light.comp` and `fill.comp`.
    pub folder: &'a str,
    /// Whether there is light to be looked up.
    pub gathers: bool,
    /// A value of [`DIRECT`].
    pub direct: u32,
    pub constants: &'a [(u32, u32)],
}

impl FillFaces {
    pub fn new(context: &Arc<Context>, desc: &FillDesc) -> Result<Self> {
        let FillDesc { label, folder, .. } = *desc;
        let constants = with(desc.constants.to_vec(), &[(DIRECT, desc.direct)]);
        let compute = |shader: &str| Compute::new(context, &ComputeDesc { label, shader, constants: &constants });
        let gathers = if desc.gathers { " LOOK_UP" } else { "" };
        Ok(Self {
            light: compute(&format!("gi/{folder}/light.comp{gathers}"))?,
            fill: compute(&format!("gi/{folder}/fill.comp"))?,
            label,
        })
    }

    /// `look_up`: what the method's look-up binds.
    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, target: &FaceVolume, look_up: Vec<Bind<'_>>) {
        let lists = ground.base();
        recorder.zone(self.label, ZoneKind::Compute, 0, |r| {
            r.full_barrier(); // the lists and the volume that is gathered from were written
            let mut binds = ground.item_binds();
            binds.extend(look_up);
            lists.cells.dispatch_items(r, &self.light, binds.clone());
            r.full_barrier(); // the items are lit
            binds.extend(target.targets(0));
            lists.cells.dispatch(r, &self.fill, binds, (0, target.edge));
        });
    }
}

/// Mips, level by level, of the parents of occupied cells. Reads: level k − 1. Writes: level k. Twin: `tests/twins/mips.rs`.
pub struct MipFaces {
    mips: Compute,
}

impl MipFaces {
    /// `folder`: of the method's `mips.comp`.
    pub fn new(context: &Arc<Context>, folder: &str, constants: &[(u32, u32)]) -> Result<Self> {
        let shader = format!("gi/{folder}/mips.comp");
        Ok(Self { mips: Compute::new(context, &ComputeDesc { label: "mips", shader: &shader, constants })? })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, volume: &FaceVolume) {
        recorder.zone(volume.mips_zone(), ZoneKind::Compute, 0, |r| {
            for level in 1..volume.levels {
                r.full_barrier(); // the level below was written
                let mut binds: Vec<Bind> = volume.sources(level).collect();
                binds.extend(volume.targets(level));
                ground.base().cells.dispatch(r, &self.mips, binds, (level, volume.edge));
            }
        });
    }
}
