//! Recording again over a warm slot allocates nothing on the heap. The test is a binary of its own, because it counts
//! the allocations of the process.

use crate::vk_common::{Host, HostFrame};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use twobounce::vk::{
    Bind, Buffer, BufferKind, ColorTarget, Compute, ComputeDesc, DrawCall, Format, Image, ImageDesc, ImageUsageFlags,
    Load, Raster, RasterDesc, Recorder, RenderTarget, Slot, SlotOptions, ZoneKind,
};

/// The system's allocator; each thread counts its calls.
struct CountingAllocator;

thread_local! {
    static CALLS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is passed on unchanged.
unsafe impl GlobalAlloc for CountingAllocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        CALLS.with(|calls| calls.set(calls.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static HEAP: CountingAllocator = CountingAllocator;

/// Allocations of one frame's recording over a warm slot, whatever the number of its commands.
const ALLOCATIONS: u64 = 0;
/// Number of commands of each kind.
const PASSES: usize = 10;

#[test]
fn recording_over_a_warm_slot_takes_nothing_from_the_heap() {
    let host = Host::new();
    let context = host.adopt(|_| ()).unwrap();
    let pass = ComputeDesc { label: "copy", shader: "test/copy.comp", constants: &[("SCALE", 1u32.into())] };
    let pass = Compute::new(&context, &pass).unwrap();
    let formats = [Format::R32G32B32A32_SFLOAT, Format::R16G16B16A16_SFLOAT];
    let draw = RasterDesc {
        label: "slices",
        vertex: "test/slices.vert",
        fragment: Some("test/slices.frag"),
        color_formats: &formats,
        ..Default::default()
    };
    let draw = Raster::new(&context, &draw).unwrap();
    let images = formats.map(|format| {
        let usage = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::TRANSFER_DST;
        let desc = ImageDesc { label: "image", format, width: 8, height: 8, usage, ..Default::default() };
        Image::new(&context, &desc).unwrap()
    });
    let [a, b] = ["a", "b"].map(|label| Buffer::new(&context, label, 4096, BufferKind::Device).expect("a buffer"));
    let record = |r: &mut Recorder| {
        r.zone("words", ZoneKind::Transfer, 0, |r| {
            r.fill(&a, 0, 64, 1);
            r.full_barrier();
            r.update(&a, 0, &[0_u8; 16]);
            r.clear(&images[0]);
            r.full_barrier();
            r.copy(&a, &b);
            r.full_barrier();
        });
        for _ in 0..PASSES {
            r.zone("compute", ZoneKind::Compute, 0, |r| {
                let binds = [Bind::buffer("target", &b), Bind::buffer("source", &a)];
                r.dispatch(&pass, &binds, &[4_u32, 0], [1, 1, 1]);
                r.full_barrier();
            });
            r.zone("raster", ZoneKind::Raster, 0, |r| {
                let colors = [&images[0], &images[1]].map(|image| ColorTarget {
                    view: image.attachment_view(0),
                    resolve: None,
                    load: Load::Clear([0.0; 4]),
                    store: true,
                });
                let target = RenderTarget { colors: &colors, width: 8, height: 8, ..Default::default() };
                r.raster(&target, |pass| pass.draw(&draw, &[], &(), DrawCall::Direct { vertices: 3, instances: 1 }));
                r.full_barrier();
            });
        }
    };
    let frame = HostFrame::new(&host);
    let mut slot = Slot::new(&context, SlotOptions { timestamps: true, log: false }).unwrap();
    let bytes = context.allocated_bytes();
    let calls = [(); 4].map(|()| {
        frame.wait();
        frame.begin();
        let before = CALLS.get();
        // SAFETY: the last recording was waited for, and this one is before the slot is dropped.
        unsafe { Recorder::on(&context, frame.commands, &mut slot, record) };
        let calls = CALLS.get() - before;
        frame.submit(&host);
        calls
    });
    assert!(calls[0] > 0, "the first recording makes lists and labels: {calls:?}");
    assert_eq!(calls[1..], [ALLOCATIONS; 3], "{calls:?}");
    assert_eq!(context.allocated_bytes(), bytes);
    frame.wait();
    assert_eq!(slot.timings(&context).unwrap().unwrap().zones.len(), 1 + 2 * PASSES);
    drop((frame, slot, pass, draw, images, a, b, context));
    host.close();
}
