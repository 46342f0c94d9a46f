//! The validation layer is active: it reports a planted hazard and a planted misuse. And a device that does not exist
//! is refused.

use crate::gpu;

use std::sync::Arc;
use twobounce::vk::{self, Bind, Compute, ComputeDesc, Context, ContextOptions, Recorder, RecorderOptions, ZoneKind};

/// One dispatch writes the bytes that the next one reads; without a barrier between them that is a hazard.
fn write_then_read(context: &Arc<Context>, barrier: bool) {
    let desc = ComputeDesc { label: "copy", shader: "test/copy.comp", constants: &[("SCALE", 1u32.into())] };
    let pass = Compute::new(context, &desc).unwrap();
    let buffers = ["a", "b", "c"].map(|label| vk::upload(context, label, &[0_u32; 64]).unwrap());
    let mut recorder = Recorder::new(context, RecorderOptions::default()).unwrap();
    recorder.zone("copies", ZoneKind::Compute, 512, |r| {
        for (source, target) in [(0, 1), (1, 2)] {
            let binds = [Bind::buffer("source", &buffers[source]), Bind::buffer("target", &buffers[target])];
            r.dispatch(&pass, &binds, &[4_u32, 0], [1, 1, 1]);
            if barrier {
                r.full_barrier();
            }
        }
    });
    recorder.finish().unwrap();
}

#[test]
fn a_missing_barrier_is_seen() {
    let context = gpu::own_context();
    write_then_read(&context, true);
    gpu::assert_clean(&context);
    write_then_read(&context, false);
    let messages = context.take_validation_messages();
    assert!(messages.iter().any(|message| message.contains("READ-AFTER-WRITE")), "{messages:?}");
}

#[test]
fn a_misuse_is_seen() {
    let context = gpu::own_context();
    let buffer = vk::upload(&context, "buffer", &[0_u32; 64]).unwrap();
    let mut recorder = Recorder::new(&context, RecorderOptions::default()).unwrap();
    recorder.fill(&buffer, 2, 4, 0); // the offset must be a multiple of 4
    drop(recorder);
    let messages = context.take_validation_messages();
    assert!(messages.iter().any(|message| message.contains("vkCmdFillBuffer")), "{messages:?}");
}

#[test]
fn an_unknown_device_is_refused_with_a_list() {
    let options = ContextOptions { device: Some("no such device".into()), validation: false };
    let Err(error) = Context::new(&options) else { panic!("accepted") };
    let message = error.to_string();
    assert!(message.contains("no such device") && message.contains("0: "), "{message}");
    let devices = vk::devices().unwrap();
    assert!(message.contains(&devices[0].name), "{message}");
}

#[test]
fn a_context_states_what_it_runs_on() {
    let context = gpu::context();
    let devices = vk::devices().unwrap();
    let report = devices.iter().find(|device| device.name == context.name).unwrap();
    assert!(report.needs.iter().all(|need| need.present), "{:?}", report.needs);
    assert_eq!(report.driver, context.driver);
    assert!(context.api_version >= (1, 2, 0));
    assert!(context.memory_budget() > 0);
}
