//! CPU twins of the GPU passes, and oracles of another kind. Every test file uses a part of this.
//!
//! A *twin* computes what a pass or a GLSL function of the same name computes, in f32, written from the formula and not
//! from the shader. An *oracle* computes the same thing in another way (clipping in f64, closed forms). Both share
//! nothing with the path tracer, nor with the code that runs on the GPU.
//!
//! Everything here lives in volume space: positions in the cube \[0,1\]³ unless a name ends in `_voxel`.
#![allow(dead_code)]
#![allow(clippy::too_many_arguments, reason = "a twin takes what its shader function takes")]

pub mod cells;
pub mod closed_forms;
pub mod cone;
pub mod cover;
pub mod dilate;
pub mod directions;
pub mod item_groups;
pub mod lamps;
pub mod mips;
pub mod octahedron;
pub mod probes;
pub mod propagation;
pub mod record;
pub mod shade;
pub mod split;
pub mod tree;
pub mod volume;
pub mod voxelise;
