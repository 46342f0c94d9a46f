//! Work within a host: its device, its command buffers, its submissions.

use crate::vk_common::{Host, HostFrame};
use bytemuck::{Pod, Zeroable};
use std::sync::Arc;
use twobounce::Error;
use twobounce::vk::ash::vk as raw;
use twobounce::vk::{
    self, Bind, Buffer, BufferKind, ColorTarget, Compute, ComputeDesc, Context, DrawCall, Format, Image, ImageDesc,
    ImageRegion, ImageUsageFlags, Load, Raster, RasterDesc, Recorder, RecorderOptions, RenderTarget, Slot, SlotOptions,
    ZoneKind,
};

/// Twin of `Item` in `glsl/test/common.glsl`.
#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Item {
    position: [f32; 3],
    count: u32,
    weights: [[f32; 2]; 2],
}

const EDGE: u32 = 8;
const ITEMS: u32 = 64;

/// A compute and a raster pass, and the resources that both frames in flight share.
struct Passes {
    compute: Compute,
    raster: Raster,
    source: Buffer,
    target: Buffer,
    images: [Image; 2],
}

impl Passes {
    fn new(context: &Arc<Context>) -> Self {
        let buffer = |label, bytes| Buffer::new(context, label, bytes, BufferKind::Device).expect("a buffer");
        let formats = [Format::R32G32B32A32_SFLOAT, Format::R16G16B16A16_SFLOAT];
        let image = |format| {
            let usage = ImageUsageFlags::COLOR_ATTACHMENT | ImageUsageFlags::TRANSFER_SRC;
            let desc = ImageDesc { label: "image", format, width: EDGE, height: EDGE, usage, ..Default::default() };
            Image::new(context, &desc).expect("an image")
        };
        let raster = RasterDesc {
            label: "slices",
            vertex: "test/slices.vert",
            fragment: Some("test/slices.frag"),
            color_formats: &formats,
            ..Default::default()
        };
        let compute = ComputeDesc { label: "copy", shader: "test/copy.comp", constants: &[("SCALE", 1u32.into())] };
        Self {
            compute: Compute::new(context, &compute).expect("a pipeline"),
            raster: Raster::new(context, &raster).expect("a pipeline"),
            source: buffer("source", u64::from(ITEMS) * size_of::<Item>() as u64),
            target: buffer("target", u64::from(ITEMS) * 4),
            images: formats.map(image),
        }
    }

    /// The raster pass, whose image goes to `texels`; then the compute pass, whose last write the host reads.
    fn record(&self, r: &mut Recorder, texels: &Buffer) {
        r.zone("slices", ZoneKind::Raster, 0, |r| {
            let colors = [&self.images[0], &self.images[1]].map(|image| ColorTarget {
                view: image.attachment_view(0),
                resolve: None,
                load: Load::Clear([0.0; 4]),
                store: true,
            });
            let target = RenderTarget { colors: &colors, width: EDGE, height: EDGE, ..Default::default() };
            r.raster(&target, |pass| pass.draw(&self.raster, &[], &(), DrawCall::Direct { vertices: 3, instances: 1 }));
        });
        r.full_barrier();
        r.copy_image_to_buffer(&self.images[0], ImageRegion::level(&self.images[0], 0), texels, 0);
        r.zone("copy", ZoneKind::Compute, 256, |r| {
            let binds = [Bind::buffer("source", &self.source), Bind::buffer("target", &self.target)];
            r.dispatch(&self.compute, &binds, &[ITEMS, 1000], [1, 1, 1]);
        });
    }
}

/// Objects of one frame in flight.
struct InFlight {
    frame: HostFrame,
    slot: Slot,
    numbers: Buffer,
    texels: Buffer,
}

impl InFlight {
    fn new(host: &Host, context: &Arc<Context>) -> Self {
        let readback = |bytes| Buffer::new(context, "readback", bytes, BufferKind::Readback).expect("a buffer");
        let slot = Slot::new(context, SlotOptions { timestamps: true, log: false }).expect("a slot");
        let (numbers, texels) = (readback(u64::from(ITEMS) * 4), readback(u64::from(EDGE * EDGE) * 16));
        Self { frame: HostFrame::new(host), slot, numbers, texels }
    }

