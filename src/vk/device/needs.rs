//! Requirements on a device, and whether it meets them. One list serves the choice of a device, the error that refuses
//! one, and `info`.

use super::features::{
    COLOR_ATTACHMENTS, FRAMEBUFFER_LAYERS, Features, ray_query_extensions, required_extensions, required_features,
};
use super::instance::{DeviceKind, DeviceReport, version_of};
use ash::vk;
use std::collections::BTreeSet;
use std::ffi::CStr;

/// A requirement, and whether the device meets it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Need {
    /// The name in the Vulkan specification, with the minimum value of a limit.
    pub name: String,
    pub present: bool,
}

/// Extensions and features of one physical device, queried once.
pub(in crate::vk) struct Capabilities {
    pub(in crate::vk) properties: vk::PhysicalDeviceProperties,
    pub(in crate::vk) driver: String,
    /// Whether the driver loses descriptors in loops: see `src/vk/pipeline/early.rs`.
    pub(in crate::vk) loses_descriptors: bool,
    pub(in crate::vk) max_push_descriptors: u32,
    pub(in crate::vk) max_allocation_bytes: u64,
    /// Sample counts of integer images that are drawn into and then read.
    pub(in crate::vk) integer_samples: vk::SampleCountFlags,
    pub(in crate::vk) memory: vk::PhysicalDeviceMemoryProperties,
    /// A queue family with graphics, compute and timestamps.
    pub(in crate::vk) queue_family: Option<u32>,
    pub(in crate::vk) extensions: BTreeSet<String>,
    pub(in crate::vk) features: Features,
    /// Whether `VK_KHR_pipeline_executable_properties` and its feature are supported.
    pub(in crate::vk) describes_executables: bool,
    /// Alignment of the memory for building acceleration structures, if the device supports them.
    pub(in crate::vk) scratch_alignment: u64,
    /// The lower one of the device's version and that of the instance.
    pub(in crate::vk) version: u32,
}

impl Capabilities {
    /// Queries all properties of `physical`; `instance_version` is that of the instance. For a device older than Vulkan
    /// 1.2 only its properties are filled in.
    pub(in crate::vk) fn query(instance: &ash::Instance, instance_version: u32, physical: vk::PhysicalDevice) -> Self {
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
        let queue_family = queues.iter().position(serves).map(|index| index as u32);
        let mut this = Self {
            properties,
            driver: String::from("unknown"),
            loses_descriptors: false,
            max_push_descriptors: 0,
            max_allocation_bytes: u64::MAX,
            integer_samples: vk::SampleCountFlags::empty(),
            memory,
            queue_family,
            extensions,
            features: Features::default(),
            describes_executables: false,
            scratch_alignment: 1,
            version: properties.api_version.min(instance_version),
        };
        if this.version >= vk::API_VERSION_1_2 {
            this.query_1_2(instance, physical);
        }
        this
    }

