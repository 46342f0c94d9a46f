//! Entry points that depend on the device's version and extensions.

use super::context::Context;
use ash::vk;

/// Entry points of extensions; dynamic rendering and barriers are core from Vulkan 1.3 on.
pub(in crate::vk) struct Functions {
    pub(in crate::vk) push_descriptor: ash::khr::push_descriptor::Device,
    pub(in crate::vk) debug_utils: Option<ash::ext::debug_utils::Device>,
    dynamic_rendering: Option<ash::khr::dynamic_rendering::Device>,
    synchronization2: Option<ash::khr::synchronization2::Device>,
}

impl Functions {
    pub(in crate::vk) fn load(instance: &ash::Instance, device: &ash::Device, is_1_3: bool, debug_utils: bool) -> Self {
        Self {
            push_descriptor: ash::khr::push_descriptor::Device::new(instance, device),
            debug_utils: debug_utils.then(|| ash::ext::debug_utils::Device::new(instance, device)),
            dynamic_rendering: (!is_1_3).then(|| ash::khr::dynamic_rendering::Device::new(instance, device)),
            synchronization2: (!is_1_3).then(|| ash::khr::synchronization2::Device::new(instance, device)),
        }
    }
}

impl Context {
    pub(in crate::vk) unsafe fn cmd_begin_rendering(&self, commands: vk::CommandBuffer, info: &vk::RenderingInfo<'_>) {
        // SAFETY: the caller's.
        unsafe {
            match &self.functions.dynamic_rendering {
                Some(khr) => khr.cmd_begin_rendering(commands, info),
                None => self.device().cmd_begin_rendering(commands, info),
            }
        }
    }

    pub(in crate::vk) unsafe fn cmd_end_rendering(&self, commands: vk::CommandBuffer) {
        // SAFETY: the caller's.
        unsafe {
            match &self.functions.dynamic_rendering {
                Some(khr) => khr.cmd_end_rendering(commands),
                None => self.device().cmd_end_rendering(commands),
            }
        }
    }

    pub(in crate::vk) unsafe fn cmd_pipeline_barrier2(
        &self,
        commands: vk::CommandBuffer,
        info: &vk::DependencyInfo<'_>,
    ) {
        // SAFETY: the caller's.
        unsafe {
            match &self.functions.synchronization2 {
                Some(khr) => khr.cmd_pipeline_barrier2(commands, info),
                None => self.device().cmd_pipeline_barrier2(commands, info),
            }
        }
    }
}
