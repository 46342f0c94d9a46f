//! Resources for a pipeline's bindings, by name, checked against reflection.

use super::buffer::Buffer;
use super::image::ImageView;
use super::pipeline::RawPipeline;
use super::recorder::Recorder;
use super::reflect::{Binding, BindingKind};
use super::sampler::Sampler;
use ash::vk;
use bytemuck::Pod;
use std::sync::Arc;

/// Where counting shaders add up; bound by itself.
pub(super) const COUNTS: &str = "counts";

#[derive(Clone)]
enum Resource<'a> {
    Buffer(&'a Buffer),
    Sampled(Vec<ImageView<'a>>, &'a Sampler),
    Storage(Vec<ImageView<'a>>),
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
        Self { name, resource: Resource::Sampled(vec![view], sampler) }
    }

    /// An array of combined image samplers, such as `sampler3D volume[7]`.
    pub fn images(name: &'a str, views: impl IntoIterator<Item = ImageView<'a>>, sampler: &'a Sampler) -> Self {
        Self { name, resource: Resource::Sampled(views.into_iter().collect(), sampler) }
    }

    pub fn storage_image(name: &'a str, view: ImageView<'a>) -> Self {
        Self { name, resource: Resource::Storage(vec![view]) }
    }

    /// An array of storage images.
    pub fn storage_images(name: &'a str, views: impl IntoIterator<Item = ImageView<'a>>) -> Self {
        Self { name, resource: Resource::Storage(views.into_iter().collect()) }
    }

    fn fits(&self, binding: &Binding) -> bool {
        match &self.resource {
            Resource::Buffer(_) => matches!(binding.kind, BindingKind::Storage | BindingKind::Uniform),
            Resource::Sampled(views, _) => {
                binding.kind == BindingKind::Sampled && views.len() == binding.count as usize
            }
            Resource::Storage(views) => {
                binding.kind == BindingKind::StorageImage && views.len() == binding.count as usize
            }
        }
    }

    fn describe(&self) -> String {
        match &self.resource {
            Resource::Buffer(_) => "a buffer".to_owned(),
            Resource::Sampled(views, _) => format!("{} sampled image(s)", views.len()),
            Resource::Storage(views) => format!("{} storage image(s)", views.len()),
        }
    }

    fn labels(&self) -> Vec<String> {
        match &self.resource {
            Resource::Buffer(buffer) => vec![buffer.label().to_owned()],
            Resource::Sampled(views, _) | Resource::Storage(views) => {
                views.iter().map(|view| view.raw.label.clone()).collect()
            }
        }
    }

    fn keep(&self, recorder: &mut Recorder) {
        match &self.resource {
            Resource::Buffer(buffer) => recorder.keep(buffer.raw.clone()),
            Resource::Sampled(views, sampler) => {
                recorder.keep(sampler.raw.clone());
                views.iter().for_each(|view| recorder.keep(view.raw.clone()));
            }
            Resource::Storage(views) => views.iter().for_each(|view| recorder.keep(view.raw.clone())),
        }
    }

    fn image_infos(&self) -> Vec<vk::DescriptorImageInfo> {
        let (views, sampler) = match &self.resource {
            Resource::Buffer(_) => (&[][..], vk::Sampler::null()),
            Resource::Sampled(views, sampler) => (views.as_slice(), sampler.raw.handle),
            Resource::Storage(views) => (views.as_slice(), vk::Sampler::null()),
        };
        let info = |view: &ImageView<'_>| vk::DescriptorImageInfo {
            sampler,
            image_view: view.handle,
            image_layout: vk::ImageLayout::GENERAL,
        };
        views.iter().map(info).collect()
    }

    fn buffer_infos(&self) -> Vec<vk::DescriptorBufferInfo> {
        let Resource::Buffer(buffer) = &self.resource else { return Vec::new() };
        vec![vk::DescriptorBufferInfo { buffer: buffer.raw.handle, offset: 0, range: vk::WHOLE_SIZE }]
    }
}

/// Binds a pipeline with all its resources and its push block; returns (binding name, labels) for the log.
///
/// Panics when a binding is missing, unknown or of another kind, or when the push block's size differs.
pub(super) fn bind_pipeline<T: Pod>(
    recorder: &mut Recorder,
    pipeline: &Arc<RawPipeline>,
    point: vk::PipelineBindPoint,
    binds: &[Bind<'_>],
    push: &T,
) -> Vec<(String, Vec<String>)> {
    let counts = recorder.counts_of(pipeline);
    let with_counts: Vec<Bind<'_>>;
    let binds = match &counts {
        Some(counts) => {
            with_counts = binds.iter().cloned().chain([Bind::buffer(COUNTS, counts)]).collect();
            &with_counts
        }
        None => binds,
    };
    let pairs = pair(pipeline, binds);
    let push = bytemuck::bytes_of(push);
    let (pass, wanted) = (&pipeline.label, pipeline.push_bytes as usize);
    assert_eq!(push.len(), wanted, "pass {pass}: the push block has {wanted} bytes, the struct {}", push.len());

    let infos: Vec<_> = pairs.iter().map(|(_, bind)| (bind.buffer_infos(), bind.image_infos())).collect();
    let writes: Vec<_> = pairs
        .iter()
        .zip(&infos)
        .map(|((binding, _), (buffers, images))| {
            let write = vk::WriteDescriptorSet::default()
                .dst_binding(binding.binding)
                .descriptor_type(binding.kind.descriptor_type());
            if images.is_empty() { write.buffer_info(buffers) } else { write.image_info(images) }
        })
        .collect();
    let context = recorder.context().clone();
    let (device, commands) = (context.device(), recorder.handle());
    // SAFETY: the pipeline and what is bound are kept; every binding of the layout is written.
    unsafe {
        device.cmd_bind_pipeline(commands, point, pipeline.handle);
        if !writes.is_empty() {
            context.functions.push_descriptor.cmd_push_descriptor_set(commands, point, pipeline.layout, 0, &writes);
        }
        if !push.is_empty() {
            device.cmd_push_constants(commands, pipeline.layout, pipeline.push_stages, 0, push);
        }
    }
    recorder.keep(pipeline.clone());
    binds.iter().for_each(|bind| bind.keep(recorder));
    pairs.iter().map(|(binding, bind)| (binding.name.clone(), bind.labels())).collect()
}

/// Each binding of the pipeline with the resource of its name.
fn pair<'p, 'b, 'r>(pipeline: &'p RawPipeline, binds: &'b [Bind<'r>]) -> Vec<(&'p Binding, &'b Bind<'r>)> {
    let pass = &pipeline.label;
    for bind in binds {
        let known = pipeline.bindings.iter().any(|binding| binding.name == bind.name);
        let names: Vec<_> = pipeline.bindings.iter().map(|binding| binding.name.as_str()).collect();
        assert!(known, "pass {pass}: no stage uses the binding {:?}; there is {}", bind.name, names.join(", "));
    }
    let find = |binding: &'p Binding| {
        let mut found = binds.iter().filter(|bind| bind.name == binding.name);
        let bind = found.next().unwrap_or_else(|| panic!("pass {pass}: nothing is bound to {:?}", binding.name));
        assert!(found.next().is_none(), "pass {pass}: {:?} is bound twice", binding.name);
        let (name, kind, count) = (&binding.name, binding.kind, binding.count);
        assert!(bind.fits(binding), "pass {pass}: {name:?} takes {count} {kind:?}, but gets {}", bind.describe());
        (binding, bind)
    };
    pipeline.bindings.iter().map(find).collect()
}
