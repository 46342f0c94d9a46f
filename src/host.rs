//! For programs that render with Vulkan themselves: their device, their command buffers, their images.
//!
//! The crate's first page says how the parts go together, and `examples/host/` is a whole host. The contract:
//!
//! | call | allocates | submits and waits | fails |
//! |---|---|---|---|
//! | [`Context::adopt`] | yes | no | yes: what the device lacks, or the host did not enable |
//! | [`Prepared::new`], [`change`](Prepared::change), [`grow`](Prepared::grow) | yes | uploads, over the host's locked queue | yes: memory, settings |
//! | [`Prepared::output`], [`inputs`](Prepared::inputs) | no | no | yes: a format or size that cannot be |
//! | [`Prepared::record`], [`record_given`](Prepared::record_given) | nothing of Vulkan's | no | no |
//! | [`Prepared::poll`], [`timings`](Prepared::timings) | no | no | only where the device is lost |
//!
//! - **Enabled by the host.** [`required_features`] and [`required_extensions`] list what must be; [`missing`] says
//!   what a device lacks before one is made, [`Context::adopt`] what was not enabled. Nothing is enabled here.
//! - **In flight.** Each frame in flight has a slot, `0..slots`. Descriptors are pushed into the command buffer, so
//!   none is updated in flight. What the frames share (lists, light, images) is ordered by the barriers that each
//!   recording begins and ends with: frames go to one queue in the order they were recorded, or semaphores order them.
//! - **Clobbered** in the command buffer: the compute and the graphics pipeline, the descriptor sets of both bind
//!   points, push constants, viewport and scissor 0, all other dynamic state, the index buffer and vertex buffer 0. Set
//!   your own again.
//! - **Barriers.** The first command makes all that the host's earlier commands wrote visible, the last makes
//!   everything visible to what follows and to the CPU. A host's image is taken from its state
//!   [before](HostImage::before) to its state [after](HostImage::after) by barriers recorded here. Images made here are
//!   in `GENERAL` layout, always.
//! - **Threads.** Everything here is `Send`. The queue and the allocator are behind the mutexes that the host lends;
//!   there is no global state but tables of constants, and a count of files that are being written.
//! - **Words.** Errors are one sentence. Notes go to [`tracing`](https://docs.rs/tracing), which is silent until a host
//!   listens.
//!
//! Not supported: rendering by a queue family without graphics, glass and coats on surfaces that the host drew,
//! swapchains, tone mapping on the device, deformed meshes; a change to a material, a mesh or the number of lights asks
//! for [`Prepared::new`] or [`Prepared::change`].

use std::sync::Arc;

use ash::vk;

use crate::frame::{Frame, FrameDesc};
use crate::ground::Counts;
use crate::ground::image::given::{self, GivenPass, GivenSurfaces};
use crate::ground::image::target;
use crate::ground::memory_plan::MemoryRow;
use crate::ground::tree::queries::QueryPlan;
use crate::renderer::MemoryCheck;
use crate::scene::{Bounds, Pose, Scene};
use crate::settings::Settings;
use crate::vk::{Image, Recorder, Slot, SlotOptions};
use crate::{Error, Result};

pub use crate::frame::{Counters, Shot};
pub use crate::layers::{Aov, Layers};
pub use crate::vk::{
    Context, FeatureStructs, Features, HostDevice, HostImage, ImageUse, ZoneKind, ZoneTiming, ZoneTimings, missing,
    ray_query_extensions, required_extensions, required_features,
};

