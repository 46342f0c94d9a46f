//! Chooses a device and opens it.

use super::features::Features;
use super::host::HostDevice;
use super::instance::{DeviceKind, Instance, VERSION};
use super::needs::Capabilities;
use crate::{Error, Result};
use ash::vk;
use std::ffi::CStr;
use std::sync::{Arc, Mutex};

/// The requested device, or the best one; `Error::Device` if it lacks a requirement.
pub(in crate::vk) fn choose(instance: &Instance, wanted: Option<&str>) -> Result<(vk::PhysicalDevice, Capabilities)> {
    let variable = std::env::var("TWOBOUNCE_DEVICE").ok().filter(|value| !value.is_empty());
    let wanted = wanted.or(variable.as_deref());
    let mut found: Vec<_> = instance
        .physical_devices()?
        .into_iter()
        .map(|physical| (physical, Capabilities::query(&instance.raw, VERSION, physical)))
        .collect();
    let names: Vec<_> = found.iter().map(|(_, capabilities)| capabilities.name()).collect();
    let index = match wanted {
        Some(wanted) => pick(wanted, &names)?,
        None => {
            let rank = |&i: &usize| {
                let (_, capabilities) = &found[i];
                (!capabilities.missing().is_empty(), DeviceKind::of_type(capabilities.properties.device_type))
            };
            (0..found.len()).min_by_key(rank).expect("the list is not empty")
        }
    };
    let missing = found[index].1.missing();
    if missing.is_empty() {
        return Ok(found.swap_remove(index));
    }
    Err(Error::Device(format!(
        "{} lacks {}: choose another device with --device (twobounce info lists them) or update its driver",
        names[index],
        missing.join(", ")
    )))
}

/// Index of the device that `wanted` selects: by an index, or by a part of a name in any case.
fn pick(wanted: &str, names: &[String]) -> Result<usize> {
    if let Ok(index) = wanted.parse::<usize>()
        && index < names.len()
    {
        return Ok(index);
    }
    let lower = wanted.to_lowercase();
    names.iter().position(|name| name.to_lowercase().contains(&lower)).ok_or_else(|| {
        let list: Vec<_> = names.iter().enumerate().map(|(i, name)| format!("{i}: {name}")).collect();
        Error::Device(format!("no Vulkan device is called {wanted:?}; there is {}", list.join(", ")))
    })
}

/// Creates a device with exactly these extensions and features, and one queue. If
/// `VK_KHR_pipeline_executable_properties` is among the extensions, its feature is enabled.
pub(in crate::vk) fn open<'a>(
    instance: &Instance,
    physical: vk::PhysicalDevice,
    queue_family: u32,
    extensions: &'a [&'a CStr],
    features: Features,
) -> std::result::Result<HostDevice<'a>, vk::Result> {
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
    let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let mut chained = features.structs();
    let info = vk::DeviceCreateInfo::default().queue_create_infos(&queues).enabled_extension_names(&names);
    let mut executables =
        vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR::default().pipeline_executable_info(true);
    let mut info = chained.chain(info);
    if extensions.contains(&ash::khr::pipeline_executable_properties::NAME) {
        info = info.push_next(&mut executables);
    }
    let mut subset = vk::PhysicalDevicePortabilitySubsetFeaturesKHR::default();
    if extensions.contains(&ash::khr::portability_subset::NAME) {
        // All queried features are enabled.
        let mut kept = vk::PhysicalDeviceFeatures2::default().push_next(&mut subset);
        // SAFETY: the device has the extension that the chained structure belongs to.
        unsafe { instance.raw.get_physical_device_features2(physical, &mut kept) };
        subset.p_next = std::ptr::null_mut();
        info = info.push_next(&mut subset);
    }
    // SAFETY: the caller checked that every extension and feature exists.
    let device = unsafe { instance.raw.create_device(physical, &info, None) }?;
    // SAFETY: the family has the requested queue.
    let queue = unsafe { device.get_device_queue(queue_family, 0) };
    Ok(HostDevice {
        instance: instance.raw.clone(),
        api_version: VERSION,
        physical_device: physical,
        device,
        queue_family,
        queue: Some(Arc::new(Mutex::new(queue))),
        allocator: None,
        pipeline_cache: None,
        instance_extensions: if instance.debug_utils { &[ash::ext::debug_utils::NAME] } else { &[] },
        device_extensions: extensions,
        features,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_picked_by_index_or_part_of_its_name() {
        let names = ["NVIDIA H200".to_owned(), "llvmpipe (LLVM 15.0.6, 256 bits)".to_owned()];
        assert_eq!(pick("1", &names).unwrap(), 1);
        assert_eq!(pick("LLVMpipe", &names).unwrap(), 1);
        assert_eq!(pick("200", &names).unwrap(), 0, "a number that is no index is a part of a name");
        let message = pick("radeon", &names).unwrap_err().to_string();
        assert!(message.contains("radeon") && message.contains("0: NVIDIA H200"), "{message}");
    }
}
