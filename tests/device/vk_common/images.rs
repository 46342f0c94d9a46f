//! A host's own image and buffer, each with memory of its own.

use twobounce::ash::{self, vk};

use super::Host;

/// An image of two levels and three layers, or a buffer that the CPU reads.
pub struct TestImage {
    pub image: vk::Image,
    buffer: vk::Buffer,
    bytes: u64,
    memory: vk::DeviceMemory,
}

impl TestImage {
    pub fn new(host: &Host, format: vk::Format, (width, height): (u32, u32)) -> Self {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(2)
            .array_layers(3)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::TRANSFER_SRC);
        unsafe {
            let image = host.device.create_image(&info, None).expect("an image");
            let needs = host.device.get_image_memory_requirements(image);
            let memory = memory(host, &needs, vk::MemoryPropertyFlags::DEVICE_LOCAL);
            host.device.bind_image_memory(image, memory, 0).expect("memory");
            Self { image, buffer: vk::Buffer::null(), bytes: 0, memory }
        }
    }

    pub fn readback(host: &Host, bytes: u32) -> Self {
        let both = vk::BufferUsageFlags::TRANSFER_DST | vk::BufferUsageFlags::TRANSFER_SRC;
        let info = vk::BufferCreateInfo::default().size(bytes.into()).usage(both);
        unsafe {
            let buffer = host.device.create_buffer(&info, None).expect("a buffer");
            let needs = host.device.get_buffer_memory_requirements(buffer);
            let seen = vk::MemoryPropertyFlags::HOST_VISIBLE | vk::MemoryPropertyFlags::HOST_COHERENT;
            let memory = memory(host, &needs, seen);
            host.device.bind_buffer_memory(buffer, memory, 0).expect("memory");
            Self { image: vk::Image::null(), buffer, bytes: bytes.into(), memory }
        }
    }

    /// A buffer of texels with one number each.
    pub fn upload(host: &Host, texels: &[f32]) -> Self {
        let this = Self::readback(host, 4 * texels.len() as u32);
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let start = host.device.map_memory(this.memory, 0, this.bytes, flags).expect("a map");
            std::ptr::copy_nonoverlapping(texels.as_ptr(), start.cast::<f32>(), texels.len());
            host.device.unmap_memory(this.memory);
        }
        this
    }

    /// Records a copy of this buffer to a level of a layer of an image, which then has the layout of a transfer's
    /// destination.
    #[allow(clippy::too_many_arguments, reason = "Vulkan describes a copy by as many parts")]
    pub fn copy_to(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        image: vk::Image,
        (width, height): (u32, u32),
        (level, layer): (u32, u32),
    ) {
        let aspect = vk::ImageAspectFlags::COLOR;
        let part = vk::ImageSubresourceLayers::default()
            .aspect_mask(aspect)
            .mip_level(level)
            .base_array_layer(layer)
            .layer_count(1);
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(aspect)
            .base_mip_level(level)
            .level_count(1)
            .base_array_layer(layer)
            .layer_count(1);
        let target = vk::ImageLayout::TRANSFER_DST_OPTIMAL;
        let barrier = [vk::ImageMemoryBarrier::default()
            .new_layout(target)
            .dst_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
            .image(image)
            .subresource_range(range)];
        let region = [vk::BufferImageCopy::default().image_subresource(part).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })];
        let (all, copy) = (vk::PipelineStageFlags::ALL_COMMANDS, vk::PipelineStageFlags::TRANSFER);
        unsafe {
            device.cmd_pipeline_barrier(commands, all, copy, vk::DependencyFlags::empty(), &[], &[], &barrier);
            device.cmd_copy_buffer_to_image(commands, self.buffer, image, target, &region);
        }
    }

    /// Records a copy of a level of a layer of an image of size `size` to this buffer, for the CPU.
    #[allow(clippy::too_many_arguments, reason = "Vulkan describes a copy by as many parts")]
    pub fn copy(
        &self,
        device: &ash::Device,
        commands: vk::CommandBuffer,
        (image, layout): (vk::Image, vk::ImageLayout),
        (width, height): (u32, u32),
        (level, layer): (u32, u32),
    ) {
        let part = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .mip_level(level)
            .base_array_layer(layer)
            .layer_count(1);
        let extent = vk::Extent3D { width, height, depth: 1 };
        let region = [vk::BufferImageCopy::default().image_subresource(part).image_extent(extent)];
        let to_cpu = [vk::MemoryBarrier::default()
            .src_access_mask(vk::AccessFlags::TRANSFER_WRITE)
            .dst_access_mask(vk::AccessFlags::HOST_READ)];
        let (copy, cpu) = (vk::PipelineStageFlags::TRANSFER, vk::PipelineStageFlags::HOST);
        unsafe {
            device.cmd_copy_image_to_buffer(commands, image, layout, self.buffer, &region);
            device.cmd_pipeline_barrier(commands, copy, cpu, vk::DependencyFlags::empty(), &to_cpu, &[], &[]);
        }
    }

    /// The copied values, after the wait for the copy.
    pub fn read<T: bytemuck::Pod>(&self, host: &Host) -> Vec<T> {
        unsafe {
            let flags = vk::MemoryMapFlags::empty();
            let start = host.device.map_memory(self.memory, 0, self.bytes, flags).expect("a map");
            let bytes = std::slice::from_raw_parts(start.cast::<u8>(), self.bytes as usize);
            let values = bytemuck::pod_collect_to_vec(bytes);
            host.device.unmap_memory(self.memory);
            values
        }
    }

    pub fn destroy(self, host: &Host) {
        unsafe {
            host.device.destroy_image(self.image, None);
            host.device.destroy_buffer(self.buffer, None);
            host.device.free_memory(self.memory, None);
        }
    }
}

fn memory(host: &Host, needs: &vk::MemoryRequirements, wanted: vk::MemoryPropertyFlags) -> vk::DeviceMemory {
    unsafe {
        let kinds = host.memory_types();
        let fits =
            |&i: &u32| needs.memory_type_bits & (1 << i) != 0 && kinds[i as usize].property_flags.contains(wanted);
        let kind = (0..kinds.len() as u32).find(fits).expect("such memory");
        let info = vk::MemoryAllocateInfo::default().allocation_size(needs.size).memory_type_index(kind);
        host.device.allocate_memory(&info, None).expect("memory")
    }
}
