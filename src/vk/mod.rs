//! Raw Vulkan, made short once: a [`Context`], resources that free themselves, pipelines whose layouts come from
//! reflection, and a [`Recorder`] that times what it records.
//!
//! By itself: [`Context::new`], then per frame [`Recorder::new`] and [`Recorder::finish`], or [`Recorder::submit`] for
//! several frames in flight. Within a host: [`Context::adopt`], a [`Slot`] per frame in flight, then per frame
//! [`Recorder::on`] the host's command buffer.
//!
//! Conventions: one queue; every image is in `GENERAL` layout from its creation on; every descriptor is pushed in set 0
//! and named as in GLSL, and so is every specialisation constant; a mistake in a pass (a missing binding, an unknown
//! constant, a push block of the wrong size) panics and names both.

mod device;
mod pipeline;
mod record;
mod resource;

#[cfg_attr(not(internals), doc(hidden))]
pub use pipeline::shader;

/// The crates whose types a host hands over.
pub use {ash, gpu_allocator};

pub use ash::vk::{
    BorderColor, BufferUsageFlags, CompareOp, Filter, Format, ImageUsageFlags, SampleCountFlags, SamplerAddressMode,
    SamplerMipmapMode,
};
pub use device::context::{Context, ContextOptions};
#[cfg_attr(not(internals), doc(hidden))]
pub use device::described::Described;
#[cfg_attr(not(internals), doc(hidden))]
pub use device::executables::{Executable, Statistic, StatisticValue};
pub use device::features::{FeatureStructs, Features, ray_query_extensions, required_extensions, required_features};
pub use device::host::{HostDevice, missing};
pub use device::instance::{DeviceKind, DeviceReport, devices};
pub use device::needs::Need;
#[cfg_attr(not(internals), doc(hidden))]
#[cfg(feature = "window")]
pub use device::presenter::Presenter;
#[cfg_attr(not(internals), doc(hidden))]
pub use device::room::beside_compiler;
pub use device::submit::immediate;
pub use pipeline::bind::Bind;
pub use pipeline::constants::{Constant, Value};
pub use pipeline::desc::{Compute, ComputeDesc, DepthDesc, Pipeline, Raster, RasterDesc, VertexInput};
pub use pipeline::reflect::{Binding, BindingKind, Member, ShaderStage, StageInfo, StructLayout};
#[cfg(feature = "hot-reload")]
pub use pipeline::reload::Reload;
pub use record::frame_log::{AttachmentLog, CallLog, CommandLog, DispatchLog, DrawLog, FrameLog, ZoneLog};
pub use record::host_image::{HostImage, ImageUse};
pub use record::pace::{Pace, Step, Watch};
pub use record::raster_pass::{ColorTarget, DepthTarget, DrawCall, Load, RasterPass, Rect, RenderTarget};
pub use record::recorder::{Pending, Recorder, RecorderOptions};
pub use record::slot::{Slot, SlotOptions};
pub use record::transfer::{download, download_image, upload, upload_at, upload_image, upload_into};
pub use record::zone::{ZoneKind, ZoneTiming, ZoneTimings, process_cpu_ms};
pub use resource::buffer::{Buffer, BufferAt, BufferKind};
pub use resource::image::{Image, ImageDesc, ImageDim, ImageRegion, ImageView};
pub use resource::sampler::Sampler;
pub use resource::structure::{Structure, StructureDesc, StructureSize, TriangleCorners};
