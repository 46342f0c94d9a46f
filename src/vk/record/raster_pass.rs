//! A rendering scope with its targets and draws.

use super::bind::bind_pipeline;
use super::frame_log::{AttachmentLog, CallLog, CommandLog, DrawLog, TargetLog};
use super::recorder::Recorder;
use crate::vk::pipeline::bind::{Bind, labels};
use crate::vk::pipeline::desc::Raster;
use crate::vk::resource::buffer::Buffer;
use crate::vk::resource::image::ImageView;
use arrayvec::ArrayVec;
use ash::vk;
use bytemuck::Pod;

/// Content of an attachment when the scope begins.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Load<T> {
    Clear(T),
    /// The previous content.
    Load,
    #[default]
    DontCare,
}

/// A colour attachment, by its index among [`RenderTarget::colors`].
#[derive(Clone, Copy)]
pub struct ColorTarget<'a> {
    pub view: ImageView<'a>,
    /// The image that receives the average of the samples.
    pub resolve: Option<ImageView<'a>>,
    pub load: Load<[f32; 4]>,
    pub store: bool,
}

impl<'a> ColorTarget<'a> {
    /// A target that is written completely, so that its previous content is irrelevant.
    pub fn overwritten(view: ImageView<'a>) -> Self {
        Self { view, resolve: None, load: Load::DontCare, store: true }
    }
}

/// The depth attachment.
#[derive(Clone, Copy)]
pub struct DepthTarget<'a> {
    pub view: ImageView<'a>,
    pub load: Load<f32>,
    pub store: bool,
}

/// A rectangle in pixels, from the top left corner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rect {
    pub x: i32,
    pub y: i32,
    pub width: u32,
    pub height: u32,
}

/// The targets of a rendering scope.
#[derive(Clone, Copy, Default)]
pub struct RenderTarget<'a> {
    pub colors: &'a [ColorTarget<'a>],
    pub depth: Option<DepthTarget<'a>>,
    /// Width in pixels.
    pub width: u32,
    pub height: u32,
    /// The number of layers for `gl_Layer`; 0 means 1.
    pub layers: u32,
    /// Samples per pixel if there is no attachment; 0 means 1.
    pub samples: u32,
    /// The viewport; `None` for the whole target.
    pub viewport: Option<Rect>,
    /// The area outside of which nothing is cleared, drawn or resolved; `None` for the whole target.
    pub area: Option<Rect>,
}

impl RenderTarget<'_> {
    /// Rows of a part are multiples of this, because pixels are shaded in quads, and CPU devices work on far larger
    /// tiles.
    const PART_ROWS: u32 = 16;

    /// A rendering scope over the whole target, or one per part if the recorder splits its work; `draw` draws the same
    /// into each.
    pub fn draw_in_parts(&self, recorder: &mut Recorder, mut draw: impl FnMut(&mut RasterPass<'_>)) {
        recorder.in_parts(self.height, Self::PART_ROWS, |r, rows| {
            let part = Rect { x: 0, y: rows.start as i32, width: self.width, height: rows.len() as u32 };
            let area = (part.height < self.height).then_some(part);
            r.raster(&RenderTarget { area, ..*self }, &mut draw);
        });
    }
}

/// The source of a draw's counts.
#[derive(Clone, Copy)]
pub enum DrawCall<'a> {
    Direct {
        vertices: u32,
        instances: u32,
    },
    /// Counts from four words of `buffer` at byte `offset`: a `VkDrawIndirectCommand`.
    Indirect {
        buffer: &'a Buffer,
        offset: u64,
    },
    /// A draw with 32-bit indices into one interleaved vertex buffer.
    Indexed {
        vertices: &'a Buffer,
        indices: &'a Buffer,
        index_count: u32,
        first_index: u32,
        /// Added to each index.
        vertex_offset: i32,
    },
}

