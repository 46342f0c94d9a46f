//! The driver's part of creating a pipeline, with all of its inputs owned, so that it can run on a thread.

use super::constants::Constant;
use super::desc::{DepthDesc, RasterDesc};
use super::raw_pipeline::RawPipeline;
use super::shader;
use super::specialize::{Choices, specialize};
use crate::vk::device::context::Context;
use crate::vk::device::label::set_name;
use ash::vk;
use std::sync::Arc;

/// The pipeline, or the error of the driver.
pub(in crate::vk) type Made = Result<vk::Pipeline, vk::Result>;

/// Inputs for compiling a pipeline.
pub(in crate::vk) struct Making {
    device: ash::Device,
    debug_utils: Option<ash::ext::debug_utils::Device>,
    cache: vk::PipelineCache,
    /// Flags, which make the driver keep statistics if the context describes its pipelines.
    flags: vk::PipelineCreateFlags,
    layout: vk::PipelineLayout,
    label: String,
    /// Stages in pipeline order, with their words.
    stages: Vec<(vk::ShaderStageFlags, &'static [u32])>,
    constants: Vec<Constant>,
    /// Names and numbers of bindings.
    bindings: Vec<(String, u32)>,
    /// Whether the driver loses descriptors in loops.
    loads_early: bool,
    /// The state of a raster pipeline.
    raster: Option<Arc<RasterState>>,
}

/// The fixed-function state of a [`RasterDesc`].
pub(in crate::vk) struct RasterState {
    vertex_bindings: Vec<vk::VertexInputBindingDescription>,
    vertex_attributes: Vec<vk::VertexInputAttributeDescription>,
    pub(in crate::vk) color_formats: Vec<vk::Format>,
    pub(in crate::vk) color_write: bool,
    color_attachments: Vec<vk::PipelineColorBlendAttachmentState>,
    pub(in crate::vk) depth: Option<DepthDesc>,
    pub(in crate::vk) samples: u32,
    conservative: bool,
}

impl RasterState {
    pub(in crate::vk) fn new(desc: &RasterDesc<'_>) -> Self {
        let input = desc.vertex_input;
        let mask = if desc.masked { vk::ColorComponentFlags::empty() } else { vk::ColorComponentFlags::RGBA };
        let color_attachment = vk::PipelineColorBlendAttachmentState::default().color_write_mask(mask);
        let binding = |stride| vk::VertexInputBindingDescription::default().stride(stride);
        let attribute = |&(location, format, offset): &_| {
            vk::VertexInputAttributeDescription::default().location(location).format(format).offset(offset)
        };
        Self {
            vertex_bindings: input.iter().map(|input| binding(input.stride)).collect(),
            vertex_attributes: input.iter().flat_map(|input| input.attributes).map(attribute).collect(),
            color_formats: desc.color_formats.to_vec(),
            color_write: !desc.masked,
            color_attachments: vec![color_attachment; desc.color_formats.len()],
            depth: desc.depth,
            samples: desc.samples.max(1),
            conservative: desc.conservative,
        }
    }
}

impl Making {
    /// Inputs for `raw`, whose layout exists. `constants` are all that its shaders use.
    pub(in crate::vk) fn new(context: &Context, raw: &RawPipeline, constants: &[Constant]) -> Self {
        let flags = match context.executable_properties {
            Some(_) => vk::PipelineCreateFlags::CAPTURE_STATISTICS_KHR,
            None => vk::PipelineCreateFlags::empty(),
        };
        Self {
            device: context.device().clone(),
            debug_utils: context.debug_utils.clone(),
            cache: context.pipeline_cache.handle,
            flags,
            layout: raw.layout,
            label: raw.label.clone(),
            stages: raw.stages.iter().map(|info| (info.stage.flag(), shader::spirv(info.shader))).collect(),
            constants: constants.to_vec(),
            bindings: raw.bindings.iter().map(|binding| (binding.name.clone(), binding.binding)).collect(),
            loads_early: context.loses_descriptors,
            raster: raw.raster.clone(),
        }
    }

    /// Compiles the pipeline, which takes long.
    pub(in crate::vk) fn make(&self) -> Made {
        let choices = Choices { constants: &self.constants, bindings: &self.bindings, loads_early: self.loads_early };
        let module = |(flag, words): &(vk::ShaderStageFlags, &[u32])| {
            let words = specialize(words, &choices);
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            // SAFETY: the words are valid SPIR-V from the build.
            unsafe { self.device.create_shader_module(&info, None) }.map(|module| (*flag, module))
        };
        let modules: Vec<_> = self.stages.iter().map(module).collect();
        let stage = |made: &Result<_, _>| {
            made.map(|(flag, module)| {
                vk::PipelineShaderStageCreateInfo::default().stage(flag).module(module).name(c"main")
            })
        };
        let made = modules.iter().map(stage).collect::<Result<Vec<_>, _>>().and_then(|stages| self.make_of(&stages));
        for (_, module) in modules.into_iter().flatten() {
            // SAFETY: pipelines do not need their modules after creation.
            unsafe { self.device.destroy_shader_module(module, None) };
        }
        made.inspect(|handle| set_name(self.debug_utils.as_ref(), *handle, &self.label))
    }

    fn make_of(&self, stages: &[vk::PipelineShaderStageCreateInfo<'_>]) -> Made {
        let made = match &self.raster {
            Some(state) => self.make_raster(state, stages),
            None => {
                let info =
                    [vk::ComputePipelineCreateInfo::default().flags(self.flags).stage(stages[0]).layout(self.layout)];
                // SAFETY: the info is complete and refers to live objects.
                unsafe { self.device.create_compute_pipelines(self.cache, &info, None) }
            }
        };
        made.map(|pipelines| pipelines[0]).map_err(|(_, result)| result)
    }

    fn make_raster(
        &self,
        state: &RasterState,
        stages: &[vk::PipelineShaderStageCreateInfo<'_>],
    ) -> Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)> {
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&state.vertex_bindings)
            .vertex_attribute_descriptions(&state.vertex_attributes);
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        // Triangles grow by no more than the device's minimum, because an exact test follows.
        let mut conservative = vk::PipelineRasterizationConservativeStateCreateInfoEXT::default()
            .conservative_rasterization_mode(vk::ConservativeRasterizationModeEXT::OVERESTIMATE);
        let mut raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        if state.conservative {
            raster = raster.push_next(&mut conservative);
        }
        let samples = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::from_raw(state.samples));
        let mut depth = vk::PipelineDepthStencilStateCreateInfo::default();
        if let Some(DepthDesc { compare, write, .. }) = state.depth {
            depth = depth.depth_test_enable(true).depth_compare_op(compare).depth_write_enable(write);
        }
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&state.color_attachments);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&state.color_formats)
            .depth_attachment_format(state.depth.map_or(vk::Format::UNDEFINED, |depth| depth.format));
        let info = [vk::GraphicsPipelineCreateInfo::default()
            .flags(self.flags)
            .stages(stages)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&samples)
            .depth_stencil_state(&depth)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(self.layout)
            .push_next(&mut rendering)];
        // SAFETY: the info is complete and refers to live objects.
        unsafe { self.device.create_graphics_pipelines(self.cache, &info, None) }
    }
}
