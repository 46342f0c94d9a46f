//! A host with a Vulkan device of its own, under validation and synchronisation validation.
#![allow(dead_code)]

pub mod images;
pub mod prepared;

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};
use twobounce::vk::ash::{self, vk};
use twobounce::vk::gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use twobounce::vk::{Context, Features, HostDevice, required_extensions, required_features};

const INSTANCE_EXTENSIONS: [&CStr; 2] = [ash::ext::debug_utils::NAME, ash::ext::validation_features::NAME];

pub struct Host {
    pub device: ash::Device,
    pub queue: Arc<Mutex<vk::Queue>>,
    pub family: u32,
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    pub pipeline_cache: vk::PipelineCache,
    version: u32,
    features: Features,
    physical: vk::PhysicalDevice,
    instance: ash::Instance,
    messenger: vk::DebugUtilsMessengerEXT,
    messages: Box<Mutex<Vec<String>>>,
    /// Dropped last, because the functions come from its library.
    entry: ash::Entry,
}

impl Host {
    pub fn new() -> Self {
        Self::of_version(vk::API_VERSION_1_3)
    }

    /// As [`Self::new`], with an instance of this version.
    pub fn of_version(version: u32) -> Self {
        Self::with(version, required_features())
    }

    /// As [`Self::new`], with a device of these features.
    pub fn enabling(features: Features) -> Self {
        Self::with(vk::API_VERSION_1_3, features)
    }

    fn with(version: u32, features: Features) -> Self {
        unsafe {
            let entry = ash::Entry::load().expect("a Vulkan loader");
            let instance = instance(&entry, version);
            let messages = Box::new(Mutex::new(Vec::new()));
            let messenger = listen(&entry, &instance, &messages);
            let physical = physical(&instance);
            let family = instance
                .get_physical_device_queue_family_properties(physical)
                .iter()
                .position(|f| f.queue_flags.contains(vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE))
                .expect("a queue family") as u32;
            let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(family).queue_priorities(&[1.0])];
            let extensions: Vec<_> = required_extensions(version).iter().map(|name| name.as_ptr()).collect();
            let mut structs = features.structs();
            let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&extensions);
            let device = instance.create_device(physical, &structs.chain(info), None).expect("a device");
            let queue = Arc::new(Mutex::new(device.get_device_queue(family, 0)));
            let allocator = Allocator::new(&AllocatorCreateDesc {
                instance: instance.clone(),
                device: device.clone(),
                physical_device: physical,
                debug_settings: Default::default(),
                buffer_device_address: false,
                allocation_sizes: Default::default(),
            });
            let allocator = Some(Arc::new(Mutex::new(allocator.expect("an allocator"))));
            let pipeline_cache = device.create_pipeline_cache(&Default::default(), None).expect("a cache");
            Self {
                device,
                queue,
                family,
                allocator,
                pipeline_cache,
                version,
                features,
                physical,
                instance,
                messenger,
                messages,
                entry,
            }
        }
    }

    /// A context over the host's objects; `change` leaves some of them out.
    pub fn adopt(&self, change: impl FnOnce(&mut HostDevice<'_>)) -> twobounce::Result<Arc<Context>> {
        let extensions = required_extensions(self.version);
        let mut host = HostDevice {
            instance: self.instance.clone(),
            api_version: self.version,
            physical_device: self.physical,
            device: self.device.clone(),
            queue_family: self.family,
            queue: Some(self.queue.clone()),
            allocator: self.allocator.clone(),
            pipeline_cache: Some(self.pipeline_cache),
            instance_extensions: &INSTANCE_EXTENSIONS,
            device_extensions: &extensions,
            features: self.features,
        };
        change(&mut host);
        // SAFETY: `device` enables all that is required; the test drops the context first.
        unsafe { Context::adopt(host) }
    }

    /// Names of the requirements that its device lacks.
    pub fn missing(&self) -> Vec<String> {
        self.missing_with(self.version)
    }

    /// As [`Self::missing`], for an instance of this version.
    pub fn missing_with(&self, version: u32) -> Vec<String> {
        // SAFETY: the handle comes from this instance.
        unsafe { twobounce::vk::missing(&self.instance, version, self.physical) }
    }

    pub fn memory_types(&self) -> Vec<vk::MemoryType> {
        let memory = unsafe { self.instance.get_physical_device_memory_properties(self.physical) };
        memory.memory_types_as_slice().to_vec()
    }

    /// Messages of the validation layer since the last call.
    pub fn take_messages(&self) -> Vec<String> {
        std::mem::take(&mut *self.messages.lock().unwrap())
    }

    /// Destroys everything; any message of the validation layer until then fails, for example about an object that
    /// still exists.
    pub fn close(mut self) {
        unsafe {
            self.device.destroy_pipeline_cache(self.pipeline_cache, None);
            let allocator = Arc::into_inner(self.allocator.take().expect("taken here only"));
            drop(allocator.expect("no context is left"));
            self.device.destroy_device(None);
            ash::ext::debug_utils::Instance::new(&self.entry, &self.instance)
                .destroy_debug_utils_messenger(self.messenger, None);
            self.instance.destroy_instance(None);
        }
        let messages = self.messages.lock().unwrap();
        assert!(messages.is_empty(), "the validation layer says:\n{}", messages.join("\n"));
    }
}

