//! Measurement: image error against a reference, and the time of each pass.

pub mod metrics;
pub mod picture;
pub mod terms;
pub mod timing;
pub mod trace;

use crate::vk::Context;
use crate::{Error, Result};

/// Refuses the result of a device that was used wrongly.
///
/// # Errors
/// [`Error::Device`] with the first of the validation layer's messages.
pub fn refuse_invalid(context: &Context) -> Result<()> {
    match context.validation_messages().first() {
        Some(first) => Err(Error::Device(format!("the validation layer reports: {first}"))),
        None => Ok(()),
    }
}
