//! Compressed files (`compressed/make.mjs` made them): each holds the knot of the plain file, within its quantisation;
//! a damaged one gives an error of one sentence or a valid scene.

use std::path::PathBuf;

use super::damage::{change_bytes, check, replace_numbers};
use super::files::{File, U8, load_bytes};
use crate::random::Random;
use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::{Value, json};
use twobounce::scene::{LoadOptions, Scene};

fn path(name: &str) -> PathBuf {
    [env!("CARGO_MANIFEST_DIR"), "tests/values/gltf/compressed", name].iter().collect()
}

/// A file that loads without a note, also with `--strict`.
fn load(name: &str) -> Scene {
    let scene = Scene::load(&path(name), &LoadOptions { strict: true, ..LoadOptions::default() }).unwrap();
    assert_eq!(scene.warnings, [""; 0], "{name}");
    scene
}

/// Attributes of a corner of a triangle in the world.
#[derive(Clone, Copy)]
struct Corner {
    position: DVec3,
    normal: Vec3,
    uv: Vec2,
    color: Vec4,
}

/// The corners of all triangles, at a time of the first animation in seconds.
fn corners(scene: &Scene, time: f32) -> Vec<Corner> {
    let pose = scene.pose((!scene.animations.is_empty()).then_some(0), time);
    let mut corners = Vec::new();
    for (instance, world) in scene.instances.iter().zip(&pose.world_from_instance) {
        let mesh = &scene.meshes[instance.mesh];
        let uv = scene.materials[mesh.material].base_color_texture.expect("a texture").transform;
        corners.extend(mesh.indices.iter().map(|&i| i as usize).map(|i| Corner {
            position: world.transform_point3(mesh.positions[i].as_dvec3()),
            normal: world.transform_vector3(mesh.normals[i].as_dvec3()).normalize().as_vec3(),
            uv: uv.transform_point2(mesh.uvs[0][i]),
            color: mesh.colors[i],
        }));
    }
    corners
}

/// The largest errors of positions, in metres, normals, uvs and colours.
#[derive(Clone, Copy)]
struct Within(f64, f32, f32, f32);

/// Compressors reorder triangles and vertices: every corner of either scene must be a corner of the other.
fn assert_alike(name: &str, [a, b]: [&[Corner]; 2], within: Within) {
    assert_eq!(a.len(), b.len(), "{name}");
    let alike = |a: &Corner, b: &Corner| {
        (a.position - b.position).length() <= within.0
            && (a.normal - b.normal).length() <= within.1
            && (a.uv - b.uv).length() <= within.2
            && (a.color - b.color).length() <= within.3
    };
    for (from, to) in [(a, b), (b, a)] {
        let mut to = to.to_vec();
        to.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
        let near = |x: f64| {
            let start = to.partition_point(|corner| corner.position.x < x - within.0);
            to[start..].iter().take_while(move |corner| corner.position.x <= x + within.0)
        };
        let lonely = from.iter().find(|corner| !near(corner.position.x).any(|other| alike(corner, other)));
        assert!(lonely.is_none(), "{name}: nothing is near {}", lonely.unwrap().position);
    }
    let area = |corners: &[Corner]| -> f64 {
        corners
            .chunks_exact(3)
            .map(|c| (c[1].position - c[0].position).cross(c[2].position - c[0].position).length())
            .sum()
    };
    assert!((area(a) / area(b) - 1.0).abs() < 1e-3, "{name}: areas {} and {}", area(a), area(b));
}

/// Positions of 14 bits over 7 m, or of 14 bits of mantissa; normals of 8 or 10 bits; uvs of 12 bits over 6; 8-bit
/// colours.
const MESHOPT: Within = Within(6e-4, 0.02, 2e-3, 0.01);

#[test]
fn meshopt_files_hold_the_plain_files_knot() {
    let plain = load("knot.glb");
    assert_eq!((plain.triangle_count(), plain.instances.len()), (3 * 1440, 3));
    for name in ["knot-quantized.glb", "knot-meshopt-ext.glb", "knot-meshopt-khr.glb"] {
        let scene = load(name);
        assert_alike(name, [&corners(&plain, 0.0), &corners(&scene, 0.0)], MESHOPT);
        // The turning knot's rotation is compressed too: 12 bits, sampled 30 times a second.
        let Within(_, normal, uv, color) = MESHOPT;
        assert_alike(name, [&corners(&plain, 0.73), &corners(&scene, 0.73)], Within(4e-3, normal, uv, color));
    }
}

