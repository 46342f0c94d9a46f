//! The renderer of the command line and of programs without Vulkan code: it owns a scene, a [`Frame`] and a
//! [`Readback`] on one device, renders frames, grows buffers, waits until feedback has settled, and reads images back.

mod lacks;
mod limits;
mod refine;

use std::sync::{Arc, Mutex};

use crate::frame::{Counters, Frame, FrameDesc, LightState, Shot};
use crate::ground::Ground;
use crate::ground::attributes::CornerWords;
use crate::ground::constants::Features;
use crate::ground::image::target::{self, Readback};
use crate::ground::memory_plan::{MemoryPlan, MemoryRow};
use crate::ground::tree::queries::QueryPlan;
use crate::layers::PassMean;
use crate::scene::{Bounds, Pose, Scene, View};
use crate::settings::Settings;
use crate::vk::{FrameLog, Pace, Recorder, RecorderOptions};
use crate::{Error, Result};

#[cfg_attr(not(internals), doc(hidden))]
pub use crate::frame::SETTLED;
#[cfg_attr(not(internals), doc(hidden))]
pub use lacks::{StageNeeds, lacks, method_of, stage_needs};
pub(crate) use limits::MemoryCheck;
#[cfg_attr(not(internals), doc(hidden))]
pub use limits::{fits, largest_image, memory_limit, most_triangles};

pub use crate::layers::{Aov, Layers};
pub use crate::vk::{Context, ContextOptions, Step, Watch, ZoneTimings};

/// How a frame is submitted to the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Submit {
    /// Several submissions, each well below 100 ms on a GPU and about a second on a CPU device, as far as passes can be
    /// split.
    #[default]
    Short,
    /// One command buffer for the whole frame.
    Frame,
    /// One submission per pass, each waited for. This also measures the CPU time of each pass on CPU devices.
    PerPass,
}

#[derive(Clone)]
pub struct RenderOptions {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Layers in addition to radiance.
    pub aovs: Vec<Aov>,
    pub submit: Submit,
    /// Whether each level of mips and each step of propagation is timed.
    pub steps: bool,
    /// Bytes of device memory that may be used; by default the budget that the device reports.
    pub memory_limit: Option<u64>,
    /// Bounds of the scene over the whole animation. They determine the place of the grid.
    pub bounds: Bounds,
    /// A function that is called after each submission of [`Submit::Short`]; its error ends the frame.
    pub watch: Option<Watch>,
    /// Whether the submissions of [`Submit::Short`] are as short on a CPU device as on a GPU. The frame takes longer,
    /// and an interruption is noticed sooner.
    pub responsive: bool,
}

impl RenderOptions {
    /// Radiance alone, in short submissions and within the device's budget.
    pub fn new(size: (u32, u32), bounds: Bounds) -> Self {
        Self {
            size,
            aovs: vec![],
            submit: Submit::Short,
            steps: false,
            memory_limit: None,
            bounds,
            watch: None,
            responsive: false,
        }
    }
}

/// Times and counts of one frame.
#[derive(Clone, Debug, Default)]
pub struct FrameReport {
    pub timings: ZoneTimings,
    pub counters: Counters,
    /// How often a buffer was too small, so that the frame was repeated with a larger one.
    pub repeats: u32,
    /// With `bounces = all`, the number of further passes until the first light had settled.
    pub settling: u32,
    /// The estimated noise with `image.passes` above 1: see [`PassMean::noise`].
    pub noise: Option<f64>,
    /// Processor time of the process over all threads in milliseconds, where the system reports it
    /// ([`Renderer::render`]).
    pub cpu_ms: Option<f64>,
}

impl FrameReport {
    /// The report of this image and a further pass over it, `next`, which has the noise of the mean.
    #[must_use]
    pub fn then(self, next: Self) -> Self {
        let timings = self.timings.then(next.timings);
        Self { repeats: self.repeats + next.repeats, settling: self.settling, timings, cpu_ms: None, ..next }
    }
}

pub struct Renderer {
    context: Arc<Context>,
    scene: Scene,
    settings: Settings,
    options: RenderOptions,
    frame: Frame,
    readback: Readback,
    /// The mean of the last image's passes, if it had several.
    mean: Option<PassMean>,
    /// Memory of the scene and the readback, which does not grow.
    fixed_plan: Vec<MemoryRow>,
    memory: MemoryCheck,
    /// The log of the last frame, if logs are kept.
    log: Option<FrameLog>,
    /// Measured times of passes, which determine the length of short submissions.
    pace: Arc<Mutex<Pace>>,
}