/// An open rendering scope.
pub struct RasterPass<'r> {
    recorder: &'r mut Recorder,
    /// Formats of the colour attachments; devices commonly support no more.
    formats: ArrayVec<vk::Format, 8>,
    depth_format: Option<vk::Format>,
    samples: u32,
    /// The target's log, if a log is kept.
    log: Option<TargetLog>,
}

impl<'r> RasterPass<'r> {
    pub(in crate::vk) fn begin(recorder: &'r mut Recorder, target: &RenderTarget<'_>) -> Self {
        let layers = target.layers.max(1);
        let colors: ArrayVec<_, 8> = target.colors.iter().map(color_attachment).collect();
        let depth = target.depth.as_ref().map(depth_attachment);
        let whole = Rect { x: 0, y: 0, width: target.width, height: target.height };
        let cut = target.area.unwrap_or(whole);
        let area = vk::Rect2D {
            offset: vk::Offset2D { x: cut.x, y: cut.y },
            extent: vk::Extent2D { width: cut.width, height: cut.height },
        };
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(layers).color_attachments(&colors);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        let view = target.viewport.unwrap_or(whole);
        let viewport = [vk::Viewport {
            x: view.x as f32,
            y: view.y as f32,
            width: view.width as f32,
            height: view.height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        }];
        let context = recorder.context().clone();
        let commands = recorder.handle;
        // SAFETY: the attachments are kept below; the buffer is recording, outside of another scope.
        unsafe {
            context.device().cmd_begin_rendering(commands, &info);
            context.device().cmd_set_viewport(commands, 0, &viewport);
            context.device().cmd_set_scissor(commands, 0, &[area]);
        }
        for color in target.colors {
            recorder.keep(color.view.raw.clone());
            if let Some(resolve) = color.resolve {
                recorder.keep(resolve.raw.clone());
            }
        }
        if let Some(depth) = &target.depth {
            recorder.keep(depth.view.raw.clone());
        }
        let first = target.colors.first().map(|color| color.view).or(target.depth.map(|depth| depth.view));
        Self {
            log: recorder.options.log.then(|| target_log(target)),
            recorder,
            formats: target.colors.iter().map(|color| color.view.raw.format).collect(),
            depth_format: target.depth.map(|depth| depth.view.raw.format),
            samples: first.map_or(target.samples.max(1), |view| view.raw.samples),
        }
    }

    /// Draws with `pipeline`, whose formats and samples must be the target's.
    pub fn draw(&mut self, pipeline: &Raster, binds: &[Bind<'_>], push: &impl Pod, call: DrawCall<'_>) {
        let raw = &pipeline.raw;
        let pass = &raw.label;
        let state = raw.raster.as_ref().expect("a raster pipeline has its fixed functions");
        assert_eq!(state.color_formats, self.formats[..], "pass {pass}: colour formats of pipeline and target");
        let depth_format = state.depth.map(|depth| depth.format);
        assert_eq!(depth_format, self.depth_format, "pass {pass}: depth formats of pipeline and target");
        assert_eq!(state.samples, self.samples, "pass {pass}: samples of pipeline and target");
        bind_pipeline(self.recorder, raw, binds, push);
        self.record(call);
        if let Some(target) = &self.log {
            let draw = DrawLog {
                pipeline: raw.label.clone(),
                stages: raw.stages.clone(),
                color_write: state.color_write,
                depth_write: state.depth.is_some_and(|depth| depth.write),
                call: call_log(call),
                resources: labels(raw, binds),
                target: target.clone(),
            };
            self.recorder.log(|| CommandLog::Draw(draw));
        }
    }

    fn record(&mut self, call: DrawCall<'_>) {
        let context = self.recorder.context().clone();
        let (device, commands) = (context.device(), self.recorder.handle);
        // SAFETY: a pipeline with all its bindings is set; buffers are kept.
        unsafe {
            match call {
                DrawCall::Direct { vertices, instances } => {
                    device.cmd_draw(commands, vertices, instances, 0, 0);
                }
                DrawCall::Indirect { buffer, offset } => {
                    device.cmd_draw_indirect(commands, buffer.raw.handle, offset, 1, 0);
                    self.recorder.keep(buffer.raw.clone());
                }
                DrawCall::Indexed { vertices, indices, index_count, first_index, vertex_offset } => {
                    device.cmd_bind_vertex_buffers(commands, 0, &[vertices.raw.handle], &[0]);
                    device.cmd_bind_index_buffer(commands, indices.raw.handle, 0, vk::IndexType::UINT32);
                    device.cmd_draw_indexed(commands, index_count, 1, first_index, vertex_offset, 0);
                    self.recorder.keep(vertices.raw.clone());
                    self.recorder.keep(indices.raw.clone());
                }
            }
        }
    }

    pub(in crate::vk) fn end(self) {
        let context = self.recorder.context().clone();
        // SAFETY: `begin` began it in the same buffer, because zones cannot start inside a scope.
        unsafe { context.device().cmd_end_rendering(self.recorder.handle) };
    }
}

fn color_attachment<'a>(color: &ColorTarget<'a>) -> vk::RenderingAttachmentInfo<'a> {
    let clear = |float32| vk::ClearValue { color: vk::ClearColorValue { float32 } };
    let info = attachment(color.view, color.load, clear, color.store);
    match color.resolve {
        None => info,
        Some(resolve) => info
            .resolve_mode(vk::ResolveModeFlags::AVERAGE)
            .resolve_image_view(resolve.handle)
            .resolve_image_layout(vk::ImageLayout::GENERAL),
    }
}

