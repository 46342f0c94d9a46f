//! Record: draws the scene into an empty screen; the geometry shader appends one record per triangle.
//! Reads: scene vertices and indices. Writes: triangles (positions in voxels of the base grid) and their attributes, counters.

use std::sync::Arc;

use glam::{DMat3, Vec3};

use super::Ground;
use super::attributes::CornerWords;
use super::layout::RecordPush;
use super::scene_on_gpu::SceneOnGpu;
use crate::Result;
use crate::scene::Pose;
use crate::vk::{
    Bind, ColorTarget, Constant, Context, DrawCall, Format, Load, Raster, RasterDesc, Recorder, RenderTarget,
    VertexInput, ZoneKind,
};

/// Edge of the front view, an empty screen for this pass. Pixels.
pub const FRONT_VIEW_EDGE: u32 = 128;
/// The front view's format does not matter: nothing is written.
pub const FRONT_VIEW_FORMAT: Format = Format::R8G8B8A8_UNORM;

pub struct Record {
    pipeline: Raster,
}

impl Record {
    pub fn new(context: &Arc<Context>, constants: &[Constant], corner: CornerWords) -> Result<Self> {
        let pipeline = Raster::new(
            context,
            &RasterDesc {
                label: "record",
                vertex: "ground/record.vert",
                geometry: Some("ground/record.geom"),
                fragment: Some("ground/record.frag"),
                constants,
                vertex_input: Some(VertexInput {
                    stride: corner.vertex_bytes() as u32,
                    attributes: &corner.vertex_input(),
                }),
                color_formats: &[FRONT_VIEW_FORMAT],
                masked: true,
                ..Default::default()
            },
        )?;
        Ok(Self { pipeline })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, scene: &SceneOnGpu, pose: &Pose) {
        recorder.zone("record", ZoneKind::Raster, ground.triangles.bytes() + ground.attributes.bytes(), |r| {
            r.full_barrier(); // reset wrote the counters
            let colors = [ColorTarget {
                view: ground.front_view.attachment_view(0),
                resolve: None,
                load: Load::DontCare,
                store: false,
            }];
            let (width, height) = (FRONT_VIEW_EDGE, FRONT_VIEW_EDGE);
            let target = RenderTarget { colors: &colors, width, height, ..Default::default() };
            let grid = &ground.desc.grid;
            r.raster(&target, |pass| {
                for draw in &scene.draws {
                    let voxel_from_object = grid.voxel_from_world() * pose.world_from_instance[draw.instance];
                    let push = RecordPush {
                        material: draw.material,
                        first_source: draw.first_source,
                        translucent: u32::from(draw.translucent),
                        ..push_of(&voxel_from_object)
                    };
                    let call = DrawCall::Indexed {
                        vertices: &scene.vertices,
                        indices: &scene.indices,
                        index_count: draw.index_count,
                        first_index: draw.first_index,
                        vertex_offset: draw.vertex_offset,
                    };
                    let binds = [
                        Bind::buffer("globals", &ground.base().globals),
                        Bind::buffer("triangles", &ground.triangles),
                        Bind::buffer("attribute_words", &ground.attributes),
                        Bind::buffer("slots", &ground.slots),
                    ];
                    pass.draw(&self.pipeline, &binds, &push, call);
                }
            });
        });
    }
}

fn push_of(voxel_from_object: &glam::DAffine3) -> RecordPush {
    let m = voxel_from_object.matrix3;
    let t = voxel_from_object.translation;
    let determinant = m.determinant();
    // The adjugate's transpose is the inverse transpose up to a factor, and exists for flat scales too.
    let normal = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    let normal = if determinant < 0.0 { -normal } else { normal };
    let largest = normal.to_cols_array().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let normal = if largest > 0.0 { normal * (1.0 / largest) } else { normal };
    let row = |i: usize| m.row(i).extend(t[i]).as_vec4().to_array();
    let normal_row = |i: usize| -> [f32; 3] { Vec3::to_array(&normal.row(i).as_vec3()) };
    RecordPush {
        rows: [row(0), row(1), row(2)],
        normal_rows: [normal_row(0), normal_row(1), normal_row(2)],
        mirrored: u32::from(determinant < 0.0),
        ..bytemuck::Zeroable::zeroed()
    }
}
