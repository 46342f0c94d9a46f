//! Binds a pipeline with its resources and its push block during recording.

use super::recorder::Recorder;
use crate::vk::pipeline::bind::{Bind, COUNTS, check_names, find};
use crate::vk::pipeline::raw_pipeline::RawPipeline;
use crate::vk::pipeline::reflect::BindingKind;
use crate::vk::resource::buffer::Buffer;
use crate::vk::resource::image::ImageView;
use arrayvec::ArrayVec;
use ash::vk;
use bytemuck::Pod;
use std::sync::Arc;

/// Descriptor infos while they are written. Their capacity is reused by the next command.
#[derive(Default)]
pub(in crate::vk) struct Infos {
    buffers: Vec<vk::DescriptorBufferInfo>,
    images: Vec<vk::DescriptorImageInfo>,
    structures: Vec<vk::AccelerationStructureKHR>,
}

impl Infos {
    fn clear(&mut self) {
        self.buffers.clear();
        self.images.clear();
        self.structures.clear();
    }

    fn push(&mut self, bind: &Bind<'_>) {
        let whole =
            |buffer: &Buffer| vk::DescriptorBufferInfo { buffer: buffer.raw.handle, offset: 0, range: vk::WHOLE_SIZE };
        self.buffers.extend(bind.buffer.map(whole));
        let sampler = bind.sampler.map_or(vk::Sampler::null(), |sampler| sampler.raw.handle);
        let info = |view: &ImageView<'_>| vk::DescriptorImageInfo {
            sampler,
            image_view: view.handle,
            image_layout: vk::ImageLayout::GENERAL,
        };
        self.images.extend(bind.views.iter().map(info));
        self.structures.extend(bind.structure.map(|structure| structure.top.handle()));
    }
}

/// Binds a pipeline with all its resources and its push block.
///
/// Panics if a binding is missing, unknown or of another kind, or if the size of the push block differs, unless the
/// shader has none.
pub(in crate::vk) fn bind_pipeline<T: Pod>(
    recorder: &mut Recorder,
    pipeline: &Arc<RawPipeline>,
    binds: &[Bind<'_>],
    push: &T,
) {
    let counts = recorder.counts_of(pipeline);
    let with_counts: Vec<Bind<'_>>;
    let binds = match &counts {
        Some(counts) => {
            with_counts = binds.iter().cloned().chain([Bind::buffer(COUNTS, counts)]).collect();
            &with_counts
        }
        None => binds,
    };
    check_names(pipeline, binds);
    let push = bytemuck::bytes_of(push);
    let (pass, wanted) = (&pipeline.label, pipeline.push_bytes as usize);
    // A form of a shader that does not read its push block has none.
    let push = if wanted == 0 { &[] } else { push };
    assert_eq!(push.len(), wanted, "pass {pass}: the push block has {wanted} bytes, the struct {}", push.len());

    let mut infos = std::mem::take(&mut recorder.recorded.infos);
    infos.clear();
    for binding in &pipeline.bindings {
        infos.push(find(pipeline, binding, binds));
    }
    let device = recorder.context().device();
    // SAFETY: the pipeline is kept below.
    unsafe { device.cmd_bind_pipeline(recorder.handle, pipeline.bind_point(), pipeline.handle()) };
    push_descriptors(recorder, pipeline, &infos);
    if !push.is_empty() {
        // SAFETY: the block has the size that the layout states.
        unsafe { device.cmd_push_constants(recorder.handle, pipeline.layout, pipeline.push_stages, 0, push) };
    }
    recorder.recorded.infos = infos;
    recorder.keep(pipeline.clone());
    let keep = &mut recorder.recorded.keep;
    for bind in binds {
        keep.extend(bind.buffer.map(|buffer| buffer.raw.clone() as _));
        keep.extend(bind.sampler.map(|sampler| sampler.raw.clone() as _));
        keep.extend(bind.views.iter().map(|view| view.raw.clone() as _));
        keep.extend(bind.structure.map(|structure| structure.triangles.clone() as _));
        keep.extend(bind.structure.map(|structure| structure.top.clone() as _));
    }
}

/// Writes all bindings of the pipeline, in the order of `infos`.
fn push_descriptors(recorder: &Recorder, pipeline: &RawPipeline, infos: &Infos) {
    if pipeline.bindings.is_empty() {
        return;
    }
    let (mut buffers, mut images) = (infos.buffers.as_slice(), infos.images.as_slice());
    // A shader has at most one.
    let structures =
        vk::WriteDescriptorSetAccelerationStructureKHR::default().acceleration_structures(&infos.structures);
    // No pass has more bindings.
    let writes: ArrayVec<vk::WriteDescriptorSet<'_>, 64> = (pipeline.bindings.iter())
        .map(|binding| {
            let to = vk::WriteDescriptorSet::default()
                .dst_binding(binding.binding)
                .descriptor_type(binding.kind.descriptor_type());
            match binding.kind {
                BindingKind::Storage | BindingKind::Uniform => to.buffer_info(take(&mut buffers, 1)),
                BindingKind::Sampled | BindingKind::StorageImage => {
                    to.image_info(take(&mut images, binding.count as usize))
                }
                BindingKind::Structure => {
                    vk::WriteDescriptorSet { p_next: (&raw const structures).cast(), descriptor_count: 1, ..to }
                }
            }
        })
        .collect();
    let (commands, point, layout) = (recorder.handle, pipeline.bind_point(), pipeline.layout);
    let push_descriptor = &recorder.context().push_descriptor;
    // SAFETY: bound resources are kept alive, and their kinds match the layout.
    unsafe { push_descriptor.cmd_push_descriptor_set(commands, point, layout, 0, &writes) };
}

/// Splits off the first `count` elements of `from`.
fn take<'a, T>(from: &mut &'a [T], count: usize) -> &'a [T] {
    let (taken, rest) = from.split_at(count);
    *from = rest;
    taken
}
