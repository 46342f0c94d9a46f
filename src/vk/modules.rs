//! Shaders and constants in the form that pipelines are made of.

use super::context::Context;
use super::shader;
use crate::Result;
use ash::vk;

/// Shader modules, needed only while a pipeline is made.
pub(super) struct Modules<'a> {
    context: &'a Context,
    handles: Vec<vk::ShaderModule>,
}

impl<'a> Modules<'a> {
    pub(super) fn new(context: &'a Context, shaders: &[&str]) -> Result<Self> {
        let mut this = Self { context, handles: Vec::new() };
        for name in shaders {
            let info = vk::ShaderModuleCreateInfo::default().code(shader::spirv(name));
            // SAFETY: the words are valid SPIR-V from the build.
            let handle = unsafe { context.device().create_shader_module(&info, None) }
                .map_err(|result| context.error(&format!("loading {name}"), result))?;
            this.handles.push(handle);
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
            unsafe { self.context.device().destroy_shader_module(*handle, None) };
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