    /// Records and submits a frame. The host's own commands write before it and read after it, without a barrier.
    fn run(&mut self, host: &Host, context: &Arc<Context>, passes: &Passes, count: u32) {
        let items = [Item { position: [0.0; 3], count, weights: [[0.0; 2]; 2] }; ITEMS as usize];
        let commands = self.frame.commands;
        self.frame.begin();
        unsafe {
            host.device.cmd_update_buffer(commands, passes.source.handle(), 0, bytemuck::cast_slice(&items));
            Recorder::on(context, commands, &mut self.slot, |recorder| passes.record(recorder, &self.texels));
            let whole = [raw::BufferCopy { src_offset: 0, dst_offset: 0, size: passes.target.bytes() }];
            host.device.cmd_copy_buffer(commands, passes.target.handle(), self.numbers.handle(), &whole);
            let barrier = [raw::MemoryBarrier::default()
                .src_access_mask(raw::AccessFlags::TRANSFER_WRITE)
                .dst_access_mask(raw::AccessFlags::HOST_READ)];
            let (copy, cpu) = (raw::PipelineStageFlags::TRANSFER, raw::PipelineStageFlags::HOST);
            let none = raw::DependencyFlags::empty();
            host.device.cmd_pipeline_barrier(commands, copy, cpu, none, &barrier, &[], &[]);
        }
        self.frame.submit(host);
    }

    /// Waits for the frame of the [`Self::run`] with `count`, and checks all its results.
    fn check(&self, context: &Arc<Context>, count: u32) {
        self.frame.wait();
        assert_eq!(self.numbers.read::<u32>(), [count + 1000; ITEMS as usize], "frame {count}");
        for (index, texel) in self.texels.read::<[f32; 4]>().into_iter().enumerate() {
            let (x, y) = (index as u32 % EDGE, index as u32 / EDGE);
            assert_eq!(texel, [x as f32 + 0.5, y as f32 + 0.5, 0.0, 1.0], "frame {count}, texel {x} {y}");
        }
        let timings = self.slot.timings(context).unwrap().expect("the frame is over");
        let names: Vec<_> = timings.zones.iter().map(|zone| (zone.name, zone.kind)).collect();
        assert_eq!(names, [("slices", ZoneKind::Raster), ("copy", ZoneKind::Compute)]);
        assert!(timings.zones.iter().all(|zone| zone.gpu_ms > 0.0 && zone.gpu_ms <= timings.gpu_ms));
        assert!(timings.zones[0].start_ms <= timings.zones[1].start_ms && timings.wall_ms > 0.0);
    }
}

/// Six frames over two slots, so that two are always in flight.
fn frames(host: &Host, context: &Arc<Context>) {
    let passes = Passes::new(context);
    let mut slots = [InFlight::new(host, context), InFlight::new(host, context)];
    assert_eq!(slots[0].slot.timings(context).unwrap(), None, "nothing was recorded");
    let bytes = context.allocated_bytes();
    for count in 0..6_u32 {
        let slot = &mut slots[count as usize % 2];
        if count >= 2 {
            slot.check(context, count - 2);
        }
        slot.run(host, context, &passes, count);
        assert_eq!(context.allocated_bytes(), bytes, "a frame takes no memory");
    }
    drop(passes); // the slots keep what is in flight
    slots[0].check(context, 4);
    slots[1].check(context, 5);
}

#[test]
fn a_host_records_into_its_own_command_buffers() {
    let host = Host::new();
    let context = host.adopt(|_| ()).unwrap();
    let data: Vec<u32> = (0..1000).collect();
    let buffer = vk::upload(&context, "data", &data).unwrap();
    assert_eq!(vk::download::<u32>(&context, &buffer).unwrap(), data, "by the host's queue");
    frames(&host, &context);
    drop((buffer, context));
    host.close();
}

/// In Vulkan 1.2 rendering and barriers come from extensions.
#[test]
fn a_host_with_vulkan_1_2_does_as_well() {
    let host = Host::of_version(raw::API_VERSION_1_2);
    let context = host.adopt(|_| ()).unwrap();
    frames(&host, &context);
    drop(context);
    host.close();
}

