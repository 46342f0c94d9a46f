//! Shaders in the form that pipelines are made of.

use ash::vk;

/// Shader modules, needed only while a pipeline is made.
pub(in crate::vk) struct Modules<'a> {
    device: &'a ash::Device,
    handles: Vec<vk::ShaderModule>,
}

impl<'a> Modules<'a> {
    /// Of valid SPIR-V.
    pub(in crate::vk) fn new(
        device: &'a ash::Device,
        shaders: impl Iterator<Item = Vec<u32>>,
    ) -> Result<Self, vk::Result> {
        let mut this = Self { device, handles: Vec::new() };
        for words in shaders {
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            // SAFETY: the words are valid SPIR-V from the build.
            this.handles.push(unsafe { device.create_shader_module(&info, None) }?);
        }
        Ok(this)
    }

    pub(in crate::vk) fn stage(
        &self,
        index: usize,
        flag: vk::ShaderStageFlags,
    ) -> vk::PipelineShaderStageCreateInfo<'static> {
        vk::PipelineShaderStageCreateInfo::default().stage(flag).module(self.handles[index]).name(c"main")
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
