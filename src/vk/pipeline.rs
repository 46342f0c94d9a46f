//! Raster and compute pipelines. Their layouts come from reflection: one push-descriptor set and one push block.

use super::bind::Bind;
use super::context::Context;
use super::modules::{Modules, Specialization};
use super::reflect::{self, Binding, BindingKind, Stage, StageInfo};
use super::shader;
use crate::{Error, Result};
use ash::vk;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError, Weak};

/// What every Vulkan device offers for push constants.
const MAX_PUSH_BYTES: u32 = 128;

/// How a fragment's colour joins what is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blend {
    /// `source + (1 - source alpha) * destination`, for colours that were multiplied by their alpha.
    PremultipliedOver,
}

/// Depth test of a raster pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DepthDesc {
    pub format: vk::Format,
    pub compare: vk::CompareOp,
    pub write: bool,
}

/// One interleaved vertex buffer.
#[derive(Clone, Copy, Debug)]
pub struct VertexInput<'a> {
    /// Bytes per vertex.
    pub stride: u32,
    /// (location, format, offset in bytes)
    pub attributes: &'a [(u32, vk::Format, u32)],
}

/// What to make a [`Raster`] of. Triangle lists, no culling; viewport and scissor come with the draw.
#[derive(Clone, Copy, Debug)]
pub struct RasterDesc<'a> {
    pub label: &'a str,
    /// Shaders by their path below `glsl/`.
    pub vertex: &'a str,
    pub geometry: Option<&'a str>,
    pub fragment: Option<&'a str>,
    /// Specialisation constants of all stages: (id, value); a float by its bits, a bool as 0 or 1.
    pub constants: &'a [(u32, u32)],
    pub vertex_input: Option<VertexInput<'a>>,
    pub color_formats: &'a [vk::Format],
    pub depth: Option<DepthDesc>,
    /// Samples per pixel: 1, 2, 4, …
    pub samples: u32,
    pub blend: Option<Blend>,
    /// `false` masks every colour write.
    pub color_write: bool,
    /// The hardware makes a fragment of every pixel that a triangle touches; only on a context that can.
    pub conservative: bool,
}

impl Default for RasterDesc<'_> {
    fn default() -> Self {
        Self {
            label: "",
            vertex: "",
            geometry: None,
            fragment: None,
            constants: &[],
            vertex_input: None,
            color_formats: &[],
            depth: None,
            samples: 1,
            blend: None,
            color_write: true,
            conservative: false,
        }
    }
}

/// What to make a [`Compute`] of.
#[derive(Clone, Copy, Debug, Default)]
pub struct ComputeDesc<'a> {
    pub label: &'a str,
    /// Shader by its path below `glsl/`.
    pub shader: &'a str,
    /// Specialisation constants: (id, value).
    pub constants: &'a [(u32, u32)],
}

/// A pipeline with what its shaders say of it.
pub(super) struct RawPipeline {
    context: Arc<Context>,
    pub(super) handle: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    pub(super) label: String,
    pub(super) stages: Vec<StageInfo>,
    pub(super) bindings: Vec<Binding>,
    pub(super) push_bytes: u32,
    pub(super) push_stages: vk::ShaderStageFlags,
    /// For raster pipelines: to be held against the target at a draw.
    pub(super) color_formats: Vec<vk::Format>,
    pub(super) depth: Option<DepthDesc>,
    pub(super) samples: u32,
    pub(super) color_write: bool,
}

impl Drop for RawPipeline {
    fn drop(&mut self) {
        if let Some(device) = self.context.device_to_destroy_with() {
            // SAFETY: nothing in flight refers to it: what is in flight holds what it uses.
            unsafe {
                device.destroy_pipeline(self.handle, None);
                device.destroy_pipeline_layout(self.layout, None);
                device.destroy_descriptor_set_layout(self.set_layout, None);
            }
        }
    }
}

/// A graphics pipeline.
pub struct Raster {
    pub(super) raw: Arc<RawPipeline>,
}

/// A compute pipeline.
pub struct Compute {
    pub(super) raw: Arc<RawPipeline>,
}

macro_rules! reflection {
    ($pipeline:ty) => {
        impl $pipeline {
            pub fn label(&self) -> &str {
                &self.raw.label
            }

            /// The bindings of set 0, merged over the stages, by number.
            pub fn bindings(&self) -> &[Binding] {
                &self.raw.bindings
            }

            /// Those of `binds` that the pipeline uses: passes that share resources list them once.
            pub fn select<'a>(&self, binds: &[Bind<'a>]) -> Vec<Bind<'a>> {
                let used = |bind: &&Bind<'a>| self.raw.bindings.iter().any(|binding| binding.name == bind.name);
                binds.iter().filter(used).cloned().collect()
            }

            /// The stages in pipeline order, as their SPIR-V states them.
            pub fn stages(&self) -> &[StageInfo] {
                &self.raw.stages
            }

            /// Bytes of the push block, 0 without one.
            pub fn push_bytes(&self) -> u32 {
                self.raw.push_bytes
            }
        }
    };
}
reflection!(Raster);
reflection!(Compute);

