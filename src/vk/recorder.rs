//! Recording one frame: zones with timestamps and labels, barriers, transfers, draws and dispatches; then one wait.

use super::bind::{Bind, bind_pipeline};
use super::buffer::Buffer;
use super::context::Context;
use super::counting::Counting;
use super::frame_log::{CommandLog, DispatchLog, FrameLog};
use super::image::{Image, ImageRegion};
use super::pipeline::{Compute, Raster};
use super::raster_pass::{DrawCall, RasterPass, RenderTarget};
use super::submit::{Commands, MAX_TIMESTAMPS};
use super::zone::{ZoneKind, ZoneTiming, ZoneTimings, process_cpu_ms};
use crate::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use std::any::Any;
use std::ffi::CString;
use std::sync::Arc;
use std::time::Instant;

/// How to submit what is recorded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecorderOptions {
    /// One submission per zone, each waited for: this also gives CPU and wall times per zone.
    pub per_pass: bool,
}

struct OpenZone {
    name: &'static str,
    kind: ZoneKind,
    bytes: u64,
    first_timestamp: u32,
}

/// Records commands, then submits them and waits. Recording cannot fail: errors come from [`Recorder::finish`].
pub struct Recorder {
    context: Arc<Context>,
    pub(super) commands: Commands,
    options: RecorderOptions,
    pub(super) zone: Option<(&'static str, ZoneKind)>,
    /// Zones that are over: their first timestamp follows the previous zone's second.
    done: Vec<(OpenZone, Option<f64>, Option<f64>)>,
    timestamps: u32,
    pub(super) log: FrameLog,
    /// What the recorded commands use, kept alive until the wait is over.
    keep: Vec<Arc<dyn Any + Send + Sync>>,
    /// On a context that counts.
    pub(super) counting: Option<Counting>,
    error: Option<Error>,
    started: Instant,
}

impl Recorder {
    /// Starts to record. What earlier submissions wrote is visible to everything recorded.
    pub fn new(context: &Arc<Context>, options: RecorderOptions) -> Result<Self> {
        let commands = Commands::begin(context)?;
        let mut this = Self {
            context: context.clone(),
            commands,
            options,
            zone: None,
            done: Vec::new(),
            timestamps: 0,
            log: FrameLog::default(),
            keep: Vec::new(),
            counting: context.counting.then(|| Counting::new(context)).transpose()?,
            error: None,
            started: Instant::now(),
        };
        let set = this.commands.set();
        // SAFETY: the buffer is recording; the pool is not in use.
        unsafe { context.device().cmd_reset_query_pool(set.commands, set.timestamps, 0, MAX_TIMESTAMPS) };
        this.timestamp();
        Ok(this)
    }

    pub fn context(&self) -> &Arc<Context> {
        &self.context
    }

    /// What was recorded so far.
    pub fn frame_log(&self) -> &FrameLog {
        &self.log
    }

    pub(super) fn handle(&self) -> vk::CommandBuffer {
        self.commands.set().commands
    }

    pub(super) fn keep(&mut self, used: Arc<dyn Any + Send + Sync>) {
        self.keep.push(used);
    }

    pub(super) fn log(&mut self, command: CommandLog) {
        self.log.push(self.zone, command);
    }

    /// Records `record` as one pass called `name`, timed and labelled. `bytes_written` is the pass's own estimate.
    /// Zones do not nest.
    pub fn zone(&mut self, name: &'static str, kind: ZoneKind, bytes_written: u64, record: impl FnOnce(&mut Self)) {
        assert!(self.zone.is_none(), "zone {name} inside of zone {:?}", self.zone);
        if self.options.per_pass {
            self.flush();
        }
        self.log.close();
        self.start_counts();
        let (cpu, wall) = (process_cpu_ms(), Instant::now());
        self.zone = Some((name, kind));
        let first_timestamp = self.timestamp();
        self.begin_label(name);
        record(self);
        self.end_label();
        self.timestamp();
        self.zone = None;
        self.log.close();
        self.keep_counts();
        let zone = OpenZone { name, kind, bytes: bytes_written, first_timestamp };
        if self.options.per_pass {
            self.flush();
            let cpu_ms = process_cpu_ms().zip(cpu).map(|(after, before)| after - before);
            self.done.push((zone, cpu_ms, Some(wall.elapsed().as_secs_f64() * 1e3)));
        } else {
            self.done.push((zone, None, None));
        }
    }

    /// Everything before that matches `from` happens before everything after that matches `to`.
    pub fn barrier(
        &mut self,
        from_stage: vk::PipelineStageFlags2,
        from_access: vk::AccessFlags2,
        to_stage: vk::PipelineStageFlags2,
        to_access: vk::AccessFlags2,
    ) {
        self.commands.record_barrier((from_stage, from_access), (to_stage, to_access));
    }

