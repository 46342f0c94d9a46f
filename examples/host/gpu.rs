//! Vulkan objects of a typical program: instance, device, queue, memory, and the frames in flight.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use twobounce::ash::{self, vk};
use twobounce::gpu_allocator::MemoryLocation;
use twobounce::gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use twobounce::host::{HostDevice, missing, required_extensions, required_features};

pub type Anything<T> = Result<T, Box<dyn std::error::Error>>;

const VERSION: u32 = vk::API_VERSION_1_3;

/// This program's device.
pub struct Gpu {
    entry: ash::Entry,
    instance: ash::Instance,
    messenger: Option<vk::DebugUtilsMessengerEXT>,
    messages: Box<Mutex<usize>>,
    physical: vk::PhysicalDevice,
    pub device: ash::Device,
    family: u32,
    queue: Arc<Mutex<vk::Queue>>,
    /// One allocator for this program's memory and twobounce's.
    allocator: Arc<Mutex<Allocator>>,
    instance_extensions: Vec<&'static CStr>,
    device_extensions: Vec<&'static CStr>,
}

impl Gpu {
    pub unsafe fn new(validate: bool) -> Anything<Self> {
        unsafe {
            let entry = ash::Entry::load()?;
            let application = vk::ApplicationInfo::default().application_name(c"host").api_version(VERSION);
            let (mut layers, mut instance_extensions) = (vec![], vec![]);
            if validate {
                layers.push(c"VK_LAYER_KHRONOS_validation".as_ptr());
                instance_extensions.extend([ash::ext::debug_utils::NAME, ash::ext::validation_features::NAME]);
            }
            let names: Vec<_> = instance_extensions.iter().map(|name| name.as_ptr()).collect();
            let synchronisation = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
            let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&synchronisation);
            let info = vk::InstanceCreateInfo::default()
                .application_info(&application)
                .enabled_layer_names(&layers)
                .enabled_extension_names(&names);
            let info = if validate { info.push_next(&mut features) } else { info };
            let instance = entry.create_instance(&info, None)?;
            let messages = Box::new(Mutex::new(0));
            let messenger = if validate { Some(listen(&entry, &instance, &messages)?) } else { None };

            let all = instance.enumerate_physical_devices()?;
            let fits = |physical: &vk::PhysicalDevice| missing(&instance, VERSION, *physical).is_empty();
            let physical = all.into_iter().find(fits).ok_or("no device has what twobounce needs")?;
            let families = instance.get_physical_device_queue_family_properties(physical);
            let both = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
            let family = families.iter().position(|family| family.queue_flags.contains(both)).ok_or("no queue")? as u32;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let device_extensions = required_extensions(VERSION); // and this program's own
            let names: Vec<_> = device_extensions.iter().map(|name| name.as_ptr()).collect();
            let mut features = required_features().structs(); // and this program's own
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
            let device = instance.create_device(physical, &features.chain(info), None)?;
            let queue = Arc::new(Mutex::new(device.get_device_queue(family, 0)));
            let allocator = Arc::new(Mutex::new(Allocator::new(&AllocatorCreateDesc {
                instance: instance.clone(),
                device: device.clone(),
                physical_device: physical,
                debug_settings: Default::default(),
                buffer_device_address: false,
                allocation_sizes: Default::default(),
            })?));
            Ok(Self {
                entry,
                instance,
                messenger,
                messages,
                physical,
                device,
                family,
                queue,
                allocator,
                instance_extensions,
                device_extensions,
            })
        }
    }

    /// The Vulkan objects that this program lends to twobounce, and the enabled features and extensions.
    pub fn lent(&self) -> HostDevice<'_> {
        HostDevice {
            instance: self.instance.clone(),
            api_version: VERSION,
            physical_device: self.physical,
            device: self.device.clone(),
            queue_family: self.family,
            queue: Some(self.queue.clone()),
            allocator: Some(self.allocator.clone()),
            pipeline_cache: None,
            instance_extensions: &self.instance_extensions,
            device_extensions: &self.device_extensions,
            features: required_features(),
        }
    }

    /// Memory of this program, from the shared allocator.
    pub fn memory(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
    ) -> Anything<Allocation> {
        let linear = location != MemoryLocation::GpuOnly;
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let desc = AllocationCreateDesc { name, requirements, location, linear, allocation_scheme };
        Ok(self.allocator.lock().expect("no panic").allocate(&desc)?)
    }

    /// An image of one level, with its memory.
    pub unsafe fn image(
        &self,
        format: vk::Format,
        (width, height): (u32, u32),
        usage: vk::ImageUsageFlags,
    ) -> Anything<(vk::Image, Allocation)> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width, height, depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        unsafe {
            let image = self.device.create_image(&info, None)?;
            let needs = self.device.get_image_memory_requirements(image);
            let memory = self.memory("image", needs, MemoryLocation::GpuOnly)?;
            self.device.bind_image_memory(image, memory.memory(), memory.offset())?;
            Ok((image, memory))
        }
    }

    /// A buffer with its memory.
    pub unsafe fn buffer(
        &self,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Anything<(vk::Buffer, Allocation)> {
        unsafe {
            let buffer = self.device.create_buffer(&vk::BufferCreateInfo::default().size(bytes).usage(usage), None)?;
            let needs = self.device.get_buffer_memory_requirements(buffer);
            let memory = self.memory("buffer", needs, location)?;
            self.device.bind_buffer_memory(buffer, memory.memory(), memory.offset())?;
            Ok((buffer, memory))
        }
    }

    /// Copies images of that size, in layout `TRANSFER_SRC_OPTIMAL`, one after another into a buffer that the CPU
    /// reads.
    pub unsafe fn copy_to_cpu(
        &self,
        commands: vk::CommandBuffer,
        images: &[vk::Image],
        (width, height): (u32, u32),
        buffer: vk::Buffer,
    ) {
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let extent = vk::Extent3D { width, height, depth: 1 };
        let region = vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent);
        let to_cpu = [vk::MemoryBarrier2::default()
            .src_stage_mask(vk::PipelineStageFlags2::COPY)
            .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
            .dst_stage_mask(vk::PipelineStageFlags2::HOST)
            .dst_access_mask(vk::AccessFlags2::HOST_READ)];
        let (barrier, layout) =
            (vk::DependencyInfo::default().memory_barriers(&to_cpu), vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
        unsafe {
            for (i, image) in (0..).zip(images) {
                let region = [region.buffer_offset(i * image_bytes((width, height)))];
                self.device.cmd_copy_image_to_buffer(commands, *image, layout, buffer, &region);
            }
            self.device.cmd_pipeline_barrier2(commands, &barrier);
        }
    }

    pub fn free(&self, memory: Allocation) {
        self.allocator.lock().expect("no panic").free(memory).expect("this program's memory");
    }

    /// Returns the number of the validation layer's messages.
    pub unsafe fn close(self) -> usize {
        unsafe {
            let _ = self.device.device_wait_idle();
            drop(self.allocator);
            self.device.destroy_device(None);
            if let Some(messenger) = self.messenger {
                let debug = ash::ext::debug_utils::Instance::new(&self.entry, &self.instance);
                debug.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
            *self.messages.lock().expect("no panic")
        }
    }
}

/// Bytes of an image that the CPU reads: four floats a pixel.
pub fn image_bytes((width, height): (u32, u32)) -> u64 {
    u64::from(width) * u64::from(height) * 16
}

/// Linear radiance, rows from the top: the sum of `images` images that [`Gpu::copy_to_cpu`] copied, when the device is
/// idle.
pub fn radiance(memory: &Allocation, images: usize, size: (u32, u32)) -> Vec<[f32; 3]> {
    let (bytes, each) = (memory.mapped_slice().expect("memory for the CPU"), image_bytes(size) as usize);
    let number = |at: usize| f32::from_ne_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let sum = |at: usize| (0..images).map(|i| number(i * each + at)).sum();
    (0..each / 16).map(|pixel| [0, 4, 8].map(|channel| sum(16 * pixel + channel))).collect()
}

/// One of the frames in flight.
pub struct Frame {
    pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    /// Signalled for the CPU.
    fence: vk::Fence,
    /// Signalled for the next frame.
    pub done: vk::Semaphore,
}

impl Frame {
    pub unsafe fn new(gpu: &Gpu) -> Anything<Self> {
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.family);
            let pool = gpu.device.create_command_pool(&info, None)?;
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = gpu.device.allocate_command_buffers(&info)?[0];
            let signaled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
            let fence = gpu.device.create_fence(&signaled, None)?;
            let done = gpu.device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?;
            Ok(Self { pool, commands, fence, done })
        }
    }

    /// Waits until the device has finished the last submission, if there is one.
    pub unsafe fn wait(&self, gpu: &Gpu) -> Anything<()> {
        Ok(unsafe { gpu.device.wait_for_fences(&[self.fence], true, u64::MAX) }?)
    }

    pub unsafe fn begin(&self, gpu: &Gpu) -> Anything<()> {
        unsafe {
            gpu.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())?;
            Ok(gpu.device.begin_command_buffer(self.commands, &vk::CommandBufferBeginInfo::default())?)
        }
    }

    pub unsafe fn submit(&self, gpu: &Gpu, before: Option<vk::Semaphore>) -> Anything<()> {
        let commands = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let semaphore = |semaphore| {
            vk::SemaphoreSubmitInfo::default().semaphore(semaphore).stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
        };
        let (waits, signals) = (before.map(semaphore), [semaphore(self.done)]);
        let info = [vk::SubmitInfo2::default()
            .wait_semaphore_infos(waits.as_slice())
            .command_buffer_infos(&commands)
            .signal_semaphore_infos(&signals)];
        unsafe {
            gpu.device.end_command_buffer(self.commands)?;
            gpu.device.reset_fences(&[self.fence])?;
            let queue = gpu.queue.lock().expect("no panic"); // twobounce locks it for its uploads
            Ok(gpu.device.queue_submit2(*queue, &info, self.fence)?)
        }
    }

    pub unsafe fn destroy(self, gpu: &Gpu) {
        unsafe {
            gpu.device.destroy_semaphore(self.done, None);
            gpu.device.destroy_fence(self.fence, None);
            gpu.device.destroy_command_pool(self.pool, None);
        }
    }
}

unsafe fn listen(
    entry: &ash::Entry,
    instance: &ash::Instance,
    messages: &Mutex<usize>,
) -> Anything<vk::DebugUtilsMessengerEXT> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast());
    Ok(unsafe { ash::ext::debug_utils::Instance::new(entry, instance).create_debug_utils_messenger(&info, None) }?)
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    count: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and `count` is the pointer that the messenger was made with.
    let (text, count) = unsafe { ((*data).message_as_c_str(), &*count.cast::<Mutex<usize>>()) };
    eprintln!("{}", text.unwrap_or_default().to_string_lossy());
    *count.lock().expect("no panic") += 1;
    vk::FALSE
}
