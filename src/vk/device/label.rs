//! Names for validation messages and captures.

use super::context::Context;
use ash::vk;
use std::collections::HashMap;
use std::ffi::CString;
use std::sync::{Mutex, PoisonError};

/// The names of zones as C strings, each created once.
#[derive(Default)]
pub(in crate::vk) struct Labels(Mutex<HashMap<&'static str, CString>>);

/// Names `handle` in validation messages and captures, if debug utilities are enabled.
pub(in crate::vk) fn set_name<T: vk::Handle>(debug: Option<&ash::ext::debug_utils::Device>, handle: T, name: &str) {
    let (Some(debug), Ok(name)) = (debug, CString::new(name)) else { return };
    let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&name);
    // SAFETY: the handle was just created by this device. A failure only leaves it unnamed.
    let _ = unsafe { debug.set_debug_utils_object_name(&info) };
}

impl Context {
    /// Names `handle` in validation messages and captures.
    pub(in crate::vk) fn set_name<T: vk::Handle>(&self, handle: T, name: &str) {
        set_name(self.debug_utils.as_ref(), handle, name);
    }

    pub(in crate::vk) fn begin_label(&self, commands: vk::CommandBuffer, name: &'static str) {
        let Some(debug) = &self.debug_utils else { return };
        let mut known = self.labels.0.lock().unwrap_or_else(PoisonError::into_inner);
        // A zero would end the name early; no pass has one.
        let name = known.entry(name).or_insert_with(|| CString::new(name).unwrap_or_default());
        let label = vk::DebugUtilsLabelEXT::default().label_name(name);
        // SAFETY: the buffer is recording.
        unsafe { debug.cmd_begin_debug_utils_label(commands, &label) };
    }

    pub(in crate::vk) fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(debug) = &self.debug_utils {
            // SAFETY: begun by `begin_label`. With one submission per pass both lie in the same one.
            unsafe { debug.cmd_end_debug_utils_label(commands) };
        }
    }
}
