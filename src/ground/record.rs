//! Record: appends a record of each triangle of the scene in the world. Reads: scene vertices and indices. Writes:
//! triangles (positions in voxels of the base grid) and their attributes, counters.
//!
//! As in the talk, the scene is drawn into an empty screen and a geometry shader appends the records. Other presets use
//! compute shaders.

use std::sync::Arc;

use glam::{DAffine3, DMat3, Vec3};

use super::layout::RecordDraw;
use super::lists::array;
use super::memory_plan::MemoryRow;
use super::scene_on_gpu::SceneOnGpu;
use super::{Ground, over_threads};
use crate::Result;
use crate::scene::Pose;
use crate::settings::Conservative;
use crate::vk::{
    Bind, Buffer, BufferKind, ColorTarget, Compute, ComputeDesc, Constant, Context, DrawCall, Format, Image, ImageDesc,
    ImageUsageFlags, Load, Raster, RasterDesc, Recorder, RenderTarget, VertexInput, ZoneKind,
};

/// Edge of the front view in pixels; the screen of this pass is empty.
const FRONT_VIEW_EDGE: u32 = 128;
/// The format of the front view is irrelevant, because nothing is written.
const FRONT_VIEW_FORMAT: Format = Format::R8G8B8A8_UNORM;
/// Threads of a workgroup in `glsl/ground/record.comp`.
const GROUP: u32 = 64;

/// Memory of [`Record::new`] for `instances` instances.
pub fn plan(conservative: Conservative, instances: u32) -> MemoryRow {
    match conservative {
        Conservative::Compute => ("record draws", array::<RecordDraw>(instances)),
        _ => ("front view", u64::from(FRONT_VIEW_EDGE).pow(2) * 4),
    }
}

pub enum Record {
    /// A list of one [`RecordDraw`] per instance.
    Compute {
        pipeline: Compute,
        draws: Buffer,
    },
    Drawn {
        pipeline: Raster,
        front_view: Image,
    },
}

impl Record {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(
        context: &Arc<Context>,
        constants: &[Constant],
        conservative: Conservative,
        scene: &SceneOnGpu,
    ) -> Result<Self> {
        let label = "record";
        if conservative == Conservative::Compute {
            let desc = ComputeDesc { label, shader: "ground/record.comp", constants };
            let (name, bytes) = plan(conservative, scene.draws.len() as u32);
            return Ok(Self::Compute {
                pipeline: Compute::new(context, &desc)?,
                draws: Buffer::new(context, name, bytes, BufferKind::Device)?,
            });
        }
        let pipeline = RasterDesc {
            label,
            vertex: "ground/record.vert",
            geometry: Some("ground/record.geom"),
            fragment: Some("ground/record.frag"),
            constants,
            vertex_input: Some(VertexInput {
                stride: scene.corner.vertex_bytes() as u32,
                attributes: &scene.corner.vertex_input(),
            }),
            color_formats: &[FRONT_VIEW_FORMAT],
            masked: true,
            ..Default::default()
        };
        let front_view = ImageDesc {
            label: "front view",
            format: FRONT_VIEW_FORMAT,
            width: FRONT_VIEW_EDGE,
            height: FRONT_VIEW_EDGE,
            usage: ImageUsageFlags::COLOR_ATTACHMENT,
            ..Default::default()
        };
        Ok(Self::Drawn { pipeline: Raster::new(context, &pipeline)?, front_view: Image::new(context, &front_view)? })
    }

    pub fn record(&self, recorder: &mut Recorder, ground: &Ground, scene: &SceneOnGpu, pose: &Pose) {
        let mut binds = vec![
            Bind::buffer("globals", &ground.base().globals),
            Bind::buffer("triangles", &ground.triangles),
            Bind::buffer("attribute_words", &ground.attributes),
            Bind::buffer("slots", &ground.slots),
        ];
        let bytes = ground.triangles.bytes() + ground.attributes.bytes();
        let draws: Vec<RecordDraw> = scene
            .draws
            .iter()
            .map(|draw| RecordDraw {
                material: draw.material,
                first_source: draw.first_source,
                translucent: u32::from(draw.translucent),
                first_index: draw.first_index,
                vertex_offset: draw.vertex_offset,
                triangles: draw.index_count / 3,
                ..placed(&(ground.desc.grid.voxel_from_world() * pose.world_from_instance[draw.instance]))
            })
            .collect();
        match self {
            Self::Compute { pipeline, draws: list } => recorder.zone("record", ZoneKind::Compute, bytes, |r| {
                r.full_barrier(); // reset wrote the counters, and the previous frame read the list
                r.update(list, 0, &draws);
                r.full_barrier();
                binds.push(Bind::buffer("record_draws", list));
                binds.push(Bind::buffer("scene_vertices", &scene.vertices));
                binds.push(Bind::buffer("scene_indices", &scene.indices));
                if !draws.is_empty() {
                    r.dispatch(pipeline, &binds, &(), over_threads(ground.desc.counts.triangles, GROUP));
                }
            }),
            Self::Drawn { pipeline, front_view } => recorder.zone("record", ZoneKind::Raster, bytes, |r| {
                r.full_barrier(); // reset wrote the counters
                let (view, load) = (front_view.attachment_view(0), Load::DontCare);
                let colors = [ColorTarget { view, resolve: None, load, store: false }];
                let (width, height) = (FRONT_VIEW_EDGE, FRONT_VIEW_EDGE);
                let target = RenderTarget { colors: &colors, width, height, ..Default::default() };
                r.raster(&target, |pass| {
                    for draw in &draws {
                        let call = DrawCall::Indexed {
                            vertices: &scene.vertices,
                            indices: &scene.indices,
                            index_count: 3 * draw.triangles,
                            first_index: draw.first_index,
                            vertex_offset: draw.vertex_offset,
                        };
                        pass.draw(pipeline, &binds, draw, call);
                    }
                });
            }),
        }
    }
}

/// The transform of a draw.
fn placed(voxel_from_object: &DAffine3) -> RecordDraw {
    let m = voxel_from_object.matrix3;
    let t = voxel_from_object.translation;
    let determinant = m.determinant();
    // The transposed adjugate equals the inverse transpose up to a factor, and also exists for singular matrices.
    let normal = DMat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    let normal = if determinant < 0.0 { -normal } else { normal };
    let largest = normal.to_cols_array().iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let normal = if largest > 0.0 { normal * (1.0 / largest) } else { normal };
    let row = |i: usize| m.row(i).extend(t[i]).as_vec4().to_array();
    let normal_row = |i: usize| -> [f32; 3] { Vec3::to_array(&normal.row(i).as_vec3()) };
    RecordDraw {
        rows: [row(0), row(1), row(2)],
        normal_rows: [normal_row(0), normal_row(1), normal_row(2)],
        mirrored: u32::from(determinant < 0.0),
        ..bytemuck::Zeroable::zeroed()
    }
}
