//! Images of a host that a recording reads or writes.

use super::frame_log::CommandLog;
use super::recorder::Recorder;
use crate::vk::device::context::Context;
use crate::vk::device::submit::record_image_barrier;
use crate::vk::resource::image::Image;
use crate::{Error, Result};
use ash::vk;

/// The use of an image by commands: their stages and accesses, and the layout of the image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImageUse {
    pub stages: vk::PipelineStageFlags2,
    pub access: vk::AccessFlags2,
    pub layout: vk::ImageLayout,
}

/// One level of one layer of a host's colour image with optimal tiling, one sample, and usage `TRANSFER_DST` for
/// writing or `TRANSFER_SRC` for reading. The host keeps it alive and provides its memory; this library destroys
/// nothing of it.
#[derive(Clone, Copy, Debug)]
pub struct HostImage {
    pub image: vk::Image,
    /// One of [`HostImage::FORMATS`] to which the device can blit; `R32G32B32A32_SFLOAT` is exact.
    pub format: vk::Format,
    /// Width and height of this level in texels.
    pub size: (u32, u32),
    pub level: u32,
    pub layer: u32,
    /// The host's last use of the image. The layout `UNDEFINED` discards its content, which is correct for images that
    /// are written.
    pub before: ImageUse,
    /// The host's next use of the image, in this recording or later.
    pub after: ImageUse,
}

impl HostImage {
    /// Formats to which linear radiance is converted. `UNORM` and `SRGB` clamp to 0…1, `SRGB` encodes, small floats
    /// round, and missing channels are dropped. Exposure and tone mapping are left to the host.
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

    /// `reads` says whether the image is read instead of written.
    ///
    /// # Errors
    /// One sentence: the format is not supported, or the device cannot blit it.
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
    /// Copies or blits between the finest level of `own`, RGBA in f32, and a host's image of the same size and any
    /// format: from the host's image if it `reads`, else to it. Earlier commands have finished with `own`, and later
    /// ones use their own barrier. The barriers of the host's image are recorded here.
    ///
    /// # Safety
    /// The host's image matches its description, was checked ([`HostImage::check`]), and lives until the device has
    /// finished.
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
            // SAFETY: as above; a nearest filter needs no further feature.
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
