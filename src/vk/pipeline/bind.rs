//! Resources for the bindings of a pipeline, by name, checked against reflection.

use super::raw_pipeline::RawPipeline;
use super::reflect::{Binding, BindingKind};
use super::shader;
use crate::vk::resource::buffer::Buffer;
use crate::vk::resource::image::ImageView;
use crate::vk::resource::sampler::Sampler;
use crate::vk::resource::structure::Structure;
use arrayvec::ArrayVec;

/// The buffer in which shaders count; it is bound automatically.
pub(in crate::vk) const COUNTS: &str = "counted";

/// A resource for the binding with that name: a buffer, an acceleration structure, or images, which are sampled with a
/// sampler and storage images without.
#[derive(Clone)]
pub struct Bind<'a> {
    pub(in crate::vk) name: &'a str,
    pub(in crate::vk) buffer: Option<&'a Buffer>,
    /// The images; no array in a shader has more than 8 elements.
    pub(in crate::vk) views: ArrayVec<ImageView<'a>, 8>,
    pub(in crate::vk) sampler: Option<&'a Sampler>,
    pub(in crate::vk) structure: Option<&'a Structure>,
}

impl<'a> Bind<'a> {
    /// A storage or uniform buffer, according to the shader's declaration.
    pub fn buffer(name: &'a str, buffer: &'a Buffer) -> Self {
        Self { buffer: Some(buffer), ..Self::storage_images(name, []) }
    }

    /// The acceleration structure of ray queries.
    pub fn structure(name: &'a str, structure: &'a Structure) -> Self {
        Self { structure: Some(structure), ..Self::storage_images(name, []) }
    }

    /// A combined image sampler.
    pub fn image(name: &'a str, view: ImageView<'a>, sampler: &'a Sampler) -> Self {
        Self::images(name, [view], sampler)
    }

    /// An array of combined image samplers, such as `sampler3D volume[7]`.
    pub fn images(name: &'a str, views: impl IntoIterator<Item = ImageView<'a>>, sampler: &'a Sampler) -> Self {
        Self { sampler: Some(sampler), ..Self::storage_images(name, views) }
    }

    pub fn storage_image(name: &'a str, view: ImageView<'a>) -> Self {
        Self::storage_images(name, [view])
    }

    /// An array of storage images.
    pub fn storage_images(name: &'a str, views: impl IntoIterator<Item = ImageView<'a>>) -> Self {
        Self { name, buffer: None, views: views.into_iter().collect(), sampler: None, structure: None }
    }

    fn fits(&self, binding: &Binding) -> bool {
        let images = self.buffer.is_none() && self.views.len() == binding.count as usize;
        match binding.kind {
            BindingKind::Storage | BindingKind::Uniform => self.buffer.is_some(),
            BindingKind::Sampled => images && self.sampler.is_some(),
            BindingKind::StorageImage => images && self.sampler.is_none(),
            BindingKind::Structure => self.structure.is_some(),
        }
    }

    fn describe(&self) -> String {
        match (self.buffer, self.sampler) {
            _ if self.structure.is_some() => "an acceleration structure".to_owned(),
            (Some(_), _) => "a buffer".to_owned(),
            (None, Some(_)) => format!("{} sampled image(s)", self.views.len()),
            (None, None) => format!("{} storage image(s)", self.views.len()),
        }
    }

    fn labels(&self) -> Vec<String> {
        let buffer = self.buffer.map(|buffer| buffer.label().to_owned());
        let structure = self.structure.map(|structure| structure.top.label.clone());
        let views = self.views.iter().map(|view| view.raw.label.clone());
        buffer.into_iter().chain(structure).chain(views).collect()
    }
}

/// The bound resources for the log: (binding name, labels).
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
