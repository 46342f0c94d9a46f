//! The device, which is opened here or lent by a host: its choice, limits, queue, command buffers and names.

pub(in crate::vk) mod choose;
pub(in crate::vk) mod context;
pub(in crate::vk) mod described;
pub(in crate::vk) mod executables;
pub(in crate::vk) mod features;
pub(in crate::vk) mod functions;
pub(in crate::vk) mod host;
pub(in crate::vk) mod instance;
pub(in crate::vk) mod label;
pub(in crate::vk) mod needs;
pub(in crate::vk) mod pipeline_cache;
pub(in crate::vk) mod pipelines;
#[cfg(feature = "window")]
pub(in crate::vk) mod presenter;
pub(in crate::vk) mod room;
pub(in crate::vk) mod submit;
