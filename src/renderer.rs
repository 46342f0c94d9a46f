//! A scene, a method and its settings on one device: plans memory, renders frames, reads images back.

use std::sync::Arc;

use glam::{DAffine3, DVec3};

use crate::Result;
use crate::frame::{Anew, FrameScene, Passes};
use crate::gi::Method;
use crate::gi::cones::constants::Features;
use crate::gi::cones::emitters::Emitters;
use crate::gi::cones::gather;
use crate::gi::cones::resources::{self, FACES, Resources, SceneCounts};
use crate::gi::cones::uniforms::{self, Capacities, FrameInputs};
use crate::gi::volume::{Volume, radiance_scale};
use crate::gpu_scene::{BlendedTriangle, GpuScene, ScenePacked};
use crate::image_target::{self, ImageTarget};
use crate::layers::{Aov, Layers};
use crate::layout;
use crate::memory_plan::{self, MemoryPlan};
use crate::scene::{Bounds, Pose, Scene, View};
use crate::settings::{self, Bounces, Settings};
use crate::vk::{self, Context, FrameLog, Recorder, RecorderOptions, ZoneTimings};

/// How a frame is handed to the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Submit {
    /// One command buffer.
    #[default]
    Frame,
    /// One submission per pass, waited for: CPU time per pass too, for CPU devices.
    PerPass,
}

pub struct RenderOptions {
    /// Pixels.
    pub size: (u32, u32),
    pub method: Method,
    /// Layers beside the image.
    pub aovs: Vec<Aov>,
    pub submit: Submit,
    /// Bytes; the device's own budget where absent.
    pub memory_limit: Option<u64>,
    /// Of the scene over the whole animation: where the volume stands.
    pub bounds: Bounds,
}

impl RenderOptions {
    /// The image alone, by cones, a frame at once and within the budget.
    pub fn new(size: (u32, u32), bounds: Bounds) -> Self {
        Self { size, method: Method::Cones, aovs: vec![], submit: Submit::Frame, memory_limit: None, bounds }
    }
}

/// What a frame did.
#[derive(Clone, Debug)]
pub struct FrameReport {
    pub timings: ZoneTimings,
    pub counters: Counters,
    /// Times that a buffer was too small and the frame was repeated with a larger one.
    pub repeats: u32,
    /// With `bounces = all`, further frames until the first had settled.
    pub settling: u32,
}

/// The GPU's counters after a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counters {
    pub triangles: u32,
    /// Zero-area triangles that were dropped.
    pub degenerate: u32,
    pub list_items: u32,
    pub occupied_voxels: u32,
}

/// With `bounces = all`: the share of all light by which one frame may still differ from the one before it.
pub const SETTLED: f64 = 1e-3;
/// And the number of frames after which it is left at that. A closed room that loses nothing never settles.
pub const MOST_SETTLING: u32 = 32;

