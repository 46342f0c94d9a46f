//! The frame: everything that turns a scene into an image, for one size and one set of settings.
//!
//! [`Frame::record`] records it into a given recorder, a host's command buffer too: uploads, lists, the method's light,
//! the image. It makes, submits and waits for nothing, and the image stays on the device. Buffers that turned out too
//! small are told by [`Frame::poll`] once the commands are done. Several frames may be in flight, each in a slot of its
//! own.

mod desc;
mod light;

use std::sync::Arc;

use glam::{DAffine3, Vec3};

use crate::Result;
use crate::gi::{Gi, Maker, Update};
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
    pub method: Box<dyn Gi>,
    pub target: ImageTarget,
    image: ImagePass,
    settings: Settings,
    lamps: Lamps,
    placed_lamps: LampSums,
    /// Scale from radiance to its stored value.
    pub scale: f32,
    /// Counters as the device left them, per slot and grid.
    counters: Vec<Vec<Buffer>>,
    /// How far the method's light has come. After each pass the caller measures the light if `is_measured` asks for it.
    pub light: LightProgress,
    /// Whether all items are lit that may be asked for, where light is made on demand.
    all_lit: bool,
    /// Inputs of the lists and light now on the device; `None` if they must be rebuilt.
    made_of: Option<MadeOf>,
    /// The next frame remakes lists and light, though nothing moved.
    stale: bool,
}

/// Everything that changes from frame to frame and shows in lists or light: no camera does.
struct MadeOf {
    instances: Vec<DAffine3>,
    /// Poses of the scene's deformers.
    deforms: Vec<DeformPose>,
    lights: Vec<layout::Light>,
    /// Its two colours, and how far its map is turned.
    sky: ([Vec3; 2], f32),
    /// The time within the animation, where the light's random numbers turn with it.
    time_s: Option<f64>,
    /// Which of the passes over the image whose mean is shown, where light is made on demand: few directions show in
    /// mirrors and would stay in the mean if every pass did not have others.
    image_pass: Option<u32>,
}

/// The scene, pose and view that a frame shows.
#[derive(Clone, Copy)]
pub struct Seen<'a> {
    pub scene: &'a Scene,
    pub pose: &'a Pose,
    pub view: &'a View,
    /// Which of the passes over the image this is, whose mean the host takes; `None`: the light alone is wanted.
    pub image: Option<u32>,
}

impl<'a> Seen<'a> {
    /// An image of one pass.
    pub fn new(scene: &'a Scene, pose: &'a Pose, view: &'a View) -> Self {
        Self { scene, pose, view, image: Some(0) }
    }
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

impl Frame {
    /// Compiles the passes and makes what they work on.
    ///
    /// # Errors
    /// Settings that make no sense, too little memory, a lost device.
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

    /// Whether the next frame starts from nothing, so that it is not known yet how much its lists take.
    pub fn starts_from_nothing(&self) -> bool {
        self.made_of.is_none()
    }

    /// Records the lists of such a frame alone: what is too small can grow before anything is lit, and the frame goes
    /// on from them. `slot`: as for [`Self::record`].
    pub fn record_lists(&mut self, r: &mut Recorder, slot: usize, seen: &Seen) {
        let now = self.made_now(seen);
        self.place_grids(seen.view);
        self.upload(r, seen, &now, true);
        self.ground.swap_lists();
        self.ground.record_lists(r, seen.pose);
        self.copy_counters(r, slot);
        (self.made_of, self.stale) = (Some(now), false);
        self.light.forget();
    }

