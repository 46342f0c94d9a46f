//! Voxel cone tracing with two bounces for everything, in raw Vulkan.

pub mod assets;
pub mod chart;
pub mod error;
pub mod frame;
pub mod gi;
pub mod ground;
pub mod host;
pub mod layers;
pub mod measure;
pub mod memory;
pub mod output;
pub mod profile;
pub mod reference;
pub mod renderer;
pub mod requirements;
pub mod scene;
pub mod settings;
pub mod stability;
pub mod vk;

/// The crates whose types a host hands over.
pub use {ash, glam, gpu_allocator};

pub use error::{Error, Result};
