//! Measuring: images against references.

pub mod metrics;
pub mod picture;