    fn query_1_2(&mut self, instance: &ash::Instance, physical: vk::PhysicalDevice) {
        let mut push = vk::PhysicalDevicePushDescriptorPropertiesKHR::default();
        let mut maintenance = vk::PhysicalDeviceMaintenance3Properties::default();
        let mut driver = vk::PhysicalDeviceDriverProperties::default();
        let mut properties =
            vk::PhysicalDeviceProperties2::default().push_next(&mut driver).push_next(&mut maintenance);
        if self.has_extension(ash::khr::push_descriptor::NAME) {
            properties = properties.push_next(&mut push);
        }
        let mut structures = vk::PhysicalDeviceAccelerationStructurePropertiesKHR::default();
        let traces = ray_query_extensions().into_iter().all(|name| self.has_extension(name));
        if traces {
            properties = properties.push_next(&mut structures);
        }
        // SAFETY: every structure in the chain belongs to Vulkan 1.2 or to an extension that the device has.
        unsafe { instance.get_physical_device_properties2(physical, &mut properties) };

        let mut vulkan12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
        let mut sync2 = vk::PhysicalDeviceSynchronization2Features::default();
        let mut executables = vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut vulkan12);
        if self.has_extension(ash::khr::pipeline_executable_properties::NAME) {
            features = features.push_next(&mut executables);
        }
        if self.is_1_3() || self.has_extension(ash::khr::dynamic_rendering::NAME) {
            features = features.push_next(&mut rendering);
        }
        if self.is_1_3() || self.has_extension(ash::khr::synchronization2::NAME) {
            features = features.push_next(&mut sync2);
        }
        let mut structure = vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default();
        let mut query = vk::PhysicalDeviceRayQueryFeaturesKHR::default();
        if traces {
            features = features.push_next(&mut structure).push_next(&mut query);
        }
        // SAFETY: as above.
        unsafe { instance.get_physical_device_features2(physical, &mut features) };
        let core = features.features;
        self.features = Features {
            dynamic_rendering: rendering.dynamic_rendering == vk::TRUE,
            synchronization2: sync2.synchronization2 == vk::TRUE,
            acceleration_structure: structure.acceleration_structure == vk::TRUE,
            ray_query: query.ray_query == vk::TRUE,
            ..Features::of_structs(&core, &vulkan12, &vk::PhysicalDeviceVulkan13Features::default())
        };
        self.describes_executables = executables.pipeline_executable_info == vk::TRUE;
        self.scratch_alignment = u64::from(structures.min_acceleration_structure_scratch_offset_alignment.max(1));
        self.max_push_descriptors = push.max_push_descriptors;
        self.max_allocation_bytes = maintenance.max_memory_allocation_size;
        let (seen, usage) =
            (vk::Format::R32_UINT, vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::SAMPLED);
        let (dim, tiling, flags) = (vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL, vk::ImageCreateFlags::empty());
        // SAFETY: as above.
        let images =
            unsafe { instance.get_physical_device_image_format_properties(physical, seen, dim, tiling, usage, flags) };
        self.integer_samples = images.map(|images| images.sample_counts).unwrap_or_default();
        let text = |chars: Option<&CStr>| chars.map(|c| c.to_string_lossy().into_owned()).unwrap_or_default();
        let name = text(driver.driver_name_as_c_str().ok());
        self.loses_descriptors = driver.driver_id == vk::DriverId::MESA_LLVMPIPE
            && self.properties.driver_version >= vk::make_api_version(0, 25, 1, 0);
        self.driver = format!("{name} {}", text(driver.driver_info_as_c_str().ok())).trim().to_owned();
    }

    pub(in crate::vk) fn is_1_3(&self) -> bool {
        self.version >= vk::API_VERSION_1_3
    }

    pub(in crate::vk) fn has_extension(&self, name: &CStr) -> bool {
        name.to_str().is_ok_and(|name| self.extensions.contains(name))
    }

    pub(in crate::vk) fn name(&self) -> String {
        self.properties.device_name_as_c_str().unwrap_or(c"unnamed device").to_string_lossy().into_owned()
    }

    /// All requirements, met or not.
    pub(in crate::vk) fn needs(&self) -> Vec<Need> {
        let limits = &self.properties.limits;
        let need = |name: &str, present: bool| Need { name: name.to_owned(), present };
        let least = |name: &str, least: u32, has: u32| need(&format!("{name} {least}"), has >= least);
        let mut needs = vec![
            need("Vulkan 1.2", self.version >= vk::API_VERSION_1_2),
            need("a queue with graphics, compute and timestamps", self.queue_family.is_some()),
        ];
        needs.extend(self.features.required().map(|(name, present)| need(name, present)));
        needs.extend([
            need("VK_KHR_push_descriptor", self.has_extension(ash::khr::push_descriptor::NAME)),
            least("maxColorAttachments", COLOR_ATTACHMENTS, limits.max_color_attachments),
            least("maxFramebufferLayers", FRAMEBUFFER_LAYERS, limits.max_framebuffer_layers),
            need(
                "R32_UINT images of 4 samples that are drawn into and sampled",
                self.integer_samples.contains(vk::SampleCountFlags::TYPE_4),
            ),
        ]);
        needs
    }

    /// Features and extensions that single settings need, present or not.
    pub(in crate::vk) fn wishes(&self) -> Vec<Need> {
        let extension = ash::ext::conservative_rasterization::NAME;
        let name = extension.to_string_lossy().into_owned();
        vec![
            Need { name: "geometryShader".into(), present: self.features.geometry_shader },
            Need { name, present: self.has_extension(extension) },
            Need { name: "VK_KHR_ray_query".into(), present: self.features.has_queries() },
        ]
    }

    /// The part of the report that needs no further queries.
    pub(in crate::vk) fn report(&self) -> DeviceReport {
        let heaps = self.memory.memory_heaps_as_slice().iter();
        DeviceReport {
            name: self.name(),
            kind: DeviceKind::of_type(self.properties.device_type),
            api_version: version_of(&self.properties),
            driver: self.driver.clone(),
            needs: self.needs(),
            wishes: self.wishes(),
            limits: self.properties.limits,
            max_allocation_bytes: self.max_allocation_bytes,
            max_push_descriptors: self.max_push_descriptors,
            heaps: heaps.map(|heap| (heap.size, heap.flags.contains(vk::MemoryHeapFlags::DEVICE_LOCAL))).collect(),
            budgets: None,
            color_samples: vec![],
            depth_samples: vec![],
        }
    }

    /// The features to enable: all required ones, and the present ones among the others.
    pub(in crate::vk) fn enabled_features(&self) -> Features {
        let Features { geometry_shader, robust_buffer_access, .. } = self.features;
        let on = self.features.has_queries();
        let queries =
            Features { buffer_device_address: on, acceleration_structure: on, ray_query: on, ..required_features() };
        Features { geometry_shader, robust_buffer_access, ..queries }
    }

    /// The names of missing requirements for a message; empty if there are none.
    pub(in crate::vk) fn missing(&self) -> Vec<String> {
        self.needs().into_iter().filter(|need| !need.present).map(|need| need.name).collect()
    }

    /// Device extensions to enable: required ones that are not core, and optional ones that are present. Devices over
    /// Metal support the last one to state that they omit parts of Vulkan, and require it to be enabled.
    pub(in crate::vk) fn enabled_extensions(&self) -> Vec<&'static CStr> {
        let optional = [
            ash::ext::memory_budget::NAME,
            ash::ext::conservative_rasterization::NAME,
            ash::khr::portability_subset::NAME,
        ];
        let present = optional.into_iter().filter(|name| self.has_extension(name));
        let queries = ray_query_extensions().into_iter().filter(|_| self.features.has_queries());
        required_extensions(self.version).into_iter().chain(present).chain(queries).collect()
    }
}

/// Whether a queue family supports everything that is recorded.
pub(in crate::vk) fn serves(family: &vk::QueueFamilyProperties) -> bool {
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    family.queue_flags.contains(wanted) && family.timestamp_valid_bits > 0
}
