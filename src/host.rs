//! The interface for programs that render with Vulkan themselves, with their own device, command buffers and images.
//!
//! The crate's first page shows how the parts fit together, and `examples/host/` is a complete host. The contract:
//!
//! | call | allocates | submits and waits | fails |
//! |---|---|---|---|
//! | [`Context::adopt`] | yes | no | yes: if the device lacks something or the host did not enable it |
//! | [`Prepared::new`], [`change`](Prepared::change), [`grow`](Prepared::grow) | yes | uploads, over the host's locked queue | yes: memory, settings |
//! | [`Prepared::output`], [`inputs`](Prepared::inputs) | no | no | yes: formats and sizes that are not supported |
//! | [`Prepared::record`], [`record_given`](Prepared::record_given) | no Vulkan objects | no | no |
//! | [`Prepared::poll`], [`timings`](Prepared::timings) | no | no | only where the device is lost |
//!
//! - **Enabled by the host.** The host enables the items of [`required_features`] and [`required_extensions`].
//!   [`missing`] lists the items that a device lacks before it is created, and [`Context::adopt`] refuses a device on
//!   which some are not enabled. This library enables nothing.
//! - **In flight.** Each frame in flight has a slot, `0..slots`. Descriptors are pushed into the command buffer, so no
//!   descriptor set is updated in flight. Frames share lists, light and images. Barriers at the beginning and end of
//!   each recording order these accesses, so frames are submitted to one queue in the order of recording, or semaphores
//!   order them.
//! - **Overwritten state** of the command buffer: the compute and graphics pipelines, the descriptor sets of both bind
//!   points, push constants, viewport and scissor 0, all other dynamic state, the index buffer and vertex buffer 0. The
//!   host sets its own state again.
//! - **Barriers.** The first command makes all writes of earlier commands of the host visible. The last one makes
//!   everything visible to later commands and to the CPU. Barriers recorded here move a host's image from its state
//!   [before](HostImage::before) to its state [after](HostImage::after). Images of this library always stay in
//!   `GENERAL` layout.
//! - **Threads.** All types are `Send`. The host lends mutexes that guard the queue and the allocator. The only global
//!   state is tables of constants and a count of files that are being written.
//! - **Messages.** An error is one sentence. Notes go to [`tracing`](https://docs.rs/tracing), which is silent until
//!   the host subscribes.
//!
//! Not supported are queue families without graphics, glass and clearcoat on surfaces drawn by the host, swapchains,
//! tone mapping on the device, and deformed meshes. A change of a material, a mesh or the number of lights needs
//! [`Prepared::new`] or [`Prepared::change`].

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

/// Description of the frames that [`Prepared::new`] makes ready.
#[derive(Clone, Debug)]
pub struct Prepare {
    /// Width and height in pixels.
    pub size: (u32, u32),
    /// Layers that are made available as images in addition to radiance. Any layer except [`Aov::Alpha`] creates all of
    /// them, which takes five more images.
    pub layers: Vec<Aov>,
    /// Bounds of the scene including all future motion ([`Scene::bounds`]). They determine the place of the grid.
    pub bounds: Bounds,
    /// The number of frames that may be in flight at once, at least 1.
    pub slots: usize,
    /// Whether the host draws surfaces itself ([`Prepared::record_given`]), which takes six more images.
    pub given: bool,
    /// Whether passes are timed, for [`Prepared::timings`].
    pub timestamps: bool,
    /// Bytes of device memory that may be used; by default the budget that the device reports.
    pub memory_limit: Option<u64>,
}

impl Prepare {
    /// Frames of radiance alone, with two frames in flight.
    pub fn new(size: (u32, u32), bounds: Bounds) -> Self {
        Self { size, layers: vec![], bounds, slots: 2, given: false, timestamps: false, memory_limit: None }
    }
}

/// A scene with settings, ready for recording: it owns everything that frames need.
pub struct Prepared {
    context: Arc<Context>,
    frame: Frame,
    given: Option<GivenPass>,
    slots: Vec<Slot>,
    /// Whether something was recorded into each slot, so that `poll` has a result.
    recorded: Vec<bool>,
    prepare: Prepare,
    memory: MemoryCheck,
    voxels: u32,
}

/// Buffers that were too small for a frame: see [`Prepared::grow`].
#[derive(Clone, Debug)]
pub struct Growth(Counts);

/// A layer of the image on the device: RGBA in f32 with one mip level and one array layer, in `GENERAL` layout before
/// and after each recording, with usage `SAMPLED` and `TRANSFER_SRC`. It is valid until the next [`Prepared::change`],
/// for commands between one recording and the next on the queue. Colours are linear radiance, premultiplied by alpha.
#[derive(Clone, Copy, Debug)]
pub struct LayerImage {
    pub image: vk::Image,
    /// A view of the whole image in its own format.
    pub view: vk::ImageView,
    pub format: vk::Format,
    /// Width and height in texels.
    pub size: (u32, u32),
    /// The channel that holds a scalar layer; `None` for colours and vectors. Depth is [`FAR`] where no surface is.
    pub channel: Option<usize>,
}

