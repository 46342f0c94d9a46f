//! Measurement: image error against a reference, and the time of each pass.

pub mod metrics;
pub mod picture;
pub mod terms;
pub mod timing;
pub mod trace;

use crate::vk::Context;
use crate::{Error, Result};

/// Refuses results of a device that reported validation errors.
///
/// # Errors
/// [`Error::Device`] with the first of the validation layer's messages.
pub fn refuse_invalid(context: &Context) -> Result<()> {
    refuse_messages(&context.validation_messages())
}

/// As [`refuse_invalid`], for messages that were taken from a context.
pub fn refuse_messages(messages: &[String]) -> Result<()> {
    match messages.first() {
        Some(first) => Err(Error::Device(format!("the validation layer reports: {first}"))),
        None => Ok(()),
    }
}
