//! A device described by documents, so that requirements can be checked for devices that are not present.

use super::features::Features;
use super::instance::DeviceReport;
use super::needs::Capabilities;
use crate::{Error, Result};
use ash::vk;
use serde::Deserialize;
use std::collections::BTreeMap;

/// A device described by documents. Limits that they omit are the minimum that Vulkan allows.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Described {
    pub name: String,
    pub driver: String,
    /// The source of the numbers.
    pub source: String,
    /// The major and the minor version.
    pub vulkan: (u32, u32),
    /// Whether a queue supports graphics, compute and timestamps.
    pub timestamps: bool,
    /// Whether R32_UINT images of 4 samples can be drawn into and sampled.
    pub integer_samples: bool,
    /// GiB of memory, which no driver determines: those of a usual machine.
    pub memory_gib: u64,
    /// Supported features by the specification's names, of those that the program may need.
    pub features: Vec<String>,
    pub extensions: Vec<String>,
    /// Limits by the specification's names.
    pub limits: BTreeMap<String, u32>,
}

impl Described {
    /// The report of `twobounce info` for the device.
    ///
    /// # Errors
    /// A sentence about a feature or a limit that is never needed or is misspelled.
    pub fn report(&self) -> Result<DeviceReport> {
        let unknown =
            |name: &str| Error::Usage(format!("{}: nothing asks a device for {name}: leave it out", self.name));
        let known = |name: &String| Features::default().list().any(|(known, _)| known == name);
        if let Some(name) = self.features.iter().find(|name| !known(name)) {
            return Err(unknown(name));
        }
        let mut limits = least();
        for (name, value) in &self.limits {
            *limit(&mut limits, name).ok_or_else(|| unknown(name))? = *value;
        }
        let version = vk::make_api_version(0, self.vulkan.0, self.vulkan.1, 0);
        let mut memory = vk::PhysicalDeviceMemoryProperties { memory_heap_count: 1, ..Default::default() };
        memory.memory_heaps[0] =
            vk::MemoryHeap { size: self.memory_gib << 30, flags: vk::MemoryHeapFlags::DEVICE_LOCAL };
        let integer_samples = if self.integer_samples { vk::SampleCountFlags::TYPE_4 } else { Default::default() };
        let capabilities = Capabilities {
            properties: vk::PhysicalDeviceProperties { api_version: version, limits, ..Default::default() },
            driver: self.driver.clone(),
            loses_descriptors: false,
            // The number that the extension guarantees.
            max_push_descriptors: 32,
            max_allocation_bytes: 1 << 30,
            integer_samples,
            memory,
            queue_family: self.timestamps.then_some(0),
            extensions: self.extensions.iter().cloned().collect(),
            features: Features::named(&self.features),
            describes_executables: false,
            scratch_alignment: 1,
            version,
        };
        Ok(DeviceReport { name: self.name.clone(), ..capabilities.report() })
    }
}

/// The required limits of the Vulkan specification, of those that are checked.
fn least() -> vk::PhysicalDeviceLimits {
    vk::PhysicalDeviceLimits {
        max_image_dimension2_d: 4096,
        max_image_dimension3_d: 256,
        max_image_array_layers: 256,
        max_storage_buffer_range: 1 << 27,
        max_per_stage_descriptor_storage_buffers: 4,
        max_per_stage_descriptor_storage_images: 4,
        max_fragment_combined_output_resources: 4,
        max_framebuffer_layers: 256,
        max_color_attachments: 4,
        ..Default::default()
    }
}

/// The limit with that name.
fn limit<'a>(limits: &'a mut vk::PhysicalDeviceLimits, name: &str) -> Option<&'a mut u32> {
    Some(match name {
        "maxImageDimension2D" => &mut limits.max_image_dimension2_d,
        "maxImageDimension3D" => &mut limits.max_image_dimension3_d,
        "maxImageArrayLayers" => &mut limits.max_image_array_layers,
        "maxStorageBufferRange" => &mut limits.max_storage_buffer_range,
        "maxPerStageDescriptorStorageBuffers" => &mut limits.max_per_stage_descriptor_storage_buffers,
        "maxPerStageDescriptorStorageImages" => &mut limits.max_per_stage_descriptor_storage_images,
        "maxFragmentCombinedOutputResources" => &mut limits.max_fragment_combined_output_resources,
        "maxFramebufferLayers" => &mut limits.max_framebuffer_layers,
        "maxColorAttachments" => &mut limits.max_color_attachments,
        _ => return None,
    })
}
