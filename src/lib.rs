//! Voxel cone tracing with two bounces for everything, in raw Vulkan.

pub mod error;
pub mod layers;
pub mod ledger;
pub mod output;
pub mod scene;
pub mod settings;
pub mod twins;

pub use error::{Error, Result};
