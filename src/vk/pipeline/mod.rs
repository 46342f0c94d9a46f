//! Shaders with their specialisation and reflection, pipelines, and the resources that these bind by name.

pub(in crate::vk) mod bind;
#[cfg(feature = "hot-reload")]
pub(in crate::vk) mod compile;
pub(in crate::vk) mod constants;
pub(in crate::vk) mod desc;
mod early;
pub(in crate::vk) mod make_pipeline;
mod operations;
pub(in crate::vk) mod raw_pipeline;
pub(in crate::vk) mod reflect;
#[cfg(feature = "hot-reload")]
pub(in crate::vk) mod reload;
pub mod shader;
pub(in crate::vk) mod specialize;
pub(in crate::vk) mod used;