    /// Everything before happens before everything after.
    pub fn full_barrier(&mut self) {
        use vk::{AccessFlags2 as A, PipelineStageFlags2 as S};
        let all = A::MEMORY_READ | A::MEMORY_WRITE;
        self.barrier(S::ALL_COMMANDS, all, S::ALL_COMMANDS, all);
    }

    /// Sets `bytes` bytes from `offset` on (both multiples of 4) to the word `value`.
    pub fn fill(&mut self, buffer: &Buffer, offset: u64, bytes: u64, value: u32) {
        check_range(buffer, offset, bytes);
        // SAFETY: in range; the buffer is kept.
        unsafe { self.context.device().cmd_fill_buffer(self.handle(), buffer.raw.handle, offset, bytes, value) };
        self.keep(buffer.raw.clone());
        self.log(CommandLog::Fill { buffer: buffer.label().to_owned(), offset, bytes, value });
    }

    /// Writes at most 64 KiB into `buffer`, in order with the commands; offset and length are multiples of 4.
    pub fn update(&mut self, buffer: &Buffer, offset: u64, data: &[u8]) {
        check_range(buffer, offset, data.len() as u64);
        assert!(data.len() <= 65536, "{}: an update of {} bytes", buffer.label(), data.len());
        // SAFETY: in range; the data is copied into the command buffer; the buffer is kept.
        unsafe { self.context.device().cmd_update_buffer(self.handle(), buffer.raw.handle, offset, data) };
        self.keep(buffer.raw.clone());
        let (buffer, bytes) = (buffer.label().to_owned(), data.len() as u64);
        self.log(CommandLog::Update { buffer, offset, bytes });
    }

    /// Writes `data` to the start of `buffer`, in order with the commands: small data that changes from frame to frame.
    pub fn update_all<T: Pod>(&mut self, buffer: &Buffer, data: &[T]) {
        const MOST: usize = 65536;
        for (index, part) in bytemuck::cast_slice(data).chunks(MOST).enumerate() {
            self.update(buffer, (index * MOST) as u64, part);
        }
    }

    /// Sets every texel of a colour image to zero.
    pub fn clear(&mut self, image: &Image) {
        let range = [vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(vk::REMAINING_MIP_LEVELS)
            .layer_count(vk::REMAINING_ARRAY_LAYERS)];
        let (general, zero) = (vk::ImageLayout::GENERAL, vk::ClearColorValue::default());
        // SAFETY: the image is in that layout for good, outside a rendering scope; it is kept.
        unsafe {
            self.context.device().cmd_clear_color_image(self.handle(), image.raw.handle, general, &zero, &range);
        }
        self.keep(image.raw.clone());
        self.log(CommandLog::Clear { image: image.label().to_owned() });
    }

    /// Copies the first bytes of `from` to the start of `to`, as many as both have.
    pub fn copy(&mut self, from: &Buffer, to: &Buffer) {
        self.copy_range(from, 0, to, 0, from.bytes().min(to.bytes()));
    }

    /// Copies `bytes` bytes.
    pub fn copy_range(&mut self, from: &Buffer, from_offset: u64, to: &Buffer, to_offset: u64, bytes: u64) {
        check_range(from, from_offset, bytes);
        check_range(to, to_offset, bytes);
        let region = [vk::BufferCopy { src_offset: from_offset, dst_offset: to_offset, size: bytes }];
        // SAFETY: in range; the buffers are kept.
        unsafe { self.context.device().cmd_copy_buffer(self.handle(), from.raw.handle, to.raw.handle, &region) };
        self.keep(from.raw.clone());
        self.keep(to.raw.clone());
        let bytes = Some(bytes);
        self.log(CommandLog::Copy { from: from.label().to_owned(), to: to.label().to_owned(), bytes });
    }

    /// Copies a region of `image` into `buffer` from byte `offset` on, tightly packed.
    pub fn copy_image_to_buffer(&mut self, image: &Image, region: ImageRegion, buffer: &Buffer, offset: u64) {
        let copy = [image_copy(image, region, offset)];
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: the image is in that layout for good; both are kept.
        unsafe {
            let (device, image, buffer) = (self.context.device(), image.raw.handle, buffer.raw.handle);
            device.cmd_copy_image_to_buffer(self.handle(), image, general, buffer, &copy);
        }
        self.keep(image.raw.clone());
        self.keep(buffer.raw.clone());
        self.log(CommandLog::Copy { from: image.label().to_owned(), to: buffer.label().to_owned(), bytes: None });
    }

