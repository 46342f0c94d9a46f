//! Resources for a pipeline's bindings, by name, checked against reflection.

use super::buffer::Buffer;
use super::image::ImageView;
use super::raw_pipeline::RawPipeline;
use super::recorder::Recorder;
use super::reflect::{Binding, BindingKind};
use super::sampler::Sampler;
use super::shader;
use super::views::Views;
use ash::vk;
use bytemuck::Pod;
use std::sync::Arc;

/// Where counting shaders add up; bound by itself.
pub(super) const COUNTS: &str = "counts";

#[derive(Clone)]
enum Resource<'a> {
    Buffer(&'a Buffer),
    Sampled(Views<'a>, &'a Sampler),
    Storage(Views<'a>),
}

/// A resource for the binding of that name.
#[derive(Clone)]
pub struct Bind<'a> {
    pub(super) name: &'a str,
    resource: Resource<'a>,
}

impl<'a> Bind<'a> {
    /// A storage or uniform buffer, as the shader declares it.
    pub fn buffer(name: &'a str, buffer: &'a Buffer) -> Self {
        Self { name, resource: Resource::Buffer(buffer) }
    }

    /// A combined image sampler.
    pub fn image(name: &'a str, view: ImageView<'a>, sampler: &'a Sampler) -> Self {
        Self { name, resource: Resource::Sampled(Views::one(view), sampler) }
    }

    /// An array of combined image samplers, such as `sampler3D volume[7]`.
    pub fn images(name: &'a str, views: impl IntoIterator<Item = ImageView<'a>>, sampler: &'a Sampler) -> Self {
        Self { name, resource: Resource::Sampled(Views::of(views), sampler) }
    }

    pub fn storage_image(name: &'a str, view: ImageView<'a>) -> Self {
        Self { name, resource: Resource::Storage(Views::one(view)) }
    }

    /// An array of storage images.
    pub fn storage_images(name: &'a str, views: impl IntoIterator<Item = ImageView<'a>>) -> Self {
        Self { name, resource: Resource::Storage(Views::of(views)) }
    }

    fn fits(&self, binding: &Binding) -> bool {
        match &self.resource {
            Resource::Buffer(_) => matches!(binding.kind, BindingKind::Storage | BindingKind::Uniform),
            Resource::Sampled(views, _) => {
                binding.kind == BindingKind::Sampled && views.as_slice().len() == binding.count as usize
            }
            Resource::Storage(views) => {
                binding.kind == BindingKind::StorageImage && views.as_slice().len() == binding.count as usize
            }
        }
    }

    fn describe(&self) -> String {
        match &self.resource {
            Resource::Buffer(_) => "a buffer".to_owned(),
            Resource::Sampled(views, _) => format!("{} sampled image(s)", views.as_slice().len()),
            Resource::Storage(views) => format!("{} storage image(s)", views.as_slice().len()),
        }
    }

    fn labels(&self) -> Vec<String> {
        match &self.resource {
            Resource::Buffer(buffer) => vec![buffer.label().to_owned()],
            Resource::Sampled(views, _) | Resource::Storage(views) => {
                views.as_slice().iter().map(|view| view.raw.label.clone()).collect()
            }
        }
    }

    fn keep(&self, recorder: &mut Recorder) {
        let views = match &self.resource {
            Resource::Buffer(buffer) => return recorder.keep(buffer.raw.clone()),
            Resource::Sampled(views, sampler) => {
                recorder.keep(sampler.raw.clone());
                views
            }
            Resource::Storage(views) => views,
        };
        views.as_slice().iter().for_each(|view| recorder.keep(view.raw.clone()));
    }
}

/// What descriptors point at while they are written; its capacity serves the next command.
#[derive(Default)]
pub(super) struct Infos {
    buffers: Vec<vk::DescriptorBufferInfo>,
    images: Vec<vk::DescriptorImageInfo>,
}

impl Infos {
    fn clear(&mut self) {
        self.buffers.clear();
        self.images.clear();
    }

    fn push(&mut self, bind: &Bind<'_>) {
        let (views, sampler) = match &bind.resource {
            Resource::Buffer(buffer) => {
                let whole = vk::DescriptorBufferInfo { buffer: buffer.raw.handle, offset: 0, range: vk::WHOLE_SIZE };
                return self.buffers.push(whole);
            }
            Resource::Sampled(views, sampler) => (views, sampler.raw.handle),
            Resource::Storage(views) => (views, vk::Sampler::null()),
        };
        let info = |view: &ImageView<'_>| vk::DescriptorImageInfo {
            sampler,
            image_view: view.handle,
            image_layout: vk::ImageLayout::GENERAL,
        };
        self.images.extend(views.as_slice().iter().map(info));
    }
}