    /// Records a frame. `slot`: one of those in flight that is free again.
    pub fn record(&mut self, r: &mut Recorder, slot: usize, seen: &Seen) {
        self.record_light(r, seen);
        if seen.image.is_none() || !self.image.asks() {
            self.light_all(r);
        }
        if seen.image.is_some() {
            // The recorded triangles become the image, with what the method looks up.
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

    /// Records a frame that lights what a host drew, instead of an image. `given`: of [`Self::given`].
    pub fn record_given(&mut self, r: &mut Recorder, slot: usize, seen: &Seen, given: &GivenSurfaces) {
        self.record_light(r, seen);
        self.light_all(r);
        given.pass.record(r, &self.ground, &self.method.binds(&self.ground), given.have_material);
        self.copy_counters(r, slot);
    }

    /// Records what stands where, and the light that the method makes of it.
    fn record_light(&mut self, r: &mut Recorder, seen: &Seen) {
        let now = self.made_now(seen);
        let before = self.made_of.take();
        let unlit = self.light.state() == LightState::Unlit;
        let moved = self.place_grids(seen.view);
        let stale = std::mem::take(&mut self.stale) || moved;
        let stood = |b: &MadeOf| b.instances == now.instances && b.deforms == now.deforms;
        let lists = stale || !before.as_ref().is_some_and(stood);
        let bytes = bytemuck::cast_slice::<layout::Light, u8>;
        let same = |before: &MadeOf| {
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
            // Records the triangles, and lists them in the voxels that they touch.
            self.ground.swap_lists();
            self.ground.record_lists(r, seen.pose);
        }
        if self.light.needs_pass() {
            // The light that the method makes of it.
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
            self.start_over(); // the recording ended before its lists and light were whole
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

    /// Light that is made on demand is forgotten where the recording ended before it was whole.
    fn forget_cut_light(&mut self, r: &Recorder) {
        if !r.goes_on() {
            self.light.forget();
            self.all_lit = false;
        }
    }

    fn made_now(&self, seen: &Seen) -> MadeOf {
        MadeOf {
            instances: seen.pose.world_from_instance.clone(),
            deforms: seen.pose.deforms.clone(),
            lights: uniforms::lights(seen.scene, seen.pose, &self.ground.desc.grid),
            sky: ([seen.scene.sky, seen.scene.sky_gradient], seen.scene.sky_turn),
            time_s: self.ground.desc.wants.turns.then_some(seen.pose.time_s),
            image_pass: self.ground.desc.wants.demand.then(|| seen.image.unwrap_or(0)),
        }
    }

    /// Puts the method's own grids and boxes of finer voxels about the camera. Returns whether one moved.
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

    /// The constants of this frame that shaders read. `lamps`: whether these may have moved.
    fn upload(&mut self, r: &mut Recorder, seen: &Seen, now: &MadeOf, lamps: bool) {
        let mean_pass = self.light.mean_pass();
        r.full_barrier(); // the frame before read the same buffers
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

    /// How much of the mean over passes is that of `pass`. Settled light of one set of directions is wrong where light
    /// goes to and fro along them, and a mean that began with it would keep that for long: the first third of the
    /// passes each take the place of the one before instead.
    fn share_of_mean(&self, pass: u32) -> f32 {
        let replacing = self.ground.desc.wants.mean_passes.unwrap_or(0) / 3;
        1.0 / (1 + pass.saturating_sub(replacing)) as f32
    }

    /// Counters of a frame that is done, and what must grow before the next, if anything overflowed.
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

    /// Replaces the buffers that are too small for `counts`; no frame may be in flight. The next frame starts from
    /// nothing.
    ///
    /// # Errors
    /// Too little memory; the counts then are as before, and no buffer is smaller.
    pub fn grow(&mut self, context: &Arc<Context>, counts: Counts) -> Result<()> {
        tracing::info!("buffers grow: {:?} to {:?}", self.counts(), counts);
        // The content of replaced buffers is lost, also where the rest finds no memory.
        self.start_over();
        if counts.blended_samples > self.counts().blended_samples {
            self.image.grow(context, counts.blended_samples)?;
        }
        self.ground.grow(context, counts)
    }

    /// The next frame starts from nothing: the last one was not finished, or what it made is gone.
    pub fn start_over(&mut self) {
        self.made_of = None;
        self.light.forget();
    }

    /// A pass that lights what a host drew, for this frame as it is. `desc`: what the frame was made for, or changed to
    /// last.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn given(&self, context: &Arc<Context>, desc: &FrameDesc) -> Result<GivenPass> {
        let given = GivenPass::new(context, &image_pass_desc(desc, &*self.method, self.counts()), desc.size)?;
        context.wait_for_pipelines()?;
        Ok(given)
    }

    /// Changes to the settings, the size and the lights of `desc`, of the same scene, and remakes only what depends on
    /// what changed: the lists stay where the grid and what is asked of it do, the light where its settings do, and a
    /// pipeline where its shaders' constants do. No frame may be in flight.
    ///
    /// # Errors
    /// As for [`Frame::new`]; the frame then is as before.
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

    /// The vertices or materials of `scene` changed on the device ([`SceneOnGpu::update_mesh`]): the next frame heeds
    /// them.
    pub fn scene_changed(&mut self, scene: &Scene) {
        self.lamps = lamps(scene, &self.settings);
        self.scale = radiance_scale(scene, self.ground.desc.grid.finest_m(), self.settings.bounces);
        self.stale = true;
    }

    /// The next frame remakes lists and light though nothing changed: what a frame costs in which something moves.
    pub fn make_anew(&mut self) {
        self.stale = true;
    }

    pub fn counts(&self) -> &Counts {
        &self.ground.desc.counts
    }

    /// Memory that is allocated for buffers as large as `counts` and a grid of edge `voxels`.
    pub fn plan(&self, counts: &Counts, voxels: u32) -> Vec<MemoryRow> {
        let settings = Settings { voxels, ..self.settings.clone() };
        plan(&settings, self.ground.desc.features, self.target.shape(), counts)
    }

    /// Memory that would be allocated for images of another size.
    pub fn plan_at(&self, size: (u32, u32)) -> Vec<MemoryRow> {
        let (width, height) = size;
        let shape = ImageShape { width, height, ..*self.target.shape() };
        plan(&self.settings, self.ground.desc.features, &shape, self.counts())
    }
}

fn light_rules(desc: &FrameDesc, ground: &Ground, method: &dyn Gi) -> LightRules {
    LightRules {
        feeds: desc.settings.bounces == Bounces::All && method.coarse_light().is_some(),
        mean_passes: ground.desc.wants.mean_passes,
        waits: desc.waits,
    }
}

fn maker<'a>(context: &'a Arc<Context>, settings: &'a Settings, ground: &'a Ground) -> Maker<'a> {
    Maker { context, settings, features: ground.desc.features, counts: &ground.desc.counts }
}
