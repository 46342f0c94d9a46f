//! Recording: bound pipelines, draws, dispatches, copies, timed zones, and submission.

pub(in crate::vk) mod bind;
pub(in crate::vk) mod build;
pub(in crate::vk) mod commands;
pub(in crate::vk) mod counting;
pub(in crate::vk) mod frame_log;
pub(in crate::vk) mod host_image;
pub(in crate::vk) mod pace;
pub(in crate::vk) mod raster_pass;
pub(in crate::vk) mod recorded;
pub(in crate::vk) mod recorder;
pub(in crate::vk) mod slot;
pub(in crate::vk) mod transfer;
pub(in crate::vk) mod zone;
