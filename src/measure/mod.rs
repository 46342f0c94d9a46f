//! Measuring: images against references, and what each pass costs.

pub mod metrics;
pub mod picture;
pub mod timing;
pub mod trace;
