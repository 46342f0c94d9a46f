//! Damaged and malicious files: a message of one sentence with the file's name, no panic, no long run, no large
//! allocation.

use std::ops::Range;
use std::path::Path;
use std::time::{Duration, Instant};

use super::files::{F32, File, U8, U16, load_bytes, png, write};
use crate::random::Random;
use crate::valid::assert_valid;
use proptest::prelude::*;
use serde_json::{Value, json};
use twobounce::memory::Limit;
use twobounce::scene::{LoadOptions, Scene};

/// A file with every object that the loader reads.
fn everything() -> File {
    let mut file = File::quad();
    let texture = file.texture(&png(2, 2, &[9; 16]));
    let slot =
        json!({"index": texture, "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.5], "rotation": 1.0}}});
    file.material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1.0], "baseColorTexture": slot, "metallicRoughnessTexture": slot},
        "normalTexture": {"index": texture}, "alphaMode": "BLEND", "emissiveFactor": [1, 1, 1],
        "extensions": {"KHR_materials_ior": {"ior": 1.3}, "KHR_materials_volume": {"thicknessFactor": 1.0, "attenuationDistance": 2.0}}
    }));
    let joints = file.accessor(U8, "VEC4", 4, &[0, 1, 0, 0].repeat(4));
    let weights = file.floats("VEC4", &[0.5, 0.5, 0.0, 0.0].repeat(4));
    let offsets = file.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let identity: Vec<f32> = glam::Mat4::IDENTITY.to_cols_array().repeat(2);
    let bind = file.floats("MAT4", &identity);
    let keys = file.view(&[3, 0]);
    let values = file.view(&[1f32, 1.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
    file.json["accessors"][0]["sparse"] =
        json!({"count": 1, "indices": {"bufferView": keys, "componentType": U16}, "values": {"bufferView": values}});
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    primitive["targets"] = json!([{"POSITION": offsets}]);
    file.json["meshes"][0]["weights"] = json!([0.5]);
    file.json["nodes"][0]["skin"] = json!(0);
    let child = file.push("nodes", json!({"mesh": 0, "translation": [1, 2, 3], "rotation": [0, 0, 0, 1]}));
    file.node(json!({"children": [child], "scale": [1, 2, 3], "camera": 0, "extensions": {"KHR_lights_punctual": {"light": 0}}}));
    file.push("skins", json!({"joints": [1, 2], "inverseBindMatrices": bind}));
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1, "zfar": 10.0}}));
    file.json["extensions"] =
        json!({"KHR_lights_punctual": {"lights": [{"type": "spot", "intensity": 3.0, "range": 5.0, "spot": {}}]}});
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    let moves = file.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    file.push(
        "animations",
        json!({"samplers": [{"input": times, "output": moves}],
        "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}),
    );
    file
}

/// Checks any outcome: a message of one sentence, or a valid scene.
pub fn check(outcome: Result<Scene, String>) {
    match outcome {
        Err(sentence) => {
            assert!(sentence.contains("scene.gl"), "no file name: {sentence}");
            assert!(!sentence.contains('\n') && sentence.len() < 600, "not one sentence: {sentence}");
        }
        Ok(scene) => assert_valid(&scene),
    }
}

/// Changes up to four bytes: flipped bits, other values. `part` chooses the range of bytes for each change.
pub fn change_bytes(random: &mut Random, bytes: &mut [u8], part: impl Fn(&mut Random) -> Range<usize>) {
    for _ in 0..=random.below(4) {
        let part = part(random);
        let at = part.start + random.below(part.len());
        bytes[at] = if random.below(2) == 0 { random.below(256) as u8 } else { bytes[at] ^ 1 << random.below(8) };
    }
}

pub fn refused(file: &File, expected: &str) {
    let sentence = file.load().err().unwrap_or_else(|| panic!("loaded, but expected: {expected}"));
    assert!(sentence.contains(expected), "expected \"{expected}\" in: {sentence}");
    check(Err(sentence));
}

#[test]
fn the_file_with_everything_loads() {
    let scene = everything().scene();
    assert_eq!((scene.triangle_count(), scene.lights.len(), scene.cameras.len(), scene.animations.len()), (4, 1, 1, 1));
    assert_valid(&scene);
}

#[test]
fn files_of_other_formats_are_refused_in_one_sentence() {
    let load = |path: &Path| Scene::load(path, &LoadOptions::default()).unwrap_err().to_string();
    let folder = tempfile::tempdir().unwrap();
    assert!(load(folder.path()).contains("is a directory"));
    assert!(load(&folder.path().join("none.glb")).contains("does not exist"));
    let glb = everything().glb();
    let version = |version: u32| [&glb[..4], &version.to_le_bytes(), &glb[8..]].concat();
    for (bytes, expected) in [
        (&b""[..], "neither glTF JSON nor a binary .glb"),
        (b"\x89PNG\r\n", "neither glTF JSON nor a binary .glb"),
        (b"{", "is not valid glTF"),
        (b"{\"asset\": 1}", "is not valid glTF"),
        (b"{}", "states no asset.version"),
        (b"{\"asset\": {\"version\": \"1.0\"}, \"meshes\": {}}", "is glTF 1.0"),
        (b"{\"asset\": {\"version\": \"2.0\", \"minVersion\": \"2.1\"}}", "is glTF 2.1"),
        (b"{\"asset\": {\"version\": \"2.0\"}, \"meshes\": {}}", "is not valid glTF at line 1"),
        (&version(1), "is glTF 1.0 binary"),
        (&version(3), "is binary glTF version 3"),
        (&glb[..glb.len() - 1], "is truncated"),
        (&glb[..10], "is truncated"),
    ] {
        let sentence = load_bytes("scene.glb", bytes).unwrap_err();
        assert!(sentence.contains(expected), "expected \"{expected}\" in: {sentence}");
        check(Err(sentence));
    }
}

/// Chunks after the JSON chunk other than the binary one are ignored; a length smaller than the header is damage.
#[test]
fn unknown_chunks_are_ignored_and_odd_lengths_refused() {
    let glb = File::empty().glb();
    let with_length = |length: u32, rest: &[u8]| [&glb[..8], &length.to_le_bytes(), rest].concat();
    let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    for tail in [&b"\x04\0\0\0ACMEdata"[..], b"\x02\0\0\0JSON{}", b"\0\0", b""] {
        let bytes = [&glb[12..json_end], tail].concat();
        let scene = load_bytes("scene.glb", &with_length(12 + bytes.len() as u32, &bytes)).unwrap();
        assert_eq!(scene.triangle_count(), 0);
    }
    for length in [0, 11, 12, 19] {
        let sentence = load_bytes("scene.glb", &with_length(length, &glb[12..])).unwrap_err();
        assert!(sentence.contains("is truncated"), "{sentence}");
    }
}

#[test]
fn skins_and_morph_targets_that_do_not_fit_are_refused_by_name() {
    let with = |attribute: &str, kind: &str, values: &[f32]| {
        let mut file = everything();
        let accessor = file.floats(kind, values);
        let pointer = if attribute == "target" { "targets/0/POSITION" } else { "attributes/WEIGHTS_0" };
        *file.json.pointer_mut(&format!("/meshes/0/primitives/0/{pointer}")).expect("it is there") = json!(accessor);
        file
    };
    let weights = |bad: f32| [[0.5, 0.5, 0.0, 0.0], [bad, 0.5, 0.0, 0.0]].concat().repeat(2);
    refused(&with("weights", "VEC4", &weights(f32::NAN)), "a weight of a joint that is NaN (vertex 1)");
    refused(&with("weights", "VEC4", &weights(-0.5)), "a weight of a joint that is -0.5 (vertex 1)");
    refused(&with("weights", "VEC4", &[0.25; 12]), "joints or weights in another number than its vertices");
    refused(&with("target", "VEC3", &[1.0; 9]), "a morph target with 3 values of POSITION for 4 vertices");
    refused(&with("target", "VEC3", &[f32::INFINITY; 12]), "a POSITION that is NaN or infinite");
    let mut file = everything();
    let (values, broken) = (file.floats("SCALAR", &[0.0, 1.0, 2.0]), file.floats("SCALAR", &[0.0, f32::NAN]));
    file.json["animations"][0]["channels"][0]["target"] = json!({"node": 0, "path": "weights"});
    file.json["animations"][0]["samplers"][0]["output"] = json!(values);
    refused(&file, "2 keys and 3 weights of 1 morph targets");
    file.json["animations"][0]["samplers"][0]["output"] = json!(broken);
    refused(&file, "keys that are NaN or infinite");
    let mut file = everything();
    let bind = file.floats("MAT4", &[f32::NAN; 32]);
    file.json["skins"][0]["inverseBindMatrices"] = json!(bind);
    refused(&file, "skin 0 has a matrix that is NaN or infinite");
}

/// Replaces the value at a JSON pointer; the file must be refused with these words.
#[test]
fn wrong_values_are_refused_by_name() {
    let huge = json!(u64::MAX);
    for (pointer, value, expected) in [
        ("/accessors/0/bufferView", json!(999), "buffer view 999 is used but does not exist"),
        ("/accessors/0/count", json!(5), "accessor 0 needs 5 elements"),
        ("/accessors/0/count", huge.clone(), "accessor 0 needs 18446744073709551615 elements"),
        ("/accessors/0/byteOffset", huge.clone(), "accessor 0 needs"),
        ("/accessors/0/componentType", json!(7), "component type 7"),
        ("/accessors/0/type", json!("VEC9"), "type \"VEC9\""),
        ("/accessors/0/type", json!("VEC2"), "does not fit its use"),
        ("/accessors/1/count", json!(3), "4 vertices but 3 values of NORMAL"),
        ("/accessors/0/sparse/count", json!(1u64 << 40), "accessor 0 (sparse) needs"),
        ("/accessors/0/sparse/indices/componentType", json!(F32), "sparse indices"),
        ("/bufferViews/0/byteLength", huge.clone(), "buffer view 0 ends after the end of buffer 0"),
        ("/bufferViews/0/byteStride", json!(4), "stride of 4"),
        ("/bufferViews/0/byteStride", json!(252), "accessor 0 needs"),
        ("/bufferViews/0/buffer", json!(1), "buffer 1 is used but does not exist"),
        ("/buffers/0/byteLength", json!(1 << 30), "of its 1073741824 bytes"),
        ("/meshes/0/primitives/0/indices", json!(0), "does not fit its use"),
        ("/meshes/0/primitives/0/indices", json!(99), "accessor 99 is used but does not exist"),
        ("/meshes/0/primitives/0/material", json!(1), "material 1 is used but does not exist"),
        ("/meshes/0/primitives/0/mode", json!(7), "mode 7"),
        ("/nodes/0/mesh", json!(3), "mesh 3 is used but does not exist"),
        ("/nodes/0/skin", json!(3), "skin 3 is used but does not exist"),
        ("/nodes/2/camera", json!(3), "camera 3 is used but does not exist"),
        ("/nodes/2/children", json!([9]), "node 9 is used but does not exist"),
        ("/nodes/2/children", json!([2]), "their own ancestors"),
        ("/nodes/0/children", json!([1]), "node 1 has two parents"),
        ("/nodes/2/scale", json!([1e20, 1, 1]), "beyond 10¹⁵"),
        ("/nodes/2/scale", json!([1e308, 1, "a"]), "is not valid glTF"),
        ("/scenes/0/nodes", json!([7]), "node 7 is used but does not exist"),
        ("/scene", json!(1), "scene 1 is used but does not exist"),
        ("/skins/0/joints", json!([8, 1]), "node 8 is used but does not exist"),
        ("/skins/0/joints", json!([1]), "uses joint 1 of 1"),
        ("/skins/0/joints", json!([1, 1, 1]), "3 joints and 2 matrices"),
        ("/meshes/0/primitives/0/attributes/JOINTS_0", json!(0), "does not fit its use"),
        ("/meshes/0/weights", json!([1e39]), "whose weight is infinite"),
        ("/animations/0/channels/0/target", json!({"node": 0, "path": "weights"}), "does not fit its use"),
        ("/textures/0/source", json!(1), "image 1 is used but does not exist"),
        ("/textures/0/sampler", json!(0), "sampler 0 is used but does not exist"),
        ("/materials/0/normalTexture/index", json!(4), "texture 4 is used but does not exist"),
        ("/cameras/0/perspective/yfov", json!(0), "camera 0 has no valid projection"),
        ("/cameras/0/perspective/zfar", json!(0.05), "camera 0 has no valid projection"),
        ("/extensions/KHR_lights_punctual/lights/0/type", json!("moon"), "unknown type \"moon\""),
        ("/extensions/KHR_lights_punctual/lights/0/intensity", json!(1e300), "not finite"),
        ("/extensions/KHR_lights_punctual/lights", json!([]), "light 0 is used but does not exist"),
        ("/animations/0/channels/0/target/node", json!(9), "node 9 is used but does not exist"),
        ("/animations/0/channels/0/sampler", json!(1), "animation sampler 1 is used"),
        ("/animations/0/samplers/0/interpolation", json!("CUBICSPLINE"), "2 keys and 2 values"),
        ("/animations/0/samplers/0/interpolation", json!("SMOOTH"), "interpolation \"SMOOTH\""),
    ] {
        let mut file = everything();
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = file.json.pointer_mut(parent).unwrap_or_else(|| panic!("no {pointer}"));
        match parent {
            Value::Array(list) => list[key.parse::<usize>().unwrap()] = value,
            object => object[key] = value,
        }
        refused(&file, expected);
    }
}

#[test]
fn wrong_numbers_in_buffers_are_refused() {
    for bad in [f32::NAN, f32::INFINITY] {
        let mut file = File::quad();
        file.binary[4..8].copy_from_slice(&bad.to_le_bytes());
        refused(&file, "position that is NaN or infinite (vertex 0)");
    }
    let mut file = File::quad();
    file.binary[4..8].copy_from_slice(&1e20f32.to_le_bytes());
    refused(&file, "beyond 10¹⁵ m (vertex 0)");
    let mut file = File::quad();
    let indices = file.accessor(U8, "SCALAR", 3, &[0, 1, 4]);
    file.json["meshes"][0]["primitives"][0]["indices"] = json!(indices);
    refused(&file, "index 4 but only 4 vertices");
    let mut file = everything();
    let times = file.floats("SCALAR", &[1.0, 0.0]);
    file.json["animations"][0]["samplers"][0]["input"] = json!(times);
    refused(&file, "key times that do not increase");
}

#[test]
fn declared_sizes_without_data_allocate_nothing() {
    let start = Instant::now();
    let mut file = File::triangle();
    file.json["accessors"][0] = json!({"componentType": F32, "type": "VEC3", "count": 4_000_000_000u64});
    refused(&file, "declares 4000000000 elements without data");
    // Each file takes a millisecond; four billion elements would take minutes and more memory than the machine has.
    assert!(start.elapsed() < Duration::from_secs(20));
}

/// Every kind of content counts towards the limit, and the limit that a small file needs is enough for it.
#[test]
fn a_limit_of_memory_names_what_takes_most() {
    let refusal = |file: &File, bytes: u64| {
        let (_folder, path) = write("scene.glb", &file.glb());
        let memory = Some(Limit { bytes, words: "the test's limit".into() });
        Scene::load(&path, &LoadOptions { memory, ..LoadOptions::default() }).err().map(|e| e.to_string())
    };
    let mebi = 1 << 20;
    assert_eq!(refusal(&everything(), mebi), None);
    let mut file = everything();
    file.json["materials"] = Value::Array(vec![json!({}); 3000]);
    assert!(refusal(&file, mebi).unwrap().contains("objects and list entries"));
    let mut file = everything();
    let texels = png(256, 256, &[0; 4 << 16]);
    let texture = file.texture(&texels);
    file.material(json!({"emissiveTexture": {"index": texture}, "normalTexture": {"index": texture}}));
    // 65536 texels: 4 bytes, 12 for each of two colour spaces, and 12 during the upload.
    assert!(refusal(&file, 5 * mebi / 2).unwrap().contains("65540 texels"));
    assert_eq!(refusal(&file, 11 * mebi / 4), None);
    let mut file = everything();
    file.view(&[0; 1 << 20]);
    let sentence = refusal(&file, mebi).unwrap();
    assert!(sentence.contains("bytes in its files") && sentence.contains("more than the test's limit"), "{sentence}");
}

#[test]
fn a_limit_on_the_device_counts_mip_chains_alone() {
    let mut file = File::quad();
    let texture = file.texture(&png(256, 256, &[0; 4 << 16]));
    file.material(json!({"emissiveTexture": {"index": texture}}));
    let (_folder, path) = write("scene.glb", &file.glb());
    let load = |bytes: u64| {
        let texture_memory = Some(Limit { bytes, words: "the device's".into() });
        Scene::load(&path, &LoadOptions { texture_memory, ..LoadOptions::default() })
    };
    assert!(load(6 << 16).is_ok());
    // Occlusion textures stay off the device, and so do materials without a mesh.
    let slot = json!({"index": texture});
    file.material(json!({"emissiveTexture": slot, "occlusionTexture": slot}));
    file.push("materials", json!({"normalTexture": slot}));
    std::fs::write(&path, file.glb()).unwrap();
    assert!(load(6 << 16).is_ok());
    let sentence = load((6 << 16) - 1).unwrap_err().to_string();
    assert!(
        sentence.contains("need 0.38 MiB on the device, more") && sentence.contains("the device's of 0.37 MiB"),
        "{sentence}"
    );
    check(Err(sentence));
}

#[test]
fn deep_hierarchies_and_nested_json_do_not_exhaust_the_stack() {
    let mut file = File::triangle();
    let mut top = 0;
    for _ in 0..20_000 {
        top = file.push("nodes", json!({"children": [top]}));
    }
    file.json["scenes"][0]["nodes"] = json!([top]);
    assert_eq!(file.scene().triangle_count(), 1);
    let nested = [b"{\"asset\":".to_vec(), b"[".repeat(100_000)].concat();
    check(load_bytes("scene.gltf", &nested));
}

#[test]
fn every_truncation_is_survived() {
    let glb = everything().glb();
    for length in (0..glb.len()).step_by(7) {
        let sentence = load_bytes("scene.glb", &glb[..length]).expect_err("a truncated file loaded");
        check(Err(sentence));
    }
}

/// Numbers that often break loaders.
const EXTREMES: [f64; 10] = [-1.0, 0.0, 0.5, 1.0, 255.0, 65536.0, 4294967295.0, 1.8446744073709552e19, 1e-300, 1e300];

/// Replaces in turn every number of a document whose JSON pointer `chosen` accepts by each of `extremes`.
pub fn replace_numbers(original: &File, extremes: &[f64], chosen: impl Fn(&str) -> bool) {
    fn numbers(value: &Value, path: String, out: &mut Vec<String>) {
        match value {
            Value::Number(_) => out.push(path),
            Value::Array(list) => list.iter().enumerate().for_each(|(i, v)| numbers(v, format!("{path}/{i}"), out)),
            Value::Object(map) => map.iter().for_each(|(k, v)| numbers(v, format!("{path}/{k}"), out)),
            _ => {}
        }
    }
    let mut pointers = Vec::new();
    numbers(&original.json, String::new(), &mut pointers);
    pointers.retain(|pointer| chosen(pointer));
    assert!(!pointers.is_empty());
    for pointer in pointers {
        for &extreme in extremes {
            let whole = extreme.fract() == 0.0 && extreme.abs() < 1e19;
            let mut file = File { json: original.json.clone(), binary: original.binary.clone() };
            *file.json.pointer_mut(&pointer).unwrap() = if whole { json!(extreme as i64) } else { json!(extreme) };
            check(file.load());
        }
    }
}

#[test]
fn every_number_of_the_document_may_be_anything() {
    replace_numbers(&everything(), &EXTREMES, |_| true);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1500, failure_persistence: None, ..ProptestConfig::default() })]

    /// Bytes flipped anywhere in the file: header, document, vertices, image.
    #[test]
    fn flipped_bytes_are_survived(flips in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..6)) {
        let mut glb = everything().glb();
        for (at, byte) in flips {
            let at = at.index(glb.len());
            glb[at] = byte;
        }
        let start = Instant::now();
        check(load_bytes("scene.glb", &glb));
        // The intact file takes a millisecond. The limit detects hangs, even on a slow machine.
        prop_assert!(start.elapsed() < Duration::from_secs(20));
    }
}