impl Compute {
    /// Compiles the pipeline, or takes the one that is alive already. Panics when the shader uses what pipelines here do not
    /// offer.
    pub fn new(context: &Arc<Context>, desc: &ComputeDesc<'_>) -> Result<Self> {
        let shader = form(context, desc.shader);
        let constants = used(&[shader], desc.constants);
        let desc = ComputeDesc { shader, constants: &constants, ..*desc };
        let raw = alive_or(context, format!("{desc:?}"), || {
            let mut raw = RawPipeline::new(context, desc.label, &[shader], &constants)?;
            let modules = Modules::new(context, &[shader])?;
            let data = Specialization::new(&constants);
            let specialization = data.info();
            let info = [vk::ComputePipelineCreateInfo::default()
                .stage(modules.stage(0, vk::ShaderStageFlags::COMPUTE, &specialization))
                .layout(raw.layout)];
            // SAFETY: the info is complete and refers to live objects.
            let made = unsafe { context.device().create_compute_pipelines(context.pipeline_cache.handle, &info, None) };
            raw.finish(made)?;
            Ok(raw)
        })?;
        Ok(Self { raw })
    }
}

impl Raster {
    /// Compiles the pipeline, or takes the one that is alive already. Panics when the shaders disagree or use what pipelines
    /// here do not offer.
    pub fn new(context: &Arc<Context>, desc: &RasterDesc<'_>) -> Result<Self> {
        let shaders = [Some(desc.vertex), desc.geometry, desc.fragment].into_iter().flatten();
        let shaders: Vec<_> = shaders.map(|name| form(context, name)).collect();
        let constants = used(&shaders, desc.constants);
        let desc = RasterDesc { constants: &constants, ..*desc };
        let raw = alive_or(context, format!("{desc:?}"), || {
            let mut raw = RawPipeline::new(context, desc.label, &shaders, &constants)?;
            raw.color_formats = desc.color_formats.to_vec();
            raw.depth = desc.depth;
            raw.samples = desc.samples;
            raw.color_write = desc.color_write;
            let modules = Modules::new(context, &shaders)?;
            let data = Specialization::new(&constants);
            let specialization = data.info();
            let stages = raw.stages.iter().enumerate();
            let stages: Vec<_> =
                stages.map(|(index, info)| modules.stage(index, info.stage.flag(), &specialization)).collect();
            let made = create_raster(context, &desc, raw.layout, &stages);
            raw.finish(made)?;
            Ok(raw)
        })?;
        Ok(Self { raw })
    }
}

/// The shader as it is, or as it counts.
fn form<'a>(context: &Context, shader: &'a str) -> &'a str {
    if context.counting { shader::counted(shader) } else { shader }
}

/// Those of `constants` that the shaders depend on.
fn used(shaders: &[&str], constants: &[(u32, u32)]) -> Vec<(u32, u32)> {
    let known: Vec<u32> = shaders.iter().flat_map(|name| reflect::constant_ids(shader::spirv(name))).collect();
    constants.iter().copied().filter(|(id, _)| known.contains(id)).collect()
}

/// The pipeline that was made of the same and is still in use, or a new one: a changed setting compiles only what depends
/// on it.
fn alive_or(
    context: &Context,
    made_of: String,
    make: impl FnOnce() -> Result<RawPipeline>,
) -> Result<Arc<RawPipeline>> {
    let pipelines = || context.pipelines.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(alive) = pipelines().get(&made_of).and_then(Weak::upgrade) {
        return Ok(alive);
    }
    // Not under the lock: other threads compile theirs meanwhile.
    let made = Arc::new(make()?);
    context.compiled.fetch_add(1, Ordering::Relaxed);
    let mut pipelines = pipelines();
    pipelines.retain(|_, pipeline| pipeline.strong_count() > 0);
    pipelines.insert(made_of, Arc::downgrade(&made));
    Ok(made)
}

type Created = std::result::Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>;

fn create_raster(
    context: &Context,
    desc: &RasterDesc<'_>,
    layout: vk::PipelineLayout,
    stages: &[vk::PipelineShaderStageCreateInfo<'_>],
) -> Created {
    let bindings: Vec<_> = desc
        .vertex_input
        .map(|input| vk::VertexInputBindingDescription::default().stride(input.stride))
        .into_iter()
        .collect();
    let attributes: Vec<_> = desc
        .vertex_input
        .map_or(&[][..], |input| input.attributes)
        .iter()
        .map(|&(location, format, offset)| {
            vk::VertexInputAttributeDescription::default().location(location).format(format).offset(offset)
        })
        .collect();
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default()
        .vertex_binding_descriptions(&bindings)
        .vertex_attribute_descriptions(&attributes);
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    // Grown by no more than the device cannot help: an exact test follows.
    let mut conservative = vk::PipelineRasterizationConservativeStateCreateInfoEXT::default()
        .conservative_rasterization_mode(vk::ConservativeRasterizationModeEXT::OVERESTIMATE);
    let mut raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    if desc.conservative {
        assert!(context.conservative_rasterization, "{}: conservative rasterisation is not enabled", desc.label);
        raster = raster.push_next(&mut conservative);
    }
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::from_raw(desc.samples));
    let mut depth = vk::PipelineDepthStencilStateCreateInfo::default();
    if let Some(DepthDesc { compare, write, .. }) = desc.depth {
        depth = depth.depth_test_enable(true).depth_compare_op(compare).depth_write_enable(write);
    }
    let attachments = vec![blend_state(desc); desc.color_formats.len()];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(desc.color_formats)
        .depth_attachment_format(desc.depth.map_or(vk::Format::UNDEFINED, |depth| depth.format));
    let info = [vk::GraphicsPipelineCreateInfo::default()
        .stages(stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering)];
    // SAFETY: the info is complete and refers to live objects.
    unsafe { context.device().create_graphics_pipelines(context.pipeline_cache.handle, &info, None) }
}

