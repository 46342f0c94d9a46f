//! Several submissions in flight at once: each sees the writes of those before it, and keeps its resources alive.

use crate::gpu;

use twobounce::vk::{self, Bind, Compute, ComputeDesc, Recorder, RecorderOptions, ZoneKind};

const DESC: ComputeDesc<'static> = ComputeDesc { label: "increment", shader: "test/increment.comp", constants: &[] };

#[test]
fn two_in_flight_run_one_after_the_other() {
    let context = gpu::own_context();
    let values = vk::upload(&context, "values", &[0_u32; 64 * 64]).unwrap();
    let pass = Compute::new(&context, &DESC).unwrap();
    let submit = |name| {
        let mut recorder = Recorder::new(&context, RecorderOptions::default()).unwrap();
        recorder.zone(name, ZoneKind::Compute, 4, |r| {
            r.dispatch(&pass, &[Bind::buffer("values", &values)], &(), [64, 1, 1]);
        });
        assert!(recorder.frame_log().zones.is_empty(), "a log is kept only where it is asked for");
        recorder.submit().unwrap()
    };
    let bytes = context.allocated_bytes();
    for _ in 0..4 {
        let (first, second) = (submit("first"), submit("second"));
        while !second.poll().unwrap() {
            std::thread::yield_now();
        }
        assert!(first.poll().unwrap(), "submitted before, so over before");
        for (pending, name) in [(second, "second"), (first, "first")] {
            let timings = pending.wait().unwrap();
            assert_eq!(timings.zones.iter().map(|zone| zone.name).collect::<Vec<_>>(), [name]);
            assert!(timings.zones[0].gpu_ms > 0.0 && timings.wall_ms >= timings.gpu_ms);
        }
    }
    assert_eq!(context.allocated_bytes(), bytes);
    assert_eq!(vk::download::<u32>(&context, &values).unwrap(), [8; 64 * 64]);
    gpu::assert_clean(&context);
}

#[test]
fn what_is_in_flight_is_kept_and_waited_for_when_dropped() {
    let values = vk::upload(&gpu::context(), "values", &[0_u32; 64]).unwrap();
    let copy = vk::Buffer::new(&gpu::context(), "copy", 256, vk::BufferKind::Readback).unwrap();
    let pass = Compute::new(&gpu::context(), &DESC).unwrap();
    let mut recorder = Recorder::new(&gpu::context(), RecorderOptions::default()).unwrap();
    recorder.dispatch(&pass, &[Bind::buffer("values", &values)], &(), [1, 1, 1]);
    recorder.full_barrier();
    recorder.copy(&values, &copy);
    let pending = recorder.submit().unwrap();
    drop((values, pass));
    drop(pending);
    assert_eq!(copy.read::<u32>(), [1; 64]);
    gpu::assert_clean(&gpu::context());
}

/// A host records on one thread and waits on another.
#[test]
fn what_a_host_holds_goes_to_other_threads() {
    fn send<T: Send>() {}
    fn sync<T: Sync>() {}
    send::<Recorder>();
    send::<vk::Pending>();
    send::<vk::Slot>();
    sync::<vk::Context>();
    send::<vk::Context>();
}
