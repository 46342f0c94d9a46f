//! A pipeline as the context stores it: its layouts, the reflection of its shaders, and its handle once a thread has
//! compiled it.

use super::bind::COUNTS;
use super::constants::Constant;
use super::make_pipeline::{Made, Making, RasterState};
use super::reflect::{self, Binding, BindingKind, Module, ShaderStage, StageInfo};
use super::shader;
use super::specialize::names_used;
use crate::vk::device::context::Context;
use crate::vk::device::pipelines::Pipeline;
use crate::{Error, Result};
use ash::vk;
use std::collections::HashSet;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::thread::{self, JoinHandle};

/// Bytes of push constants that every Vulkan device supports.
const MAX_PUSH_BYTES: u32 = 128;

/// The stack of a compiling thread, as large as a main thread's usually is, because drivers compile recursively.
const STACK_BYTES: usize = 8 << 20;

/// A pipeline with the reflection of its shaders.
pub(in crate::vk) struct RawPipeline {
    pub(in crate::vk) layout: vk::PipelineLayout,
    set_layout: vk::DescriptorSetLayout,
    pub(in crate::vk) label: String,
    pub(in crate::vk) stages: Vec<StageInfo>,
    pub(in crate::vk) bindings: Vec<Binding>,
    pub(in crate::vk) push_bytes: u32,
    pub(in crate::vk) push_stages: vk::ShaderStageFlags,
    /// The state of a raster pipeline.
    pub(in crate::vk) raster: Option<Arc<RasterState>>,
    making: Mutex<Option<JoinHandle<Made>>>,
    made: OnceLock<Made>,
}

impl Pipeline for RawPipeline {
    fn label(&self) -> &str {
        &self.label
    }

    fn made(&self) -> std::result::Result<vk::Pipeline, vk::Result> {
        *self.made.get_or_init(|| {
            let thread = self.making.lock().unwrap_or_else(PoisonError::into_inner).take();
            // A panic was reported before; the context must still be able to destroy existing objects.
            thread.expect("started once").join().unwrap_or(Err(vk::Result::ERROR_UNKNOWN))
        })
    }

    fn has_failed(&self) -> bool {
        self.made.get().is_some_and(|made| made.is_err())
    }

    unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller guarantees this.
        unsafe {
            device.destroy_pipeline(self.made().unwrap_or_default(), None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// Keeps the bindings of one tracer, because a pass with those of both may exceed the limit of push descriptors.
/// Constants remove the queries on a device without them.
fn keep_traced(module: &mut Module, constants: &[Constant], queries: bool) {
    let structures = module.bindings.iter().filter(|binding| binding.kind == BindingKind::Structure);
    let Some(structure) = structures.map(|binding| binding.name.clone()).next() else { return };
    let used = if queries { names_used(shader::spirv(module.info.shader), constants) } else { HashSet::new() };
    if used.contains(&structure) {
        module.bindings.retain(|binding| used.contains(&binding.name));
    } else {
        module.bindings.retain(|binding| binding.name != structure);
    }
}

impl RawPipeline {
    /// Reflects the shaders, creates the layouts, and starts to compile. `constants` are all that the shaders use.
    pub(in crate::vk) fn new(
        context: &Context,
        label: &str,
        shaders: &[&str],
        constants: &[Constant],
        raster: Option<RasterState>,
    ) -> Result<Self> {
        let mut modules: Vec<_> = shaders.iter().map(|name| reflect::module(shader::entry(name))).collect();
        if !context.counting {
            // No shader reads it once the constant is set: `specialize` removes it from the shaders too.
            modules.iter_mut().for_each(|module| module.bindings.retain(|binding| binding.name != COUNTS));
        }
        modules.iter_mut().for_each(|module| keep_traced(module, constants, context.has_ray_queries()));
        let push_bytes = modules.iter().map(|module| module.push_bytes).max().unwrap_or(0);
        assert!(push_bytes <= MAX_PUSH_BYTES, "{label}: a push block of {push_bytes} bytes, {MAX_PUSH_BYTES} at most");
        let with_push = modules.iter().filter(|module| module.push_bytes > 0);
        let push_stages =
            with_push.fold(vk::ShaderStageFlags::empty(), |flags, module| flags | module.info.stage.flag());
        let mut this = Self {
            layout: vk::PipelineLayout::null(),
            set_layout: vk::DescriptorSetLayout::null(),
            label: label.to_owned(),
            bindings: reflect::merge(label, &modules),
            stages: modules.into_iter().map(|module| module.info).collect(),
            push_bytes,
            push_stages,
            raster: raster.map(Arc::new),
            making: Mutex::default(),
            made: OnceLock::new(),
        };
        let descriptors: u32 = this.bindings.iter().map(|binding| binding.count).sum();
        let most = context.capabilities.max_push_descriptors;
        if descriptors > most {
            return Err(Error::Device(format!(
                "{} pushes at most {most} descriptors, but the pass {label} needs {descriptors}: choose another device",
                context.name
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
        let storage_buffers = this.stages.iter().map(|info| this.storage_buffers_of(info.stage)).max().unwrap_or(0);
        let most = context.limits.max_per_stage_descriptor_storage_buffers;
        if storage_buffers > most {
            return Err(Error::Device(format!(
                "{} gives a shader at most {most} storage buffers, but the pass {label} needs {storage_buffers}: choose another \
                 device or another method (twobounce info says which presets run)",
                context.name
            )));
        }
        this.create_layouts(context.device())
            .map_err(|result| context.error(&format!("creating the pass {label}"), result))?;
        this.start(Making::new(context, &this, constants));
        Ok(this)
    }

    fn storage_buffers_of(&self, stage: ShaderStage) -> u32 {
        let of_stage = |binding: &&Binding| binding.kind == BindingKind::Storage && binding.stages.contains(&stage);
        self.bindings.iter().filter(of_stage).map(|binding| binding.count).sum()
    }

    /// Compiles the pipeline on a thread of its own: a frame has about twenty, and drivers compile on the calling
    /// thread.
    fn start(&mut self, making: Making) {
        let making = Arc::new(making);
        let on_thread = making.clone();
        let thread = thread::Builder::new().name("pipeline".into()).stack_size(STACK_BYTES);
        match thread.spawn(move || on_thread.make()) {
            Ok(thread) => self.making = Mutex::new(Some(thread)),
            // No thread can be started, so the pipeline is compiled here.
            Err(_) => self.made = OnceLock::from(making.make()),
        }
    }

    /// The pipeline as in [`Pipeline::made`], for a pass that needs it now. Panics if the driver failed and
    /// [`Context::wait_for_pipelines`] was not called.
    pub(in crate::vk) fn handle(&self) -> vk::Pipeline {
        self.made().unwrap_or_else(|result| panic!("compiling the pass {} failed ({result})", self.label))
    }

    pub(in crate::vk) fn bind_point(&self) -> vk::PipelineBindPoint {
        let is_compute = self.stages[0].stage == ShaderStage::Compute;
        if is_compute { vk::PipelineBindPoint::COMPUTE } else { vk::PipelineBindPoint::GRAPHICS }
    }

    fn create_layouts(&mut self, device: &ash::Device) -> std::result::Result<(), vk::Result> {
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
            self.set_layout = device.create_descriptor_set_layout(&set, None)?;
            let sets = [self.set_layout];
            let push = [vk::PushConstantRange::default().stage_flags(self.push_stages).size(self.push_bytes)];
            let mut info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            if self.push_bytes > 0 {
                info = info.push_constant_ranges(&push);
            }
            let made = device.create_pipeline_layout(&info, None);
            self.layout = made.inspect_err(|_| device.destroy_descriptor_set_layout(self.set_layout, None))?;
        }
        Ok(())
    }
}
