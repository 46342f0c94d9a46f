//! The cheapest settings that hold limits on a scene, found by measuring. `docs/plan.md` says what is measured and how
//! sure it is.
//!
//! [`ask`] leads from a question to an [`answer`]. [`space`] has the ladders, [`needs`] says which of them a scene has
//! a use for, [`search`] chooses what is measured next, by what [`model`] predicts; [`mod@bench`] measures,
//! [`crate::lab::store::Results`] keeps.

pub mod answer;
pub mod ask;
pub mod bench;
pub mod limits;
pub mod model;
pub mod needs;
pub mod search;
pub mod space;

/// Version of what is kept between calls and of the file that `plan --json` writes.
pub const VERSION: u32 = 1;