/// Three instances whose compressed places, rotations and sizes are read.
#[test]
fn an_instanced_file_holds_the_plain_files_knots() {
    let (plain, scene) = (load("knot.glb"), load("knot-instanced.glb"));
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 3));
    assert_alike("knot-instanced.glb", [&corners(&plain, 0.0), &corners(&scene, 0.0)], MESHOPT);
}

/// Positions of 14 bits over 7 m, normals of 10 bits, uvs of 12 over 6, colours of 8.
const DRACO: Within = Within(5e-4, 0.006, 2e-3, 0.01);

#[test]
fn draco_files_hold_the_plain_files_knot() {
    let plain = load("knot.glb");
    for name in ["knot-draco-edgebreaker.glb", "knot-draco-valence.glb", "knot-draco-sequential.glb"] {
        let scene = load(name);
        assert_eq!(
            (scene.meshes.len(), scene.meshes[0].positions.len()),
            (1, plain.meshes[0].positions.len()),
            "{name}"
        );
        assert_alike(name, [&corners(&plain, 0.73), &corners(&scene, 0.73)], DRACO);
    }
}

/// A stream may hold triangles alone: then all attributes are plain.
#[test]
fn a_draco_stream_without_attributes_is_read() {
    let mut file = File::triangle();
    // Version 2.2 of a mesh in sequence: one triangle of three vertices, its indices plain, no decoders of attributes.
    let stream = file.view(b"DRACO\x02\x02\x01\x00\x00\x00\x01\x03\x01\x02\x00\x01\x00");
    let indices = file.push("accessors", json!({"componentType": U8, "count": 3, "type": "SCALAR"}));
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["indices"] = json!(indices);
    primitive["extensions"] = json!({"KHR_draco_mesh_compression": {"bufferView": stream, "attributes": {}}});
    let mesh = &file.scene().meshes[0];
    assert_eq!(mesh.positions, [Vec3::Y, Vec3::ZERO, Vec3::X], "without normals every corner is a vertex");
}

/// Replaces the value at a JSON pointer of a file, which must then be refused with these words.
fn refused(name: &str, pointer: &str, value: &Value, expected: &str) {
    let (mut json, binary) = split(&std::fs::read(path(name)).unwrap());
    *json.pointer_mut(pointer).unwrap_or_else(|| panic!("no {pointer}")) = value.clone();
    let sentence = File { json, binary }.load().err().unwrap_or_else(|| panic!("loaded, but expected: {expected}"));
    assert!(sentence.contains(expected), "expected \"{expected}\" in: {sentence}");
    check(Err(sentence));
}

#[test]
fn wrong_values_of_draco_primitives_are_refused_by_name() {
    let (json, _) = split(&std::fs::read(path("knot-draco-edgebreaker.glb")).unwrap());
    let primitive = &json["meshes"][0]["primitives"][0];
    let stream = "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression";
    let accessor = |value: &Value, key: &str| format!("/accessors/{value}/{key}");
    let [positions, normals] = ["POSITION", "NORMAL"].map(|name| &primitive["attributes"][name]);
    let bytes =
        format!("/bufferViews/{}/byteLength", primitive["extensions"]["KHR_draco_mesh_compression"]["bufferView"]);
    let what = "mesh 0 primitive 0 is compressed by Draco";
    for (pointer, value, expected) in [
        (format!("{stream}/bufferView"), json!(99), "buffer view 99 is used but does not exist"),
        (format!("{stream}/attributes/NORMAL"), json!(9), "and its bytes hold no NORMAL"),
        (format!("{stream}/attributes"), json!([]), "but how is not stated"),
        (accessor(positions, "count"), json!(900), "where its accessors state 900 and 1440"),
        (accessor(positions, "count"), json!(90), "and its bytes hold more than its accessors state"),
        (accessor(positions, "count"), json!(1u64 << 40), "needs about"),
        (accessor(&primitive["indices"], "count"), json!(4323), "hold 803 vertices and 1440 triangles where"),
        (accessor(&primitive["indices"], "count"), json!(300), "and its bytes hold more than its accessors state"),
        (accessor(&primitive["indices"], "count"), json!(u64::MAX), "triangles over all instances"),
        (accessor(normals, "type"), json!("VEC2"), "hold NORMAL of another type than accessor"),
        (accessor(normals, "type"), json!("VEC9"), "which glTF does not define"),
        (bytes, json!(1000), "and its bytes are damaged"),
    ] {
        refused("knot-draco-edgebreaker.glb", &pointer, &value, expected);
    }
    refused("knot-draco-edgebreaker.glb", stream, &json!({}), &format!("{what}, but how is not stated"));
}

