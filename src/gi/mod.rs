//! Global illumination: the closed list of methods, and where the volume stands.

pub mod cones;
pub mod volume;

/// The methods that `render` knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Direct light alone.
    None,
    /// Voxel cone tracing with up to two bounces.
    Cones,
}
