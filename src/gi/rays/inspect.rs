//! Debug views of the method: its stored light, and the rays that gathered a pixel's light.

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

/// A frame of this method as input of a debug view.
#[derive(Clone, Copy)]
pub struct Inspected<'a> {
    pub ground: &'a Ground,
    pub method: &'a dyn IndirectMethod,
}

/// Debug views of a frame of this method.
pub struct Inspect {
    kept: Compute,
    rays: Compute,
    /// Rays per pixel, and the side of a gathered pixel in pixels.
    diffuse: u32,
    scale: u32,
}

/// A ray that gathered diffuse light. Positions are in voxels of the base grid; radiance is stored radiance,
/// `Frame::scale` times radiance.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct InspectedRay {
    pub from: [f32; 3],
    /// The first hit point, or the point where the ray left the grid for the sky; `from` if the pixel shows no surface.
    pub to: [f32; 3],
    /// Radiance along the ray, including light through transmitting surfaces.
    pub light: [f32; 3],
    /// 1 + the number of the triangle that was hit first, counted over the instances in the scene's order; 0 without a
    /// hit.
    pub source: u32,
    /// 1 if the triangle was hit from behind.
    pub back: u32,
}

#[derive(Clone, Copy, Pod, Zeroable)]
#[repr(C)]
struct Push {
    pixel: [u32; 2],
    scale: u32,
}

impl Inspect {
    /// Passes for frames with these settings.
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

    /// For each pixel of the last frame's view: the cached radiance of its surface, as stored, and 1 + the number of
    /// the list item that caches it; 0 without an item.
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

    /// The rays of the gathered pixel that contains `pixel` of the last frame's image.
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

/// A pass that reads a frame, and its output.
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
            on_demand.light_all(&mut r, frame.ground); // no image requested the light of these items
            r.full_barrier(); // the items are lit
        }
        r.dispatch(self.pass, &self.pass.select(&binds), &self.push, self.groups);
        r.finish().map(drop)
    }
}
