//! Devices that are known from documents: the requirements of each preset that they lack, and the table of
//! `docs/devices.md`.

use std::path::Path;

use twobounce::ash::vk::PhysicalDeviceLimits;
use twobounce::frame::FrameDesc;
use twobounce::ground::constants::Features;
use twobounce::renderer::{fits, lacks, method_of, stage_needs};
use twobounce::scene::{LoadOptions, Scene};
use twobounce::settings::{Method, PRESETS, Settings};
use twobounce::vk::{BindingKind, Described, DeviceReport, shader};

use crate::device_tables::{described, table};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn report(part: &str) -> DeviceReport {
    let all = described(root()).unwrap();
    all.iter().find(|device| device.name.contains(part)).unwrap_or_else(|| panic!("no {part}")).report().unwrap()
}

#[test]
fn the_page_of_devices_says_what_the_requirements_say() {
    for (path, mark) in
        [("docs/devices.md", "<!-- table: devices -->"), ("docs/notes/devices.md", "<!-- table: sources -->")]
    {
        let page = std::fs::read_to_string(root().join(path)).unwrap();
        let filled = twobounce::lab::table::fill(&page, |name, _| table(name, root())).unwrap();
        let again = "run `cargo run --release --example pages -- devices`";
        assert!(page.contains(mark) && page == filled, "{path} differs from this: {again}\n{filled}");
    }
}

#[test]
fn devices_run_what_they_have_all_for() {
    for (part, runs) in [("(RADV)", true), ("(ANV)", true), ("lavapipe", true), ("(NVK)", true), ("V3DV", false)] {
        let found = report(part);
        for preset in PRESETS {
            let missing = lacks(&found, &(preset.settings)());
            assert_eq!(missing.is_empty(), runs, "{part}, {}: {missing:?}", preset.name);
        }
    }
    // Metal has no geometry shaders.
    let moltenvk = report("MoltenVK");
    for preset in PRESETS {
        let settings = (preset.settings)();
        let expected: &[&str] = if settings.grid.conservative.needs().is_empty() { &[] } else { &["geometryShader"] };
        assert_eq!(lacks(&moltenvk, &settings), expected, "{}", preset.name);
    }
    let timestamps = "a queue with graphics, compute and timestamps";
    assert_eq!(lacks(&report("(KosmicKrisp)"), &Settings::fast()), [timestamps]);
}

/// The memory plan is compared with a device's memory and with its largest binding.
#[test]
fn frames_that_do_not_fit_a_device_are_refused() {
    let scene = Scene::load(&root().join("assets/gallery.glb"), &LoadOptions::default()).unwrap();
    let (pose, bounds, settings) = (scene.pose(None, 0.0), scene.bounds(None), Settings::cones());
    let scene = &scene;
    let desc = FrameDesc {
        scene,
        settings: &settings,
        size: (1280, 720),
        outputs: 1,
        bounds,
        slots: 1,
        waits: true,
        query: None,
    };
    let device = report("(RADV)");
    fits(&device, &desc, &pose).unwrap();
    let refused = |change: &dyn Fn(&mut DeviceReport)| {
        let mut device = device.clone();
        change(&mut device);
        fits(&device, &desc, &pose).unwrap_err().to_string()
    };
    let memory = refused(&|device| device.heaps[0].0 = 64 << 20);
    assert!(memory.contains("more than the memory of AMD Radeon RX 570 (RADV) of 64 MiB"), "{memory}");
    let buffer = refused(&|device| device.limits.max_storage_buffer_range = 1 << 16);
    assert!(buffer.contains("more than the largest buffer that AMD Radeon RX 570 (RADV) binds"), "{buffer}");
}