/// Binds a pipeline with all its resources and its push block.
///
/// Panics when a binding is missing, unknown or of another kind, or when the push block's size differs, unless it has none.
pub(super) fn bind_pipeline<T: Pod>(
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
    // A form of a shader that reads nothing of its push block has none.
    let push = if wanted == 0 { &[] } else { push };
    assert_eq!(push.len(), wanted, "pass {pass}: the push block has {wanted} bytes, the struct {}", push.len());

    let mut infos = std::mem::take(&mut recorder.recorded.infos);
    infos.clear();
    for binding in &pipeline.bindings {
        infos.push(find(pipeline, binding, binds));
    }
    let device = recorder.context().device();
    // SAFETY: the pipeline is kept below.
    unsafe { device.cmd_bind_pipeline(recorder.handle(), pipeline.bind_point(), pipeline.handle()) };
    push_descriptors(recorder, pipeline, &infos);
    if !push.is_empty() {
        // SAFETY: the block has the size that the layout states.
        unsafe { device.cmd_push_constants(recorder.handle(), pipeline.layout, pipeline.push_stages, 0, push) };
    }
    recorder.recorded.infos = infos;
    recorder.keep(pipeline.clone());
    binds.iter().for_each(|bind| bind.keep(recorder));
}

/// Writes all bindings of the pipeline, in the order of `infos`, a few at a time: so no list of writes is allocated.
fn push_descriptors(recorder: &Recorder, pipeline: &RawPipeline, infos: &Infos) {
    const AT_ONCE: usize = 16;
    let context = recorder.context();
    let mut writes = [vk::WriteDescriptorSet::default(); AT_ONCE];
    let (mut buffers, mut images) = (infos.buffers.as_slice(), infos.images.as_slice());
    for bindings in pipeline.bindings.chunks(AT_ONCE) {
        for (write, binding) in writes.iter_mut().zip(bindings) {
            let to = vk::WriteDescriptorSet::default()
                .dst_binding(binding.binding)
                .descriptor_type(binding.kind.descriptor_type());
            *write = match binding.kind {
                BindingKind::Storage | BindingKind::Uniform => to.buffer_info(take(&mut buffers, 1)),
                BindingKind::Sampled | BindingKind::StorageImage => {
                    to.image_info(take(&mut images, binding.count as usize))
                }
            };
        }
        let (commands, point, writes) = (recorder.handle(), pipeline.bind_point(), &writes[..bindings.len()]);
        // SAFETY: what is bound is kept, and of the kind that the layout states.
        unsafe {
            context.functions.push_descriptor.cmd_push_descriptor_set(commands, point, pipeline.layout, 0, writes)
        };
    }
}

/// The first `count` elements, which `from` then no longer has.
fn take<'a, T>(from: &mut &'a [T], count: usize) -> &'a [T] {
    let (taken, rest) = from.split_at(count);
    *from = rest;
    taken
}

/// What is bound, for the log: (binding name, labels).
pub(super) fn labels(pipeline: &RawPipeline, binds: &[Bind<'_>]) -> Vec<(String, Vec<String>)> {
    let of = |binding: &Binding| (binding.name.clone(), find(pipeline, binding, binds).labels());
    pipeline.bindings.iter().filter(|binding| binding.name != COUNTS).map(of).collect()
}

fn check_names(pipeline: &RawPipeline, binds: &[Bind<'_>]) {
    if shader::are_edited() {
        return;
    }
    for bind in binds {
        if !pipeline.bindings.iter().any(|binding| binding.name == bind.name) {
            let names: Vec<_> = pipeline.bindings.iter().map(|binding| binding.name.as_str()).collect();
            let (pass, names) = (&pipeline.label, names.join(", "));
            panic!("pass {pass}: no stage uses the binding {:?}; there is {names}", bind.name);
        }
    }
}

/// The resource for `binding`.
fn find<'b, 'r>(pipeline: &RawPipeline, binding: &Binding, binds: &'b [Bind<'r>]) -> &'b Bind<'r> {
    let pass = &pipeline.label;
    let mut found = binds.iter().filter(|bind| bind.name == binding.name);
    let bind = found.next().unwrap_or_else(|| panic!("pass {pass}: nothing is bound to {:?}", binding.name));
    assert!(found.next().is_none(), "pass {pass}: {:?} is bound twice", binding.name);
    let (name, kind, count) = (&binding.name, binding.kind, binding.count);
    assert!(bind.fits(binding), "pass {pass}: {name:?} takes {count} {kind:?}, but gets {}", bind.describe());
    bind
}
