//! Known weaknesses of methods in numbers. A [`case::Case`] is a scene and a number with an ideal value. Every preset
//! runs each case on several grids at several places, because a single alignment may be lucky.
//!
//! [`cases`] lists them, [`cell`] makes a [`row::Row`] of a case, a preset and a grid, and [`export`] writes rows and
//! compares them with an earlier table. Rows are stored in a folder like those of a chart.

pub mod case;
pub mod cases;
pub mod cell;
pub mod export;
pub mod fine_scenes;
pub mod markdown;
pub mod motion;
pub mod random;
pub mod row;
pub mod scenes;
pub mod stage;
pub mod warnings;

/// Version of the rows: see [`crate::chart::VERSION`].
pub const VERSION: u32 = 2;

/// The side of every image in pixels.
pub const SIZE: u32 = 64;

/// Edges of the grids that run by default.
pub const GRIDS: &[u32] = &[32, 64, 128];