/// A device with one less of a limit is refused for exactly that limit.
#[test]
fn a_limit_that_is_one_too_low_is_named() {
    for method in Method::ALL.iter().copied() {
        let settings = Settings { method, ..Settings::fast() };
        let needs = stage_needs(method);
        let with = |buffers: u32, images: u32, outputs: u32| {
            let mut device = report("lavapipe");
            device.limits = PhysicalDeviceLimits {
                max_per_stage_descriptor_storage_buffers: buffers,
                max_per_stage_descriptor_storage_images: images,
                max_fragment_combined_output_resources: outputs,
                ..device.limits
            };
            lacks(&device, &settings)
        };
        let (buffers, images, outputs) = (needs.storage_buffers, needs.storage_images, needs.fragment_outputs);
        assert!(buffers > 4 && images > 0 && outputs > 0, "{method}: {needs:?}");
        assert_eq!(with(buffers, images, outputs), [""; 0]);
        assert_eq!(with(buffers - 1, images, outputs), [format!("maxPerStageDescriptorStorageBuffers {buffers}")]);
        assert_eq!(with(buffers, images - 1, outputs), [format!("maxPerStageDescriptorStorageImages {images}")]);
        assert_eq!(with(buffers, images, outputs - 1), [format!("maxFragmentCombinedOutputResources {outputs}")]);
    }
}

/// Every device offers enough of all other resources that shaders bind: the specification's table of required limits.
#[test]
fn other_limits_are_those_of_every_device() {
    for name in shader::names().filter(|name| !name.starts_with("test/")) {
        let (_, bindings) = shader::reflected(name);
        let count = |kind| bindings.iter().filter(|binding| binding.kind == kind).map(|b| b.count).sum::<u32>();
        assert!(count(BindingKind::Sampled) <= 16, "{name}: maxPerStageDescriptorSampledImages");
        assert!(count(BindingKind::Uniform) <= 12, "{name}: maxPerStageDescriptorUniformBuffers");
        // Rays use an acceleration structure or the tree, and do not need the tree's boxes with the former.
        let all = bindings.iter().map(|binding| binding.count).sum::<u32>() - count(BindingKind::Structure);
        assert!(all <= 32, "{name}: maxPushDescriptors");
    }
}

/// No shader uses subgroup operations, so results depend on no subgroup's size; none needs numbers of 16 or 64 bits.
#[test]
fn shaders_use_few_capabilities_and_no_subgroups() {
    const CAPABILITY: u32 = 17;
    // Shader, Geometry, SampleRateShading, ImageQuery, ShaderLayer
    let known = [1, 2, 35, 50, 69];
    let mut used = std::collections::BTreeSet::new();
    for name in shader::names() {
        let words = shader::specialized(name, &[("FEATURES", (!Features::QUERY.0).into())]);
        let mut at = 5;
        while at < words.len() && words[at] & 0xffff == CAPABILITY {
            let capability = words[at + 1];
            assert!(known.contains(&capability), "glsl/{name} needs the capability {capability} of SPIR-V");
            used.insert(capability);
            at += (words[at] >> 16) as usize;
        }
    }
    assert_eq!(used.into_iter().collect::<Vec<_>>(), known);
}

#[test]
fn every_method_has_shaders_and_tests_have_none_of_them() {
    for method in Method::ALL.iter().copied().filter(|method| *method != Method::None) {
        assert!(shader::names().any(|name| method_of(name) == Some(method)), "{method}");
        assert!(stage_needs(method).storage_buffers >= stage_needs(Method::None).storage_buffers);
    }
}

#[test]
fn a_description_that_is_wrong_is_refused_in_a_sentence() {
    let text = std::fs::read_to_string(root().join("tests/profiles/radv.toml")).unwrap();
    let said = |from: &str, to: &str| {
        assert!(text.contains(from));
        let described: Described = toml::from_str(&text.replace(from, to)).unwrap();
        described.report().unwrap_err().to_string()
    };
    assert!(said("\"geometryShader\"", "\"geometryShaders\"").contains("nothing asks a device for geometryShaders"));
    assert!(said("maxColorAttachments", "maxColourAttachments").contains("maxColourAttachments: leave it out"));
}
