//! What twobounce needs of a device. One list serves the choice of a device, the error that refuses one, and `info`.

use ash::vk;
use std::collections::BTreeSet;
use std::ffi::CStr;

/// The voxel shading pass writes six faces and the isotropic volume at once.
pub const NEEDED_COLOR_ATTACHMENTS: u32 = 7;
/// One layer per slice of the largest grid.
pub const NEEDED_FRAMEBUFFER_LAYERS: u32 = 256;

/// One thing that twobounce needs, and what the device has of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Need {
    /// The name that the Vulkan specification uses, with the least value where there is one.
    pub name: String,
    pub present: bool,
}

/// Extensions and features of one physical device, queried once.
pub(super) struct Capabilities {
    pub(super) properties: vk::PhysicalDeviceProperties,
    pub(super) driver: String,
    pub(super) pipeline_cache_uuid: [u8; 16],
    pub(super) max_push_descriptors: u32,
    pub(super) max_allocation_bytes: u64,
    pub(super) memory: vk::PhysicalDeviceMemoryProperties,
    /// Family with graphics, compute and timestamps.
    pub(super) queue_family: Option<u32>,
    pub(super) extensions: BTreeSet<String>,
    features: vk::PhysicalDeviceFeatures,
    shader_output_layer: bool,
    scalar_block_layout: bool,
    dynamic_rendering: bool,
    synchronization2: bool,
}

impl Capabilities {
    /// Asks `physical` for everything. A device older than Vulkan 1.2 has only its properties filled in.
    pub(super) fn query(instance: &ash::Instance, physical: vk::PhysicalDevice) -> Self {
        // SAFETY: the handle comes from this instance.
        let (properties, memory, queues, found) = unsafe {
            (
                instance.get_physical_device_properties(physical),
                instance.get_physical_device_memory_properties(physical),
                instance.get_physical_device_queue_family_properties(physical),
                instance.enumerate_device_extension_properties(physical).unwrap_or_default(),
            )
        };
        let extensions =
            found.iter().filter_map(|e| e.extension_name_as_c_str().ok()?.to_str().ok()).map(str::to_owned).collect();
        let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
        let queue_family = queues
            .iter()
            .position(|q| q.queue_flags.contains(wanted) && q.timestamp_valid_bits > 0)
            .map(|index| index as u32);
        let mut this = Self {
            properties,
            driver: String::from("unknown"),
            pipeline_cache_uuid: properties.pipeline_cache_uuid,
            max_push_descriptors: 0,
            max_allocation_bytes: u64::MAX,
            memory,
            queue_family,
            extensions,
            features: vk::PhysicalDeviceFeatures::default(),
            shader_output_layer: false,
            scalar_block_layout: false,
            dynamic_rendering: false,
            synchronization2: false,
        };
        if properties.api_version >= vk::API_VERSION_1_2 {
            this.query_1_2(instance, physical);
        }
        this
    }

    fn query_1_2(&mut self, instance: &ash::Instance, physical: vk::PhysicalDevice) {
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut push = vk::PhysicalDevicePushDescriptorPropertiesKHR::default();
        let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut properties =
            vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut maintenance);
        if self.has_extension(ash::khr::push_descriptor::NAME) {
            properties = properties.push_next(&mut push);
        }
        // SAFETY: every structure in the chain belongs to Vulkan 1.2 or to an extension that the device has.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };

        let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
        let mut sync2 = vk::PhysicalDeviceSynchronization2Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan12);
        if self.is_1_3() || self.has_extension(ash::khr::dynamic_rendering::NAME) {
            features = features.push_next(&mut rendering);
        }
        if self.is_1_3() || self.has_extension(ash::khr::synchronization2::NAME) {
            features = features.push_next(&mut sync2);
        }
        // SAFETY: as above.
        unsafe { instance.get_physical_device_features2(physical, &mut features) };
        self.features = features.features;
        self.shader_output_layer = vulkan12.shader_output_layer == vk::TRUE;
        self.scalar_block_layout = vulkan12.scalar_block_layout == vk::TRUE;
        self.dynamic_rendering = rendering.dynamic_rendering == vk::TRUE;
        self.synchronization2 = sync2.synchronization2 == vk::TRUE;
        self.max_push_descriptors = push.max_push_descriptors;
        self.max_allocation_bytes = maintenance.max_memory_allocation_size;
        let text = |chars: Option<&CStr>| chars.map(|c| c.to_string_lossy().into_owned()).unwrap_or_default();
        let name = text(driver.driver_name_as_c_str().ok());
        self.driver = format!("{name} {}", text(driver.driver_info_as_c_str().ok())).trim().to_owned();
    }

    pub(super) fn is_1_3(&self) -> bool {
        self.properties.api_version >= vk::API_VERSION_1_3
    }

    pub(super) fn has_extension(&self, name: &CStr) -> bool {
        name.to_str().is_ok_and(|name| self.extensions.contains(name))
    }

    pub(super) fn name(&self) -> String {
        self.properties.device_name_as_c_str().unwrap_or(c"unnamed device").to_string_lossy().into_owned()
    }

    /// Everything that twobounce needs, present or not.
    pub(super) fn needs(&self) -> Vec<Need> {
        let limits = &self.properties.limits;
        let features = &self.features;
        let need = |name: &str, present: bool| Need { name: name.to_owned(), present };
        vec![
            need("Vulkan 1.2", self.properties.api_version >= vk::API_VERSION_1_2),
            need("a queue with graphics, compute and timestamps", self.queue_family.is_some()),
            need("geometryShader", features.geometry_shader == vk::TRUE),
            need("vertexPipelineStoresAndAtomics", features.vertex_pipeline_stores_and_atomics == vk::TRUE),
            need("fragmentStoresAndAtomics", features.fragment_stores_and_atomics == vk::TRUE),
            need("shaderOutputLayer", self.shader_output_layer),
            need("scalarBlockLayout", self.scalar_block_layout),
            need("dynamicRendering", self.dynamic_rendering),
            need("synchronization2", self.synchronization2),
            need("VK_KHR_push_descriptor", self.has_extension(ash::khr::push_descriptor::NAME)),
            need(
                &format!("maxColorAttachments {NEEDED_COLOR_ATTACHMENTS}"),
                limits.max_color_attachments >= NEEDED_COLOR_ATTACHMENTS,
            ),
            need(
                &format!("maxFramebufferLayers {NEEDED_FRAMEBUFFER_LAYERS}"),
                limits.max_framebuffer_layers >= NEEDED_FRAMEBUFFER_LAYERS,
            ),
        ]
    }

    /// The names of what is missing, for a message; empty when the device will do.
    pub(super) fn missing(&self) -> Vec<String> {
        self.needs().into_iter().filter(|need| !need.present).map(|need| need.name).collect()
    }

    /// Device extensions to enable: what is needed and not core, and the memory budget where there is one.
    pub(super) fn enabled_extensions(&self) -> Vec<&'static CStr> {
        let mut names = vec![ash::khr::push_descriptor::NAME];
        if !self.is_1_3() {
            names.push(ash::khr::dynamic_rendering::NAME);
            names.push(ash::khr::synchronization2::NAME);
        }
        if self.has_extension(ash::ext::memory_budget::NAME) {
            names.push(ash::ext::memory_budget::NAME);
        }
        names
    }

    /// Vulkan 1.0 features to enable: exactly what is needed.
    pub(super) fn enabled_features() -> vk::PhysicalDeviceFeatures {
        vk::PhysicalDeviceFeatures::default()
            .geometry_shader(true)
            .vertex_pipeline_stores_and_atomics(true)
            .fragment_stores_and_atomics(true)
    }
}
