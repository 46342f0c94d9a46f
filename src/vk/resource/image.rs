//! Images in `GENERAL` layout with all their views.

use super::memory::{Memory, Owner};
use crate::vk::device::context::Context;
use crate::{Error, Result};
use ash::vk;
use std::sync::Arc;

/// The dimension of an image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ImageDim {
    #[default]
    D2,
    D2Array,
    /// A 3D image. Each level can be an attachment with one layer per slice.
    D3,
}

/// The description of an [`Image`].
#[derive(Clone, Copy, Debug)]
pub struct ImageDesc<'a> {
    pub label: &'a str,
    pub dim: ImageDim,
    pub format: vk::Format,
    /// Width in texels at level 0.
    pub width: u32,
    pub height: u32,
    /// Slices of a 3D image at level 0, layers of an array; 1 for `D2`.
    pub depth_or_layers: u32,
    pub mips: u32,
    /// Samples per texel: 1, 2, 4, 8 or 16.
    pub samples: u32,
    pub usage: vk::ImageUsageFlags,
    /// Formats of the same size as which [`Image::view_as`] may sample it.
    pub view_formats: &'a [vk::Format],
}

impl Default for ImageDesc<'_> {
    fn default() -> Self {
        Self {
            label: "",
            dim: ImageDim::D2,
            format: vk::Format::UNDEFINED,
            width: 1,
            height: 1,
            depth_or_layers: 1,
            mips: 1,
            samples: 1,
            usage: vk::ImageUsageFlags::empty(),
            view_formats: &[],
        }
    }
}

pub(in crate::vk) struct RawImage {
    context: Arc<Context>,
    pub(in crate::vk) handle: vk::Image,
    memory: Option<Memory>,
    pub(in crate::vk) label: String,
    dim: ImageDim,
    pub(in crate::vk) format: vk::Format,
    extent: [u32; 3],
    layers: u32,
    mips: u32,
    pub(in crate::vk) samples: u32,
    view: vk::ImageView,
    /// Views of single levels; empty if the usage has no sampling and no storage.
    mip_views: Vec<vk::ImageView>,
    /// Attachment views of single levels; empty if the image is not an attachment.
    attachment_views: Vec<vk::ImageView>,
    format_views: Vec<(vk::Format, vk::ImageView)>,
}

impl Drop for RawImage {
    fn drop(&mut self) {
        let Some(device) = self.context.device_to_destroy_with() else { return };
        let format_views = self.format_views.iter().map(|(_, view)| view);
        let views = self.mip_views.iter().chain(&self.attachment_views).chain(format_views).chain([&self.view]);
        // SAFETY: nothing in flight refers to it; see `Memory::drop`. Destroying null is allowed.
        unsafe {
            for view in views {
                device.destroy_image_view(*view, None);
            }
            device.destroy_image(self.handle, None);
        }
    }
}

/// An image with its memory and views, in `GENERAL` layout. Recorded commands keep it alive.
pub struct Image {
    pub(in crate::vk) raw: Arc<RawImage>,
}

/// A view of an [`Image`] for bindings or attachments.
#[derive(Clone, Copy)]
pub struct ImageView<'a> {
    pub(in crate::vk) handle: vk::ImageView,
    pub(in crate::vk) raw: &'a Arc<RawImage>,
    /// The level of a view of a single level, else 0.
    pub(in crate::vk) level: u32,
}

impl ImageView<'_> {
    /// The handle for a host's own commands, valid as long as the image lives.
    pub fn handle(&self) -> vk::ImageView {
        self.handle
    }
}

impl Image {
    /// Creates the image and its views and brings it into `GENERAL` layout; its content is undefined.
    ///
    /// `Error::Memory` if it exceeds the device's limits or the free device memory.
    pub fn new(context: &Arc<Context>, desc: &ImageDesc<'_>) -> Result<Self> {
        check_size(context, desc)?;
        let mut raw = create(context, desc)?;
        raw.memory = Some(Memory::bind(context, desc.label, &Owner::Image(raw.handle))?);
        context.set_name(raw.handle, desc.label);
        raw.create_views(desc).map_err(|result| context.error(&format!("creating {}", desc.label), result))?;
        let transition = raw.first_transition();
        let raw = Arc::new(raw);
        let weak = Arc::downgrade(&raw);
        context.transition_first((weak, transition))?;
        Ok(Self { raw })
    }

