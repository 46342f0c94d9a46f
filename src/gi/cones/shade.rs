//! Passes 2b and 4b, shade: each voxel shades its list into seven targets. Raster form: one triangle over the screen per
//! slice. Cells form: a thread per item of the lists, then one per occupied voxel.
//! Reads: lists, who of them is lit, triangles, materials, lights, lamps; 4b the first bounce's volume and kept direct light.
//! Writes: level 0 of a volume, premultiplied stored radiance; item lights; 2b kept direct light.
//! Twin of the fill: `src/twins/shade.rs`.

use std::sync::Arc;

use super::constants::{DIRECT, DIRECT_AGAIN, DIRECT_KEEP, DIRECT_READ, Features, constants};
use super::resources::{FACES, Resources, VOLUME_FORMAT, VolumeImages};
use super::{Bounce, Form, face_binds, layered_target, shading_binds, volume_binds};
use crate::Result;
use crate::gpu_scene::GpuScene;
use crate::settings::{Settings, Work};
use crate::vk::{Bind, Compute, ComputeDesc, Context, DrawCall, Raster, RasterDesc, Recorder};

pub struct Shade {
    form: Form<ByCells>,
    bounce: Bounce,
}

/// Lights the lists' items, then fills the occupied voxels.
struct ByCells {
    light: Compute,
    fill: Compute,
}

impl Shade {
    /// `gathers`: whether there is a volume to gather from.
    pub fn new(
        context: &Arc<Context>,
        settings: &Settings,
        features: Features,
        bounce: Bounce,
        gathers: bool,
    ) -> Result<Self> {
        let label = bounce.pick("shade 1", "shade 2");
        let mut constants = constants(&settings.of_voxels(), features, u32::from(gathers));
        let direct = if settings.keeps_direct() { bounce.pick(DIRECT_KEEP, DIRECT_READ) } else { DIRECT_AGAIN };
        constants.push((DIRECT, direct));
        let compute = |shader| Compute::new(context, &ComputeDesc { label, shader, constants: &constants });
        let form = match settings.shading {
            Work::Raster => Form::Raster(Raster::new(
                context,
                &RasterDesc {
                    label,
                    vertex: "cones/layered.vert",
                    fragment: Some(if gathers { "cones/shade_second.frag" } else { "cones/shade_first.frag" }),
                    constants: &constants,
                    color_formats: &[VOLUME_FORMAT; FACES],
                    ..Default::default()
                },
            )?),
            Work::Cells => Form::Cells(ByCells {
                light: compute(if gathers { "cones/light_second.comp" } else { "cones/light_first.comp" })?,
                fill: compute("cones/fill.comp")?,
            }),
        };
        Ok(Self { form, bounce })
    }

    /// `previous`: the volume to gather from.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &GpuScene,
        resources: &Resources,
        target: &VolumeImages,
        previous: Option<&VolumeImages>,
    ) {
        let bytes = self.form.bytes(8 * FACES as u64 * u64::from(target.edge).pow(3));
        recorder.zone(self.bounce.pick("shade 1", "shade 2"), self.form.kind(), bytes, |r| {
            r.full_barrier(); // voxelise wrote the lists, mips 1 the volume that is gathered from
            let mut binds = shading_binds(scene, resources);
            binds.push(Bind::buffer("direct_light", &resources.direct_light));
            if let Some(volume) = previous {
                binds.extend(volume_binds(volume, &resources.volume_sampler));
            }
            match &self.form {
                Form::Raster(pipeline) => r.raster(&layered_target(&target.colors(0), target.edge), |pass| {
                    let call = DrawCall::Direct { vertices: 3, instances: target.edge };
                    pass.draw(pipeline, &binds, &(), call);
                }),
                Form::Cells(ByCells { light, fill }) => {
                    binds.extend([
                        Bind::buffer("item_lights", &resources.item_lights),
                        Bind::buffer("item_parts", &resources.item_parts),
                        Bind::buffer("lit_items", &resources.lit_items),
                    ]);
                    resources.cells.dispatch_items(r, light, binds.clone());
                    r.full_barrier(); // the items are lit
                    binds.extend(face_binds(target, 0));
                    resources.cells.dispatch(r, fill, binds, (0, target.edge));
                }
            }
        });
    }
}