fn depth_attachment<'a>(depth: &DepthTarget<'a>) -> vk::RenderingAttachmentInfo<'a> {
    let clear = |depth| vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth, stencil: 0 } };
    attachment(depth.view, depth.load, clear, depth.store)
}

fn attachment<'a, T>(
    view: ImageView<'a>,
    load: Load<T>,
    clear: impl Fn(T) -> vk::ClearValue,
    store: bool,
) -> vk::RenderingAttachmentInfo<'a> {
    let (load, value) = match load {
        Load::Clear(value) => (vk::AttachmentLoadOp::CLEAR, clear(value)),
        Load::Load => (vk::AttachmentLoadOp::LOAD, vk::ClearValue::default()),
        Load::DontCare => (vk::AttachmentLoadOp::DONT_CARE, vk::ClearValue::default()),
    };
    vk::RenderingAttachmentInfo::default()
        .image_view(view.handle)
        .image_layout(vk::ImageLayout::GENERAL)
        .load_op(load)
        .clear_value(value)
        .store_op(if store { vk::AttachmentStoreOp::STORE } else { vk::AttachmentStoreOp::DONT_CARE })
}

fn target_log(target: &RenderTarget<'_>) -> TargetLog {
    TargetLog {
        colors: target.colors.iter().map(|color| attachment_log(color.view, color.resolve)).collect(),
        depth: target.depth.map(|depth| attachment_log(depth.view, None)),
        width: target.width,
        height: target.height,
        layers: target.layers.max(1),
    }
}

fn call_log(call: DrawCall<'_>) -> CallLog {
    match call {
        DrawCall::Direct { vertices, instances } => CallLog::Direct { vertices, instances },
        DrawCall::Indirect { buffer, offset } => CallLog::Indirect { buffer: buffer.label().to_owned(), offset },
        DrawCall::Indexed { index_count, .. } => CallLog::Indexed { indices: index_count },
    }
}

fn attachment_log(view: ImageView<'_>, resolve: Option<ImageView<'_>>) -> AttachmentLog {
    let [width, height, _] = view.raw.extent_of(view.level);
    AttachmentLog {
        image: view.raw.label.clone(),
        format: format!("{:?}", view.raw.format),
        level: view.level,
        width,
        height,
        layers: view.raw.attachment_layers(view.level),
        samples: view.raw.samples,
        resolve: resolve.map(|view| view.raw.label.clone()),
    }
}
