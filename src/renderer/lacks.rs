//! Requirements of settings beyond those of every frame, and the requirements that a device does not meet.

use std::sync::LazyLock;

use crate::settings::{Method, Settings};
use crate::vk::{BindingKind, DeviceReport, ShaderStage, shader};

/// The maximum use of limited resources by one stage of a shader.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StageNeeds {
    pub storage_buffers: u32,
    pub storage_images: u32,
    /// The number of colours, storage buffers and storage images that a fragment shader writes.
    pub fragment_outputs: u32,
}

impl StageNeeds {
    fn of_shader(name: &str) -> Self {
        let (info, bindings) = shader::reflected(name);
        let count = |kind: BindingKind, written: bool| {
            let counted = bindings.iter().filter(|binding| binding.kind == kind && (!written || !binding.read_only));
            counted.map(|binding| binding.count).sum::<u32>()
        };
        let written = count(BindingKind::Storage, true) + count(BindingKind::StorageImage, true) + info.outputs as u32;
        Self {
            storage_buffers: count(BindingKind::Storage, false),
            storage_images: count(BindingKind::StorageImage, false),
            fragment_outputs: if info.stage == ShaderStage::Fragment { written } else { 0 },
        }
    }

    fn max(self, other: Self) -> Self {
        Self {
            storage_buffers: self.storage_buffers.max(other.storage_buffers),
            storage_images: self.storage_images.max(other.storage_images),
            fragment_outputs: self.fragment_outputs.max(other.fragment_outputs),
        }
    }
}

/// The method that the shader `name` belongs to; `None` if frames of every method may run it.
pub fn method_of(name: &str) -> Option<Method> {
    // Only cones have volumes of face radiance.
    if name.starts_with("ground/faces/") {
        return Some(Method::Cones);
    }
    let mut words = name.split(['/', ' ', '.']);
    words.find_map(|word| Method::ALL.iter().copied().find(|method| method.name() == word))
}

/// Whether frames run the shader; tests and measurements have their own shaders.
fn is_of_frames(name: &str) -> bool {
    !name.starts_with("test/") && !name.starts_with("profile/") && !name.contains("/measured/")
}

/// The maximum over the shaders of a method and the shared ones.
pub fn stage_needs(method: Method) -> StageNeeds {
    static OF_SHADERS: LazyLock<Vec<(Option<Method>, StageNeeds)>> = LazyLock::new(|| {
        let names = shader::names().filter(|name| is_of_frames(name));
        names.map(|name| (method_of(name), StageNeeds::of_shader(name))).collect()
    });
    let own = OF_SHADERS.iter().filter(|(of, _)| of.is_none_or(|of| of == method));
    own.fold(StageNeeds::default(), |most, (_, needs)| most.max(*needs))
}

/// Requirements of frames with these settings that a device does not meet: names from the Vulkan specification, with
/// the minimum value of a limit.
pub fn lacks(device: &DeviceReport, settings: &Settings) -> Vec<String> {
    let asked = settings.grid.conservative.needs();
    let own = device.wishes.iter().filter(|need| asked.contains(&need.name.as_str()));
    let missing = device.needs.iter().chain(own).filter(|need| !need.present).map(|need| need.name.clone());
    let (limits, needs) = (&device.limits, stage_needs(settings.method));
    let least = [
        ("maxPerStageDescriptorStorageBuffers", limits.max_per_stage_descriptor_storage_buffers, needs.storage_buffers),
        ("maxPerStageDescriptorStorageImages", limits.max_per_stage_descriptor_storage_images, needs.storage_images),
        ("maxFragmentCombinedOutputResources", limits.max_fragment_combined_output_resources, needs.fragment_outputs),
    ];
    let below = least.into_iter().filter(|(_, has, needed)| has < needed);
    missing.chain(below.map(|(name, _, needed)| format!("{name} {needed}"))).collect()
}