/// Inputs for which frames are prepared.
#[derive(Clone, Debug)]
pub struct Prepare {
    /// Pixels.
    pub size: (u32, u32),
    /// Layers beside the image, to be handed out as images: any but [`Aov::Alpha`] makes all of them, five images more.
    pub layers: Vec<Aov>,
    /// Of the scene over all that will move ([`Scene::bounds`]): where the grid stands.
    pub bounds: Bounds,
    /// Frames that may be in flight at once, 1 or more.
    pub slots: usize,
    /// Make ready for surfaces that the host draws: [`Prepared::record_given`], six images more.
    pub given: bool,
    /// Measure passes, for [`Prepared::timings`].
    pub timestamps: bool,
    /// Bytes of device memory that may be taken; the device's own budget where absent.
    pub memory_limit: Option<u64>,
}

impl Prepare {
    /// The image alone, two frames in flight.
    pub fn new(size: (u32, u32), bounds: Bounds) -> Self {
        Self { size, layers: vec![], bounds, slots: 2, given: false, timestamps: false, memory_limit: None }
    }
}

/// A scene with settings, ready to be recorded: it holds everything that frames need.
pub struct Prepared {
    context: Arc<Context>,
    frame: Frame,
    given: Option<GivenPass>,
    slots: Vec<Slot>,
    /// Whether anything was recorded over a slot that `poll` can tell of.
    recorded: Vec<bool>,
    prepare: Prepare,
    memory: MemoryCheck,
    voxels: u32,
}

/// Buffers that a frame turned out to need larger: see [`Prepared::grow`].
#[derive(Clone, Debug)]
pub struct Growth(Counts);

/// A layer of the image, on the device: RGBA in f32, one level and layer, in `GENERAL` layout before and after each
/// recording, made with `SAMPLED` and `TRANSFER_SRC` usage. It is valid until the next [`Prepared::change`], for
/// commands that follow the recording and come before the next one on the queue. Colours are linear radiance,
/// premultiplied by alpha.
#[derive(Clone, Copy, Debug)]
pub struct LayerImage {
    pub image: vk::Image,
    /// Of the whole image, in its own format.
    pub view: vk::ImageView,
    pub format: vk::Format,
    /// Texels.
    pub size: (u32, u32),
    /// The channel that holds the layer, where it is one number. Depth is [`FAR`] where no surface is.
    pub channel: Option<usize>,
}

/// Depth, in metres, where no surface is.
pub const FAR: f32 = target::FAR;

/// A host's image that takes a layer: from [`Prepared::output`].
#[derive(Clone, Copy, Debug)]
pub struct Output {
    layer: Aov,
    image: HostImage,
    /// Of [`Prepared::record_given`].
    given: bool,
}

/// A host's own surfaces, to be lit: from [`Prepared::inputs`].
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// In the order of [`IndirectMethodvenPass::inputs`].
    images: [HostImage; 3],
    material: Option<HostImage>,
}