impl Renderer {
    /// Plans memory, refuses a scene that does not fit, uploads the scene and compiles the passes. `pose` is the first
    /// pose.
    ///
    /// # Errors
    /// There is too little memory (the message names the largest grid that fits), settings are invalid, or the device
    /// is lost.
    pub fn new(
        context: &Arc<Context>,
        scene: Scene,
        pose: &Pose,
        settings: Settings,
        options: RenderOptions,
    ) -> Result<Self> {
        scene.check()?;
        pose.check(&scene)?;
        let desc = desc(context, &scene, &settings, &options)?;
        let memory = MemoryCheck::new(context, options.memory_limit);
        let readback = target::readback_plan(desc.size, desc.outputs);
        let (packed, fixed_plan) = memory.pack(context, &desc, pose, &[readback])?;
        let frame = Frame::new(context, &desc, &Arc::new(packed.upload(context)?))?;
        let readback = Readback::new(context, options.size, desc.outputs)?;
        let (pace, context) = (pace(context, &options), context.clone());
        Ok(Self { context, scene, settings, options, frame, readback, mean: None, fixed_plan, memory, log: None, pace })
    }

    /// Changes settings and size; only parts that depend on them are rebuilt.
    ///
    /// # Errors
    /// As for [`Renderer::new`]; after an error the renderer is as before.
    pub fn change(&mut self, settings: Settings, size: (u32, u32)) -> Result<()> {
        self.change_layers(settings, size, self.options.aovs.clone())
    }

    /// Changes settings, size and layers; only parts that depend on them are rebuilt.
    ///
    /// # Errors
    /// As for [`Renderer::new`]; after an error the renderer is as before.
    pub fn change_layers(&mut self, settings: Settings, size: (u32, u32), aovs: Vec<Aov>) -> Result<()> {
        let options = RenderOptions { size, aovs, ..self.options.clone() };
        let desc = desc(&self.context, &self.scene, &settings, &options)?;
        let mut fixed_plan = self.fixed_plan.clone();
        fixed_plan.pop();
        fixed_plan.push(target::readback_plan(size, desc.outputs));
        self.memory.check_first(&desc, &self.frame.ground.scene.trees, &fixed_plan)?;
        // The readback changes before the frame, which must not stay changed if the readback lacks memory.
        let other = size != self.options.size || desc.outputs != target::outputs(&self.options.aovs);
        let readback = other.then(|| Readback::new(&self.context, size, desc.outputs)).transpose()?;
        self.frame.change(&self.context, &desc)?;
        if let Some(readback) = readback {
            self.readback = readback;
        }
        self.pace = pace(&self.context, &options);
        (self.settings, self.options, self.fixed_plan) = (settings, options, fixed_plan);
        Ok(())
    }

    /// Replaces the scene by one with other lights, sky, materials (with the same textures), and other vertices of the
    /// meshes `moved`, as many as before. Everything else of the scene is unchanged.
    ///
    /// # Errors
    /// The device is lost or has no memory for more lights; the scene has other instances, meshes, numbers of vertices,
    /// or vertex attributes that shading reads; or a mesh of `moved` has a skin or morph targets, which a pose moves.
    pub fn change_scene(&mut self, scene: Scene, pose: &Pose, moved: &[usize]) -> Result<()> {
        scene.check()?;
        pose.check(&scene)?;
        let on_gpu = self.frame.ground.scene.clone();
        if CornerWords::of_features(Features::of_scene(&scene)) != on_gpu.corner {
            let words =
                "a scene that changes got its first vertex colours or textures, or lost its last: make a new renderer";
            return Err(Error::Usage(words.into()));
        }
        let vertices = |scene: &Scene| scene.meshes.iter().map(|mesh| mesh.positions.len()).collect::<Vec<_>>();
        if scene.instances.len() != self.scene.instances.len() || vertices(&scene) != vertices(&self.scene) {
            let words = "a scene that changes has other instances, meshes or numbers of vertices: make a new renderer";
            return Err(Error::Usage(words.into()));
        }
        if let Some(mesh) = moved.iter().find(|&&mesh| scene.meshes.get(mesh).is_none_or(|mesh| mesh.deform.is_some()))
        {
            let words = format!(
                "mesh {mesh} of a scene that changes is not there, or has a skin or morph targets: move it by a pose"
            );
            return Err(Error::Usage(words));
        }
        let mut recorder = Recorder::new(&self.context, RecorderOptions::default())?;
        on_gpu.update_materials(&mut recorder, &scene, pose);
        moved.iter().for_each(|&mesh| on_gpu.update_mesh(&mut recorder, mesh, &scene.meshes[mesh]));
        recorder.finish()?;
        self.scene = scene;
        self.frame.scene_changed(&self.scene);
        self.frame.change(&self.context, &desc(&self.context, &self.scene, &self.settings, &self.options)?)
    }