#[test]
fn a_slot_measures_and_logs_only_on_demand() {
    let host = Host::new();
    let context = host.adopt(|_| ()).unwrap();
    let values = Buffer::new(&context, "values", 64, BufferKind::Device).unwrap();
    for (timestamps, log) in [(false, true), (true, false)] {
        let frame = HostFrame::new(&host);
        let mut slot = Slot::new(&context, SlotOptions { timestamps, log }).unwrap();
        frame.begin();
        // SAFETY: the frame is waited for before the slot is dropped.
        unsafe {
            Recorder::on(&context, frame.commands, &mut slot, |recorder| {
                recorder.zone("reset", ZoneKind::Transfer, 64, |r| r.fill(&values, 0, 64, 1));
            });
        }
        frame.submit(&host);
        frame.wait();
        assert_eq!(slot.timings(&context).unwrap().is_some(), timestamps);
        let names: Vec<_> = slot.frame_log().zones.iter().map(|zone| zone.name).collect();
        assert_eq!(names, if log { vec!["reset"] } else { vec![] });
        // SAFETY: it was waited for.
        unsafe { slot.clear() };
        assert!(slot.timings(&context).unwrap().is_none() && slot.frame_log().zones.is_empty());
    }
    drop((values, context));
    host.close();
}

/// The other tests' hosts rely on the barriers at both ends of a recording: without one, the validation layer reports
/// it.
#[test]
fn the_host_is_really_validated() {
    let host = Host::new();
    let context = host.adopt(|_| ()).unwrap();
    let passes = Passes::new(&context);
    let frame = HostFrame::new(&host);
    frame.begin();
    for value in [1, 2] {
        unsafe { host.device.cmd_fill_buffer(frame.commands, passes.source.handle(), 0, 64, value) };
    }
    frame.submit(&host);
    let messages = host.take_messages();
    assert!(messages.iter().any(|message| message.contains("WRITE-AFTER-WRITE")), "{messages:?}");
    drop((frame, passes, context));
    host.close();
}

#[test]
fn without_queue_allocator_and_cache_only_frames_are_recorded() {
    let host = Host::new();
    let context = host
        .adopt(|device| {
            (device.queue, device.allocator, device.pipeline_cache) = (None, None, None);
            device.instance_extensions = &[];
        })
        .unwrap();
    frames(&host, &context);
    for refused in [
        vk::upload(&context, "data", &[0_u32]).map(drop),
        Recorder::new(&context, RecorderOptions::default()).map(drop),
    ] {
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("without a queue") && message.contains("HostDevice"), "{message}");
    }
    drop(context);
    host.close();
}

#[test]
fn a_host_that_did_not_enable_what_is_needed_is_refused() {
    let host = Host::new();
    let refused = |change: fn(&mut vk::HostDevice<'_>)| {
        let Err(Error::Device(message)) = host.adopt(change) else { panic!("accepted") };
        assert!(!message.contains('\n') && !message.contains(". "), "one sentence: {message}");
        message
    };
    let feature = refused(|device| device.features.sample_rate_shading = false);
    assert!(feature.contains("was made without sampleRateShading: enable"), "{feature}");
    let both = refused(|device| {
        device.features.scalar_block_layout = false;
        device.device_extensions = &[];
    });
    assert!(both.contains("without VK_KHR_push_descriptor, scalarBlockLayout:"), "{both}");
    let old = refused(|device| device.api_version = raw::API_VERSION_1_1);
    assert!(old.contains("1.1, but 1.2 is needed"), "{old}");
    let family = refused(|device| device.queue_family = 99);
    assert!(family.contains("queue family 99"), "{family}");
    host.close();
}

#[test]
fn structures_of_a_later_version_say_the_same() {
    let structs = vk::required_features().structs();
    let vulkan13 = raw::PhysicalDeviceVulkan13Features::default().dynamic_rendering(true).synchronization2(true);
    assert_eq!(vk::Features::of_structs(&structs.core, &structs.vulkan12, &vulkan13), vk::required_features());
    assert!(vk::required_extensions(raw::API_VERSION_1_2).len() > vk::required_extensions(raw::API_VERSION_1_3).len());
}
