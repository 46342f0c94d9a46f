//! Measuring: images against references, and what each pass costs.

pub mod timing;
pub mod trace;