impl Prepared {
    /// Uploads `scene` and compiles the passes. `pose`: the first one.
    ///
    /// # Errors
    /// Too little memory (with the largest grid that would fit), settings that make no sense, a context without a
    /// queue, a lost device.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        pose: &Pose,
        settings: &Settings,
        prepare: &Prepare,
    ) -> Result<Self> {
        scene.check()?;
        pose.check(scene)?;
        let slots = prepare.slots.max(1);
        let desc = desc(context, scene, settings, prepare)?;
        let memory = MemoryCheck::new(context, prepare.memory_limit);
        let (packed, _) = memory.pack(context, &desc, pose, &given_plan(prepare))?;
        let frame = Frame::new(context, &desc, &Arc::new(packed.upload(context)?))?;
        let options = SlotOptions { timestamps: prepare.timestamps, log: false };
        Ok(Self {
            given: given(context, &frame, &desc, prepare)?,
            slots: (0..slots).map(|_| Slot::new(context, options)).collect::<Result<_>>()?,
            recorded: vec![false; slots],
            context: context.clone(),
            frame,
            prepare: prepare.clone(),
            memory,
            voxels: settings.voxels,
        })
    }

    /// Checks that `layer` can be written to `image`. Cheap: a swapchain's images may be given anew each frame.
    ///
    /// # Errors
    /// The layer was not prepared, the image has another size, its format cannot be converted to.
    pub fn output(&self, layer: Aov, image: HostImage) -> Result<Output> {
        if self.frame.target.layer(layer).is_none() {
            let name = layer.name();
            return Err(Error::Usage(format!("the layer {name} was not prepared: name it in Prepare::layers")));
        }
        self.check(&image, false)?;
        Ok(Output { layer, image, given: false })
    }

    /// Checks that the light of a host's surfaces can be written to `image`: `layer` is [`Aov::Direct`] or
    /// [`Aov::Indirect`].
    ///
    /// # Errors
    /// As for [`Self::output`], or [`Prepare::given`] was not set.
    pub fn given_output(&self, layer: Aov, image: HostImage) -> Result<Output> {
        self.check_given()?;
        if !matches!(layer, Aov::Direct | Aov::Indirect) {
            let name = layer.name();
            return Err(Error::Usage(format!("a host's surfaces have direct and indirect light, and no layer {name}")));
        }
        self.check(&image, false)?;
        Ok(Output { layer, image, given: true })
    }

    /// Checks that a host's surfaces can be lit: images that can be read, of the frame's size, seen through the view of
    /// the frame. `depth`, in the first channel: metres along the view's forward axis, 0 where there is no surface
    /// (`R32_SFLOAT`, since a half is too coarse to start rays from). `normal`: in world space, of any length above 0,
    /// towards the viewer, of a float format. `albedo`: linear, glTF's base colour. `material`, linear, of glTF's
    /// model: roughness, metallic, and specular, how much what is no metal mirrors, 1 as a rule (0 of an image with two
    /// channels). Without it all surfaces are Lambertian.
    ///
    /// # Errors
    /// As for [`Self::output`], or [`Prepare::given`] was not set.
    pub fn inputs(
        &self,
        depth: HostImage,
        normal: HostImage,
        albedo: HostImage,
        material: Option<HostImage>,
    ) -> Result<Inputs> {
        self.check_given()?;
        let images = [depth, normal, albedo];
        images.iter().chain(&material).try_for_each(|image| self.check(image, true))?;
        Ok(Inputs { images, material })
    }

    fn check_given(&self) -> Result<()> {
        let refuse = || Error::Usage("surfaces of a host were not prepared for: set Prepare::given".into());
        self.given.as_ref().map(drop).ok_or_else(refuse)
    }

    fn check(&self, image: &HostImage, reads: bool) -> Result<()> {
        let (size, own) = (image.size, self.prepare.size);
        if size != own {
            return Err(Error::Usage(format!(
                "an image of {}x{} does not fit a frame of {}x{}: prepare frames of its size",
                size.0, size.1, own.0, own.1
            )));
        }
        image.check(&self.context, reads)
    }

    /// A layer on the device; `None` where it was not prepared.
    pub fn layer(&self, layer: Aov) -> Option<LayerImage> {
        let (image, channel) = self.frame.target.layer(layer)?;
        let (format, size) = (image.format(), self.prepare.size);
        Some(LayerImage { image: image.handle(), view: image.view().handle(), format, size, channel })
    }

    /// Records a frame into `commands`: what is `seen`, and then copies of layers to `outputs` (of a layer that is one
    /// number, the image that it shares with others). Nothing of Vulkan is allocated, nothing is submitted or waited
    /// for.
    ///
    /// `seen.scene` is the scene that was prepared, with lights moved and of other intensity, another sky, another
    /// [`Pose`] and camera; lists and light are made anew only where something shows in them. `seen.image` is
    /// `Some(0)`, or counts passes over one image whose mean the host takes, or `None` for the light alone.
    ///
    /// # Panics
    /// `slot` is none of those prepared, `seen.pose` is not of `seen.scene` ([`Pose::check`]), `seen.scene` has more
    /// lights than at the start, or an output is of another size than the frame by now.
    ///
    /// # Safety
    /// - `commands` belongs to the context's device and queue family, it is recording, it is outside of a render pass
    ///   or rendering scope, and no query and no conditional rendering is active in it.
    /// - The device is done with what was recorded over `slot` before, and that is not submitted again.
    /// - All recordings are submitted, once each, in their order to one queue, or the host orders them by semaphores.
    /// - The images of `outputs` are as they say, and live until the device is done.
    /// - The device is done with everything recorded before `self` is dropped, changed or grown.
    pub unsafe fn record(&mut self, commands: vk::CommandBuffer, slot: usize, seen: &Shot, outputs: &[Output]) {
        seen.pose.check(seen.scene).expect("a pose of the scene");
        let Self { context, frame, slots, .. } = self;
        let record = |recorder: &mut Recorder| {
            frame.record(recorder, slot, seen);
            let layer = |output: &Output| (!output.given).then(|| frame.target.layer(output.layer)).flatten();
            // SAFETY: the caller's.
            unsafe { write(recorder, outputs, |output| layer(output).expect("checked by `output`").0) };
        };
        // SAFETY: the caller's.
        unsafe { Recorder::on(context, commands, &mut slots[slot], record) };
        self.recorded[slot] = true;
    }

    /// As [`Self::record`], but no image is drawn: surfaces that the host drew, `inputs`, are lit by the scene as it is
    /// prepared, which they need not be a part of. They cast no shadow and send no light unless they are. `outputs`: of
    /// [`Self::given_output`]. Light is looked up at every pixel, so it costs most with `image.interleave` above 1.
    ///
    /// # Panics
    /// As for [`Self::record`].
    ///
    /// # Safety
    /// As for [`Self::record`], and the images of `inputs` are as they say.
    #[expect(clippy::too_many_arguments, reason = "as `record`, with the surfaces of the host")]
    pub unsafe fn record_given(
        &mut self,
        commands: vk::CommandBuffer,
        slot: usize,
        seen: &Shot,
        inputs: &Inputs,
        outputs: &[Output],
    ) {
        seen.pose.check(seen.scene).expect("a pose of the scene");
        let Self { context, frame, slots, given, .. } = self;
        let given = given.as_ref().expect("checked by `inputs`");
        let own = |output: &Output| {
            assert!(output.given, "an output of `record`");
            given.light(output.layer == Aov::Direct)
        };
        let record = |recorder: &mut Recorder| {
            for (host, own) in inputs.images.iter().chain(&inputs.material).zip(given.inputs()) {
                // SAFETY: `inputs` checked them; the rest is the caller's.
                unsafe { recorder.convert(own, host, true) };
            }
            let surfaces = GivenSurfaces { pass: given, have_material: inputs.material.is_some() };
            frame.record_given(recorder, slot, seen, &surfaces);
            // SAFETY: the caller's.
            unsafe { write(recorder, outputs, own) };
        };
        // SAFETY: the caller's.
        unsafe { Recorder::on(context, commands, &mut slots[slot], record) };
        self.recorded[slot] = true;
    }

    /// Buffers that must grow, once the device is done with what was recorded over `slot`: `None` where the frame is
    /// whole. Until then frames lack triangles or light, and do no other harm. A scene may have to grow two or three
    /// times, each after a frame.
    ///
    /// # Safety
    /// The device is done with what was recorded over `slot`: it writes the counters that are read here.
    pub unsafe fn poll(&self, slot: usize) -> Option<Growth> {
        self.recorded[slot].then(|| self.frame.poll(slot).1).flatten().map(Growth)
    }

    /// Counters of the frame over `slot`; `None` before the first.
    ///
    /// # Safety
    /// As for [`Self::poll`].
    pub unsafe fn counters(&self, slot: usize) -> Option<Counters> {
        self.recorded[slot].then(|| self.frame.poll(slot).0)
    }

    /// Time that each pass over `slot` took; `None` without [`Prepare::timestamps`], or while the device is not done.
    ///
    /// # Errors
    /// The device is lost.
    pub fn timings(&self, slot: usize) -> Result<Option<ZoneTimings>> {
        self.slots[slot].timings(&self.context)
    }

    /// Makes buffers larger. The next frame starts from nothing.
    ///
    /// # Errors
    /// Too little memory.
    ///
    /// # Safety
    /// No frame is in flight: buffers that it uses are freed.
    pub unsafe fn grow(&mut self, growth: Growth) -> Result<()> {
        let plan = |voxels| self.frame.plan(&growth.0, voxels);
        self.memory.check(self.voxels, &given_plan(&self.prepare), &plan)?;
        // SAFETY: the caller's.
        unsafe { self.clear() };
        self.frame.grow(&self.context, growth.0)
    }

    /// Changes to other settings, another size and other layers, and to as many lights as `scene` has by now; only what
    /// depends on what changed is made anew. Outputs and layer images are then asked for again. The slots and whether
    /// they measure stay as they were.
    ///
    /// # Errors
    /// As for [`Prepared::new`]; all then is as before, or, where a host's surfaces alone lack memory, changed without
    /// them.
    ///
    /// # Safety
    /// No frame is in flight: buffers that it uses are freed.
    pub unsafe fn change(&mut self, scene: &Scene, settings: &Settings, prepare: &Prepare) -> Result<()> {
        scene.check()?;
        let prepare = Prepare { slots: self.slots.len(), timestamps: self.prepare.timestamps, ..prepare.clone() };
        let desc = desc(&self.context, scene, settings, &prepare)?;
        self.memory.check_first(&desc, &self.frame.ground.scene.trees, &given_plan(&prepare))?;
        self.frame.change(&self.context, &desc)?;
        // SAFETY: the caller's.
        unsafe { self.clear() };
        (self.voxels, self.prepare, self.given) = (settings.voxels, prepare.clone(), None);
        self.given = given(&self.context, &self.frame, &desc, &prepare)?;
        Ok(())
    }

    /// The next frame starts without the light of those before it: after a cut.
    pub fn forget_light(&mut self) {
        self.frame.light.forget();
    }

    /// Lets go of what the slots keep.
    ///
    /// # Safety
    /// No frame is in flight.
    unsafe fn clear(&mut self) {
        // SAFETY: the caller's.
        self.slots.iter_mut().for_each(|slot| unsafe { slot.clear() });
        self.recorded.fill(false);
    }
}

