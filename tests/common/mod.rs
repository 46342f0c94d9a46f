//! GPU test support: one validated context per test binary, and the rule that a validation message fails the test.

use std::sync::{Arc, OnceLock};
use twobounce::vk::{Context, ContextOptions};

/// The device under test, always under the validation layer. A missing loader, layer or device fails the test.
pub fn gpu() -> Arc<Context> {
    static GPU: OnceLock<Arc<Context>> = OnceLock::new();
    GPU.get_or_init(new_gpu).clone()
}

/// A context of its own, for a test that counts bytes or plants a fault.
pub fn new_gpu() -> Arc<Context> {
    Context::new(&ContextOptions { device: None, validation: true })
        .unwrap_or_else(|error| panic!("GPU tests need a Vulkan device and the validation layer: {error}"))
}

/// Fails on any error or warning of the validation layer so far.
pub fn assert_clean(context: &Context) {
    let messages = context.validation_messages();
    assert!(messages.is_empty(), "the validation layer says:\n{}", messages.join("\n"));
}
