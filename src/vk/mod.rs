//! A small layer over raw Vulkan: a [`Context`], resources that free themselves, pipelines whose layouts come from
//! reflection, and a [`Recorder`] that times its passes.
//!
//! A program without its own device calls [`Context::new`], then for each frame [`Recorder::new`] and
//! [`Recorder::finish`], or [`Recorder::submit`] for several frames in flight. A host calls [`Context::adopt`], keeps a
//! [`Slot`] per frame in flight, and for each frame calls [`Recorder::on`] with its command buffer.
//!
//! Conventions: there is one queue; every image is in `GENERAL` layout after its creation; every descriptor is pushed
//! in set 0; descriptors and specialisation constants have the names of GLSL; a mistake in a pass (a missing binding,
//! an unknown constant, a push block of the wrong size) panics and names both.

mod device;
mod pipeline;
mod record;
mod resource;

#[cfg_attr(not(internals), doc(hidden))]
pub use pipeline::shader;

/// The crates whose types a host passes.
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