unsafe fn instance(entry: &ash::Entry, version: u32) -> ash::Instance {
    let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
    let extensions = INSTANCE_EXTENSIONS.map(CStr::as_ptr);
    let application = vk::ApplicationInfo::default().api_version(version);
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions)
        .push_next(&mut features);
    unsafe { entry.create_instance(&info, None) }.expect("an instance with the validation layer")
}

/// The device that a context would choose: the variable `TWOBOUNCE_DEVICE`, else the first device.
unsafe fn physical(instance: &ash::Instance) -> vk::PhysicalDevice {
    let all = unsafe { instance.enumerate_physical_devices() }.expect("devices");
    let wanted = std::env::var("TWOBOUNCE_DEVICE").unwrap_or_default();
    let named = |physical: &&vk::PhysicalDevice| {
        let properties = unsafe { instance.get_physical_device_properties(**physical) };
        !wanted.is_empty() && properties.device_name_as_c_str().unwrap().to_string_lossy().contains(&wanted)
    };
    *all.iter().find(named).unwrap_or(&all[0])
}

unsafe fn listen(
    entry: &ash::Entry,
    instance: &ash::Instance,
    messages: &Mutex<Vec<String>>,
) -> vk::DebugUtilsMessengerEXT {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION)
        .pfn_user_callback(Some(on_message))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast());
    let debug = ash::ext::debug_utils::Instance::new(entry, instance);
    unsafe { debug.create_debug_utils_messenger(&info, None) }.expect("a messenger")
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    user: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data, and `user` is the list given at creation.
    let (text, messages) = unsafe { ((*data).message_as_c_str(), &*user.cast::<Mutex<Vec<String>>>()) };
    messages.lock().unwrap().push(text.unwrap_or_default().to_string_lossy().into_owned());
    vk::FALSE
}

/// One of a host's frames in flight.
pub struct HostFrame {
    device: ash::Device,
    pool: vk::CommandPool,
    pub commands: vk::CommandBuffer,
    fence: vk::Fence,
}

impl HostFrame {
    pub fn new(host: &Host) -> Self {
        let device = host.device.clone();
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(host.family);
        let fence = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
        unsafe {
            let pool = device.create_command_pool(&pool, None).expect("a pool");
            let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
            let commands = device.allocate_command_buffers(&info).expect("a command buffer")[0];
            let fence = device.create_fence(&fence, None).expect("a fence");
            Self { device, pool, commands, fence }
        }
    }

    /// Waits until the device has finished the last submission, if there is one.
    pub fn wait(&self) {
        unsafe { self.device.wait_for_fences(&[self.fence], true, u64::MAX) }.expect("a frame");
    }

    pub fn begin(&self) {
        unsafe {
            self.device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()).expect("a reset");
            self.device.begin_command_buffer(self.commands, &vk::CommandBufferBeginInfo::default()).expect("a start");
        }
    }

    pub fn submit(&self, host: &Host) {
        let commands = [self.commands];
        unsafe {
            self.device.end_command_buffer(self.commands).expect("an end");
            self.device.reset_fences(&[self.fence]).expect("a reset");
            let info = [vk::SubmitInfo::default().command_buffers(&commands)];
            self.device.queue_submit(*host.queue.lock().unwrap(), &info, self.fence).expect("a submission");
        }
    }
}

impl Drop for HostFrame {
    fn drop(&mut self) {
        self.wait();
        unsafe {
            self.device.destroy_fence(self.fence, None);
            self.device.destroy_command_pool(self.pool, None);
        }
    }
}
