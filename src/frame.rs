//! The frame: everything that turns a scene into an image, for one size and one set of settings.
//!
//! [`Frame::record`] records a frame into a given recorder, which may be a host's command buffer: uploads, lists, the
//! method's light, and the image. It creates, submits and waits for nothing, and the image stays on the device.
//! [`Frame::poll`] reports buffers that were too small, once the commands have finished. Several frames may be in
//! flight, each in its own slot.

mod desc;
mod light;

use std::sync::Arc;

use glam::{DAffine3, Vec3};

use crate::Result;
use crate::gi::{IndirectMethod, Maker, Update};
use crate::ground::grid::radiance_scale;
use crate::ground::image::given::{GivenPass, GivenSurfaces};
use crate::ground::image::target::{ImageShape, ImageTarget};
use crate::ground::image::{ImageFrame, ImagePass};
use crate::ground::lamps::{LampSums, Lamps};
use crate::ground::layout::{self, Globals};
use crate::ground::memory_plan::MemoryRow;
use crate::ground::scene_on_gpu::SceneOnGpu;
use crate::ground::uniforms::{self, FrameUniforms};
use crate::ground::{Counts, Ground};
use crate::scene::deform::DeformPose;
use crate::scene::{Pose, Scene, View};
use crate::settings::{Bounces, Settings};
use crate::vk::{Buffer, BufferKind, Context, Recorder};

pub use desc::{FrameDesc, first_plan, make_trees};
use desc::{ground_desc, image_pass_desc, lamps, of_light, plan, shape};
pub use light::{LightProgress, LightRules, LightState, MOST_SETTLING, SETTLED};

pub struct Frame {
    pub ground: Ground,
    pub method: Box<dyn IndirectMethod>,
    pub target: ImageTarget,
    image: ImagePass,
    settings: Settings,
    lamps: Lamps,
    placed_lamps: LampSums,
    /// Scale from radiance to its stored value.
    pub scale: f32,
    /// Counters of each slot and grid, written by the device.
    counters: Vec<Vec<Buffer>>,
    /// The progress of the method's light. After each pass the caller measures the light if `is_measured` requests it.
    pub light: LightProgress,
    /// Whether all items are lit that can be requested, for light on demand.
    all_lit: bool,
    /// Inputs of the lists and light now on the device; `None` if they must be rebuilt.
    made_of: Option<LightInputs>,
    /// Whether the next frame rebuilds lists and light although nothing moved.
    stale: bool,
}

/// All inputs that can change between frames and affect lists or light. The camera does not.
struct LightInputs {
    instances: Vec<DAffine3>,
    /// Poses of the scene's deformers.
    deforms: Vec<DeformPose>,
    lights: Vec<layout::Light>,
    /// The two colours of the sky, and the rotation of its map.
    sky: ([Vec3; 2], f32),
    /// The time within the animation, if the light's random numbers change with it.
    time_s: Option<f64>,
    /// The pass over the image, for light on demand. Mirrors show the few directions of the light, so every pass uses
    /// other directions; otherwise their pattern would remain in the mean.
    image_pass: Option<u32>,
}

/// The scene, pose and view of a frame.
#[derive(Clone, Copy)]
pub struct Shot<'a> {
    pub scene: &'a Scene,
    pub pose: &'a Pose,
    pub view: &'a View,
    /// The index of this pass among the passes over one image that the host averages; `None` updates the light alone.
    pub image: Option<u32>,
}

impl<'a> Shot<'a> {
    /// A shot for an image of one pass.
    pub fn new(scene: &'a Scene, pose: &'a Pose, view: &'a View) -> Self {
        Self { scene, pose, view, image: Some(0) }
    }
}

/// Counters of the GPU after a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    pub triangles: u32,
    /// The number of triangles without area, which were dropped.
    pub degenerate: u32,
    pub list_items: u32,
    pub occupied_voxels: u32,
}