/// A valid file whose plain buffer is named as a missing fallback.
#[test]
fn a_fallback_buffer_is_not_read() {
    let (mut json, binary) = split(&std::fs::read(path("knot-meshopt-ext.glb")).unwrap());
    assert_eq!(json["buffers"][1]["extensions"]["EXT_meshopt_compression"]["fallback"], json!(true));
    json["buffers"][1]["uri"] = json!("none.bin");
    let scene = File { json: json.clone(), binary: binary.clone() }.scene();
    assert_eq!(scene.triangle_count(), 3 * 1440);
    json["buffers"][1].as_object_mut().unwrap().remove("extensions");
    assert!(File { json, binary }.load().unwrap_err().contains("\"none.bin\" does not exist"));
}

#[test]
fn wrong_values_of_compressed_views_are_refused_by_name() {
    let (json, _) = split(&std::fs::read(path("knot-meshopt-ext.glb")).unwrap());
    let views = json["bufferViews"].as_array().unwrap();
    let with =
        |key: &str| views.iter().position(|v| v["extensions"]["EXT_meshopt_compression"].get(key).is_some()).unwrap();
    let (compressed, filtered) = (with("byteOffset"), with("filter"));
    let huge = json!(u64::MAX);
    for (key, value, expected) in [
        ("buffer", json!(7), "buffer 7 is used but does not exist"),
        ("buffer", json!(1), "buffer 1 has no data"),
        ("byteOffset", huge.clone(), "its compressed bytes end after the end of buffer 0"),
        ("byteLength", json!(1 << 20), "its compressed bytes end after the end of buffer 0"),
        ("byteLength", json!(40), "its bytes are damaged, or too few or too many"),
        ("byteOffset", json!(1), "is compressed by meshopt and its bytes are of an unknown version"),
        ("count", json!(5), "its bytes are damaged, or too few or too many"),
        ("count", json!(1u64 << 50), "needs about"),
        ("count", huge, "needs about"),
        ("byteStride", json!(7), "mode ATTRIBUTES with filter NONE cannot hold"),
        ("mode", json!("WORDS"), "in the unknown mode \"WORDS\""),
        ("mode", json!(null), "but how is not stated"),
    ] {
        let pointer = format!("/bufferViews/{compressed}/extensions/EXT_meshopt_compression/{key}");
        refused("knot-meshopt-ext.glb", &pointer, &value, expected);
    }
    let filter = format!("/bufferViews/{filtered}/extensions/EXT_meshopt_compression/filter");
    refused("knot-meshopt-ext.glb", &filter, &json!("BLUR"), "with the unknown filter \"BLUR\"");
}

/// The JSON and the binary chunk of a `.glb`.
fn split(glb: &[u8]) -> (Value, Vec<u8>) {
    let word = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let end = 20 + word(12);
    (serde_json::from_slice(&glb[20..end]).unwrap(), glb[end + 8..end + 8 + word(end)].to_vec())
}

/// Flipped bits, changed bytes and missing ends, in the bytes that decoders read.
#[test]
fn damaged_files_are_one_sentence_or_a_valid_scene() {
    let mut random = Random(7);
    for name in [
        "knot-meshopt-ext.glb",
        "knot-meshopt-khr.glb",
        "knot-draco-edgebreaker.glb",
        "knot-draco-valence.glb",
        "knot-draco-sequential.glb",
    ] {
        let glb = std::fs::read(path(name)).unwrap();
        let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
        let mut refused = 0;
        for _ in 0..400 {
            let mut damaged = glb.clone();
            change_bytes(&mut random, &mut damaged, |_| json_end + 8..glb.len());
            let outcome = load_bytes("scene.glb", &damaged);
            refused += usize::from(outcome.is_err());
            check(outcome);
        }
        assert!(refused > 60, "{name}: {refused} of 400 were refused");
    }
}

/// Random numbers in extensions, and in the accessors and views beside them.
#[test]
fn every_number_of_compressed_documents_may_be_anything() {
    for name in ["knot-instanced.glb", "knot-meshopt-khr.glb", "knot-draco-sequential.glb"] {
        let (json, binary) = split(&std::fs::read(path(name)).unwrap());
        let chosen = |pointer: &str| pointer.contains("extensions") || pointer.starts_with("/accessors");
        replace_numbers(
            &File { json, binary },
            &[-1.0, 0.0, 3.0, 65536.0, 4294967295.0, 1.8446744073709552e19],
            chosen,
        );
    }
}
