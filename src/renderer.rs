//! A host of its own, as the command line uses it: a scene, a [`Frame`] and a [`Readback`] on one device. Renders
//! frames, lets buffers grow, waits for feedback to settle, reads images back.

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

/// How a frame is handed to the device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Submit {
    /// In parts that each take well below 100 ms on a GPU and about a second on a CPU device, as far as passes can be
    /// cut.
    #[default]
    Short,
    /// One command buffer.
    Frame,
    /// One submission per pass, waited for: CPU time per pass too, for CPU devices.
    PerPass,
}

#[derive(Clone)]
pub struct RenderOptions {
    /// Pixels.
    pub size: (u32, u32),
    /// Layers beside the image.
    pub aovs: Vec<Aov>,
    pub submit: Submit,
    /// Time each level of mips and each step of propagation.
    pub steps: bool,
    /// Bytes; the device's own budget where absent.
    pub memory_limit: Option<u64>,
    /// Of the scene over the whole animation: where the grid stands.
    pub bounds: Bounds,
    /// With [`Submit::Short`], asked after each of them; an error ends the frame.
    pub watch: Option<Watch>,
    /// With [`Submit::Short`], as short on a CPU device as on a GPU: it pays for that, and answers sooner.
    pub responsive: bool,
}

impl RenderOptions {
    /// The image alone, in short submissions and within the budget.
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

/// Times and counts of a frame.
#[derive(Clone, Debug)]
pub struct FrameReport {
    pub timings: ZoneTimings,
    pub counters: Counters,
    /// Times that a buffer was too small and the frame was repeated with a larger one.
    pub repeats: u32,
    /// With `bounces = all`, further frames until the first had settled.
    pub settling: u32,
    /// With `image.passes` above 1: see [`PassMean::noise`].
    pub noise: Option<f64>,
    /// Of [`Renderer::render`]: milliseconds of processor time of the process over all threads, where the system tells
    /// it.
    pub cpu_ms: Option<f64>,
}

impl FrameReport {
    /// Of this image and a further pass over it, `next`, whose noise is the mean's.
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
    /// Of the last image's passes, where it had several.
    mean: Option<PassMean>,
    /// The scene on the device and the readback: what does not grow.
    fixed_plan: Vec<MemoryRow>,
    memory: MemoryCheck,
    /// Where it is kept.
    log: Option<FrameLog>,
    /// How long what passes take, where submissions are short.
    pace: Arc<Mutex<Pace>>,
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

    /// Changes to other settings and another size; only what depends on them is remade.
    ///
    /// # Errors
    /// As for [`Renderer::new`]; the renderer then is as before.
    pub fn change(&mut self, settings: Settings, size: (u32, u32)) -> Result<()> {
        self.change_layers(settings, size, self.options.aovs.clone())
    }

    /// Changes to other settings, another size and other layers; only what depends on them is remade.
    ///
    /// # Errors
    /// As for [`Renderer::new`]; the renderer then is as before.
    pub fn change_layers(&mut self, settings: Settings, size: (u32, u32), aovs: Vec<Aov>) -> Result<()> {
        let options = RenderOptions { size, aovs, ..self.options.clone() };
        let desc = desc(&self.context, &self.scene, &settings, &options)?;
        let mut fixed_plan = self.fixed_plan.clone();
        fixed_plan.pop();
        fixed_plan.push(target::readback_plan(size, desc.outputs));
        self.memory.check_first(&desc, &self.frame.ground.scene.trees, &fixed_plan)?;
        // It comes before the frame, which must not stay changed where there is no memory for it.
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

    /// The scene with lights, sky, materials (but for which textures they use) and vertices of the meshes `moved` (as
    /// many as before) changed: what else it holds stays.
    ///
    /// # Errors
    /// The device is lost, or has no room for more lights, or there are other instances, meshes or numbers of vertices
    /// than before, or vertices have other attributes than before that shading reads, or a mesh of `moved` has a skin
    /// or morph targets: a pose moves these.
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

    /// The next frame remakes lists and light though nothing changed: what a frame costs in which something moves.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn make_anew(&mut self) {
        self.frame.make_anew();
    }

    /// With `bounces = all`: the next frame starts without the light of those before it, as the first one did.
    pub fn forget_light(&mut self) {
        self.frame.light.forget();
    }

    /// One frame, repeated only where buffers had to grow; without an `image`, of that pass, the light alone. A frame
    /// that starts from nothing makes its lists first, as often as it takes until they fit: no light is made from lists
    /// that are not whole.
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

    /// Records the next frame, or its lists alone, and waits for it.
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
        // A log tells of a frame as a host records it: whole.
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
                // A frame that was interrupted during its image had made its light before.
                if matches!(error, Error::Interrupted) && self.frame.light.state() != LightState::Unlit {
                    self.light_made()?;
                } else {
                    self.frame.start_over();
                }
                Err(error)
            }
        }
    }

    /// Bands of rows that an image is made in, one after another, and images that [`Self::render`] takes the mean of.
    pub fn bands(&self) -> (u32, u32) {
        (self.frame.target.shape().bands().count() as u32, self.settings.image.passes)
    }

    /// The last frame's image and the layers asked for.
    pub fn read(&self) -> Layers {
        match &self.mean {
            Some(mean) => mean.layers(),
            None => self.readback.read(&self.options.aovs),
        }
    }

    /// Memory that is allocated now, resource by resource.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn plan(&self) -> MemoryPlan {
        let mut rows = self.frame.plan(self.frame.counts(), self.settings.voxels);
        rows.extend(&self.fixed_plan);
        MemoryPlan { rows }
    }

    /// Memory that would be allocated for images of another size.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn plan_at(&self, size: (u32, u32)) -> MemoryPlan {
        let mut rows = self.frame.plan_at(size);
        rows.extend(&self.fixed_plan[..self.fixed_plan.len() - 1]);
        rows.push(target::readback_plan(size, target::outputs(&self.options.aovs)));
        MemoryPlan { rows }
    }

    /// From the next frame on, keeps what a frame records, for tests: see [`Self::log`].
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn keep_log(&mut self) {
        self.log.get_or_insert_default();
    }

    /// Commands that the last frame recorded; `None` without [`Self::keep_log`].
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn log(&self) -> Option<&FrameLog> {
        self.log.as_ref()
    }

    /// Buffers and lists after the last frame.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn ground(&self) -> &Ground {
        &self.frame.ground
    }

    /// The frame, with everything that it works on.
    #[cfg_attr(not(internals), doc(hidden))]
    pub fn frame(&self) -> &Frame {
        &self.frame
    }

    /// The settings that are rendered with.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Width and height of the image in pixels.
    pub fn size(&self) -> (u32, u32) {
        self.options.size
    }

    /// The scene that is rendered.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }
}

fn pace(context: &Context, options: &RenderOptions) -> Arc<Mutex<Pace>> {
    Pace::new(context.is_cpu, options.responsive, options.watch.clone())
}

/// One frame in flight.
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