impl Frame {
    /// Compiles the passes and creates their resources.
    ///
    /// # Errors
    /// Settings are invalid, there is too little memory, or the device is lost.
    pub fn new(context: &Arc<Context>, desc: &FrameDesc, scene_on_gpu: &Arc<SceneOnGpu>) -> Result<Self> {
        let settings = desc.settings;
        let lamps = lamps(desc.scene, settings);
        let ground =
            Ground::new(context, desc.scene, scene_on_gpu.clone(), ground_desc(desc, &lamps, &scene_on_gpu.trees)?)?;
        let method = settings.method.make(&maker(context, settings, &ground))?;
        let target = ImageTarget::new(context, shape(desc))?;
        let image = ImagePass::new(
            context,
            &image_pass_desc(desc, &*method, &ground.desc.counts),
            target.shape(),
            &ground.desc.counts,
        )?;
        let counter = |_| {
            let bytes = size_of::<Globals>() as u64;
            Buffer::new(context, "counters, readback", bytes, BufferKind::Readback)
        };
        let counters = |_| (0..ground.lists.len()).map(counter).collect::<Result<Vec<_>>>();
        context.wait_for_pipelines()?;
        Ok(Self {
            counters: (0..desc.slots).map(counters).collect::<Result<_>>()?,
            scale: radiance_scale(desc.scene, ground.desc.grid.finest_m(), settings.bounces),
            settings: settings.clone(),
            placed_lamps: LampSums::default(),
            light: LightProgress::new(light_rules(desc, &ground, &*method)),
            all_lit: false,
            made_of: None,
            stale: false,
            ground,
            method,
            target,
            image,
            lamps,
        })
    }

    /// Whether the next frame has no earlier lists, so that the size of its lists is unknown.
    pub fn starts_from_nothing(&self) -> bool {
        self.made_of.is_none()
    }

    /// Records only the lists of such a frame, so that buffers can grow before anything is lit. The frame then
    /// continues from these lists. `slot` is as for [`Self::record`].
    pub fn record_lists(&mut self, r: &mut Recorder, slot: usize, seen: &Shot) {
        let now = self.made_now(seen);
        self.place_grids(seen.view);
        self.upload(r, seen, &now, true);
        self.ground.swap_lists();
        self.ground.record_lists(r, seen.pose);
        self.copy_counters(r, slot);
        (self.made_of, self.stale) = (Some(now), false);
        self.light.forget();
    }

    /// Records a frame. `slot` is a slot whose earlier frame has finished.
    pub fn record(&mut self, r: &mut Recorder, slot: usize, seen: &Shot) {
        self.record_light(r, seen);
        if seen.image.is_none() || !self.image.asks() {
            self.light_all(r);
        }
        if seen.image.is_some() {
            // The image shows the recorded triangles with the light that the method looks up.
            let (ground, target) = (&self.ground, &self.target);
            let frame = ImageFrame { ground, target, scene: seen.scene };
            let asked = self.method.on_demand().filter(|_| !self.all_lit);
            self.image.record(r, &frame, &self.method.binds(ground), asked);
            if asked.is_some() {
                self.forget_cut_light(r);
            }
        }
        self.copy_counters(r, slot);
    }

    /// Records a frame that lights surfaces drawn by a host, instead of an image. `given` is a result of
    /// [`Self::given`].
    pub fn record_given(&mut self, r: &mut Recorder, slot: usize, seen: &Shot, given: &GivenSurfaces) {
        self.record_light(r, seen);
        self.light_all(r);
        given.pass.record(r, &self.ground, &self.method.binds(&self.ground), given.have_material);
        self.copy_counters(r, slot);
    }

    /// Records the geometry, the lists, and the light that the method makes from them.
    fn record_light(&mut self, r: &mut Recorder, seen: &Shot) {
        let now = self.made_now(seen);
        let before = self.made_of.take();
        let unlit = self.light.state() == LightState::Unlit;
        let moved = self.place_grids(seen.view);
        let stale = std::mem::take(&mut self.stale) || moved;
        let stood = |b: &LightInputs| b.instances == now.instances && b.deforms == now.deforms;
        let lists = stale || !before.as_ref().is_some_and(stood);
        let bytes = bytemuck::cast_slice::<layout::Light, u8>;
        let same = |before: &LightInputs| {
            bytes(&before.lights) == bytes(&now.lights)
                && before.sky == now.sky
                && before.time_s == now.time_s
                && before.image_pass == now.image_pass
        };
        if lists || unlit || !before.as_ref().is_some_and(same) {
            self.light.changed();
        }
        self.upload(r, seen, &now, lists || unlit);
        if lists {
            // The triangles are recorded, and listed in the voxels that they touch.
            self.ground.swap_lists();
            self.ground.record_lists(r, seen.pose);
        }
        if self.light.needs_pass() {
            // The method computes its light.
            let update = Update {
                lists: lists || unlit,
                history: self.light.has_history(),
                known: !unlit,
                measured: self.light.is_measured(),
                sky: seen.scene.sky != Vec3::ZERO,
                passes: self.light.passes(),
                mean_pass: self.light.mean_pass(),
            };
            self.method.update(r, &self.ground, &update);
            self.all_lit = false;
            self.light.passed();
        }
        self.made_of = Some(now);
        if !r.goes_on() {
            self.start_over(); // the recording ended before lists and light were complete
        }
    }

