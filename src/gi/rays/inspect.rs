//! Debug views of the method: where it stores its light, and the rays along which a pixel's light was gathered.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};

use crate::Result;
use crate::gi::IndirectMethod;
use crate::ground::Ground;
use crate::ground::constants::{constants, with};
use crate::settings::Settings;
use crate::vk::{
    self, Bind, Buffer, BufferKind, Compute, ComputeDesc, Context, Format, Image, ImageDesc, ImageUsageFlags,
    Recorder, RecorderOptions,
};

/// Threads of a workgroup of `inspect.comp`: along each side of a square of pixels, or rays.
const PIXELS: u32 = 8;
const RAYS: u32 = 64;

/// A frame of this method, as far as it is looked at.
#[derive(Clone, Copy)]
pub struct Inspected<'a> {
    pub ground: &'a Ground,
    pub method: &'a dyn IndirectMethod,
}

/// Of a frame of this method.
pub struct Inspect {
    kept: Compute,
    rays: Compute,
    /// Rays of a pixel, and pixels along each side of one that is gathered.
    diffuse: u32,
    scale: u32,
}

/// A ray along which diffuse light was gathered. Positions in voxels of the base grid, radiance as stored:
/// `Frame::scale` times it.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct InspectedRay {
    pub from: [f32; 3],
    /// Where the first surface was met, or where it left the grid for the sky; `from` where the pixel shows no surface.
    pub to: [f32; 3],
    /// Radiance that the ray brought, including light that passed through surfaces that transmit it.
    pub light: [f32; 3],
    /// 1 + the triangle that was met first, counted over the instances in the scene's order; 0: none.
    pub source: u32,
    /// 1 where it was met from behind.
    pub back: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    pixel: [u32; 2],
    scale: u32,
}

impl Inspect {
    /// For frames with these settings.
    ///
    /// # Errors
    /// A lost device.
    pub fn new(context: &Arc<Context>, settings: &Settings, frame: Inspected) -> Result<Self> {
        let constants = with(constants(settings, frame.ground.desc.features), frame.method.constants());
        let compute = |label, shader| Compute::new(context, &ComputeDesc { label, shader, constants: &constants });
        let made = Self {
            kept: compute("kept light", "gi/rays/inspect.comp")?,
            rays: compute("rays of a pixel", "gi/rays/inspect.comp RAYS")?,
            diffuse: settings.of.rays.diffuse,
            scale: if settings.image.gathers_apart() { settings.image.gather_resolution.scale() } else { 1 },
        };
        context.wait_for_pipelines()?;
        Ok(made)
    }

    /// Per pixel of the last frame's view: the radiance that is kept for the surface there, as stored, and 1 + which of
    /// the lists' items keeps it; 0 where none does.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn kept(&self, context: &Arc<Context>, frame: Inspected, (width, height): (u32, u32)) -> Result<Vec<[f32; 4]>> {
        let image = Image::new(
            context,
            &ImageDesc {
                label: "kept light",
                format: Format::R32G32B32A32_SFLOAT,
                width,
                height,
                usage: ImageUsageFlags::STORAGE | ImageUsageFlags::TRANSFER_SRC,
                ..Default::default()
            },
        )?;
        let groups = [width.div_ceil(PIXELS), height.div_ceil(PIXELS), 1];
        let push = Push { pixel: [0; 2], scale: self.scale };
        let look = Look { pass: &self.kept, own: Bind::storage_image("kept_light", image.view()), push, groups };
        look.run(context, frame)?;
        vk::download_image(context, &image, 0)
    }

    /// The rays of the gathered pixel in which `pixel` of the last frame's image lies.
    ///
    /// # Errors
    /// Too little memory, or a lost device.
    pub fn rays(&self, context: &Arc<Context>, frame: Inspected, pixel: (u32, u32)) -> Result<Vec<InspectedRay>> {
        let bytes = u64::from(self.diffuse) * size_of::<InspectedRay>() as u64;
        let buffer = Buffer::new(context, "rays of a pixel", bytes, BufferKind::Device)?;
        let groups = [self.diffuse.div_ceil(RAYS), 1, 1];
        let push = Push { pixel: [pixel.0, pixel.1], scale: self.scale };
        Look { pass: &self.rays, own: Bind::buffer("inspected", &buffer), push, groups }.run(context, frame)?;
        vk::download(context, &buffer)
    }
}

/// A pass that looks at a frame, with what it writes to.
struct Look<'a> {
    pass: &'a Compute,
    own: Bind<'a>,
    push: Push,
    groups: [u32; 3],
}

impl Look<'_> {
    fn run(&self, context: &Arc<Context>, frame: Inspected) -> Result<()> {
        let mut binds = frame.ground.image_binds();
        binds.extend(frame.method.binds(frame.ground));
        binds.push(self.own.clone());
        let mut r = Recorder::new(context, RecorderOptions::default())?;
        r.full_barrier(); // the last frame wrote lists and light
        if let Some(on_demand) = frame.method.on_demand() {
            on_demand.light_all(&mut r, frame.ground); // no image asked for what is looked at
            r.full_barrier(); // it is lit
        }
        r.dispatch(self.pass, &self.pass.select(&binds), &self.push, self.groups);
        r.finish().map(drop)
    }
}