/// The depth, in metres, of pixels without a surface.
pub const FAR: f32 = target::FAR;

/// A host's image that receives a layer: the result of [`Prepared::output`].
#[derive(Clone, Copy, Debug)]
pub struct Output {
    layer: Aov,
    image: HostImage,
    /// Whether the image belongs to [`Prepared::record_given`].
    given: bool,
}

/// A host's own surfaces to be lit: the result of [`Prepared::inputs`].
#[derive(Clone, Copy, Debug)]
pub struct Inputs {
    /// Depth, normal and albedo, in the order of [`GivenPass::inputs`].
    images: [HostImage; 3],
    material: Option<HostImage>,
}

impl Prepared {
    /// Uploads `scene` and compiles the passes. `pose` is the first pose.
    ///
    /// # Errors
    /// There is too little memory (the message names the largest grid that fits), settings are invalid, the context has
    /// no queue, or the device is lost.
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

    /// Checks that `layer` can be written to `image`. The call is cheap, so a host can repeat it for the images of a
    /// swapchain in each frame.
    ///
    /// # Errors
    /// The layer was not prepared, the image has another size, or no conversion to its format exists.
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
            return Err(Error::Usage(format!(
                "surfaces that a host gives have only the layers direct and indirect, not {name}: leave it out"
            )));
        }
        self.check(&image, false)?;
        Ok(Output { layer, image, given: true })
    }

    /// Checks that a host's surfaces can be lit. The images are readable, have the size of the frame, and show the view
    /// of the frame.
    /// - `depth` holds metres along the view's forward axis in the first channel, and 0 without a surface. Its format
    ///   is `R32_SFLOAT`, because half floats are too coarse for the origins of rays.
    /// - `normal` points towards the viewer in world space, with any length above 0, in a float format.
    /// - `albedo` is glTF's linear base colour.
    /// - `material` holds glTF's roughness, metallic and specular (the specular reflectance of non-metals, usually 1;
    ///   an image with two channels has 0). Without it all surfaces are Lambertian.
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
        let refuse = || Error::Usage("nothing was prepared for surfaces that a host gives: set Prepare::given".into());
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

    /// Records a frame of `seen` into `commands`, followed by copies of layers to `outputs`. A scalar layer is copied
    /// with the other channels of the image that holds it. No Vulkan object is allocated, and nothing is submitted or
    /// waited for.
    ///
    /// `seen.scene` is the prepared scene; lights may have moved or changed their intensity, and sky, [`Pose`] and
    /// camera may differ. Lists and light are rebuilt only if a change affects them. `seen.image` is `Some(0)`, or a
    /// counter of passes over one image that the host averages, or `None` to update the light alone.
    ///
    /// # Panics
    /// `slot` was not prepared, `seen.pose` does not belong to `seen.scene` ([`Pose::check`]), `seen.scene` has more
    /// lights than at first, or an output does not have the current size of the frame.
    ///
    /// # Safety
    /// - `commands` belongs to the context's device and queue family. It is recording, outside of a render pass or
    ///   rendering scope, and without an active query or conditional rendering.
    /// - The device has finished the earlier recording of `slot`, which is not submitted again.
    /// - All recordings are submitted, once each, in their order to one queue, or the host orders them by semaphores.
    /// - The images of `outputs` match their description, and live until the device has finished.
    /// - Before `self` is dropped, changed or grown, the device has finished all recordings.
    pub unsafe fn record(&mut self, commands: vk::CommandBuffer, slot: usize, seen: &Shot, outputs: &[Output]) {
        seen.pose.check(seen.scene).expect("a pose of the scene");
        let Self { context, frame, slots, .. } = self;
        let record = |recorder: &mut Recorder| {
            frame.record(recorder, slot, seen);
            let layer = |output: &Output| (!output.given).then(|| frame.target.layer(output.layer)).flatten();
            // SAFETY: the caller guarantees this.
            unsafe { write(recorder, outputs, |output| layer(output).expect("checked by `output`").0) };
        };
        // SAFETY: the caller guarantees this.
        unsafe { Recorder::on(context, commands, &mut slots[slot], record) };
        self.recorded[slot] = true;
    }

    /// Records a frame like [`Self::record`], but draws no image: it lights the host's surfaces `inputs` with the
    /// prepared scene. The surfaces need not be part of the scene; if they are not, they cast no shadow and reflect no
    /// light. `outputs` come from [`Self::given_output`]. Light is gathered at every pixel, so the cost is highest with
    /// `image.interleave` above 1.
    ///
    /// # Panics
    /// As for [`Self::record`].
    ///
    /// # Safety
    /// As for [`Self::record`], and the images of `inputs` match their description.
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
                // SAFETY: `inputs` checked the images, and the caller guarantees the rest.
                unsafe { recorder.convert(own, host, true) };
            }
            let surfaces = GivenSurfaces { pass: given, have_material: inputs.material.is_some() };
            frame.record_given(recorder, slot, seen, &surfaces);
            // SAFETY: the caller guarantees this.
            unsafe { write(recorder, outputs, own) };
        };
        // SAFETY: the caller guarantees this.
        unsafe { Recorder::on(context, commands, &mut slots[slot], record) };
        self.recorded[slot] = true;
    }

    /// The buffers that must grow after the frame in `slot`; `None` if the frame is complete. An incomplete frame lacks
    /// triangles or light and is otherwise harmless. Buffers of a scene may have to grow two or three times, each time
    /// after a frame.
    ///
    /// # Safety
    /// The device has finished the recording of `slot`, because it writes the counters that are read here.
    pub unsafe fn poll(&self, slot: usize) -> Option<Growth> {
        self.recorded[slot].then(|| self.frame.poll(slot).1).flatten().map(Growth)
    }

    /// Counters of the frame in `slot`; `None` before the first frame.
    ///
    /// # Safety
    /// As for [`Self::poll`].
    pub unsafe fn counters(&self, slot: usize) -> Option<Counters> {
        self.recorded[slot].then(|| self.frame.poll(slot).0)
    }

    /// Device time of each pass of the frame in `slot`; `None` without [`Prepare::timestamps`], or before the device
    /// has finished.
    ///
    /// # Errors
    /// The device is lost.
    pub fn timings(&self, slot: usize) -> Result<Option<ZoneTimings>> {
        self.slots[slot].timings(&self.context)
    }

    /// Replaces buffers by larger ones. The next frame rebuilds lists and light.
    ///
    /// # Errors
    /// There is too little memory.
    ///
    /// # Safety
    /// No frame is in flight, because buffers that it uses are freed.
    pub unsafe fn grow(&mut self, growth: Growth) -> Result<()> {
        let plan = |voxels| self.frame.plan(&growth.0, voxels);
        self.memory.check(self.voxels, &given_plan(&self.prepare), &plan)?;
        // SAFETY: the caller guarantees this.
        unsafe { self.clear() };
        self.frame.grow(&self.context, growth.0)
    }

    /// Changes settings, size and layers, and adopts the current number of lights of `scene`; only parts that depend on
    /// a change are rebuilt. The host then requests outputs and layer images again. The number of slots and timestamps
    /// stay unchanged.
    ///
    /// # Errors
    /// As for [`Prepared::new`]. After an error everything is as before. If only the resources for a host's surfaces
    /// lack memory, the change is made without them.
    ///
    /// # Safety
    /// No frame is in flight, because buffers that it uses are freed.
    pub unsafe fn change(&mut self, scene: &Scene, settings: &Settings, prepare: &Prepare) -> Result<()> {
        scene.check()?;
        let prepare = Prepare { slots: self.slots.len(), timestamps: self.prepare.timestamps, ..prepare.clone() };
        let desc = desc(&self.context, scene, settings, &prepare)?;
        self.memory.check_first(&desc, &self.frame.ground.scene.trees, &given_plan(&prepare))?;
        self.frame.change(&self.context, &desc)?;
        // SAFETY: the caller guarantees this.
        unsafe { self.clear() };
        (self.voxels, self.prepare, self.given) = (settings.voxels, prepare.clone(), None);
        self.given = given(&self.context, &self.frame, &desc, &prepare)?;
        Ok(())
    }

    /// Starts the next frame without the light of earlier frames, for example after a cut.
    pub fn forget_light(&mut self) {
        self.frame.light.forget();
    }

    /// Drops everything that the slots keep alive.
    ///
    /// # Safety
    /// No frame is in flight.
    unsafe fn clear(&mut self) {
        // SAFETY: the caller guarantees this.
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

/// Writes layers to a host's images.
///
/// # Safety
/// The images match their description, were checked, and live until the device has finished.
unsafe fn write<'a>(r: &mut Recorder, outputs: &[Output], own: impl Fn(&Output) -> &'a Image) {
    if !outputs.is_empty() {
        r.full_barrier(); // the layers were drawn before
    }
    for output in outputs {
        // SAFETY: the caller guarantees this.
        unsafe { r.convert(own(output), &output.image, false) };
    }
}

fn given_plan(prepare: &Prepare) -> Vec<MemoryRow> {
    prepare.given.then(|| given::plan(prepare.size)).into_iter().collect()
}

fn given(context: &Arc<Context>, frame: &Frame, desc: &FrameDesc<'_>, prepare: &Prepare) -> Result<Option<GivenPass>> {
    prepare.given.then(|| frame.given(context, desc)).transpose()
}