fn desc<'a>(context: &Context, scene: &'a Scene, settings: &'a Settings, prepare: &Prepare) -> Result<FrameDesc<'a>> {
    let Prepare { size, bounds, slots, .. } = *prepare;
    let (outputs, query) = (target::outputs(&prepare.layers), QueryPlan::of_scene(context, scene, settings)?);
    let desc = FrameDesc { scene, settings, size, outputs, bounds, slots: slots.max(1), query, waits: false };
    desc.check()?;
    Ok(desc)
}

/// Writes what was drawn to a host's images.
///
/// # Safety
/// The images are as they say, were checked, and live until the device is done.
unsafe fn write<'a>(r: &mut Recorder, outputs: &[Output], own: impl Fn(&Output) -> &'a Image) {
    if !outputs.is_empty() {
        r.full_barrier(); // it was drawn
    }
    for output in outputs {
        // SAFETY: the caller's.
        unsafe { r.convert(own(output), &output.image, false) };
    }
}

fn given_plan(prepare: &Prepare) -> Vec<MemoryRow> {
    prepare.given.then(|| given::plan(prepare.size)).into_iter().collect()
}

fn given(context: &Arc<Context>, frame: &Frame, desc: &FrameDesc<'_>, prepare: &Prepare) -> Result<Option<GivenPass>> {
    prepare.given.then(|| frame.given(context, desc)).transpose()
}
