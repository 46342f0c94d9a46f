//! Entry points that depend on the device's version.

use ash::vk;
use std::ffi::{CStr, CString};

/// A device older than Vulkan 1.3, with the functions of its extensions for dynamic rendering and barriers under the
/// names of 1.3.
pub(in crate::vk) fn with_promoted(instance: &ash::Instance, device: vk::Device) -> ash::Device {
    // SAFETY: the device comes from this instance.
    let find = |name: &CStr| unsafe { instance.get_device_proc_addr(device, name.as_ptr()) };
    let load = |name: &CStr| {
        let of_extension = CString::new([name.to_bytes(), b"KHR"].concat()).expect("a name has no zero");
        find(&of_extension).or_else(|| find(name)).map_or(std::ptr::null(), |function| function as *const _)
    };
    // SAFETY: an extension's function has the signature of the one that it was promoted to.
    unsafe { ash::Device::load_with(load, device) }
}
