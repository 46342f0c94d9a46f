//! Speed against accuracy: many settings on the same scenes, each a row with its times and its errors.
//!
//! [`plan`] says which settings, [`measure`] makes a [`row::Row`] of one, [`store`] keeps rows between calls; the rest draws.
//! [`study`] is the plan whose rows are documentation.

pub mod export;
pub mod frontier;
pub mod measure;
pub mod page;
pub mod picture;
pub mod plan;
pub mod row;
pub mod store;
pub mod study;
pub mod svg;

/// Version of the rows, as files and as kept between calls; it grows when a key changes its name, unit or meaning, and when
/// there is a new one, which rows kept from earlier would lack.
pub const VERSION: u32 = 2;