    /// All levels and layers for sampling; as a storage image it only reads level 0.
    pub fn view(&self) -> ImageView<'_> {
        ImageView { handle: self.raw.view, raw: &self.raw, level: 0 }
    }

    /// One level with all its layers or slices, of the image's own dimension, for sampling or storage.
    pub fn mip_view(&self, level: u32) -> ImageView<'_> {
        self.level_view(&self.raw.mip_views, level, "sampled or storage")
    }

    /// One level as an attachment; a 3D level is a 2D array with a layer per slice.
    pub fn attachment_view(&self, level: u32) -> ImageView<'_> {
        self.level_view(&self.raw.attachment_views, level, "attachment")
    }

    /// All levels and layers, sampled as `format`, one of the formats given at creation.
    pub fn view_as(&self, format: vk::Format) -> ImageView<'_> {
        let label = self.label();
        let found = self.raw.format_views.iter().find(|(known, _)| *known == format);
        let (_, handle) = found.unwrap_or_else(|| panic!("{label} was not made to be viewed as {format:?}"));
        ImageView { handle: *handle, raw: &self.raw, level: 0 }
    }

    fn level_view(&self, views: &[vk::ImageView], level: u32, usage: &str) -> ImageView<'_> {
        let label = self.label();
        let handle = views.get(level as usize);
        let handle = *handle.unwrap_or_else(|| panic!("{label} has no {usage} view of level {level}"));
        ImageView { handle, raw: &self.raw, level }
    }

    /// The handle for a host's own commands, valid as long as the image lives. The image stays in `GENERAL` layout.
    pub fn handle(&self) -> vk::Image {
        self.raw.handle
    }

    pub fn label(&self) -> &str {
        &self.raw.label
    }

    pub fn format(&self) -> vk::Format {
        self.raw.format
    }

    pub fn mips(&self) -> u32 {
        self.raw.mips
    }

    pub fn layers(&self) -> u32 {
        self.raw.layers
    }

    /// Texels of `level` along x, y, z; z is 1 unless the image is 3D.
    pub fn extent(&self, level: u32) -> [u32; 3] {
        self.raw.extent_of(level)
    }

    /// Bytes that the driver allocated for it.
    pub fn allocated_bytes(&self) -> u64 {
        self.raw.memory.as_ref().expect("bound at creation").bytes()
    }
}

impl RawImage {
    pub(in crate::vk) fn extent_of(&self, level: u32) -> [u32; 3] {
        self.extent.map(|texels| (texels >> level).max(1))
    }

    /// Layers of an attachment view of `level`.
    pub(in crate::vk) fn attachment_layers(&self, level: u32) -> u32 {
        if self.dim == ImageDim::D3 { self.extent_of(level)[2] } else { self.layers }
    }

    pub(in crate::vk) fn aspect(&self) -> vk::ImageAspectFlags {
        match self.format {
            vk::Format::D16_UNORM | vk::Format::D32_SFLOAT | vk::Format::X8_D24_UNORM_PACK32 => {
                vk::ImageAspectFlags::DEPTH
            }
            _ => vk::ImageAspectFlags::COLOR,
        }
    }

    fn create_views(&mut self, desc: &ImageDesc<'_>) -> std::result::Result<(), vk::Result> {
        use vk::ImageUsageFlags as U;
        let own_type = match self.dim {
            ImageDim::D2 => vk::ImageViewType::TYPE_2D,
            ImageDim::D2Array => vk::ImageViewType::TYPE_2D_ARRAY,
            ImageDim::D3 => vk::ImageViewType::TYPE_3D,
        };
        let all = self.range(0..desc.mips);
        let viewable = U::SAMPLED | U::STORAGE | U::COLOR_ATTACHMENT | U::DEPTH_STENCIL_ATTACHMENT;
        if desc.usage.intersects(viewable) {
            self.view = self.create_view(own_type, desc.format, all, desc.usage)?;
        }
        for level in 0..desc.mips {
            if desc.usage.intersects(U::SAMPLED | U::STORAGE) {
                let usage = desc.usage & (U::SAMPLED | U::STORAGE);
                let view = self.create_view(own_type, desc.format, self.range(level..level + 1), usage)?;
                self.mip_views.push(view);
            }
            let usage = desc.usage & (U::COLOR_ATTACHMENT | U::DEPTH_STENCIL_ATTACHMENT);
            if !usage.is_empty() {
                let layers = self.attachment_layers(level);
                let kind = if layers == 1 { vk::ImageViewType::TYPE_2D } else { vk::ImageViewType::TYPE_2D_ARRAY };
                let range = self.range(level..level + 1).layer_count(layers);
                let view = self.create_view(kind, desc.format, range, usage)?;
                self.attachment_views.push(view);
            }
        }
        for format in desc.view_formats {
            let view = self.create_view(own_type, *format, all, U::SAMPLED)?;
            self.format_views.push((*format, view));
        }
        Ok(())
    }

