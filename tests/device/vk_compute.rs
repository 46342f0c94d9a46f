//! The Vulkan layer: data in, a compute pass, data out; reflection; zones, log and errors.

use crate::gpu;
use crate::studio::asset;

use bytemuck::{Pod, Zeroable};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::LazyLock;
use twobounce::ground::constants::{self, Features};
use twobounce::profile::executables::table;
use twobounce::settings::Settings;
use twobounce::vk::{
    self, Bind, Binding, BindingKind, Buffer, BufferKind, CommandLog, Compute, ComputeDesc, Constant, Recorder,
    RecorderOptions, ShaderStage, ZoneKind,
};

/// A context that keeps a log.
const LOGGED: RecorderOptions = RecorderOptions { per_pass: false, steps: false, log: true };

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Item {
    position: [f32; 3],
    count: u32,
    weights: [[f32; 2]; 2],
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Push {
    count: u32,
    add: u32,
}

fn copy_pass(constants: &[Constant]) -> Compute {
    Compute::new(&gpu::context(), &ComputeDesc { label: "copy", shader: "test/copy.comp", constants }).unwrap()
}

/// The message with which a pass refuses these constants.
fn refusal(constants: &[Constant]) -> String {
    panic_of(|| drop(copy_pass(constants)))
}

#[test]
fn constants_are_checked_by_their_names() {
    let scale = ("SCALE", 3u32.into());
    drop(copy_pass(&[scale]));
    assert_eq!(refusal(&[]), "pass copy: glsl/test/copy.comp depends on the constant SCALE, which is not given");
    let unknown = refusal(&[scale, ("SCALES", 3u32.into())]);
    assert_eq!(unknown, "pass copy: no header declares the constant SCALES, nor does glsl/test/copy.comp");
    let elsewhere = refusal(&[scale, ("HARDWARE", 1u32.into())]);
    assert!(elsewhere.contains("HARDWARE"), "another shader's own constant: {elsewhere}");
    let other_type = refusal(&[("SCALE", 3.0.into())]);
    assert_eq!(other_type, "pass copy: glsl/test/copy.comp declares SCALE like Uint(1), but gets Float(3.0)");
    assert_eq!(refusal(&[scale, scale]), "pass copy: the constant SCALE is given twice");
    // A constant of a header may be given to a pass that does not include it, since passes share lists.
    drop(copy_pass(&[scale, ("EDGE", 64u32.into())]));
}

fn items(count: u32) -> Vec<Item> {
    (0..count).map(|i| Item { position: [9.0, 9.0, 1000.0], count: i, weights: [[9.0; 2], [9.0, 500.0]] }).collect()
}

#[test]
fn data_survives_the_way_up_and_down() {
    let data: Vec<u32> = (0..100_001).map(|i: u32| i.wrapping_mul(2_654_435_761)).collect();
    let buffer = vk::upload(&gpu::context(), "round trip", &data).unwrap();
    assert_eq!(vk::download::<u32>(&gpu::context(), &buffer).unwrap(), data);
    let empty = vk::upload::<u32>(&gpu::context(), "empty", &[]).unwrap();
    assert!(empty.bytes() >= 4, "empty data can still be bound");
    gpu::assert_clean(&gpu::context());
}

#[test]
fn a_compute_pass_reads_structs_push_block_and_constants() {
    for per_pass in [false, true] {
        let pass = copy_pass(&[("SCALE", 3u32.into())]);
        let source = vk::upload(&gpu::context(), "source", &items(100)).unwrap();
        let target = vk::upload(&gpu::context(), "target", &[u32::MAX; 128]).unwrap();
        let mut recorder =
            Recorder::new(&gpu::context(), RecorderOptions { per_pass, ..RecorderOptions::default() }).unwrap();
        recorder.zone("copy", ZoneKind::Compute, 400, |r| {
            let binds = [Bind::buffer("target", &target), Bind::buffer("source", &source)];
            r.dispatch(&pass, &binds, &Push { count: 100, add: 7 }, [2, 1, 1]);
        });
        drop((source, pass)); // the recorder keeps what it recorded
        let timings = recorder.finish().unwrap();
        let result = vk::download::<u32>(&gpu::context(), &target).unwrap();
        for (i, value) in result.into_iter().enumerate() {
            let expected = if i < 100 { 3 * (i as u32 + 1500) + 7 } else { u32::MAX };
            assert_eq!(value, expected, "element {i}");
        }
        assert_eq!(timings.zones.len(), 1);
        let zone = &timings.zones[0];
        assert_eq!((zone.name, zone.kind, zone.bytes), ("copy", ZoneKind::Compute, 400));
        assert!(zone.gpu_ms > 0.0 && zone.gpu_ms <= timings.gpu_ms && timings.gpu_ms <= timings.wall_ms);
        assert_eq!(zone.cpu_ms.is_some(), per_pass);
        assert_eq!(zone.wall_ms.is_some(), per_pass);
    }
    gpu::assert_clean(&gpu::context());
}

#[test]
fn reflection_gives_names_kinds_stages_and_layouts() {
    let pass = copy_pass(&[("SCALE", 1u32.into())]);
    let storage = |binding, name: &str, read_only| Binding {
        binding,
        name: name.to_owned(),
        kind: BindingKind::Storage,
        count: 1,
        stages: vec![ShaderStage::Compute],
        read_only,
    };
    assert_eq!(pass.bindings(), [storage(0, "source", true), storage(1, "target", false)]);
    assert_eq!(pass.push_bytes(), 8);
    assert_eq!(pass.stages().len(), 1);
    assert_eq!((pass.stages()[0].stage, pass.stages()[0].shader), (ShaderStage::Compute, "test/copy.comp"));

    let structs = vk::shader::structs("test/copy.comp");
    let item = &structs["Item"];
    let members: Vec<_> = item.members.iter().map(|m| (m.name.as_str(), m.offset, m.bytes)).collect();
    assert_eq!(members, [("position", 0, 12), ("count", 12, 4), ("weights", 16, 16)]);
    assert_eq!(item.stride, Some(size_of::<Item>()));
    assert_eq!(structs["Push"].members.len(), 2);
}

#[test]
fn fills_updates_and_copies_are_ordered_and_logged() {
    let first = Buffer::new(&gpu::context(), "first", 64, BufferKind::Device).unwrap();
    let second = Buffer::new(&gpu::context(), "second", 64, BufferKind::Device).unwrap();
    let readback = Buffer::new(&gpu::context(), "readback", 64, BufferKind::Readback).unwrap();
    let mut recorder = Recorder::new(&gpu::context(), LOGGED).unwrap();
    recorder.zone("reset", ZoneKind::Transfer, 64, |r| {
        r.fill(&first, 0, 64, 5);
        r.full_barrier();
        r.update(&first, 8, &[1_u8, 0, 0, 0]);
    });
    recorder.zone("copies", ZoneKind::Transfer, 128, |r| {
        r.full_barrier();
        r.copy(&first, &second);
        r.full_barrier();
        r.copy_range(second.at(8), readback.at(0), 8);
    });
    recorder.zone("nothing", ZoneKind::Compute, 0, |_| {});
    let log = recorder.frame_log().clone();
    recorder.finish().unwrap();
    assert_eq!(readback.read::<u32>()[..2], [1, 5]);

    let names: Vec<_> = log.zones.iter().map(|zone| zone.name).collect();
    assert_eq!(names, ["reset", "copies"], "a zone that records nothing is not in the log");
    assert_eq!(log.zones[0].fills().collect::<Vec<_>>(), ["first"]);
    let update = CommandLog::Update { buffer: "first".into(), offset: 8, bytes: 4 };
    assert_eq!(log.zones[0].commands[1], update);
    let copy = CommandLog::Copy { from: "second".into(), to: "readback".into(), bytes: Some(8) };
    assert_eq!(log.zones[1].commands[1], copy);
    gpu::assert_clean(&gpu::context());
}

#[test]
fn an_indirect_dispatch_takes_its_groups_from_a_buffer() {
    let pass = Compute::new(
        &gpu::context(),
        &ComputeDesc { label: "increment", shader: "test/increment.comp", constants: &[] },
    )
    .unwrap();
    let values = vk::upload(&gpu::context(), "values", &[0_u32; 192]).unwrap();
    let groups = vk::upload(&gpu::context(), "groups", &[0_u32, 2, 1, 1]).unwrap();
    let mut recorder = Recorder::new(&gpu::context(), LOGGED).unwrap();
    recorder.dispatch_indirect(&pass, &[Bind::buffer("values", &values)], &(), groups.at(4));
    let log = recorder.frame_log().clone();
    recorder.finish().unwrap();
    let result = vk::download::<u32>(&gpu::context(), &values).unwrap();
    assert_eq!(result.iter().sum::<u32>(), 128);
    assert_eq!(log.zones[0].name, "", "commands outside of zones come under the empty name");
    let dispatch = log.zones[0].dispatches().next().unwrap();
    assert_eq!(dispatch.indirect, Some(("groups".to_owned(), 4)));
    assert_eq!(dispatch.resources, [("values".to_owned(), vec!["values".to_owned()])]);
    gpu::assert_clean(&gpu::context());
}

/// Message of the panic in `f`; fails without a panic.
fn panic_of(f: impl FnOnce()) -> String {
    let payload = catch_unwind(AssertUnwindSafe(f)).expect_err("this must panic");
    payload.downcast_ref::<String>().cloned().unwrap_or_default()
}

#[test]
fn a_wrong_binding_panics_naming_pass_and_binding() {
    let pass = copy_pass(&[("SCALE", 1u32.into())]);
    let buffer = vk::upload(&gpu::context(), "buffer", &[0_u32; 64]).unwrap();
    let push = Push { count: 0, add: 0 };
    let dispatch = |binds: &[Bind<'_>]| {
        let mut recorder = Recorder::new(&gpu::context(), RecorderOptions::default()).unwrap();
        panic_of(AssertUnwindSafe(|| recorder.dispatch(&pass, binds, &push, [1, 1, 1])).0)
    };
    let source = || Bind::buffer("source", &buffer);
    let target = || Bind::buffer("target", &buffer);
    let missing = dispatch(&[source()]);
    assert!(missing.contains("copy") && missing.contains("\"target\""), "{missing}");
    let unknown = dispatch(&[source(), target(), Bind::buffer("other", &buffer)]);
    assert!(unknown.contains("copy") && unknown.contains("\"other\""), "{unknown}");
    let twice = dispatch(&[source(), target(), target()]);
    assert!(twice.contains("copy") && twice.contains("\"target\""), "{twice}");
    let kind = dispatch(&[source(), Bind::storage_images("target", [])]);
    assert!(kind.contains("copy") && kind.contains("\"target\"") && kind.contains("Storage"), "{kind}");

    let mut recorder = Recorder::new(&gpu::context(), RecorderOptions::default()).unwrap();
    let size = panic_of(AssertUnwindSafe(|| recorder.dispatch(&pass, &[source(), target()], &0_u32, [1, 1, 1])).0);
    assert!(size.contains("copy") && size.contains("8 bytes, the struct 4"), "{size}");
    gpu::assert_clean(&gpu::context());
}

#[test]
fn the_account_of_memory_is_the_sum_of_the_resources() {
    let context = gpu::own_context();
    assert_eq!(context.allocated_bytes(), 0);
    let large = Buffer::new(&context, "large", 10 << 20, BufferKind::Device).unwrap();
    let small = Buffer::new(&context, "small", 100, BufferKind::Upload).unwrap();
    assert_eq!(context.allocated_bytes(), large.allocated_bytes() + small.allocated_bytes());
    // Alignment alone: a driver rounds a buffer up by at most 64 KiB.
    assert!(context.allocated_bytes() - (10 << 20) - 100 <= 2 << 16);
    drop(large);
    assert_eq!(context.allocated_bytes(), small.allocated_bytes());
    drop(small);
    assert_eq!(context.allocated_bytes(), 0);
    gpu::assert_clean(&context);
}

#[test]
fn too_large_a_buffer_is_refused_in_one_sentence() {
    let bytes = u64::from(gpu::context().limits.max_storage_buffer_range) + 4;
    let Err(error) = Buffer::new(&gpu::context(), "triangles", bytes, BufferKind::Device) else { panic!("accepted") };
    let message = error.to_string();
    assert!(matches!(error, twobounce::Error::Memory(_)), "{message}");
    assert!(message.contains("triangles") && message.contains("MiB") && !message.contains('\n'), "{message}");
    gpu::assert_clean(&gpu::context());
}

#[test]
fn programs_are_described_where_the_driver_can() {
    let plain = gpu::context();
    assert_eq!(plain.executables().unwrap(), None, "nobody asked");
    let context = gpu::describing();
    let constants = &[("SCALE", 3u32.into())];
    let _pass = Compute::new(&context, &ComputeDesc { label: "copy", shader: "test/copy.comp", constants }).unwrap();
    let told = context.executables().unwrap();
    match &told {
        Some(programs) => {
            let [program] = &programs[..] else { panic!("one shader is {programs:?}") };
            assert!(program.pipeline == "copy" && program.subgroup_size > 0 && !program.name.is_empty());
            assert!(!program.statistics.is_empty(), "{program:?}");
        }
        None => assert!(!*SAYS_MUCH, "{} describes nothing", context.name),
    }
    print!("{}", table(told.as_deref(), &context.name));
    if *SAYS_MUCH {
        assert!(context.has_ray_queries(), "RADV has them");
        let translucent = Features::ALPHA.0 | Features::MASK.0 | Features::BLEND.0 | Features::TRANSMISSION.0;
        let passes = [0, translucent].into_iter().flat_map(|features| {
            [("by the tree", features), ("by queries", features | Features::QUERY.0)].map(|(label, features)| {
                let mut all = constants::constants(&Settings::fast(), Features(features));
                all.push(("SHADOW", 0u32.into()));
                Compute::new(&context, &ComputeDesc { label, shader: "test/rays.comp", constants: &all }).unwrap()
            })
        });
        let passes: Vec<Compute> = passes.collect();
        let programs = context.executables().unwrap().unwrap();
        assert_eq!(programs.len(), 1 + passes.len(), "each was compiled");
        print!("{}", table(Some(&programs), &context.name));
        image_parts_take_fewer_registers_than_all_at_once(&context);
    }
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    if *SAYS_MUCH {
        std::mem::forget(context); // without a card RADV cannot wait for its device, and so not end it
    }
}

/// Parts of the image's light that few fragments need are passes of their own, so that the pass over all fragments holds
/// fewer registers.
fn image_parts_take_fewer_registers_than_all_at_once(context: &std::sync::Arc<vk::Context>) {
    let settings = Settings::fast();
    let features = Features::of_settings(&asset("gallery.glb"), &settings);
    let ground = constants::with(constants::constants(&settings, features), &[("LINKED", true.into())]);
    let registers = [1u32, 2, 4, 7].map(|parts| {
        let rays = [("DIFFUSE_RAYS", 8u32), ("LOBE_RAYS", 8), ("BOUNCES", 2), ("PARTS", parts)];
        let all = constants::with(ground.clone(), &rays.map(|(name, value)| (name, value.into())));
        let shader = "ground/image/image.comp rays GATHERED";
        let _pass = Compute::new(context, &ComputeDesc { label: "image", shader, constants: &all }).unwrap();
        let programs = context.executables().unwrap().unwrap();
        let program = programs.last().unwrap();
        print!("parts {parts}: {}", table(Some(std::slice::from_ref(program)), &context.name));
        let taken = program.statistics.iter().find(|statistic| statistic.name == "VGPRs");
        taken.map_or(String::new(), |statistic| statistic.value.to_string()).parse::<u32>().unwrap()
    });
    let [light, look_ups, lobes, all] = registers;
    println!("vector registers of the image's parts: {light}, {look_ups}, {lobes}; of all at once: {all}");
    assert!(light < all && look_ups < all && lobes <= all, "{registers:?}");
}

/// Set where the driver is known to describe programs.
static SAYS_MUCH: LazyLock<bool> = LazyLock::new(|| std::env::var_os("TWOBOUNCE_TEST_DESCRIBES").is_some());

/// RADV compiles for a card that is absent; submissions to it do nothing. Debian's package mesa-vulkan-drivers installs
/// it beside lavapipe on this architecture.
#[test]
#[cfg(target_arch = "x86_64")]
fn a_compiler_for_cards_describes_programs_without_a_card() {
    let folder = "/usr/share/vulkan/icd.d";
    let drivers = std::fs::read_dir(folder).unwrap().map(|file| file.unwrap().path());
    let is_for_cards = |file: &std::path::PathBuf| {
        let name = file.file_name().unwrap().to_string_lossy();
        name.starts_with("radeon_icd") && !name.contains("i686")
    };
    let driver = drivers.into_iter().find(is_for_cards).unwrap_or_else(|| {
        panic!("{folder} has no radeon_icd: install RADV, Mesa's driver for AMD's cards (mesa-vulkan-drivers)")
    });
    let test = "vk_compute::programs_are_described_where_the_driver_can";
    let mut command = std::process::Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--nocapture"]).env("TWOBOUNCE_TEST_DESCRIBES", "1");
    command.env("RADV_FORCE_FAMILY", "navi21").env_remove("TWOBOUNCE_DEVICE");
    let output = command.env("VK_DRIVER_FILES", &driver).env("VK_ICD_FILENAMES", &driver).output().unwrap();
    let told = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{told}{}", String::from_utf8_lossy(&output.stderr));
    for word in ["1 passed", "copy", "by queries", "VGPRs", "Spilled VGPRs", "Scratch size"] {
        assert!(told.contains(word), "{word} is not in\n{told}");
    }
}
