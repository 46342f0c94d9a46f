//! Raster and compute pipelines. Their layouts come from reflection: one push-descriptor set and one push block.

use super::bind::Bind;
use super::constants::{Constant, checked};
use super::make_pipeline::RasterState;
use super::raw_pipeline::RawPipeline;
use super::reflect::{Binding, StageInfo};
use super::shader::generation;
use crate::Result;
use crate::vk::device::context::Context;
use ash::vk;
use std::marker::PhantomData;
use std::sync::Arc;

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

/// The description of a [`Raster`] pipeline. It draws triangle lists without culling; viewport and scissor are set at
/// the draw.
#[derive(Clone, Copy, Debug, Default)]
pub struct RasterDesc<'a> {
    pub label: &'a str,
    /// Shaders by their path below `glsl/`.
    pub vertex: &'a str,
    pub geometry: Option<&'a str>,
    pub fragment: Option<&'a str>,
    /// Specialisation constants: all that the stages use, and possibly more of the headers or of these stages.
    pub constants: &'a [Constant],
    pub vertex_input: Option<VertexInput<'a>>,
    pub color_formats: &'a [vk::Format],
    pub depth: Option<DepthDesc>,
    /// Samples per pixel: 1, 2, 4, …; 0 means 1.
    pub samples: u32,
    /// Whether colour writes are off.
    pub masked: bool,
    /// Whether the hardware rasterises conservatively, on a context that supports it.
    pub conservative: bool,
}

/// The description of a [`Compute`] pipeline.
#[derive(Clone, Copy, Debug, Default)]
pub struct ComputeDesc<'a> {
    pub label: &'a str,
    /// Shader by its path below `glsl/`.
    pub shader: &'a str,
    /// Specialisation constants: all that the shader uses, and possibly more of the headers or of this shader.
    pub constants: &'a [Constant],
}

/// A pipeline made from [`RasterDesc`] or [`ComputeDesc`].
pub struct Pipeline<Desc> {
    pub(in crate::vk) raw: Arc<RawPipeline>,
    /// The context, which destroys the pipeline.
    _context: Arc<Context>,
    _made_of: PhantomData<Desc>,
}

pub type Raster = Pipeline<RasterDesc<'static>>;
pub type Compute = Pipeline<ComputeDesc<'static>>;

impl<Desc> Pipeline<Desc> {
    fn of_raw(raw: Arc<RawPipeline>, context: &Arc<Context>) -> Self {
        Self { raw, _context: context.clone(), _made_of: PhantomData }
    }

    pub fn label(&self) -> &str {
        &self.raw.label
    }

    /// The bindings of set 0, merged over the stages, in the order of their names and numbers.
    pub fn bindings(&self) -> &[Binding] {
        &self.raw.bindings
    }

    /// The resources of `binds` that the pipeline uses, because passes that share resources list them once.
    pub fn select<'a>(&self, binds: &[Bind<'a>]) -> Vec<Bind<'a>> {
        let used = |bind: &&Bind<'a>| self.raw.bindings.iter().any(|binding| binding.name == bind.name);
        binds.iter().filter(used).cloned().collect()
    }

    /// The stages in pipeline order, as their SPIR-V states them.
    pub fn stages(&self) -> &[StageInfo] {
        &self.raw.stages
    }

    /// Bytes of the push block; 0 without one.
    pub fn push_bytes(&self) -> u32 {
        self.raw.push_bytes
    }
}

impl Compute {
    /// Starts to compile the pipeline, or returns the existing one of the context. Panics if the shader uses features
    /// that these pipelines do not support, or if the constants do not match. The first use waits for the compilation,
    /// as does [`Context::wait_for_pipelines`].
    pub fn new(context: &Arc<Context>, desc: &ComputeDesc<'_>) -> Result<Self> {
        let constants = checked(desc.label, &[desc.shader], desc.constants, context.counting);
        let desc = ComputeDesc { constants: &constants, ..*desc };
        let raw = context.pipelines.find_or_make(format!("{} {desc:?}", generation()), || {
            RawPipeline::new(context, desc.label, &[desc.shader], &constants, None)
        })?;
        Ok(Self::of_raw(raw, context))
    }
}

impl Raster {
    /// Starts to compile the pipeline, or returns the existing one of the context. Panics if the shaders disagree or
    /// use features that these pipelines do not support, or if the constants do not match. The first use waits for the
    /// compilation, as does [`Context::wait_for_pipelines`].
    pub fn new(context: &Arc<Context>, desc: &RasterDesc<'_>) -> Result<Self> {
        let shaders = [Some(desc.vertex), desc.geometry, desc.fragment].into_iter().flatten();
        let shaders: Vec<_> = shaders.collect();
        let constants = checked(desc.label, &shaders, desc.constants, context.counting);
        let desc = RasterDesc { constants: &constants, ..*desc };
        if desc.conservative {
            assert!(context.conservative_rasterization, "{}: conservative rasterisation is not enabled", desc.label);
        }
        let raw = context.pipelines.find_or_make(format!("{} {desc:?}", generation()), || {
            RawPipeline::new(context, desc.label, &shaders, &constants, Some(RasterState::new(&desc)))
        })?;
        Ok(Self::of_raw(raw, context))
    }
}
