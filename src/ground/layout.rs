//! Structs of the ground that are shared with GLSL (`glsl/ground/layout.glsl`), in scalar block layout: no padding,
//! 4-byte alignment. `tests/device/layouts.rs` compares names, offsets and sizes with the compiled shaders.

use super::boxes::MOST_BOXES;

/// Structs shared with GLSL, with the names and offsets of their fields for the test against reflection.
macro_rules! shared {
    ($($(#[$doc:meta])* $name:ident { $($field:ident: $type:ty),+ $(,)? })+) => {$(
        $(#[$doc])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $(pub $field: $type),+ }

        impl $name {
            /// (name, offset in bytes) of every field, in order.
            pub const FIELDS: &'static [(&'static str, usize)] = &[$((stringify!($field), std::mem::offset_of!($name, $field))),+];
        }
    )+};
}
pub(crate) use shared;

shared! {
    /// A triangle as the recording pass appends it, without its [attributes](super::attributes); corners in voxels.
    Triangle { corners: [[f32; 3]; 3], material: u32, source: u32, translucent: u32 }

    /// Counters; the first four are a `VkDrawIndirectCommand`.
    Globals {
        vertex_count: u32, instance_count: u32, first_vertex: u32, first_instance: u32,
        item_count: u32, cell_count: u32, triangle_overflow: u32, item_overflow: u32, cell_overflow: u32,
        degenerate_count: u32, blended_samples: u32,
    }

    /// The length of a list, such as the occupied cells of a level; the first three are a `VkDispatchIndirectCommand`.
    ListCount { groups_x: u32, groups_y: u32, groups_z: u32, count: u32 }

    /// One entry of the list of `voxel`; `next` is 1-based, 0 ends the list.
    ListItem { triangle: u32, next: u32, voxel: u32 }

    /// Light that each side of a list item reflects and emits, in stored radiance, and the share of its voxel that it
    /// fills.
    ItemLight { front: [f32; 3], opacity: f32, back: [f32; 3], area: f32 }

    /// For a list item: the item whose light it copies, the area of its triangle in the voxel (over the area of a
    /// face), the triangle's source, and whether it is lit for everything in its voxel. If another surface cuts the
    /// item: the item that is lit for the part that is invisible from `anchor` (1-based), and two coordinates in the
    /// voxel of 16 bits each.
    ItemPart { lit_by: u32, area: f32, source: u32, alone: u32, twin: u32, anchor: u32 }

    /// A texture of a material: a mip chain in the atlas, without levels if there is no texture.
    TextureSlot {
        layer: u32, first_level: u32, level_count: u32, flags: u32, uv_set: u32, linear: [f32; 4], offset: [f32; 2],
    }

    Material {
        base_color: [f32; 4], emissive: [f32; 3], metallic: f32, roughness: f32, normal_scale: f32, alpha_cutoff: f32,
        ior: f32, specular: f32, specular_color: [f32; 3], transmission: f32, thickness_m: f32,
        attenuation_color: [f32; 3], attenuation_distance_m: f32, flags: u32, slots: [TextureSlot; 8],
    }

    Light {
        position: [f32; 3], kind: u32, direction: [f32; 3], range_m: f32, intensity: [f32; 3], radius: f32,
        spot_scale: f32, spot_offset: f32,
    }

    /// A piece of an emissive triangle with constant radiance; positions in voxels.
    Lamp { a: [f32; 3], b: [f32; 3], c: [f32; 3], radiance: [f32; 3], two_sided: u32, shine: f32 }

    /// A sphere around neighbouring pieces in voxels, a cone around their normals, and their power up to a common
    /// factor.
    LampNode { center: [f32; 3], radius: f32, axis: [f32; 3], spread_cosine: f32, power: f32 }

    /// The place of a level in its layer, in texels.
    TextureLevel { x: u32, y: u32, width: u32, height: u32 }

    /// Data that changes from frame to frame. Lengths are in voxels unless a name ends in `_m`.
    Frame {
        clip_from_voxel: [[f32; 4]; 4],
        eye: [f32; 3], voxel_m: f32,
        forward: [f32; 3], orthographic: u32,
        right_per_ndc: [f32; 3], scale: f32,
        down_per_ndc: [f32; 3], light_count: u32,
        sky: [f32; 3], turn: u32,
        image_size: [f32; 2], samples: u32,
        lamp_count: u32, lamp_tree: u32, lamp_shine: f32, light_pass: u32, sky_gradient: [f32; 3],
        light_share: f32,
        sky_scale: f32, sky_most: f32, sky_width: i32, sky_height: i32, sky_levels: u32, sky_octaves: f32, sky_turn: f32,
        image_shift: [f32; 2], ndc_shift: [f32; 2], image_pass: u32,
        boxes: [[f32; 3]; MOST_BOXES], last_boxes: [[f32; 3]; MOST_BOXES],
    }

    /// A draw of the recording pass, pushed or in a list: rows of `voxel_from_object` and of its inverse transpose, and
    /// the start of its indices and vertices.
    RecordDraw {
        rows: [[f32; 4]; 3], normal_rows: [[f32; 3]; 3], material: u32, first_source: u32, mirrored: u32, translucent: u32,
        first_index: u32, vertex_offset: i32, triangles: u32,
    }

    /// Push constants of the pass that deforms a mesh: the start of its data in the words, the pose and the vertices.
    DeformPush {
        first_word: u32, vertices: u32, targets: u32, influences: u32, first_weight: u32, first_joint: u32, first_vertex: u32,
        vertex_words: u32, flags: u32,
    }

    /// Push constants of the voxeliser: the place of a grid, or of a box of finer voxels, in voxels of the base grid,
    /// and the voxels that a finer box lists.
    GridPush { offset: [f32; 3], scale: f32, first: u32, hole: [i32; 3], hole_edge: i32 }

    /// Push constants of the passes over the cells of one level.
    LevelPush { level: u32, first: u32 }

    /// Push constants of the passes that light items: the range of shares.
    SharesPush { first: u32, end: u32 }

    /// Push constants of passes along one axis: 0, 1 or 2.
    AxisPush { axis: u32 }

    /// Push constants of the passes that draw or shade a band: its first row, and the first row that it sees.
    BandPush { first_row: u32, first_seen: u32 }

    /// Push constants of the passes that list fragments: a range of the rows that a band sees.
    RowsPush { first: u32, end: u32 }

    /// Push constants of the resolving pass: the radiance of a uniform sky, the first row that a band sees, and the
    /// first of its rows that is resolved.
    ResolvePush { sky: [f32; 3], varied_sky: u32, first_seen: u32, first: u32 }

    /// Push constants of the gathering pass: the first gathered row of a band, a range of its rows, and the first row
    /// that the band sees.
    GatherPush { first_row: u32, first: u32, end: u32, first_seen: u32 }

    /// Push constants of the passes over all gathered rows of a band: their number.
    OwnRowsPush { rows: u32 }
}

/// Bits of [`Material::flags`].
pub mod material_flags {
    pub const MASK: u32 = 1;
    pub const BLEND: u32 = 2;
    pub const DOUBLE_SIDED: u32 = 4;
    pub const UNLIT: u32 = 8;
}