fn blend_state(desc: &RasterDesc<'_>) -> vk::PipelineColorBlendAttachmentState {
    let mask = if desc.color_write { vk::ColorComponentFlags::RGBA } else { vk::ColorComponentFlags::empty() };
    let state = vk::PipelineColorBlendAttachmentState::default().color_write_mask(mask);
    match desc.blend {
        None => state,
        Some(Blend::PremultipliedOver) => state
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .color_blend_op(vk::BlendOp::ADD)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE_MINUS_SRC_ALPHA)
            .alpha_blend_op(vk::BlendOp::ADD),
    }
}

impl RawPipeline {
    /// Everything but the pipeline itself: reflection and layouts.
    fn new(context: &Arc<Context>, label: &str, shaders: &[&str], constants: &[(u32, u32)]) -> Result<Self> {
        let modules: Vec<_> = shaders.iter().map(|name| reflect::module(shader::entry(name), constants)).collect();
        let push_bytes = modules.iter().map(|module| module.push_bytes).max().unwrap_or(0);
        assert!(push_bytes <= MAX_PUSH_BYTES, "{label}: a push block of {push_bytes} bytes, {MAX_PUSH_BYTES} at most");
        let with_push = modules.iter().filter(|module| module.push_bytes > 0);
        let push_stages =
            with_push.fold(vk::ShaderStageFlags::empty(), |flags, module| flags | module.info.stage.flag());
        let mut this = Self {
            context: context.clone(),
            handle: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            label: label.to_owned(),
            bindings: reflect::merge(label, &modules),
            stages: modules.into_iter().map(|module| module.info).collect(),
            push_bytes,
            push_stages,
            color_formats: Vec::new(),
            depth: None,
            samples: 1,
            color_write: true,
        };
        let descriptors: u32 = this.bindings.iter().map(|binding| binding.count).sum();
        if descriptors > context.max_push_descriptors {
            return Err(Error::Device(format!(
                "{} pushes at most {} descriptors, but the pass {label} needs {descriptors}: choose another device",
                context.name, context.max_push_descriptors
            )));
        }
        let storage_images =
            this.bindings.iter().filter(|b| b.kind == BindingKind::StorageImage).map(|b| b.count).sum::<u32>();
        let most = context.limits.max_per_stage_descriptor_storage_images;
        if storage_images > most {
            return Err(Error::Device(format!(
                "{} stores to at most {most} images at once, but the pass {label} to {storage_images}: choose another form of \
                 the pass or another device",
                context.name
            )));
        }
        this.create_layouts().map_err(|result| context.error(&format!("creating the pass {label}"), result))?;
        Ok(this)
    }

    pub(super) fn bind_point(&self) -> vk::PipelineBindPoint {
        let is_compute = self.stages[0].stage == Stage::Compute;
        if is_compute { vk::PipelineBindPoint::COMPUTE } else { vk::PipelineBindPoint::GRAPHICS }
    }

    fn create_layouts(&mut self) -> std::result::Result<(), vk::Result> {
        let bindings: Vec<_> = self
            .bindings
            .iter()
            .map(|binding| {
                let stages = binding.stages.iter().fold(vk::ShaderStageFlags::empty(), |all, s| all | s.flag());
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.binding)
                    .descriptor_type(binding.kind.descriptor_type())
                    .descriptor_count(binding.count)
                    .stage_flags(stages)
            })
            .collect();
        let set = vk::DescriptorSetLayoutCreateInfo::default()
            .flags(vk::DescriptorSetLayoutCreateFlags::PUSH_DESCRIPTOR_KHR)
            .bindings(&bindings);
        // SAFETY: the infos are complete.
        unsafe {
            let device = self.context.device();
            self.set_layout = device.create_descriptor_set_layout(&set, None)?;
            let sets = [self.set_layout];
            let push = [vk::PushConstantRange::default().stage_flags(self.push_stages).size(self.push_bytes)];
            let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            if self.push_bytes > 0 {
                info = info.push_constant_ranges(&push);
            }
            self.layout = device.create_pipeline_layout(&info, None)?;
        }
        Ok(())
    }

    fn finish(&mut self, made: Created) -> Result<()> {
        let doing = || format!("compiling the pass {}", self.label);
        self.handle = made.map_err(|(_, result)| self.context.error(&doing(), result))?[0];
        self.context.set_name(self.handle, &self.label);
        Ok(())
    }
}
