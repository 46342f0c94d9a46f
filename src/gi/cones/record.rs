//! Pass 1, record: draws the scene into an empty screen; the geometry shader appends one record per triangle.
//! Reads: scene vertices and indices. Writes: triangles (positions in voxels), globals.

use std::sync::Arc;

use glam::{DMat3, Vec3};

use super::constants::{Features, constants};
use super::resources::{FRONT_VIEW_EDGE, FRONT_VIEW_FORMAT, Resources};
use crate::Result;
use crate::gi::volume::Volume;
use crate::gpu_scene::GpuScene;
use crate::layout::{RecordPush, SceneVertex};
use crate::scene::Pose;
use crate::settings::Settings;
use crate::vk::{
    Bind, ColorTarget, Context, DrawCall, Format, Load, Raster, RasterDesc, Recorder, RenderTarget, VertexInput,
    ZoneKind,
};

pub struct Record {
    pipeline: Raster,
}

impl Record {
    pub fn new(context: &Arc<Context>, settings: &Settings, features: Features) -> Result<Self> {
        let pipeline = Raster::new(
            context,
            &RasterDesc {
                label: "record",
                vertex: "cones/record.vert",
                geometry: Some("cones/record.geom"),
                fragment: Some("cones/record.frag"),
                constants: &constants(settings, features, 0),
                vertex_input: Some(VertexInput {
                    stride: size_of::<SceneVertex>() as u32,
                    attributes: &[
                        (0, Format::R32G32B32_SFLOAT, 0),
                        (1, Format::R32G32B32_SFLOAT, 12),
                        (2, Format::R32G32B32A32_SFLOAT, 24),
                        (3, Format::R32G32B32A32_SFLOAT, 40),
                        (4, Format::R16G16B16A16_SFLOAT, 56),
                    ],
                }),
                color_formats: &[FRONT_VIEW_FORMAT],
                color_write: false,
                ..Default::default()
            },
        )?;
        Ok(Self { pipeline })
    }

    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        pose: &Pose,
        volume: &Volume,
        resources: &Resources,
    ) {
        recorder.zone("record", ZoneKind::Raster, resources.triangles.bytes(), |r| {
            r.full_barrier(); // reset wrote the counters
            let colors = [ColorTarget {
                view: resources.front_view.attachment_view(0),
                resolve: None,
                load: Load::DontCare,
                store: false,
            }];
            let (width, height) = (FRONT_VIEW_EDGE, FRONT_VIEW_EDGE);
            let target = RenderTarget { colors: &colors, width, height, ..Default::default() };
            r.raster(&target, |pass| {
                for draw in &scene.draws {
                    let voxel_from_object = volume.voxel_from_world() * pose.world_from_instance[draw.instance];
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
                        instances: 1,
                        first_instance: 0,
                    };
                    let binds = [
                        Bind::buffer("frame", &resources.frame),
                        Bind::buffer("globals", &resources.globals),
                        Bind::buffer("triangles", &resources.triangles),
                        Bind::buffer("slots", &resources.slots),
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
        material: 0,
        first_source: 0,
        translucent: 0,
        mirrored: u32::from(determinant < 0.0),
    }
}