    /// Copies a region of one colour image to `to` of another's finest level.
    pub fn copy_image(&mut self, from: &Image, region: ImageRegion, to: &Image, at: [u32; 3]) {
        let layers = |level, first| {
            vk::ImageSubresourceLayers::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .mip_level(level)
                .base_array_layer(first)
                .layer_count(region.layers)
        };
        let offset = |[x, y, z]: [u32; 3]| vk::Offset3D { x: x as i32, y: y as i32, z: z as i32 };
        let [width, height, depth] = region.extent;
        let copy = [vk::ImageCopy::default()
            .src_subresource(layers(region.level, region.first_layer))
            .src_offset(offset(region.offset))
            .dst_subresource(layers(0, 0))
            .dst_offset(offset(at))
            .extent(vk::Extent3D { width, height, depth })];
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: both images are in that layout for good, outside a rendering scope; both are kept.
        unsafe {
            let device = self.context.device();
            device.cmd_copy_image(self.handle(), from.raw.handle, general, to.raw.handle, general, &copy);
        }
        self.keep(from.raw.clone());
        self.keep(to.raw.clone());
        self.log(CommandLog::Copy { from: from.label().to_owned(), to: to.label().to_owned(), bytes: None });
    }

    /// Copies tightly packed texels from byte `offset` of `buffer` on into a region of `image`.
    pub fn copy_buffer_to_image(&mut self, buffer: &Buffer, offset: u64, image: &Image, region: ImageRegion) {
        let copy = [image_copy(image, region, offset)];
        let general = vk::ImageLayout::GENERAL;
        // SAFETY: the image is in that layout for good; both are kept.
        unsafe {
            let (device, image, buffer) = (self.context.device(), image.raw.handle, buffer.raw.handle);
            device.cmd_copy_buffer_to_image(self.handle(), buffer, image, general, &copy);
        }
        self.keep(image.raw.clone());
        self.keep(buffer.raw.clone());
        self.log(CommandLog::Copy { from: buffer.label().to_owned(), to: image.label().to_owned(), bytes: None });
    }

    /// One rendering scope into `target`, for any number of draws.
    pub fn raster(&mut self, target: &RenderTarget<'_>, draw: impl FnOnce(&mut RasterPass<'_>)) {
        let mut pass = RasterPass::begin(self, target);
        draw(&mut pass);
        pass.end();
    }

