//! What the passes need of a device.

use super::features::{Features, Requirements};

/// The least that every pass works with.
pub const REQUIREMENTS: Requirements = Requirements {
    features: Features {
        // Triangles are recorded, and turned to the axis that they fill most, one by one.
        geometry_shader: true,
        // Both are kept in lists on the way.
        vertex_pipeline_stores_and_atomics: true,
        fragment_stores_and_atomics: true,
        // Volumes are drawn slice by slice.
        shader_output_layer: true,
        scalar_block_layout: true,
        ..Features::RECORDER
    },
    // The voxel shading pass writes six faces and the isotropic volume at once.
    color_attachments: 7,
    // One layer per slice of the largest grid.
    framebuffer_layers: 256,
};
