//! Features and extensions of Vulkan that passes need: named, compared, and in the form that device creation takes.

use super::requirements::REQUIREMENTS;
use ash::vk;
use std::ffi::CStr;

/// The features that are ever asked for, by the names of the Vulkan specification.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Features {
    pub geometry_shader: bool,
    pub vertex_pipeline_stores_and_atomics: bool,
    pub fragment_stores_and_atomics: bool,
    pub shader_output_layer: bool,
    pub scalar_block_layout: bool,
    pub dynamic_rendering: bool,
    pub synchronization2: bool,
}

/// What passes need of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Requirements {
    /// With those of [`Features::RECORDER`], which are needed in any case.
    pub features: Features,
    /// Least `maxColorAttachments`.
    pub color_attachments: u32,
    /// Least `maxFramebufferLayers`.
    pub framebuffer_layers: u32,
}

impl Features {
    /// What every recording needs, whatever the passes are.
    #[cfg_attr(not(internals), doc(hidden))]
    pub const RECORDER: Self = Self {
        geometry_shader: false,
        vertex_pipeline_stores_and_atomics: false,
        fragment_stores_and_atomics: false,
        shader_output_layer: false,
        scalar_block_layout: false,
        dynamic_rendering: true,
        synchronization2: true,
    };

    /// The features that these structures hold. A host that enables dynamic rendering and synchronisation by the
    /// structures of their extensions sets those two fields itself.
    pub fn of(
        core: &vk::PhysicalDeviceFeatures,
        vulkan12: &vk::PhysicalDeviceVulkan12Features<'_>,
        vulkan13: &vk::PhysicalDeviceVulkan13Features<'_>,
    ) -> Self {
        Self {
            geometry_shader: core.geometry_shader == vk::TRUE,
            vertex_pipeline_stores_and_atomics: core.vertex_pipeline_stores_and_atomics == vk::TRUE,
            fragment_stores_and_atomics: core.fragment_stores_and_atomics == vk::TRUE,
            shader_output_layer: vulkan12.shader_output_layer == vk::TRUE,
            scalar_block_layout: vulkan12.scalar_block_layout == vk::TRUE,
            dynamic_rendering: vulkan13.dynamic_rendering == vk::TRUE,
            synchronization2: vulkan13.synchronization2 == vk::TRUE,
        }
    }

    /// The structures that enable these features.
    pub fn structs(&self) -> FeatureStructs {
        FeatureStructs {
            core: vk::PhysicalDeviceFeatures::default()
                .geometry_shader(self.geometry_shader)
                .vertex_pipeline_stores_and_atomics(self.vertex_pipeline_stores_and_atomics)
                .fragment_stores_and_atomics(self.fragment_stores_and_atomics),
            vulkan12: vk::PhysicalDeviceVulkan12Features::default()
                .shader_output_layer(self.shader_output_layer)
                .scalar_block_layout(self.scalar_block_layout),
            dynamic_rendering: vk::PhysicalDeviceDynamicRenderingFeatures::default()
                .dynamic_rendering(self.dynamic_rendering),
            synchronization2: vk::PhysicalDeviceSynchronization2Features::default()
                .synchronization2(self.synchronization2),
        }
    }

    /// Each feature's name, and whether it is among these.
    pub(in crate::vk) fn list(&self) -> [(&'static str, bool); 7] {
        [
            ("geometryShader", self.geometry_shader),
            ("vertexPipelineStoresAndAtomics", self.vertex_pipeline_stores_and_atomics),
            ("fragmentStoresAndAtomics", self.fragment_stores_and_atomics),
            ("shaderOutputLayer", self.shader_output_layer),
            ("scalarBlockLayout", self.scalar_block_layout),
            ("dynamicRendering", self.dynamic_rendering),
            ("synchronization2", self.synchronization2),
        ]
    }

    /// The names of those that `wanted` has, and whether they are among these.
    pub(in crate::vk) fn hold(&self, wanted: &Self) -> impl Iterator<Item = (&'static str, bool)> {
        self.list().into_iter().zip(wanted.list()).filter(|(_, (_, wanted))| *wanted).map(|(own, _)| own)
    }
}

impl Requirements {
    /// All features that are needed.
    pub(in crate::vk) fn all_features(&self) -> Features {
        Features { dynamic_rendering: true, synchronization2: true, ..self.features }
    }
}

/// Features as device creation takes them. A host may set further fields before it chains them, and takes the values
/// over into its own structures where those exclude one of these (`VkPhysicalDeviceVulkan13Features` excludes two).
#[derive(Clone, Copy, Debug, Default)]
pub struct FeatureStructs {
    pub core: vk::PhysicalDeviceFeatures,
    pub vulkan12: vk::PhysicalDeviceVulkan12Features<'static>,
    pub dynamic_rendering: vk::PhysicalDeviceDynamicRenderingFeatures<'static>,
    pub synchronization2: vk::PhysicalDeviceSynchronization2Features<'static>,
}

impl FeatureStructs {
    /// `info` with all of these.
    pub fn chain<'a>(&'a mut self, info: vk::DeviceCreateInfo<'a>) -> vk::DeviceCreateInfo<'a> {
        info.enabled_features(&self.core)
            .push_next(&mut self.vulkan12)
            .push_next(&mut self.dynamic_rendering)
            .push_next(&mut self.synchronization2)
    }
}

/// Every feature that a device must have enabled to be used by twobounce.
pub fn required_features() -> Features {
    REQUIREMENTS.all_features()
}

/// Every device extension that must be enabled on a device of that Vulkan version: the lower one of the device's and of
/// what the instance was made with.
pub fn required_extensions(api_version: u32) -> Vec<&'static CStr> {
    let mut names = vec![ash::khr::push_descriptor::NAME];
    if api_version < vk::API_VERSION_1_3 {
        names.extend([ash::khr::dynamic_rendering::NAME, ash::khr::synchronization2::NAME]);
    }
    names
}
