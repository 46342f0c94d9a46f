//! Vulkan features, extensions and limits that passes need: their names, and the structures for device creation.

use ash::vk;
use std::ffi::CStr;

/// The minimum `maxColorAttachments`: the voxel shading pass writes six faces and the isotropic volume at once.
pub(in crate::vk) const COLOR_ATTACHMENTS: u32 = 7;
/// The minimum `maxFramebufferLayers`: one layer per slice of the largest grid.
pub(in crate::vk) const FRAMEBUFFER_LAYERS: u32 = 256;

/// Declares the features that are needed, each with its name in the Vulkan specification.
macro_rules! features {
    ($($(#[$doc:meta])* $field:ident $name:literal),+ $(,)?) => {
        /// Features that settings may need, by the names of the Vulkan specification.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
        pub struct Features { $($(#[$doc])* pub $field: bool),+ }

        impl Features {
            /// The name of each feature, and whether it is set.
            pub(in crate::vk) fn list(self) -> impl Iterator<Item = (&'static str, bool)> {
                [$(($name, self.$field)),+].into_iter()
            }

            /// Features with these names.
            pub(in crate::vk) fn named(names: &[String]) -> Self {
                Self { $($field: names.iter().any(|name| name == $name)),+ }
            }
        }

        const ALL: Features = Features { $($field: true),+ };
    };
}

features! {
    /// Records and lists triangles as the talk does, if settings request that
    /// ([`Conservative`](crate::settings::Conservative)).
    geometry_shader "geometryShader",
    /// Bounds accesses: reads beyond a buffer's end return data of that buffer or 0, and writes there modify no other
    /// memory.
    robust_buffer_access "robustBufferAccess",
    /// Lets vertex and geometry shaders write triangles to lists.
    vertex_pipeline_stores_and_atomics "vertexPipelineStoresAndAtomics",
    /// Lets fragment shaders write to lists.
    fragment_stores_and_atomics "fragmentStoresAndAtomics",
    /// Lists each sample of a blended surface separately.
    sample_rate_shading "sampleRateShading",
    /// Draws volumes slice by slice.
    shader_output_layer "shaderOutputLayer",
    scalar_block_layout "scalarBlockLayout",
    /// Begins rendering scopes in every recording.
    dynamic_rendering "dynamicRendering",
    /// Records barriers in every recording.
    synchronization2 "synchronization2",
    /// Gives buffers addresses, from which acceleration structures are built.
    buffer_device_address "bufferDeviceAddress",
    /// Provides acceleration structures for [`ray_query`](Self::ray_query).
    acceleration_structure "accelerationStructure",
    /// Traces rays by the device's ray queries, if settings request or allow that
    /// ([`Tracer`](crate::settings::Tracer)).
    ray_query "rayQuery",
}

/// Every feature that must be enabled on a device; the other features serve single settings, or safety.
pub fn required_features() -> Features {
    Features { geometry_shader: false, robust_buffer_access: false, ..ALL.without_queries() }
}

impl Features {
    /// The required features, and whether each is set.
    pub(in crate::vk) fn required(self) -> impl Iterator<Item = (&'static str, bool)> {
        required_features().list().zip(self.list()).filter(|((_, required), _)| *required).map(|(_, own)| own)
    }

    /// Whether the features of ray queries are set. Devices have all or none of them.
    pub(in crate::vk) fn has_queries(self) -> bool {
        self.buffer_device_address && self.acceleration_structure && self.ray_query
    }

    pub(in crate::vk) fn without_queries(self) -> Self {
        Self { buffer_device_address: false, acceleration_structure: false, ray_query: false, ..self }
    }

    /// The features that these structures enable. A host that enables dynamic rendering, synchronisation, acceleration
    /// structures or ray queries by the structures of their extensions sets those fields itself.
    pub fn of_structs(
        core: &vk::PhysicalDeviceFeatures,
        vulkan12: &vk::PhysicalDeviceVulkan12Features<'_>,
        vulkan13: &vk::PhysicalDeviceVulkan13Features<'_>,
    ) -> Self {
        Self {
            geometry_shader: core.geometry_shader == vk::TRUE,
            robust_buffer_access: core.robust_buffer_access == vk::TRUE,
            vertex_pipeline_stores_and_atomics: core.vertex_pipeline_stores_and_atomics == vk::TRUE,
            fragment_stores_and_atomics: core.fragment_stores_and_atomics == vk::TRUE,
            sample_rate_shading: core.sample_rate_shading == vk::TRUE,
            shader_output_layer: vulkan12.shader_output_layer == vk::TRUE,
            scalar_block_layout: vulkan12.scalar_block_layout == vk::TRUE,
            dynamic_rendering: vulkan13.dynamic_rendering == vk::TRUE,
            synchronization2: vulkan13.synchronization2 == vk::TRUE,
            buffer_device_address: vulkan12.buffer_device_address == vk::TRUE,
            acceleration_structure: false,
            ray_query: false,
        }
    }

    /// The structures that enable these features.
    pub fn structs(&self) -> FeatureStructs {
        FeatureStructs {
            core: vk::PhysicalDeviceFeatures::default()
                .geometry_shader(self.geometry_shader)
                .robust_buffer_access(self.robust_buffer_access)
                .vertex_pipeline_stores_and_atomics(self.vertex_pipeline_stores_and_atomics)
                .fragment_stores_and_atomics(self.fragment_stores_and_atomics)
                .sample_rate_shading(self.sample_rate_shading),
            vulkan12: vk::PhysicalDeviceVulkan12Features::default()
                .shader_output_layer(self.shader_output_layer)
                .scalar_block_layout(self.scalar_block_layout)
                .buffer_device_address(self.buffer_device_address),
            dynamic_rendering: vk::PhysicalDeviceDynamicRenderingFeatures::default()
                .dynamic_rendering(self.dynamic_rendering),
            synchronization2: vk::PhysicalDeviceSynchronization2Features::default()
                .synchronization2(self.synchronization2),
            acceleration_structure: vk::PhysicalDeviceAccelerationStructureFeaturesKHR::default()
                .acceleration_structure(self.acceleration_structure),
            ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR::default().ray_query(self.ray_query),
        }
    }
}

/// Feature structures for device creation. A host may set further fields before it chains them. If its own structures
/// exclude one of these (`VkPhysicalDeviceVulkan13Features` excludes two), it copies the values.
#[derive(Clone, Copy, Debug, Default)]
pub struct FeatureStructs {
    pub core: vk::PhysicalDeviceFeatures,
    pub vulkan12: vk::PhysicalDeviceVulkan12Features<'static>,
    pub dynamic_rendering: vk::PhysicalDeviceDynamicRenderingFeatures<'static>,
    pub synchronization2: vk::PhysicalDeviceSynchronization2Features<'static>,
    pub acceleration_structure: vk::PhysicalDeviceAccelerationStructureFeaturesKHR<'static>,
    pub ray_query: vk::PhysicalDeviceRayQueryFeaturesKHR<'static>,
}

impl FeatureStructs {
    /// `info` with all of these structures chained; those of ray queries only if they are enabled, because few devices
    /// know them.
    pub fn chain<'a>(&'a mut self, info: vk::DeviceCreateInfo<'a>) -> vk::DeviceCreateInfo<'a> {
        let info = info
            .enabled_features(&self.core)
            .push_next(&mut self.vulkan12)
            .push_next(&mut self.dynamic_rendering)
            .push_next(&mut self.synchronization2);
        if self.ray_query.ray_query == vk::FALSE {
            return info;
        }
        info.push_next(&mut self.acceleration_structure).push_next(&mut self.ray_query)
    }
}

/// Every device extension that must be enabled for a Vulkan version, which is the lower one of the device's version and
/// that of the instance.
pub fn required_extensions(api_version: u32) -> Vec<&'static CStr> {
    let mut names = vec![ash::khr::push_descriptor::NAME];
    if api_version < vk::API_VERSION_1_3 {
        names.extend([ash::khr::dynamic_rendering::NAME, ash::khr::synchronization2::NAME]);
    }
    names
}

/// Device extensions that ray queries need in addition.
pub fn ray_query_extensions() -> [&'static CStr; 3] {
    [ash::khr::acceleration_structure::NAME, ash::khr::ray_query::NAME, ash::khr::deferred_host_operations::NAME]
}
