//! The commands of a recording: barriers, transfers, draws and dispatches.

use super::bind::bind_pipeline;
use super::frame_log::{CommandLog, DispatchLog};
use super::raster_pass::{RasterPass, RenderTarget};
use super::recorder::Recorder;
use crate::vk::device::submit::record_barrier;
use crate::vk::pipeline::bind::{Bind, labels};
use crate::vk::pipeline::desc::Compute;
use crate::vk::resource::buffer::{Buffer, BufferAt};
use crate::vk::resource::image::{Image, ImageRegion};
use ash::vk;
use bytemuck::Pod;

impl Recorder {
    /// Orders all earlier commands before all later ones.
    pub fn full_barrier(&mut self) {
        let all =
            (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE);
        record_barrier(self.context(), self.handle, all, all);
    }

    /// Fills `bytes` bytes from `offset` (both multiples of 4) with the word `value`.
    pub fn fill(&mut self, buffer: &Buffer, offset: u64, bytes: u64, value: u32) {
        check_range(buffer, offset, bytes);
        // SAFETY: in range; the buffer is kept.
        unsafe { self.context().device().cmd_fill_buffer(self.handle, buffer.raw.handle, offset, bytes, value) };
        self.keep(buffer.raw.clone());
        self.log(|| CommandLog::Fill { buffer: buffer.label().to_owned(), offset, bytes, value });
    }

    /// Writes `data` to `buffer` from byte `first`, in order with the commands, for small data that changes from frame
    /// to frame. Offset and length are multiples of 4.
    pub fn update<T: Pod>(&mut self, buffer: &Buffer, first: u64, data: &[T]) {
        const MOST: usize = 65536;
        let data: &[u8] = bytemuck::cast_slice(data);
        check_range(buffer, first, data.len() as u64);
        self.keep(buffer.raw.clone());
        for (index, part) in data.chunks(MOST).enumerate() {
            let (offset, bytes) = (first + (index * MOST) as u64, part.len() as u64);
            // SAFETY: in range; the data is copied into the command buffer; the buffer is kept.
            unsafe { self.context().device().cmd_update_buffer(self.handle, buffer.raw.handle, offset, part) };
            self.log(|| CommandLog::Update { buffer: buffer.label().to_owned(), offset, bytes });
        }
    }

    /// Sets every texel of a colour image to zero.
    pub fn clear(&mut self, image: &Image) {
        let range = [vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(vk::REMAINING_MIP_LEVELS)
            .layer_count(vk::REMAINING_ARRAY_LAYERS)];
        let (general, zero) = (vk::ImageLayout::GENERAL, vk::ClearColorValue::default());
        // SAFETY: the image is in that layout for good, outside a rendering scope; it is kept.
        unsafe {
            self.context().device().cmd_clear_color_image(self.handle, image.raw.handle, general, &zero, &range);
        }
        self.keep(image.raw.clone());
        self.log(|| CommandLog::Clear { image: image.label().to_owned() });
    }

