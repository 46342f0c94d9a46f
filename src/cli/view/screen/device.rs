//! The instance and the device that present, and what the validation layer says of them.

use std::ffi::CStr;
use std::sync::atomic::{AtomicU32, Ordering};

use anyhow::anyhow;
use ash::{khr, vk};
use winit::raw_window_handle::RawDisplayHandle;

use crate::cli::view::NoWindow;

const VALIDATION_LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Errors and warnings of the validation layer so far.
static MESSAGES: AtomicU32 = AtomicU32::new(0);

pub type Messenger = (ash::ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT);

/// What presents to this display, and what listens to the validation layer.
pub fn instance(
    entry: &ash::Entry,
    display: RawDisplayHandle,
    validation: bool,
) -> anyhow::Result<(ash::Instance, Option<Messenger>)> {
    let mut extensions = ash_window::enumerate_required_extensions(display)
        .map_err(|e| NoWindow::because(format!("Vulkan cannot present to this display: {e}")))?
        .to_vec();
    let mut layers = vec![];
    if validation {
        layers.push(VALIDATION_LAYER.as_ptr());
        extensions.push(ash::ext::debug_utils::NAME.as_ptr());
    }
    let application = vk::ApplicationInfo::default().application_name(c"twobounce").api_version(vk::API_VERSION_1_3);
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if validation {
        info = info.push_next(&mut features);
    }
    // SAFETY: the info and all that it points to live through the call.
    let instance = unsafe { entry.create_instance(&info, None) }
        .map_err(|e| NoWindow::because(format!("Vulkan cannot present to this display: {e}")))?;
    let messenger = validation.then(|| listen(entry, &instance)).transpose()?;
    Ok((instance, messenger))
}

/// The device that makes the frames, where it presents too, else the first one that presents.
pub fn choose(
    instance: &ash::Instance,
    functions: &khr::surface::Instance,
    surface: vk::SurfaceKHR,
    name: &str,
) -> anyhow::Result<(vk::PhysicalDevice, u32)> {
    // SAFETY: the instance is alive, as is the surface.
    unsafe {
        let mut found = vec![];
        for physical in instance.enumerate_physical_devices()? {
            let extensions = instance.enumerate_device_extension_properties(physical)?;
            let properties = instance.get_physical_device_properties(physical);
            let presents = extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME));
            if !presents || properties.api_version < vk::API_VERSION_1_3 {
                continue;
            }
            let families = instance.get_physical_device_queue_family_properties(physical);
            let family = (0..families.len() as u32).find(|&family| {
                families[family as usize].queue_flags.contains(vk::QueueFlags::GRAPHICS)
                    && functions.get_physical_device_surface_support(physical, family, surface).unwrap_or(false)
            });
            let is_it = properties.device_name_as_c_str().is_ok_and(|own| own.to_string_lossy() == name);
            found.extend(family.map(|family| (!is_it, physical, family)));
        }
        let best = found.into_iter().min_by_key(|(other, ..)| *other);
        let (_, physical, family) =
            best.ok_or_else(|| NoWindow::because("no Vulkan 1.3 device presents to this display"))?;
        Ok((physical, family))
    }
}

fn listen(entry: &ash::Entry, instance: &ash::Instance) -> anyhow::Result<Messenger> {
    use vk::{DebugUtilsMessageSeverityFlagsEXT as Severity, DebugUtilsMessageTypeFlagsEXT as Type};
    let debug = ash::ext::debug_utils::Instance::new(entry, instance);
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::VALIDATION)
        .pfn_user_callback(Some(on_message));
    // SAFETY: the callback uses nothing but a static.
    let messenger = unsafe { debug.create_debug_utils_messenger(&info, None) }?;
    Ok((debug, messenger))
}

unsafe extern "system" fn on_message(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    _: *mut std::ffi::c_void,
) -> vk::Bool32 {
    // SAFETY: the layer passes valid data.
    let text = unsafe { (*data).message_as_c_str() }.map(|text| text.to_string_lossy().into_owned());
    crate::cli::out::warn(&format!("validation: {}", text.unwrap_or_default()));
    MESSAGES.fetch_add(1, Ordering::Relaxed);
    vk::FALSE
}

/// An error where the validation layer said anything.
pub fn refuse_invalid() -> anyhow::Result<()> {
    match MESSAGES.load(Ordering::Relaxed) {
        0 => Ok(()),
        count => Err(anyhow!("the validation layer has {count} messages about the window")),
    }
}