    /// The subresource range of these levels and all layers.
    fn range(&self, levels: std::ops::Range<u32>) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default()
            .aspect_mask(self.aspect())
            .base_mip_level(levels.start)
            .level_count(levels.len() as u32)
            .layer_count(self.layers)
    }

    /// The barrier that brings the new image into `GENERAL` layout.
    fn first_transition(&self) -> vk::ImageMemoryBarrier2<'static> {
        vk::ImageMemoryBarrier2::default()
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::GENERAL)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(self.handle)
            .subresource_range(self.range(0..self.mips))
    }

    fn create_view(
        &self,
        kind: vk::ImageViewType,
        format: vk::Format,
        range: vk::ImageSubresourceRange,
        usage: vk::ImageUsageFlags,
    ) -> std::result::Result<vk::ImageView, vk::Result> {
        let mut usage = vk::ImageViewUsageCreateInfo::default().usage(usage);
        let info = vk::ImageViewCreateInfo::default()
            .image(self.handle)
            .view_type(kind)
            .format(format)
            .subresource_range(range)
            .push_next(&mut usage);
        // SAFETY: the image is alive and has memory.
        unsafe { self.context.device().create_image_view(&info, None) }
    }
}

fn check_size(context: &Context, desc: &ImageDesc<'_>) -> Result<()> {
    let limits = &context.limits;
    let (side, deep) = match desc.dim {
        ImageDim::D2 | ImageDim::D2Array => (limits.max_image_dimension2_d, limits.max_image_array_layers),
        ImageDim::D3 => (limits.max_image_dimension3_d, limits.max_image_dimension3_d),
    };
    let ImageDesc { label, width, height, depth_or_layers, .. } = *desc;
    assert!(width.min(height).min(depth_or_layers).min(desc.mips) > 0, "{label} is empty");
    if width.max(height) <= side && depth_or_layers <= deep {
        return Ok(());
    }
    Err(Error::Memory(format!(
        "{label} would be {width} x {height} x {depth_or_layers}, but {} allows {side} x {side} x {deep} at most",
        context.name
    )))
}

fn create(context: &Arc<Context>, desc: &ImageDesc<'_>) -> Result<RawImage> {
    let mut flags = vk::ImageCreateFlags::empty();
    if desc.dim == ImageDim::D3 && desc.usage.contains(vk::ImageUsageFlags::COLOR_ATTACHMENT) {
        flags |= vk::ImageCreateFlags::TYPE_2D_ARRAY_COMPATIBLE;
    }
    let mut formats = vec![desc.format];
    formats.extend(desc.view_formats);
    let mut list = vk::ImageFormatListCreateInfo::default().view_formats(&formats);
    let (kind, depth, layers) = match desc.dim {
        ImageDim::D2 | ImageDim::D2Array => (vk::ImageType::TYPE_2D, 1, desc.depth_or_layers),
        ImageDim::D3 => (vk::ImageType::TYPE_3D, desc.depth_or_layers, 1),
    };
    let mut info = vk::ImageCreateInfo::default()
        .image_type(kind)
        .format(desc.format)
        .extent(vk::Extent3D { width: desc.width, height: desc.height, depth })
        .mip_levels(desc.mips)
        .array_layers(layers)
        .samples(vk::SampleCountFlags::from_raw(desc.samples))
        .usage(desc.usage);
    if !desc.view_formats.is_empty() {
        // The other formats may lack a usage (sRGB has no storage), so each view states its own.
        flags |= vk::ImageCreateFlags::MUTABLE_FORMAT | vk::ImageCreateFlags::EXTENDED_USAGE;
        info = info.push_next(&mut list);
    }
    info = info.flags(flags);
    // SAFETY: the info is complete.
    let handle = unsafe { context.device().create_image(&info, None) }
        .map_err(|result| context.error(&format!("creating {}", desc.label), result))?;
    Ok(RawImage {
        context: context.clone(),
        handle,
        memory: None,
        label: desc.label.to_owned(),
        dim: desc.dim,
        format: desc.format,
        extent: [desc.width, desc.height, depth],
        layers,
        mips: desc.mips,
        samples: desc.samples,
        view: vk::ImageView::null(),
        mip_views: Vec::new(),
        attachment_views: Vec::new(),
        format_views: Vec::new(),
    })
}

/// A box of texels in some layers of one level, for copies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImageRegion {
    pub level: u32,
    pub first_layer: u32,
    pub layers: u32,
    /// Offset in texels.
    pub offset: [u32; 3],
    /// Extent in texels.
    pub extent: [u32; 3],
}

impl ImageRegion {
    /// All texels and layers of one level.
    pub fn level(image: &Image, level: u32) -> Self {
        let (layers, extent) = (image.layers(), image.extent(level));
        Self { level, first_layer: 0, layers, offset: [0; 3], extent }
    }

    /// `count` rows of one level, starting with row `first`, in all layers.
    pub fn rows(image: &Image, level: u32, first: u32, count: u32) -> Self {
        let whole = Self::level(image, level);
        let [width, _, depth] = whole.extent;
        Self { offset: [0, first, 0], extent: [width, count, depth], ..whole }
    }

    /// One layer of one level.
    pub fn layer(image: &Image, level: u32, layer: u32) -> Self {
        Self { first_layer: layer, layers: 1, ..Self::level(image, level) }
    }
}
