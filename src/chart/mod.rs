//! Time and error of many settings on the same scenes, each a row.
//!
//! [`plan`] lists settings. [`measure`] makes a [`row::Row`] of each setting, of the path tracer and of images of other
//! programs ([`import`]). [`crate::lab::store`] keeps rows between calls, and the other modules write files. [`study`]
//! is the plan for `docs/notes/study/`.

pub mod export;
pub mod frontier;
pub mod import;
pub mod marks;
pub mod measure;
pub mod outline;
pub mod page;
pub mod picture;
pub mod plan;
pub mod row;
pub mod study;
pub mod suite;
pub mod svg;

/// The version of stored rows. It increases when a key changes its name, unit or meaning, and when there is a new key,
/// which older rows would lack.
pub const VERSION: u32 = 4;

/// The version of `rows.json`. It increases when a key is new or changes its name, unit or meaning. Version 5 has rows
/// without settings, of the path tracer and of other programs.
pub const JSON_VERSION: u32 = 5;
