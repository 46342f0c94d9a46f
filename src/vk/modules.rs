//! Shaders and constants in the form that pipelines are made of.

use ash::vk;

/// Shader modules, needed only while a pipeline is made.
pub(super) struct Modules<'a> {
    device: &'a ash::Device,
    handles: Vec<vk::ShaderModule>,
}

impl<'a> Modules<'a> {
    /// Of valid SPIR-V.
    pub(super) fn new(device: &'a ash::Device, shaders: impl Iterator<Item = &'a [u32]>) -> Result<Self, vk::Result> {
        let mut this = Self { device, handles: Vec::new() };
        for words in shaders {
            let info = vk::ShaderModuleCreateInfo::default().code(words);
            // SAFETY: the words are valid SPIR-V from the build.
            this.handles.push(unsafe { device.create_shader_module(&info, None) }?);
        }
        Ok(this)
    }

    pub(super) fn stage<'s>(
        &self,
        index: usize,
        flag: vk::ShaderStageFlags,
        specialization: &'s vk::SpecializationInfo<'s>,
    ) -> vk::PipelineShaderStageCreateInfo<'s> {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(flag)
            .module(self.handles[index])
            .name(c"main")
            .specialization_info(specialization)
    }
}

impl Drop for Modules<'_> {
    fn drop(&mut self) {
        for handle in &self.handles {
            // SAFETY: pipelines do not need their modules once made.
            unsafe { self.device.destroy_shader_module(*handle, None) };
        }
    }
}

/// Constants in the form that Vulkan takes.
pub(super) struct Specialization {
    entries: Vec<vk::SpecializationMapEntry>,
    values: Vec<u32>,
}

impl Specialization {
    pub(super) fn new(constants: &[(u32, u32)]) -> Self {
        let entry = |(index, (id, _)): (usize, &(u32, u32))| {
            vk::SpecializationMapEntry::default().constant_id(*id).offset(index as u32 * 4).size(4)
        };
        Self {
            entries: constants.iter().enumerate().map(entry).collect(),
            values: constants.iter().map(|(_, value)| *value).collect(),
        }
    }

    pub(super) fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().map_entries(&self.entries).data(bytemuck::cast_slice(&self.values))
    }
}