    /// Lights all items, if light is made on demand and they are not lit yet.
    fn light_all(&mut self, r: &mut Recorder) {
        if let Some(on_demand) = self.method.on_demand().filter(|_| !self.all_lit) {
            on_demand.light_all(r, &self.ground);
            self.all_lit = true;
            self.forget_cut_light(r);
        }
    }

    /// Forgets light that is made on demand if the recording ended before it was complete.
    fn forget_cut_light(&mut self, r: &Recorder) {
        if !r.goes_on() {
            self.light.forget();
            self.all_lit = false;
        }
    }

    fn made_now(&self, seen: &Shot) -> LightInputs {
        LightInputs {
            instances: seen.pose.world_from_instance.clone(),
            deforms: seen.pose.deforms.clone(),
            lights: uniforms::lights(seen.scene, seen.pose, &self.ground.desc.grid),
            sky: ([seen.scene.sky, seen.scene.sky_gradient], seen.scene.sky_turn),
            time_s: self.ground.desc.wants.turns.then_some(seen.pose.time_s),
            image_pass: self.ground.desc.wants.demand.then(|| seen.image.unwrap_or(0)),
        }
    }

    /// Moves the method's own grids and the boxes of finer voxels to the camera. Returns whether one moved.
    fn place_grids(&mut self, view: &View) -> bool {
        let eye = self.ground.desc.grid.voxel_from_world().transform_point3(view.eye).as_vec3();
        let about = self.ground.desc.grid.about.unwrap_or(eye);
        self.ground.place_grids(&self.method.grids(eye), about)
    }

    fn copy_counters(&self, r: &mut Recorder, slot: usize) {
        r.full_barrier(); // the counters were written
        for (lists, counters) in self.ground.lists.iter().zip(&self.counters[slot]) {
            r.copy(&lists.globals, counters);
        }
    }

    /// Writes the uniforms of this frame. `lamps` says whether lamps may have moved.
    fn upload(&mut self, r: &mut Recorder, seen: &Shot, now: &LightInputs, lamps: bool) {
        let mean_pass = self.light.mean_pass();
        r.full_barrier(); // the previous frame read the same buffers
        if lamps {
            let placed =
                self.lamps.place(seen.scene, seen.pose, &self.ground.desc.grid, self.settings.lights.lamp_points);
            self.placed_lamps = placed.sums();
            r.update(&self.ground.lamps, 0, &placed.pieces);
            r.update(&self.ground.lamp_nodes, 0, &placed.nodes);
        }
        let uniforms = FrameUniforms {
            scene: seen.scene,
            view: seen.view,
            grid: &self.ground.desc.grid,
            scale: self.scale,
            size: self.target.size(),
            samples: self.settings.image.samples,
            time_s: seen.pose.time_s,
            lamps: self.placed_lamps,
            light_pass: now.image_pass.unwrap_or(mean_pass),
            light_share: self.share_of_mean(mean_pass),
            image_pass: seen.image.unwrap_or(0),
            boxes: [self.ground.base().boxes, self.ground.base().made_boxes],
        };
        r.update(&self.ground.frame, 0, &[uniforms.layout()]);
        r.update(&self.ground.lights, 0, &now.lights);
    }

    /// The weight of `pass` in the mean over passes. Settled light from one set of directions is wrong where light
    /// travels back and forth along them, and would bias the mean for long. Therefore each of the first third of the
    /// passes replaces the previous one instead.
    fn share_of_mean(&self, pass: u32) -> f32 {
        let replacing = self.ground.desc.wants.mean_passes.unwrap_or(0) / 3;
        1.0 / (1 + pass.saturating_sub(replacing)) as f32
    }

    /// Counters of a finished frame, and the buffers that must grow before the next frame if one overflowed.
    pub fn poll(&self, slot: usize) -> (Counters, Option<Counts>) {
        let found: Vec<Globals> = self.counters[slot].iter().map(|buffer| buffer.read_some(0, 1)[0]).collect();
        let base = &found[0];
        let counters = Counters {
            triangles: base.vertex_count / 3,
            degenerate: base.degenerate_count,
            list_items: base.item_count,
            occupied_voxels: base.cell_count,
        };
        let grown = self.counts().grown(&found);
        (counters, (grown != *self.counts()).then_some(grown))
    }

    /// Replaces buffers that are too small for `counts`; no frame may be in flight. The next frame rebuilds lists and
    /// light.
    ///
    /// # Errors
    /// There is too little memory. Then the counts are as before, and no buffer is smaller.
    pub fn grow(&mut self, context: &Arc<Context>, counts: Counts) -> Result<()> {
        tracing::info!("buffers grow: {:?} to {:?}", self.counts(), counts);
        // The content of replaced buffers is lost, even if a later buffer finds no memory.
        self.start_over();
        if counts.blended_samples > self.counts().blended_samples {
            self.image.grow(context, counts.blended_samples)?;
        }
        self.ground.grow(context, counts)
    }

