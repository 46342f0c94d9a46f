//! The frame, in order: a sentence and a call per pass.

use std::sync::Arc;

use crate::Result;
use crate::gi::cones::alike::Alike;
use crate::gi::cones::cells::Cells;
use crate::gi::cones::clearance::Clearance;
use crate::gi::cones::constants::Features;
use crate::gi::cones::mips::Mips;
use crate::gi::cones::record::Record;
use crate::gi::cones::render::Render;
use crate::gi::cones::resources::Resources;
use crate::gi::cones::shade::Shade;
use crate::gi::cones::voxelise::Voxelise;
use crate::gi::cones::{Bounce, reset};
use crate::gi::volume::Volume;
use crate::gpu_scene::GpuScene;
use crate::image_target::ImageTarget;
use crate::scene::Pose;
use crate::settings::{Bounces, Emitters, Lists, Settings, Shadows};
use crate::vk::{Context, Recorder};

/// The passes of one method with its settings, compiled.
pub struct Passes {
    record: Record,
    /// Absent where nobody walks the lists.
    voxelise: Option<Voxelise>,
    /// Absent where no ray walks the lists.
    clearance: Option<Clearance>,
    /// Absent where no pass goes through lists of cells.
    cells: Option<Cells>,
    /// Absent where every item is lit.
    alike: Option<Alike>,
    shade_first: Option<Shade>,
    /// The first bounce with the last frame's second volume to gather from; absent unless `bounces = all`.
    shade_again: Option<Shade>,
    shade_second: Option<Shade>,
    mips: Option<Mips>,
    render: Render,
    lists: Lists,
}

/// What one frame works on.
pub struct FrameScene<'a> {
    pub scene: &'a GpuScene,
    pub pose: &'a Pose,
    pub volume: &'a Volume,
    pub resources: &'a Resources,
    pub target: &'a ImageTarget,
    /// Triangles in the blend order.
    pub blended: u32,
    /// Whether the last volume holds the frame before.
    pub history: bool,
    /// Whether an image is wanted, or the volumes alone.
    pub image: bool,
    /// Whether the volumes hold what the frame before filled, and nothing else.
    pub volumes_known: bool,
    pub anew: Anew,
}

/// What a frame makes anew; the rest still holds from the frame before. New lists make new volumes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Anew {
    pub lists: bool,
    pub volumes: bool,
}

impl Passes {
    /// `bounces`: volumes to fill, 0 to 2.
    pub fn new(
        context: &Arc<Context>,
        settings: &Settings,
        features: Features,
        bounces: u32,
        target: &ImageTarget,
    ) -> Result<Self> {
        let lists_are_read = bounces > 0 || settings.shadows == Shadows::Rays || settings.emitters == Emitters::Sampled;
        let all = settings.bounces == Bounces::All && bounces > 0;
        let shade = |needed: bool, bounce, gathers| {
            needed.then(|| Shade::new(context, settings, features, bounce, gathers)).transpose()
        };
        Ok(Self {
            record: Record::new(context, settings, features)?,
            voxelise: lists_are_read.then(|| Voxelise::new(context, settings)).transpose()?,
            clearance: (lists_are_read && settings.traces_rays())
                .then(|| Clearance::new(context, settings))
                .transpose()?,
            cells: (bounces > 0 && settings.uses_cells()).then(|| Cells::new(context, settings)).transpose()?,
            alike: (bounces > 0 && settings.lights_alike()).then(|| Alike::new(context, settings)).transpose()?,
            shade_first: shade(bounces > 0, Bounce::First, false)?,
            shade_again: shade(all, Bounce::First, true)?,
            shade_second: shade(bounces > 1, Bounce::Second, true)?,
            mips: (bounces > 0).then(|| Mips::new(context, settings)).transpose()?,
            render: Render::new(context, settings, features, bounces > 0, target)?,
            lists: settings.lists,
        })
    }

    /// Records one frame.
    pub fn record(&self, r: &mut Recorder, frame: &FrameScene) {
        let FrameScene { scene, pose, volume, resources, target, blended, history, image, volumes_known, anew } =
            *frame;
        if anew.lists {
            // 0. Counters and lists start empty.
            reset::all(r, resources);
            // 1. The scene is drawn into an empty screen; the geometry shader keeps its triangles.
            self.record.record(r, scene, pose, volume, resources);
            // 2a. Every voxel lists the triangles that touch it,
            if let Some(voxelise) = &self.voxelise {
                voxelise.record(r, Bounce::First, resources);
            }
            // and knows how far around it nothing is listed: what rays pass at once.
            if let Some(clearance) = &self.clearance {
                clearance.record(r, resources);
            }
            // The occupied ones are listed, with their parents: nobody else need be shaded.
            if let Some(cells) = &self.cells {
                cells.list(r, resources);
            }
            // and of triangles that are alike one is chosen to be lit.
            if let Some(alike) = &self.alike {
                alike.record(r, scene, resources);
            }
        }
        // What the last lists filled and these do not is emptied.
        let empty = |r: &mut Recorder, bounce: Bounce, volume| match &self.cells {
            Some(cells) if anew.lists => cells.empty(r, bounce, resources, volume, volumes_known),
            _ => (),
        };
        if let (Some(shade), Some(mips), true) = (&self.shade_first, &self.mips, anew.volumes) {
            empty(r, Bounce::First, &resources.volumes[0]);
            match (&self.shade_again, &resources.volumes[..]) {
                // 2b. Every voxel shades its list with direct light and, with all bounces, what the last frame left,
                (Some(again), [first, second]) if history => again.record(r, scene, resources, first, Some(second)),
                // or with direct light alone,
                _ => shade.record(r, scene, resources, &resources.volumes[0], None),
            }
            // 2c. and coarser voxels sum it up, per direction of travel.
            mips.record(r, Bounce::First, resources, &resources.volumes[0]);
        }
        if let (Some(shade), Some(mips), Some(voxelise), true) =
            (&self.shade_second, &self.mips, &self.voxelise, anew.volumes)
        {
            if self.lists == Lists::Rebuild && anew.lists {
                // 3. The lists start empty again, the triangles stay.
                reset::lists(r, resources);
                // 4a. The lists are built again, as the talk does (D29).
                voxelise.record(r, Bounce::Second, resources);
            }
            empty(r, Bounce::Second, &resources.volumes[1]);
            // 4b. Every voxel shades its list with direct light and cones into the first bounce,
            shade.record(r, scene, resources, &resources.volumes[1], Some(&resources.volumes[0]));
            // 4c. and coarser voxels sum it up.
            mips.record(r, Bounce::Second, resources, &resources.volumes[1]);
        }
        // 5. The recorded triangles become the image, with cones into the last bounce.
        if image {
            self.render.record(r, scene, resources, resources.volumes.last(), target, blended);
        }
    }
}