pub struct Renderer {
    context: Arc<Context>,
    scene: Scene,
    settings: Settings,
    options: RenderOptions,
    volume: Volume,
    scale: f32,
    /// Scene, its textures and the image's targets: what does not grow.
    fixed_plan: Vec<(&'static str, u64)>,
    /// Bytes that may be taken, and who says so.
    memory_limit: (u64, String),
    counts: SceneCounts,
    bounces: u32,
    gpu_scene: GpuScene,
    blended: Vec<BlendedTriangle>,
    emitters: Emitters,
    /// Pieces of lamps, and whether they are chosen through the tree.
    placed_emitters: (u32, bool),
    /// Where the instances were when the lamps were placed.
    lamps_of: Option<Vec<DAffine3>>,
    passes: Passes,
    resources: Resources,
    capacities: Capacities,
    target: ImageTarget,
    frame_index: u32,
    /// Whether the second volume holds the frame before.
    history: bool,
    /// What the lists and volumes on the device were made of; `None` where they cannot be gone on from.
    made_of: Option<MadeOf>,
    /// Where it is kept.
    log: Option<FrameLog>,
}

/// Everything that changes from frame to frame and shows in lists or volumes: no camera does.
struct MadeOf {
    instances: Vec<DAffine3>,
    /// As the device has them.
    lights: Vec<u8>,
}

impl Renderer {
    /// Plans memory, refuses what does not fit, uploads the scene and compiles the passes. `pose`: the first one.
    ///
    /// # Errors
    /// Too little memory (with the largest grid that would fit), settings that make no sense, a lost device.
    pub fn new(
        context: &Arc<Context>,
        scene: Scene,
        pose: &Pose,
        settings: Settings,
        options: RenderOptions,
    ) -> Result<Self> {
        let volume = Volume::place(options.bounds, &settings)?;
        let packed = ScenePacked::new(&scene, pose);
        let outputs = image_target::outputs(&options.aovs);
        let bounces = if options.method == Method::Cones { settings.bounces.volumes() } else { 0 };
        let sampled = settings.emitters == settings::Emitters::Sampled;
        let emitters = if sampled { Emitters::new(&scene) } else { Emitters::default() };
        let counts = SceneCounts {
            emitters: emitters.count(settings.emitter_samples),
            triangles: packed.triangles,
            blended: packed.blended.len() as u32,
            lights: scene.lights.len() as u32,
        };
        let capacities = first_capacities(counts);
        let mut fixed_plan = packed.plan();
        fixed_plan.extend(image_target::plan(options.size, settings.image.samples, outputs));
        if bounces > 0 {
            let band_rows = image_target::band_rows(options.size.0, options.size.1, settings.image.samples, outputs);
            fixed_plan.extend(gather::plan(&settings, options.size, band_rows));
        }
        let budget = context.memory_budget();
        let limit = match options.memory_limit {
            Some(bytes) if bytes < budget => (bytes, "the --memory-limit".to_owned()),
            _ => (budget, format!("the budget of {}", context.name)),
        };
        check_memory(&limit, &settings, &fixed_plan, |at| resources::plan(counts, at, bounces, capacities))?;
        let features = Features::of(&scene, &settings);
        let resources = Resources::new(context, counts, &settings, bounces, capacities)?;
        let gpu_scene = packed.upload(context)?;
        let target = ImageTarget::new(context, options.size, settings.image.samples, outputs, scene.sky.into())?;
        let passes = Passes::new(context, &settings, features, bounces, &target)?;
        Ok(Self {
            context: context.clone(),
            scale: radiance_scale(&scene, volume.voxel_m, settings.bounces),
            blended: packed.blended,
            emitters,
            memory_limit: limit,
            placed_emitters: (0, false),
            lamps_of: None,
            scene,
            settings,
            options,
            volume,
            fixed_plan,
            counts,
            bounces,
            gpu_scene,
            passes,
            resources,
            capacities,
            target,
            frame_index: 0,
            history: false,
            made_of: None,
            log: None,
        })
    }

    /// Renders one frame and waits for it. Buffers that turn out too small grow, and the frame is repeated. With
    /// `bounces = all` the first frame is repeated until it settles: until the second volume changes by less than
    /// [`SETTLED`] from one to the next, [`MOST_SETTLING`] times at most.
    ///
    /// # Errors
    /// A buffer cannot grow as far as the scene needs, or the device is lost.
    pub fn render(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        let lights = uniforms::lights(&self.scene, pose, &self.volume);
        self.upload_pose(pose, view, &lights)?;
        if self.settings.bounces != Bounces::All || self.history || self.bounces < 2 {
            return self.frame(pose, view, &lights, true);
        }
        let mut repeats = self.frame(pose, view, &lights, false)?.repeats;
        self.history = true;
        let (mut settling, mut before) = (1, self.stored()?);
        while settling < MOST_SETTLING {
            repeats += self.frame(pose, view, &lights, false)?.repeats;
            settling += 1;
            let now = self.stored()?;
            let change: f64 = now.iter().zip(&before).map(|(a, b)| (a - b).abs()).sum();
            if change <= SETTLED * now.iter().sum::<f64>() {
                break;
            }
            before = now;
        }
        let report = self.frame(pose, view, &lights, true)?;
        Ok(FrameReport { repeats: repeats + report.repeats, settling, ..report })
    }