    /// Makes the next frame rebuild lists and light, because the last frame was incomplete or its results are gone.
    pub fn start_over(&mut self) {
        self.made_of = None;
        self.light.forget();
    }

    /// Creates a pass that lights surfaces drawn by a host. `desc` is the description with which the frame was created
    /// or last changed.
    ///
    /// # Errors
    /// There is too little memory, or the device is lost.
    pub fn given(&self, context: &Arc<Context>, desc: &FrameDesc) -> Result<GivenPass> {
        let given = GivenPass::new(context, &image_pass_desc(desc, &*self.method, self.counts()), desc.size)?;
        context.wait_for_pipelines()?;
        Ok(given)
    }

    /// Adopts the settings, size and lights of `desc` for the same scene, and rebuilds only parts that depend on a
    /// change: lists if their grid or contents differ, light if its settings differ, and a pipeline if the constants of
    /// its shaders differ. No frame may be in flight.
    ///
    /// # Errors
    /// As for [`Frame::new`]; after an error the frame is as before.
    pub fn change(&mut self, context: &Arc<Context>, desc: &FrameDesc) -> Result<()> {
        let (old, new) = (&self.settings, desc.settings);
        let relit = !of_light(old).means_same(&of_light(new));
        let lamps = relit.then(|| lamps(desc.scene, new));
        let ground = ground_desc(desc, lamps.as_ref().unwrap_or(&self.lamps), &self.ground.scene.trees)?;
        if !self.ground.desc.serves(&ground) {
            *self = Self::new(context, desc, &self.ground.scene.clone())?;
            return Ok(());
        }
        let method = relit.then(|| new.method.make(&maker(context, new, &self.ground))).transpose()?;
        let seen_anew = relit
            || !old.means_same(new)
            || desc.size != self.target.size()
            || desc.outputs != self.target.shape().outputs;
        let image = || {
            let target = ImageTarget::new(context, shape(desc))?;
            let desc = image_pass_desc(desc, &**method.as_ref().unwrap_or(&self.method), self.counts());
            Ok((ImagePass::new(context, &desc, target.shape(), self.counts())?, target))
        };
        let image = seen_anew.then(image).transpose()?;
        context.wait_for_pipelines()?;
        if let Some((image, target)) = image {
            (self.image, self.target) = (image, target);
        }
        if let (Some(method), Some(lamps)) = (method, lamps) {
            (self.method, self.lamps) = (method, lamps);
            self.scale = radiance_scale(desc.scene, ground.grid.finest_m(), new.bounces);
            self.light = LightProgress::new(light_rules(desc, &self.ground, &*self.method));
        }
        self.settings = new.clone();
        Ok(())
    }

    /// Vertices or materials of `scene` were changed on the device ([`SceneOnGpu::update_mesh`]). The change takes
    /// effect in the next frame.
    pub fn scene_changed(&mut self, scene: &Scene) {
        self.lamps = lamps(scene, &self.settings);
        self.scale = radiance_scale(scene, self.ground.desc.grid.finest_m(), self.settings.bounces);
        self.stale = true;
    }

    /// Makes the next frame rebuild lists and light although nothing changed, to measure the cost of a frame with
    /// motion.
    pub fn make_anew(&mut self) {
        self.stale = true;
    }

    pub fn counts(&self) -> &Counts {
        &self.ground.desc.counts
    }

    /// The memory for buffers of the size `counts` and a grid of edge `voxels`.
    pub fn plan(&self, counts: &Counts, voxels: u32) -> Vec<MemoryRow> {
        let settings = Settings { voxels, ..self.settings.clone() };
        plan(&settings, self.ground.desc.features, self.target.shape(), counts)
    }

    /// The memory that images of another size would take.
    pub fn plan_at(&self, size: (u32, u32)) -> Vec<MemoryRow> {
        let (width, height) = size;
        let shape = ImageShape { width, height, ..*self.target.shape() };
        plan(&self.settings, self.ground.desc.features, &shape, self.counts())
    }
}

fn light_rules(desc: &FrameDesc, ground: &Ground, method: &dyn IndirectMethod) -> LightRules {
    LightRules {
        feeds: desc.settings.bounces == Bounces::All && method.coarse_light().is_some(),
        mean_passes: ground.desc.wants.mean_passes,
        waits: desc.waits,
    }
}

fn maker<'a>(context: &'a Arc<Context>, settings: &'a Settings, ground: &'a Ground) -> Maker<'a> {
    Maker { context, settings, features: ground.desc.features, counts: &ground.desc.counts }
}
