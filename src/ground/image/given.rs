//! Given: lights surfaces that a host drew, by their depth, normal, albedo and material. Reads: these images,
//! triangles, lists, the method's light. Writes: direct and indirect radiance, f32.

use std::sync::Arc;

use super::ImagePassDesc;
use super::target::COLOR_FORMAT;
use crate::Result;
use crate::ground::Ground;
use crate::ground::constants::{Features, with};
use crate::ground::memory_plan::MemoryRow;
use crate::vk::{Bind, Compute, ComputeDesc, Context, Image, ImageDesc, ImageUsageFlags, Recorder, ZoneKind};

/// Names of the images: depth, normal, albedo, material; direct, indirect.
const NAMES: [&str; 6] =
    ["given_depth", "given_normal", "given_albedo", "given_material", "given_direct", "given_indirect"];
const INPUTS: usize = 4;
/// Pixels along each side of a workgroup of `given.comp`.
const GROUP: u32 = 8;

pub struct GivenPass {
    pass: Compute,
    images: Vec<Image>,
    size: (u32, u32),
}

/// Surfaces of a host in the images of a pass.
pub struct GivenSurfaces<'a> {
    pub pass: &'a GivenPass,
    /// Whether the host gave a material; otherwise the surfaces are Lambertian.
    pub have_material: bool,
}

/// Memory of [`GivenPass::new`].
pub fn plan((width, height): (u32, u32)) -> MemoryRow {
    ("given surfaces and their light", u64::from(width) * u64::from(height) * 16 * NAMES.len() as u64)
}

impl GivenPass {
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn new(context: &Arc<Context>, desc: &ImagePassDesc, size: (u32, u32)) -> Result<Self> {
        let shader = format!("ground/image/given.comp {}", desc.method);
        let copied = ImageUsageFlags::TRANSFER_SRC | ImageUsageFlags::TRANSFER_DST;
        let usage = copied | ImageUsageFlags::SAMPLED | ImageUsageFlags::STORAGE;
        let image = |label: &&str| {
            let (format, (width, height)) = (COLOR_FORMAT, size);
            Image::new(context, &ImageDesc { label, format, width, height, usage, ..Default::default() })
        };
        // The host's surfaces may be glossy even if the scene's are not.
        let features = ("FEATURES", (desc.features.0 | Features::SPECULAR.0).into());
        let constants = with(desc.constants.clone(), &[features]);
        Ok(Self {
            pass: Compute::new(context, &ComputeDesc { label: "given", shader: &shader, constants: &constants })?,
            images: NAMES.iter().map(image).collect::<Result<_>>()?,
            size,
        })
    }

    /// The images to which a host's depth, normal, albedo and material are copied.
    pub fn inputs(&self) -> &[Image] {
        &self.images[..INPUTS]
    }

    /// The image of direct light, or that of indirect light.
    pub fn light(&self, direct: bool) -> &Image {
        &self.images[if direct { INPUTS } else { INPUTS + 1 }]
    }

    /// `look_up` holds the bindings of the method's look-up. `have_material`: see [`GivenSurfaces`].
    pub fn record(&self, r: &mut Recorder, ground: &Ground, look_up: &[Bind<'_>], have_material: bool) {
        let texels = &ground.scene.texel_sampler;
        let mut binds = ground.image_binds();
        binds.extend_from_slice(look_up);
        for (i, (name, image)) in NAMES.into_iter().zip(&self.images).enumerate() {
            let input = i < INPUTS;
            binds.push(if input {
                Bind::image(name, image.view(), texels)
            } else {
                Bind::storage_image(name, image.view())
            });
        }
        let (width, height) = self.size;
        let groups = [width.div_ceil(GROUP), height.div_ceil(GROUP), 1];
        let bytes = u64::from(width) * u64::from(height) * 32;
        r.full_barrier(); // the method wrote its light, and the host its surfaces
        r.zone("given", ZoneKind::Compute, bytes, |r| {
            r.dispatch(&self.pass, &self.pass.select(&binds), &u32::from(have_material), groups);
        });
    }
}