    /// Copies the beginning of `from` to `to`, up to the smaller size.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) {
        self.copy_range(from.at(0), to.at(0), from.bytes().min(to.bytes()));
    }

    /// Copies `bytes` bytes between these positions of both buffers.
    pub fn copy_range(&mut self, from: BufferAt<'_>, to: BufferAt<'_>, bytes: u64) {
        let (BufferAt { buffer: from, offset: from_offset }, BufferAt { buffer: to, offset: to_offset }) = (from, to);
        check_range(from, from_offset, bytes);
        check_range(to, to_offset, bytes);
        let region = [vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes }];
        // SAFETY: in range; the buffers are kept.
        unsafe { self.context().device().cmd_copy_buffer(self.handle, from.raw.handle, to.raw.handle, &region) };
        self.keep(from.raw.clone());
        self.keep(to.raw.clone());
        let bytes = Some(bytes);
        self.log(|| CommandLog::Copy { from: from.label().to_owned(), to: to.label().to_owned(), bytes });
    }

    /// Copies a region of `image` into `buffer` from byte `offset`, tightly packed.
    pub fn copy_image_to_buffer(&mut self, image: &Image, region: ImageRegion, buffer: &Buffer, offset: u64) {
        let copy = [image_copy(image, region, offset)];
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: the image is in that layout for good; both are kept.
        unsafe {
            let (device, image, buffer) = (self.context().device(), image.raw.handle, buffer.raw.handle);
            device.cmd_copy_image_to_buffer(self.handle, image, general, buffer, &copy);
        }
        self.keep(image.raw.clone());
        self.keep(buffer.raw.clone());
        self.log(|| CommandLog::Copy { from: image.label().to_owned(), to: buffer.label().to_owned(), bytes: None });
    }

    /// Copies tightly packed texels from byte `offset` of `buffer` into a region of `image`.
    pub fn copy_buffer_to_image(&mut self, buffer: &Buffer, offset: u64, image: &Image, region: ImageRegion) {
        let copy = [image_copy(image, region, offset)];
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: the image is in that layout for good; both are kept.
        unsafe {
            let (device, image, buffer) = (self.context().device(), image.raw.handle, buffer.raw.handle);
            device.cmd_copy_buffer_to_image(self.handle, buffer, image, general, &copy);
        }
        self.keep(image.raw.clone());
        self.keep(buffer.raw.clone());
        self.log(|| CommandLog::Copy { from: buffer.label().to_owned(), to: image.label().to_owned(), bytes: None });
    }

    /// One rendering scope into `target`, for any number of draws.
    pub fn raster(&mut self, target: &RenderTarget<'_>, draw: impl FnOnce(&mut RasterPass<'_>)) {
        let mut pass = RasterPass::begin(self, target);
        draw(&mut pass);
        pass.end();
    }

    /// Runs `groups` workgroups.
    pub fn dispatch(&mut self, pipeline: &Compute, binds: &[Bind<'_>], push: &impl Pod, groups: [u32; 3]) {
        let limit = self.context().limits.max_compute_work_group_count;
        let fits = groups.iter().zip(limit).all(|(count, most)| *count <= most);
        assert!(fits, "{}: {groups:?} workgroups, {limit:?} at most", pipeline.label());
        bind_pipeline(self, &pipeline.raw, binds, push);
        let [x, y, z] = groups;
        // SAFETY: a compute pipeline and all its bindings are set.
        unsafe { self.context().device().cmd_dispatch(self.handle, x, y, z) };
        self.log(|| dispatch_log(pipeline, binds, Some(groups), None));
    }

    /// Runs the number of workgroups that three words of a buffer hold, starting at `counts`.
    pub fn dispatch_indirect(&mut self, pipeline: &Compute, binds: &[Bind<'_>], push: &impl Pod, counts: BufferAt<'_>) {
        let BufferAt { buffer, offset } = counts;
        check_range(buffer, offset, 12);
        bind_pipeline(self, &pipeline.raw, binds, push);
        // SAFETY: in range; a compute pipeline and all its bindings are set; the buffer is kept.
        unsafe { self.context().device().cmd_dispatch_indirect(self.handle, buffer.raw.handle, offset) };
        self.keep(buffer.raw.clone());
        self.log(|| dispatch_log(pipeline, binds, None, Some((buffer.label().to_owned(), offset))));
    }
}

fn dispatch_log(
    pipeline: &Compute,
    binds: &[Bind<'_>],
    groups: Option<[u32; 3]>,
    indirect: Option<(String, u64)>,
) -> CommandLog {
    let (resources, stages) = (labels(&pipeline.raw, binds), pipeline.stages().to_vec());
    CommandLog::Dispatch(DispatchLog { pipeline: pipeline.label().to_owned(), stages, groups, indirect, resources })
}

fn check_range(buffer: &Buffer, offset: u64, bytes: u64) {
    let (label, size) = (buffer.label(), buffer.bytes());
    let fits = offset.checked_add(bytes).is_some_and(|end| end <= size);
    assert!(fits, "{label}: {bytes} bytes at {offset} do not fit into {size}");
}

fn layers(image: &Image, region: ImageRegion) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers {
        aspect_mask: image.raw.aspect(),
        mip_level: region.level,
        base_array_layer: region.first_layer,
        layer_count: region.layers,
    }
}

fn offset([x, y, z]: [u32; 3]) -> vk::Offset3D {
    vk::Offset3D { x: x as i32, y: y as i32, z: z as i32 }
}

fn extent(ImageRegion { extent: [width, height, depth], .. }: ImageRegion) -> vk::Extent3D {
    vk::Extent3D { width, height, depth }
}

fn image_copy(image: &Image, region: ImageRegion, buffer_offset: u64) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .buffer_offset(buffer_offset)
        .image_subresource(layers(image, region))
        .image_offset(offset(region.offset))
        .image_extent(extent(region))
}
