//! Memory, buffers, images and samplers, which free themselves.

pub(in crate::vk) mod buffer;
pub(in crate::vk) mod image;
pub(in crate::vk) mod memory;
pub(in crate::vk) mod sampler;
pub(in crate::vk) mod structure;
