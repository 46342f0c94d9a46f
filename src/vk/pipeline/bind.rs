//! Resources for a pipeline's bindings, by name, checked against reflection.

use super::raw_pipeline::RawPipeline;
use super::reflect::{Binding, BindingKind};
use super::shader;
use crate::vk::resource::buffer::Buffer;
use crate::vk::resource::image::ImageView;
use crate::vk::resource::sampler::Sampler;
use crate::vk::resource::views::Views;

/// Where counting shaders add up; bound by itself.
pub(in crate::vk) const COUNTS: &str = "counted";

#[derive(Clone)]
pub(in crate::vk) enum Resource<'a> {
    Buffer(&'a Buffer),
    Sampled(Views<'a>, &'a Sampler),
    Storage(Views<'a>),
}

/// A resource for the binding of that name.
#[derive(Clone)]
pub struct Bind<'a> {
    pub(in crate::vk) name: &'a str,
    pub(in crate::vk) resource: Resource<'a>,
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
}

/// The bound resources, for the log: (binding name, labels).
pub(in crate::vk) fn labels(pipeline: &RawPipeline, binds: &[Bind<'_>]) -> Vec<(String, Vec<String>)> {
    let of = |binding: &Binding| (binding.name.clone(), find(pipeline, binding, binds).labels());
    pipeline.bindings.iter().filter(|binding| binding.name != COUNTS).map(of).collect()
}

pub(in crate::vk) fn check_names(pipeline: &RawPipeline, binds: &[Bind<'_>]) {
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
pub(in crate::vk) fn find<'b, 'r>(pipeline: &RawPipeline, binding: &Binding, binds: &'b [Bind<'r>]) -> &'b Bind<'r> {
    let pass = &pipeline.label;
    let mut found = binds.iter().filter(|bind| bind.name == binding.name);
    let bind = found.next().unwrap_or_else(|| panic!("pass {pass}: nothing is bound to {:?}", binding.name));
    assert!(found.next().is_none(), "pass {pass}: {:?} is bound twice", binding.name);
    let (name, kind, count) = (&binding.name, binding.kind, binding.count);
    assert!(bind.fits(binding), "pass {pass}: {name:?} takes {count} {kind:?}, but gets {}", bind.describe());
    bind
}
