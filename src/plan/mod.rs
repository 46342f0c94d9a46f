//! Finds the cheapest settings within limits for a scene by measuring. `docs/plan.md` explains the measurements and
//! their certainty.
//!
//! [`ask`] leads from a question to an [`answer`]. [`space`] has the ladders, and [`needs`] decides which of them the
//! scene needs. [`search`] chooses the next measurements by the predictions of [`model`]. [`mod@bench`] measures, and
//! [`crate::lab::store::Results`] stores.

pub mod answer;
pub mod ask;
pub mod bench;
pub mod limits;
pub mod model;
pub mod needs;
pub mod search;
pub mod space;

/// The version of stored measurements and of the file of `plan --json`.
pub const VERSION: u32 = 1;