    /// One frame, repeated only where buffers had to grow; without its `image` the volumes alone.
    fn frame(&mut self, pose: &Pose, view: &View, lights: &[layout::Light], image: bool) -> Result<FrameReport> {
        let now = MadeOf { instances: pose.world_from_instance.clone(), lights: bytemuck::cast_slice(lights).to_vec() };
        for repeats in 0.. {
            self.upload_frame(view)?;
            let before = self.made_of.take();
            let anew = self.anew(before.as_ref(), &now);
            if anew.lists {
                self.resources.turn();
            }
            let recording =
                RecorderOptions { per_pass: self.options.submit == Submit::PerPass, log: self.log.is_some() };
            let mut recorder = Recorder::new(&self.context, recording)?;
            self.passes.record(
                &mut recorder,
                &FrameScene {
                    scene: &self.gpu_scene,
                    pose,
                    volume: &self.volume,
                    resources: &self.resources,
                    target: &self.target,
                    blended: self.counts.blended,
                    history: self.history,
                    image,
                    volumes_known: before.is_some(),
                    anew,
                },
            );
            if let Some(log) = &mut self.log {
                log.clone_from(recorder.frame_log());
            }
            let timings = recorder.finish()?;
            let globals = self.globals()?;
            if !self.grow(&globals)? {
                self.frame_index += 1;
                self.made_of = Some(now);
                let counters = Counters {
                    triangles: globals.vertex_count / 3,
                    degenerate: globals.degenerate_count,
                    list_items: globals.item_count,
                    occupied_voxels: globals.cell_count,
                };
                return Ok(FrameReport { timings, counters, repeats, settling: 0 });
            }
            // A frame whose lists overflowed is none to go on from.
            self.history = false;
        }
        unreachable!("a frame is repeated until its buffers are large enough or growing them fails")
    }

    /// What the frame cannot keep of the one before.
    fn anew(&self, before: Option<&MadeOf>, now: &MadeOf) -> Anew {
        let Some(before) = before.filter(|_| self.settings.reuse == settings::Reuse::Still) else {
            return Anew { lists: true, volumes: true };
        };
        let lists = before.instances != now.instances;
        // With jitter and with all bounces a frame's light differs from the last one's though nothing changes.
        let unsteady = self.settings.jitter || self.settings.bounces == Bounces::All;
        Anew { lists, volumes: lists || unsteady || before.lights != now.lights }
    }

    /// What the second volume holds, coarsely: the isotropic face's level of 8³ texels.
    fn stored(&self) -> Result<Vec<f64>> {
        let volume = self.resources.volumes.last().expect("called with two volumes");
        let texels: Vec<[u16; 4]> = vk::download_image(&self.context, &volume.faces[FACES - 1], volume.levels - 4)?;
        Ok(texels.iter().flat_map(|t| t[..3].to_vec()).map(|bits| half::f16::from_bits(bits).to_f64()).collect())
    }

    /// The last frame's image and the layers asked for.
    pub fn read(&self) -> Layers {
        self.target.read(&self.options.aovs)
    }

    /// What is allocated now, resource by resource.
    pub fn plan(&self) -> MemoryPlan {
        let mut rows = resources::plan(self.counts, &self.settings, self.bounces, self.capacities);
        rows.extend(&self.fixed_plan);
        MemoryPlan { rows }
    }

    /// From the next frame on, keeps what a frame records, for tests: see [`Self::log`].
    pub fn keep_log(&mut self) {
        self.log.get_or_insert_default();
    }

    /// What the last frame recorded; `None` without [`Self::keep_log`].
    pub fn log(&self) -> Option<&FrameLog> {
        self.log.as_ref()
    }

    /// The passes' buffers and volumes after the last frame.
    pub fn resources(&self) -> &Resources {
        &self.resources
    }

    /// What is rendered.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    pub fn volume(&self) -> &Volume {
        &self.volume
    }

