//! Measurement: image error against a reference, and the time of each pass.

pub mod metrics;
pub mod picture;
pub mod timing;
pub mod trace;
