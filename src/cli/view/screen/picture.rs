//! The picture on the device: how it comes there, into the window's image, and back.

use anyhow::{Context as _, anyhow};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::swapchain::color_range;
use super::{Picture, Screen};

const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;

/// The picture on the device, and the buffer that it comes through.
pub struct Shown {
    pub size: (u32, u32),
    image: vk::Image,
    memory: Allocation,
    staging: vk::Buffer,
    pub mapped: Allocation,
}

impl Screen {
    /// The picture into a swapchain's image, which then is in `GENERAL` layout.
    ///
    /// # Safety
    /// The command buffer is recording.
    pub(super) unsafe fn record_picture(&self, image: vk::Image) {
        let (device, commands) = (&self.device, self.commands);
        let extent = self.swapchain.extent;
        self.barrier(image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
        let Some(shown) = &self.picture else {
            let grey = vk::ClearColorValue { float32: [0.05, 0.05, 0.05, 1.0] };
            let range = [color_range()];
            // SAFETY: the image is in this layout.
            unsafe { device.cmd_clear_color_image(commands, image, vk::ImageLayout::GENERAL, &grey, &range) };
            self.barrier(image, vk::ImageLayout::GENERAL, vk::ImageLayout::GENERAL);
            return;
        };
        self.barrier(shown.image, vk::ImageLayout::UNDEFINED, vk::ImageLayout::GENERAL);
        let (width, height) = shown.size;
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let copy = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })];
        let corners = |width: u32, height: u32| {
            [vk::Offset3D::default(), vk::Offset3D { x: width as i32, y: height as i32, z: 1 }]
        };
        let blit = [vk::ImageBlit::default()
            .src_subresource(layers)
            .src_offsets(corners(width, height))
            .dst_subresource(layers)
            .dst_offsets(corners(extent.width, extent.height))];
        let general = vk::ImageLayout::GENERAL;
        // A pixel for a pixel where the sizes are the same.
        let same = (width, height) == (extent.width, extent.height);
        let filter = if same { vk::Filter::NEAREST } else { vk::Filter::LINEAR };
        // SAFETY: the images are in these layouts.
        unsafe {
            device.cmd_copy_buffer_to_image(commands, shown.staging, shown.image, general, &copy);
            self.barrier(shown.image, general, general);
            device.cmd_blit_image(commands, shown.image, general, image, general, &blit, filter);
        }
        self.barrier(image, general, general);
    }

    /// Everything before is done and visible.
    pub(super) fn barrier(&self, image: vk::Image, from: vk::ImageLayout, to: vk::ImageLayout) {
        let all = vk::PipelineStageFlags2::ALL_COMMANDS;
        let access = vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(all)
            .src_access_mask(access)
            .dst_stage_mask(all)
            .dst_access_mask(access)
            .old_layout(from)
            .new_layout(to)
            .image(image)
            .subresource_range(color_range())];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: the command buffer is recording.
        unsafe { self.device.cmd_pipeline_barrier2(self.commands, &info) };
    }

    pub(super) fn record_grab(&self, image: vk::Image) -> anyhow::Result<(vk::Buffer, Allocation)> {
        let vk::Extent2D { width, height } = self.swapchain.extent;
        let bytes = u64::from(width) * u64::from(height) * 4;
        let (buffer, memory) = self.buffer(bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)?;
        let general = vk::ImageLayout::GENERAL;
        self.barrier(image, general, general);
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let copy = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })];
        let visible = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        // SAFETY: the image is in this layout, the buffer is large enough.
        unsafe {
            self.device.cmd_copy_image_to_buffer(self.commands, image, general, buffer, &copy);
            self.device.cmd_pipeline_barrier2(self.commands, &vk::DependencyInfo::default().memory_barriers(&visible));
        }
        Ok((buffer, memory))
    }

    pub(super) fn read_grab(&self, buffer: vk::Buffer, memory: Allocation) -> anyhow::Result<Picture> {
        let vk::Extent2D { width, height } = self.swapchain.extent;
        let bytes = width as usize * height as usize * 4;
        let mut rgba = memory.mapped_slice().context("memory that is not mapped")?[..bytes].to_vec();
        if self.swapchain.format == vk::Format::B8G8R8A8_UNORM {
            rgba.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        self.free_buffer(buffer, memory);
        Ok(Picture { size: (width, height), rgba })
    }

    fn buffer(
        &self,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> anyhow::Result<(vk::Buffer, Allocation)> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: the device is alive.
        let buffer = unsafe { self.device.create_buffer(&info, None) }?;
        // SAFETY: as above.
        let requirements = unsafe { self.device.get_buffer_memory_requirements(buffer) };
        let memory = self.memory("picture, staging", requirements, location, true)?;
        // SAFETY: the memory fits the buffer's requirements.
        unsafe { self.device.bind_buffer_memory(buffer, memory.memory(), memory.offset()) }?;
        Ok((buffer, memory))
    }

    fn memory(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> anyhow::Result<Allocation> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let desc = AllocationCreateDesc { name, requirements, location, linear, allocation_scheme };
        let allocator = self.allocator.as_ref().expect("until the screen is dropped");
        Ok(allocator.lock().map_err(|_| anyhow!("an allocation failed before"))?.allocate(&desc)?)
    }

    pub(super) fn new_picture(&self, (width, height): (u32, u32)) -> anyhow::Result<Shown> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(FORMAT)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC);
        // SAFETY: the device is alive.
        let image = unsafe { self.device.create_image(&info, None) }?;
        // SAFETY: as above.
        let requirements = unsafe { self.device.get_image_memory_requirements(image) };
        let memory = self.memory("picture", requirements, MemoryLocation::GpuOnly, false)?;
        // SAFETY: the memory fits the image's requirements.
        unsafe { self.device.bind_image_memory(image, memory.memory(), memory.offset()) }?;
        let bytes = u64::from(width) * u64::from(height) * 4;
        let (staging, mapped) = self.buffer(bytes, vk::BufferUsageFlags::TRANSFER_SRC, MemoryLocation::CpuToGpu)?;
        Ok(Shown { size: (width, height), image, memory, staging, mapped })
    }

    fn free_buffer(&self, buffer: vk::Buffer, memory: Allocation) {
        // SAFETY: no frame is in flight: each is waited for.
        unsafe { self.device.destroy_buffer(buffer, None) };
        self.free(memory);
    }

    pub(super) fn free_picture(&self, shown: Shown) {
        self.free_buffer(shown.staging, shown.mapped);
        // SAFETY: no frame is in flight.
        unsafe { self.device.destroy_image(shown.image, None) };
        self.free(shown.memory);
    }

    fn free(&self, memory: Allocation) {
        if let Some(Ok(mut allocator)) = self.allocator.as_ref().map(|allocator| allocator.lock()) {
            // It fails only for memory of another allocator.
            let _ = allocator.free(memory);
        }
    }
}