    /// What stored radiance was multiplied with.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    fn upload_pose(&mut self, pose: &Pose, view: &View, lights: &[layout::Light]) -> Result<()> {
        self.upload(&self.resources.lights, lights)?;
        if self.lamps_of.as_ref() != Some(&pose.world_from_instance) {
            let lamps = self.emitters.place(pose, &self.volume, self.settings.emitter_samples);
            self.placed_emitters = (lamps.pieces.len() as u32, !lamps.nodes.is_empty());
            self.upload(&self.resources.emitters, &lamps.pieces)?;
            self.upload(&self.resources.emitter_nodes, &lamps.nodes)?;
            self.lamps_of = Some(pose.world_from_instance.clone());
        }
        let order = back_to_front(&self.blended, &self.scene, pose, view);
        self.upload(&self.resources.order, &order)
    }

    fn upload_frame(&self, view: &View) -> Result<()> {
        let frame = uniforms::frame(&FrameInputs {
            scene: &self.scene,
            view,
            settings: &self.settings,
            volume: &self.volume,
            scale: self.scale,
            size: self.options.size,
            capacities: self.capacities,
            frame_index: self.frame_index,
            emitters: self.placed_emitters,
        });
        self.upload(&self.resources.frame, &[frame])
    }

    fn upload<T: bytemuck::Pod>(&self, buffer: &vk::Buffer, data: &[T]) -> Result<()> {
        if data.is_empty() { Ok(()) } else { vk::upload_into(&self.context, buffer, data) }
    }

    fn globals(&self) -> Result<layout::Globals> {
        let bytes: Vec<u32> = vk::download(&self.context, &self.resources.globals)?;
        Ok(*bytemuck::from_bytes(&bytemuck::cast_slice(&bytes)[..size_of::<layout::Globals>()]))
    }

    /// Makes the buffers that were too small for the last frame larger; whether any was.
    fn grow(&mut self, globals: &layout::Globals) -> Result<bool> {
        let grown = |capacity: u32, needed: u32, overflow: u32| {
            // An eighth to spare: a moving scene does not grow again at once.
            if overflow == 0 { capacity } else { needed.saturating_add(needed / 8) }
        };
        let capacities = Capacities {
            triangles: grown(self.capacities.triangles, globals.vertex_count / 3, globals.triangle_overflow),
            items: grown(self.capacities.items, globals.item_count, globals.item_overflow),
            cells: grown(self.capacities.cells, globals.cell_count, globals.cell_overflow),
        };
        if capacities == self.capacities {
            return Ok(false);
        }
        let plan = |at: &Settings| resources::plan(self.counts, at, self.bounces, capacities);
        check_memory(&self.memory_limit, &self.settings, &self.fixed_plan, plan)?;
        tracing::info!("buffers grow and the frame is repeated: {:?} to {:?}", self.capacities, capacities);
        self.capacities = capacities;
        self.resources.grow(&self.context, self.counts, &self.settings, self.bounces, capacities)?;
        Ok(true)
    }
}

/// Refuses settings whose resources, those of `plan` and what does not grow, exceed the limit (bytes, what it is called).
fn check_memory(
    limit: &(u64, String),
    settings: &Settings,
    fixed: &[(&'static str, u64)],
    plan: impl Fn(&Settings) -> Vec<(&'static str, u64)>,
) -> Result<()> {
    memory_plan::check(settings.voxels, limit.0, &limit.1, |edge| {
        let at = Settings { voxels: edge, ..settings.clone() };
        fixed.iter().chain(&plan(&at)).map(|row| row.1).sum()
    })
}

/// Room for every triangle of the scene; list items and cells for a typical one, to be grown if need be.
fn first_capacities(counts: SceneCounts) -> Capacities {
    let triangles = counts.triangles.max(1);
    let items = (4 * triangles).max(1 << 16);
    Capacities { triangles, items, cells: 1 << 15 }
}

/// Sources of the blended triangles, the farthest centroid first; equal depths in the scene's order.
fn back_to_front(blended: &[BlendedTriangle], scene: &Scene, pose: &Pose, view: &View) -> Vec<u32> {
    let depth = |t: &BlendedTriangle| {
        let mesh = &scene.meshes[t.mesh];
        let corners = &mesh.indices[t.first_index..t.first_index + 3];
        let sum: DVec3 = corners
            .iter()
            .map(|&i| pose.world_from_instance[t.instance].transform_point3(mesh.positions[i as usize].as_dvec3()))
            .sum();
        (sum / 3.0 - view.eye).dot(view.forward)
    };
    let mut order: Vec<(f64, u32)> = blended.iter().map(|t| (depth(t), t.source)).collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    order.into_iter().map(|(_, source)| source).collect()
}
