//! Images that a host made, as a recording writes and reads them.

use super::frame_log::CommandLog;
use super::recorder::Recorder;
use crate::vk::device::context::Context;
use crate::vk::device::submit::record_image_barrier;
use crate::vk::resource::image::Image;
use crate::{Error, Result};
use ash::vk;

/// How commands use an image: their stages, what they do there, and the layout that the image then is in.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImageUse {
    pub stages: vk::PipelineStageFlags2,
    pub access: vk::AccessFlags2,
    pub layout: vk::ImageLayout,
}

/// One level of one layer of a colour image that a host made with optimal tiling and one sample, and with
/// `TRANSFER_DST` usage to be written, `TRANSFER_SRC` to be read. The host keeps it alive and gives it memory; nothing
/// of it is destroyed here.
#[derive(Clone, Copy, Debug)]
pub struct HostImage {
    pub image: vk::Image,
    /// One of [`HostImage::FORMATS`] that the device can blit to; `R32G32B32A32_SFLOAT` is exact.
    pub format: vk::Format,
    /// Texels of this level.
    pub size: (u32, u32),
    pub level: u32,
    pub layer: u32,
    /// The host's last use of it; with the layout `UNDEFINED` what it held is lost, which does not matter where it is
    /// written.
    pub before: ImageUse,
    /// The host's next use of it, in this recording or after it.
    pub after: ImageUse,
}

impl HostImage {
    /// The formats that linear radiance is converted to. `UNORM` and `SRGB` clamp to 0…1, `SRGB` encodes, small floats
    /// round, and channels that a format lacks are left out: exposure and tone mapping are the host's.
    pub const FORMATS: [vk::Format; 14] = [
        vk::Format::R32G32B32A32_SFLOAT,
        vk::Format::R32G32_SFLOAT,
        vk::Format::R32_SFLOAT,
        vk::Format::R16G16B16A16_SFLOAT,
        vk::Format::R16G16_SFLOAT,
        vk::Format::R16_SFLOAT,
        vk::Format::B10G11R11_UFLOAT_PACK32,
        vk::Format::R16G16B16A16_UNORM,
        vk::Format::A2B10G10R10_UNORM_PACK32,
        vk::Format::A2R10G10B10_UNORM_PACK32,
        vk::Format::R8G8B8A8_UNORM,
        vk::Format::R8G8B8A8_SRGB,
        vk::Format::B8G8R8A8_UNORM,
        vk::Format::B8G8R8A8_SRGB,
    ];

    /// `reads`: from it, else to it.
    ///
    /// # Errors
    /// One sentence: the format is none of these, or the device cannot blit from or to it.
    pub(crate) fn check(&self, context: &Context, reads: bool) -> Result<()> {
        let (format, name) = (self.format, &context.name);
        if !Self::FORMATS.contains(&format) {
            return Err(Error::Usage(format!(
                "an image of format {format:?} cannot take radiance: use one of HostImage::FORMATS"
            )));
        }
        let feature = if reads { vk::FormatFeatureFlags::BLIT_SRC } else { vk::FormatFeatureFlags::BLIT_DST };
        // SAFETY: the handle comes from this instance.
        let found = unsafe { context.instance.get_physical_device_format_properties(context.physical, format) };
        if format != vk::Format::R32G32B32A32_SFLOAT && !found.optimal_tiling_features.contains(feature) {
            let exact = "R32G32B32A32_SFLOAT";
            return Err(Error::Device(format!(
                "{name} cannot convert images of format {format:?}: use {exact}, which is copied"
            )));
        }
        Ok(())
    }

    fn barrier(&self, from: ImageUse, to: ImageUse) -> vk::ImageMemoryBarrier2<'static> {
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .base_mip_level(self.level)
            .level_count(1)
            .base_array_layer(self.layer)
            .layer_count(1);
        vk::ImageMemoryBarrier2::default()
            .src_stage_mask(from.stages)
            .src_access_mask(from.access)
            .old_layout(from.layout)
            .dst_stage_mask(to.stages)
            .dst_access_mask(to.access)
            .new_layout(to.layout)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(self.image)
            .subresource_range(range)
    }
}

impl Recorder {
    /// Copies or blits between the finest level of `own`, RGBA in f32, and a host's image of the same size, in whatever
    /// format that is: from it where it `reads`, else to it. What was recorded before is done with `own`, and what
    /// follows waits by a barrier of its own; the barriers of the host's image are recorded here.
    ///
    /// # Safety
    /// The host's image is as it says, was checked ([`HostImage::check`]), and lives until the device is done.
    pub(crate) unsafe fn convert(&mut self, own: &Image, host: &HostImage, reads: bool) {
        let (width, height) = host.size;
        assert_eq!(own.extent(0), [width, height, 1], "{}: the host's image has another size", own.label());
        let (access, layout) = if reads {
            (vk::AccessFlags2::TRANSFER_READ, vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
        } else {
            (vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL)
        };
        let used = ImageUse { stages: vk::PipelineStageFlags2::ALL_TRANSFER, access, layout };
        record_image_barrier(self.context(), self.handle, host.barrier(host.before, used));
        let layers = |level, layer| {
            vk::ImageSubresourceLayers::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .mip_level(level)
                .base_array_layer(layer)
                .layer_count(1)
        };
        let mut ends = [
            (own.raw.handle, vk::ImageLayout::GENERAL, layers(0, 0)),
            (host.image, layout, layers(host.level, host.layer)),
        ];
        if reads {
            ends.reverse();
        }
        let [(from, from_layout, source), (to, to_layout, target)] = ends;
        let (device, commands) = (self.context().device(), self.handle);
        if own.format() == host.format {
            let extent = vk::Extent3D { width, height, depth: 1 };
            let copy = [vk::ImageCopy::default().src_subresource(source).dst_subresource(target).extent(extent)];
            // SAFETY: both images are in these layouts; one is kept, the other is the caller's.
            unsafe { device.cmd_copy_image(commands, from, from_layout, to, to_layout, &copy) };
        } else {
            let whole = [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }];
            let blit = [vk::ImageBlit::default()
                .src_subresource(source)
                .src_offsets(whole)
                .dst_subresource(target)
                .dst_offsets(whole)];
            // SAFETY: as above; a filter of nearest texels asks for no further feature.
            unsafe { device.cmd_blit_image(commands, from, from_layout, to, to_layout, &blit, vk::Filter::NEAREST) };
        }
        self.keep(own.raw.clone());
        let names = || (own.label().to_owned(), format!("a host's image, {:?}", host.format));
        self.log(|| {
            let (own, host) = names();
            let (from, to) = if reads { (host, own) } else { (own, host) };
            CommandLog::Copy { from, to, bytes: None }
        });
        record_image_barrier(self.context(), self.handle, host.barrier(used, host.after));
    }
}
