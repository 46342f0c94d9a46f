//! Voxel cone tracing with two bounces for everything, in raw Vulkan.

pub mod error;
pub mod scene;
pub mod settings;
pub mod vk;

pub use error::{Error, Result};