    /// Makes the next frame rebuild lists and light although nothing changed, to measure the cost of a frame with
    /// motion.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn make_anew(&mut self) {
        self.frame.make_anew();
    }

    /// With `bounces = all`, starts the next frame without the light of earlier frames, like the first one.
    pub fn forget_light(&mut self) {
        self.frame.light.forget();
    }

    /// Renders one frame, which is repeated only if buffers had to grow. `image` is the number of the pass, or `None`
    /// for the light alone. A frame without earlier lists builds these first, repeatedly until they fit, because light
    /// is never computed from incomplete lists.
    fn draw(&mut self, pose: &Pose, view: &View, image: Option<u32>) -> Result<FrameReport> {
        pose.check(&self.scene)?;
        let (mut repeats, mut listed) = (0, None);
        loop {
            let alone = self.frame.starts_from_nothing();
            let (timings, log) = self.submit(pose, view, image, alone)?;
            let (counters, grown) = self.frame.poll(0);
            if let Some(counts) = grown {
                let plan = |voxels| self.frame.plan(&counts, voxels);
                self.memory.check(self.settings.voxels, &self.fixed_plan, &plan)?;
                self.frame.grow(&self.context, counts)?;
                repeats += u32::from(!alone);
            } else if alone {
                listed = Some((timings, log));
            } else {
                let (timings, log) = match listed {
                    Some((lists, lists_log)) => (lists.then(timings), lists_log.then(log)),
                    None => (timings, log),
                };
                if let Some(kept) = &mut self.log {
                    *kept = log;
                }
                self.light_made()?;
                return Ok(FrameReport { timings, counters, repeats, settling: 0, noise: None, cpu_ms: None });
            }
        }
    }

    /// Records the next frame, or only its lists, and waits for it.
    fn submit(
        &mut self,
        pose: &Pose,
        view: &View,
        image: Option<u32>,
        lists_alone: bool,
    ) -> Result<(ZoneTimings, FrameLog)> {
        let RenderOptions { submit, steps, .. } = self.options;
        let options = RecorderOptions { per_pass: submit == Submit::PerPass, steps, log: self.log.is_some() };
        let mut recorder = Recorder::new(&self.context, options)?;
        // The log shows a frame in one recording, like that of a host.
        if self.options.submit == Submit::Short && self.log.is_none() {
            recorder = recorder.paced(&self.pace);
        }
        let seen = Shot { scene: &self.scene, pose, view, image };
        if lists_alone {
            self.frame.record_lists(&mut recorder, 0, &seen);
        } else {
            self.frame.record(&mut recorder, 0, &seen);
            if image.is_some() {
                self.readback.record(&mut recorder, &self.frame.target);
            }
        }
        let log = recorder.frame_log().clone();
        match recorder.finish() {
            Ok(timings) => Ok((timings, log)),
            Err(error) => {
                // An interruption during the image leaves light that is already complete.
                if matches!(error, Error::Interrupted) && self.frame.light.state() != LightState::Unlit {
                    self.light_made()?;
                } else {
                    self.frame.start_over();
                }
                Err(error)
            }
        }
    }

    /// The number of bands of rows in which an image is made, and the number of passes that [`Self::render`] averages.
    pub fn bands(&self) -> (u32, u32) {
        (self.frame.target.shape().bands().count() as u32, self.settings.image.passes)
    }

    /// Reads back the last image and its layers.
    pub fn read(&self) -> Layers {
        match &self.mean {
            Some(mean) => mean.layers(),
            None => self.readback.read(&self.options.aovs),
        }
    }

    /// The memory that is allocated now, for each resource.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn plan(&self) -> MemoryPlan {
        let mut rows = self.frame.plan(self.frame.counts(), self.settings.voxels);
        rows.extend(&self.fixed_plan);
        MemoryPlan { rows }
    }

    /// The memory that images of another size would take.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn plan_at(&self, size: (u32, u32)) -> MemoryPlan {
        let mut rows = self.frame.plan_at(size);
        rows.extend(&self.fixed_plan[..self.fixed_plan.len() - 1]);
        rows.push(target::readback_plan(size, target::outputs(&self.options.aovs)));
        MemoryPlan { rows }
    }

    /// Keeps a log of the commands of each later frame, for tests: see [`Self::log`].
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn keep_log(&mut self) {
        self.log.get_or_insert_default();
    }

    /// The commands of the last frame; `None` without [`Self::keep_log`].
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn log(&self) -> Option<&FrameLog> {
        self.log.as_ref()
    }

    /// Buffers and lists after the last frame.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn ground(&self) -> &Ground {
        &self.frame.ground
    }

    /// The frame with all of its resources.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The current settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Width and height of the image in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.options.size
    }

    /// The current scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

fn pace(context: &Context, options: &RenderOptions) -> Arc<Mutex<Pace>> {
    Pace::new(context.is_cpu, options.responsive, options.watch.clone())
}

/// The description of a frame with one slot.
fn desc<'a>(
    context: &Context,
    scene: &'a Scene,
    settings: &'a Settings,
    options: &RenderOptions,
) -> Result<FrameDesc<'a>> {
    let (outputs, query) = (target::outputs(&options.aovs), QueryPlan::of_scene(context, scene, settings)?);
    let RenderOptions { size, bounds, .. } = *options;
    let desc = FrameDesc { scene, settings, size, outputs, bounds, slots: 1, query, waits: true };
    desc.check()?;
    Ok(desc)
}
