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

mod bind;
mod buffer;
mod choose;
mod commands;
#[cfg(feature = "hot-reload")]
mod compile;
mod constants;
mod context;
mod counting;
mod features;
mod frame_log;
mod functions;
mod host;
mod host_image;
mod image;
mod instance;
mod label;
mod make_pipeline;
mod memory;
mod modules;
mod needs;
mod pace;
mod pending;
mod pipeline;
mod pipeline_cache;
mod pipelines;
mod raster_pass;
mod raw_pipeline;
mod recorded;
mod recorder;
mod reflect;
#[cfg(feature = "hot-reload")]
mod reload;
mod sampler;
pub mod shader;
mod slot;
mod specialize;
mod submit;
mod transfer;
mod used;
mod views;
mod zone;

/// The crates whose types a host hands over.
pub use {ash, gpu_allocator};

pub use ash::vk::{
    BorderColor, BufferUsageFlags, CompareOp, Filter, Format, ImageUsageFlags, SampleCountFlags, SamplerAddressMode,
    SamplerMipmapMode,
};
pub use bind::Bind;
pub use buffer::{Buffer, BufferKind};
pub use constants::{Constant, Value};
pub use context::{Context, ContextOptions};
pub use features::{FeatureStructs, Features, Requirements, required_extensions, required_features};
pub use frame_log::{AttachmentLog, CallLog, CommandLog, DispatchLog, DrawLog, FrameLog, ZoneLog};
pub use host::{HostDevice, missing};
pub use host_image::{HostImage, ImageUse};
pub use image::{Image, ImageDesc, ImageDim, ImageRegion, ImageView};
pub use instance::{DeviceKind, DeviceReport, devices};
pub use needs::Need;
pub use pace::{Pace, Step, Watch};
pub use pending::Pending;
pub use pipeline::{Blend, Compute, ComputeDesc, DepthDesc, Raster, RasterDesc, VertexInput};
pub use raster_pass::{ColorTarget, DepthTarget, DrawCall, Load, RasterPass, Rect, RenderTarget};
pub use recorder::{Recorder, RecorderOptions};
pub use reflect::{Binding, BindingKind, Member, Stage, StageInfo, StructLayout};
#[cfg(feature = "hot-reload")]
pub use reload::Reload;
pub use sampler::Sampler;
pub use slot::{HostRecorder, Slot, SlotOptions};
pub use transfer::{download, download_image, upload, upload_at, upload_image, upload_into};
pub use zone::{ZoneKind, ZoneTiming, ZoneTimings, process_cpu_ms};
