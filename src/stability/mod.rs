//! Where methods fail, in numbers. A [`case::Case`] is a scene and a number with an ideal; each is run by every preset
//! on several grids at several places in the grid, because one lucky alignment proves nothing.
//!
//! [`cases`] lists them, [`cell`] makes a [`row::Row`] of a case, a preset and a grid, [`export`] shows rows and holds
//! them against an earlier table. They are kept in a folder as those of a chart are.

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

/// Pixels along both sides of every image.
pub const SIZE: u32 = 64;

/// Edges of the grids that are run where none is named.
pub const GRIDS: &[u32] = &[32, 64, 128];