    /// One rendering scope with one draw.
    pub fn draw(
        &mut self,
        pipeline: &Raster,
        target: &RenderTarget<'_>,
        binds: &[Bind<'_>],
        push: &impl Pod,
        call: DrawCall<'_>,
    ) {
        self.raster(target, |pass| pass.draw(pipeline, binds, push, call));
    }

    /// Runs `groups` workgroups.
    pub fn dispatch(&mut self, pipeline: &Compute, binds: &[Bind<'_>], push: &impl Pod, groups: [u32; 3]) {
        let limit = self.context.limits.max_compute_work_group_count;
        let fits = groups.iter().zip(limit).all(|(count, most)| *count <= most);
        assert!(fits, "{}: {groups:?} workgroups, {limit:?} at most", pipeline.label());
        let resources = bind_pipeline(self, &pipeline.raw, vk::PipelineBindPoint::COMPUTE, binds, push);
        let [x, y, z] = groups;
        // SAFETY: a compute pipeline and all its bindings are set.
        unsafe { self.context.device().cmd_dispatch(self.handle(), x, y, z) };
        self.log_dispatch(pipeline, Some(groups), None, resources);
    }

    /// Runs the workgroups that three words of `buffer` at byte `offset` count.
    pub fn dispatch_indirect(
        &mut self,
        pipeline: &Compute,
        binds: &[Bind<'_>],
        push: &impl Pod,
        buffer: &Buffer,
        offset: u64,
    ) {
        check_range(buffer, offset, 12);
        let resources = bind_pipeline(self, &pipeline.raw, vk::PipelineBindPoint::COMPUTE, binds, push);
        // SAFETY: in range; a compute pipeline and all its bindings are set; the buffer is kept.
        unsafe { self.context.device().cmd_dispatch_indirect(self.handle(), buffer.raw.handle, offset) };
        self.keep(buffer.raw.clone());
        self.log_dispatch(pipeline, None, Some((buffer.label().to_owned(), offset)), resources);
    }

    fn log_dispatch(
        &mut self,
        pipeline: &Compute,
        groups: Option<[u32; 3]>,
        indirect: Option<(String, u64)>,
        resources: Vec<(String, Vec<String>)>,
    ) {
        let (pipeline, stages) = (pipeline.label().to_owned(), pipeline.stages().to_vec());
        self.log(CommandLog::Dispatch(DispatchLog { pipeline, stages, groups, indirect, resources }));
    }

    /// Submits, waits and reads the times.
    pub fn finish(mut self) -> Result<ZoneTimings> {
        self.timestamp();
        let doing = "rendering";
        match self.error.take() {
            Some(error) => return Err(error),
            None => self.commands.submit_and_wait(doing)?,
        }
        let ticks = self.read_timestamps()?;
        let ms = |from: u32, to: u32| {
            let ticks = ticks[to as usize].saturating_sub(ticks[from as usize]);
            ticks as f64 * f64::from(self.context.limits.timestamp_period) * 1e-6
        };
        let counts = |index| self.counting.as_ref().map_or_else(Vec::new, |counting| counting.read(index));
        let timing = |(index, (zone, cpu_ms, wall_ms)): (usize, &(OpenZone, Option<f64>, Option<f64>))| ZoneTiming {
            name: zone.name,
            kind: zone.kind,
            start_ms: ms(0, zone.first_timestamp),
            gpu_ms: ms(zone.first_timestamp, zone.first_timestamp + 1),
            cpu_ms: *cpu_ms,
            wall_ms: *wall_ms,
            bytes: zone.bytes,
            counts: counts(index),
        };
        Ok(ZoneTimings {
            zones: self.done.iter().enumerate().map(timing).collect(),
            gpu_ms: ms(0, self.timestamps - 1),
            wall_ms: self.started.elapsed().as_secs_f64() * 1e3,
        })
    }

    fn read_timestamps(&self) -> Result<Vec<u64>> {
        let mut ticks = vec![0_u64; self.timestamps as usize];
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        // SAFETY: that many were written, and the work was waited for.
        unsafe {
            let pool = self.commands.set().timestamps;
            self.context.device().get_query_pool_results(pool, 0, &mut ticks, flags)
        }
        .map_err(|result| self.context.error("reading the timestamps", result))?;
        Ok(ticks)
    }

    /// Writes the next timestamp, once everything before is done; returns its index.
    fn timestamp(&mut self) -> u32 {
        let index = self.timestamps;
        assert!(index < MAX_TIMESTAMPS, "more than {} zones in one recording", MAX_TIMESTAMPS / 2 - 1);
        self.timestamps += 1;
        let set = self.commands.set();
        let stage = vk::PipelineStageFlags::BOTTOM_OF_PIPE;
        // SAFETY: the query was reset and not written since.
        unsafe { self.context.device().cmd_write_timestamp(set.commands, stage, set.timestamps, index) };
        index
    }

    /// Submits what was recorded, waits, and goes on recording. The first error is kept for `finish`.
    fn flush(&mut self) {
        if self.error.is_none() {
            let waited = self.commands.submit_and_wait("rendering").and_then(|()| self.commands.begin_again());
            self.error = waited.err();
        }
    }

    fn begin_label(&self, name: &str) {
        let (Some(debug), Ok(name)) = (&self.context.functions.debug_utils, CString::new(name)) else { return };
        let label = vk::DebugUtilsLabelEXT::default().label_name(&name);
        // SAFETY: the buffer is recording.
        unsafe { debug.cmd_begin_debug_utils_label(self.handle(), &label) };
    }

    fn end_label(&self) {
        if let Some(debug) = &self.context.functions.debug_utils {
            // SAFETY: begun by `begin_label`. With one submission per pass both lie in the same one.
            unsafe { debug.cmd_end_debug_utils_label(self.handle()) };
        }
    }
}

fn check_range(buffer: &Buffer, offset: u64, bytes: u64) {
    let (label, size) = (buffer.label(), buffer.bytes());
    let fits = offset.checked_add(bytes).is_some_and(|end| end <= size);
    assert!(fits, "{label}: {bytes} bytes at {offset} do not fit into {size}");
}

fn image_copy(image: &Image, region: ImageRegion, buffer_offset: u64) -> vk::BufferImageCopy {
    let ImageRegion { level, first_layer, layers, offset, extent } = region;
    vk::BufferImageCopy::default()
        .buffer_offset(buffer_offset)
        .image_subresource(vk::ImageSubresourceLayers {
            aspect_mask: image.raw.aspect(),
            mip_level: level,
            base_array_layer: first_layer,
            layer_count: layers,
        })
        .image_offset(vk::Offset3D { x: offset[0] as i32, y: offset[1] as i32, z: offset[2] as i32 })
        .image_extent(vk::Extent3D { width: extent[0], height: extent[1], depth: extent[2] })
}
