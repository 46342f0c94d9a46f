//! Small files that describe more than a machine holds, and files without an end: each is refused at once, in little
//! memory, by a sentence that names it.
#![cfg(target_os = "linux")]

use crate::cli_common;
mod many;
mod more;

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use cli_common::names;
use serde_json::{Value, json};

/// Far more memory than the program takes without a scene, and far less than any of these files asks for.
const MEMORY_KIB: u64 = 200 << 10;
const TIME: Duration = Duration::from_secs(2);

/// Fails unless the scene is refused in one sentence with all `parts`, quickly, in little memory and without output.
fn refused(folder: &Path, scene: &str, parts: &[&str]) {
    refused_by(folder, &["render", scene, "-o", "a.png"], scene, parts);
}

/// As [`refused`], for any command; the sentence begins with `subject`.
fn refused_by(folder: &Path, args: &[&str], subject: &str, parts: &[&str]) {
    let before = names(folder);
    let start = Instant::now();
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    // No driver is found, so that a driver's memory is not measured.
    command.env("VK_DRIVER_FILES", "/none").env("VK_ICD_FILENAMES", "/none").current_dir(folder);
    let mut child = command.args(args).stderr(Stdio::piped()).spawn().unwrap();
    let mut memory_kib = 0;
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        memory_kib = memory_kib.max(most_memory_kib(child.id()));
        if start.elapsed() > 5 * TIME {
            child.kill().unwrap();
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    let took = start.elapsed();
    let mut message = String::new();
    child.stderr.unwrap().read_to_string(&mut message).unwrap();
    let code = status.code();
    assert_eq!(code, Some(2), "{args:?}: {message}");
    assert!(message.starts_with(&format!("twobounce: {subject}: ")), "{args:?}: {message}");
    assert_eq!(message.trim_end().lines().count(), 1, "{args:?}: {message}");
    assert!(parts.iter().all(|part| message.contains(part)), "{args:?} should say {parts:?}: {message}");
    assert!(took < TIME, "{args:?} took {took:?}: {message}");
    assert!(memory_kib < MEMORY_KIB, "{args:?} took {memory_kib} KiB: {message}");
    assert_eq!(names(folder), before, "{args:?} left something behind");
}

/// The largest memory that a process has held so far. The system's count for ended children would include this test's
/// own memory, which a child shares until it runs the program.
fn most_memory_kib(process: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse().ok()).unwrap_or(0)
}

/// One triangle whose positions are the first 36 bytes of `uri`.
fn triangle(uri: &str) -> Value {
    json!({
        "asset": {"version": "2.0"}, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"}],
        "bufferViews": [{"buffer": 0, "byteLength": 36}], "buffers": [{"byteLength": 36, "uri": uri}]
    })
}

/// Nine floats: (0,0,0) (1,0,0) (0,1,0).
const INLINE: &str = "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";

/// A triangle with this many materials, each with a texture from an image of its own, which `image` names.
fn textured(count: usize, image: impl Fn(usize) -> String) -> Value {
    let mut scene = triangle(INLINE);
    let list = |make: &dyn Fn(usize) -> Value| Value::Array((0..count).map(make).collect());
    scene["images"] = list(&|i| json!({"uri": image(i)}));
    scene["textures"] = list(&|i| json!({"source": i}));
    scene["materials"] = list(&|i| json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}}));
    scene
}

/// The start of a PNG: a header that states this many texels, and enough data that a decoder reads on.
fn png_header(width: u32, height: u32) -> Vec<u8> {
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 2, 0, 0, 0]].concat();
    // A byte of deflate expands to at most 1032 bytes, each of at most eight texels.
    let data = vec![0x78; (u64::from(width.min(1 << 14)) * u64::from(height.min(1 << 14)) / 8000) as usize + 2];
    png(&[(b"IHDR", &header), (b"IDAT", &data)])
}

/// A PNG of these chunks.
fn png(chunks: &[(&[u8; 4], &[u8])]) -> Vec<u8> {
    let chunk = |kind: &[u8; 4], data: &[u8]| {
        let body = [&kind[..], data].concat();
        [&(data.len() as u32).to_be_bytes()[..], &body, &crc(&body).to_be_bytes()].concat()
    };
    let chunks: Vec<u8> = chunks.iter().flat_map(|(kind, data)| chunk(kind, data)).collect();
    [&b"\x89PNG\r\n\x1a\n"[..], &chunks].concat()
}

/// The checksum of PNG chunks (ISO 3309), bit by bit.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, _| if crc & 1 == 1 { 0xedb8_8320 ^ (crc >> 1) } else { crc >> 1 };
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step))
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

fn write(folder: &Path, name: &str, scene: &Value) {
    fs::write(folder.join(name), scene.to_string()).unwrap();
}

#[test]
fn accessors_without_data_are_added_up() {
    let folder = folder();
    let sparse = json!({"componentType": 5126, "count": 4_000_000, "type": "VEC3", "sparse": {
        "count": 1, "indices": {"bufferView": 0, "componentType": 5121}, "values": {"bufferView": 0}}});
    let mut many = triangle(INLINE);
    many["accessors"] = Value::Array(vec![sparse.clone(); 1000]);
    let primitive = |i: usize| json!({"attributes": {"POSITION": i}});
    many["meshes"][0]["primitives"] = (0..1000).map(primitive).collect();
    write(folder.path(), "sparse.gltf", &many);
    refused(folder.path(), "sparse.gltf", &["of memory", "vertices", "fewer triangles"]);

    // A mesh that a thousand nodes deform is loaded a thousand times.
    let mut deformed = triangle(INLINE);
    deformed["accessors"] = json!([sparse]);
    deformed["nodes"] = Value::Array(vec![json!({"mesh": 0, "weights": [0.5]}); 1000]);
    deformed["scenes"][0]["nodes"] = (0..1000).collect();
    write(folder.path(), "deformed.gltf", &deformed);
    refused(folder.path(), "deformed.gltf", &["of memory", "vertices", "fewer triangles"]);

    let mut keys = triangle(INLINE);
    keys["accessors"] = json!([keys["accessors"][0], {"componentType": 5126, "count": 4_000_000, "type": "VEC3"}, {"componentType": 5126, "count": 4_000_000, "type": "SCALAR"}]);
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "translation"}});
    keys["animations"] = json!([{"samplers": [{"input": 2, "output": 1}], "channels": vec![channel; 10_000]}]);
    write(folder.path(), "keys.gltf", &keys);
    refused(folder.path(), "keys.gltf", &["of memory", "animations", "fewer keys"]);

    for count in [1u64 << 32, u64::MAX] {
        let mut huge = triangle(INLINE);
        huge["accessors"][0] = json!({"componentType": 5126, "count": count, "type": "VEC3"});
        write(folder.path(), "huge.gltf", &huge);
        refused(folder.path(), "huge.gltf", &["accessor 0", "without data"]);
        huge["accessors"][0]["bufferView"] = json!(0);
        write(folder.path(), "backed.gltf", &huge);
        refused(folder.path(), "backed.gltf", &["accessor 0", "36 bytes"]);
    }
}

#[test]
fn triangles_of_all_instances_are_added_up() {
    let folder = folder();
    let mut scene = triangle(INLINE);
    scene["accessors"] = json!([{"componentType": 5126, "count": 4_000_000, "type": "VEC3"}]);
    scene["nodes"] = Value::Array(vec![json!({"mesh": 0}); 50_000]);
    scene["scenes"][0]["nodes"] = (0..50_000).collect();
    write(folder.path(), "instances.gltf", &scene);
    refused(folder.path(), "instances.gltf", &["triangles over all instances", "fewer triangles or instances"]);
}

#[test]
fn texels_are_added_up_from_headers() {
    let folder = folder();
    fs::write(folder.path().join("wide.png"), png_header(16384, 16384)).unwrap();
    write(folder.path(), "wide.gltf", &textured(2000, |_| "wide.png".into()));
    refused(folder.path(), "wide.gltf", &["of memory", "texels", "use smaller textures"]);
    fs::write(folder.path().join("huge.png"), png_header(0x7fff_ffff, 0x7fff_ffff)).unwrap();
    write(folder.path(), "huge.gltf", &textured(1, |_| "huge.png".into()));
    refused(folder.path(), "huge.gltf", &["image 0", "huge.png", "16384"]);
}

#[test]
fn only_as_much_of_a_file_is_read_as_is_used() {
    let folder = folder();
    let sparse = |name: &str, bytes: u64| fs::File::create(folder.path().join(name)).unwrap().set_len(bytes).unwrap();
    // Sparse files: 64 TiB exceed every machine, and reading 8 GiB would take seconds.
    sparse("long.bin", 8 << 30);
    let mut scene = triangle("long.bin");
    scene["bufferViews"][0]["byteOffset"] = json!(1);
    write(folder.path(), "beyond.gltf", &scene);
    refused(folder.path(), "beyond.gltf", &["buffer view 0 ends after the end of buffer 0 of 36 bytes"]);
    scene["buffers"][0]["byteLength"] = json!(9u64 << 30);
    write(folder.path(), "short.gltf", &scene);
    refused(folder.path(), "short.gltf", &["buffer 0 holds 8589934592 of its 9663676416 bytes"]);
    sparse("vast.bin", 1 << 43);
    let mut scene = triangle("vast.bin");
    scene["buffers"][0]["byteLength"] = json!(1u64 << 43);
    write(folder.path(), "vast.gltf", &scene);
    refused(folder.path(), "vast.gltf", &["of memory", "bytes in its files"]);
    sparse("film.gltf", 1 << 43);
    refused(folder.path(), "film.gltf", &["neither glTF JSON nor a binary .glb"]);
}

#[test]
fn a_binary_file_states_its_lengths_and_is_held_to_them() {
    let folder = folder();
    let glb = |length: u32, chunk: u32, kind: &[u8], text: &[u8]| {
        let words = [2, length, chunk].map(u32::to_le_bytes).concat();
        [b"glTF", &words[..], kind, text].concat()
    };
    for (name, bytes, part) in [
        ("long.glb", glb(u32::MAX, 2, b"JSON", b"{}"), "states 4294967295 bytes and the file has 22"),
        ("chunk.glb", glb(22, u32::MAX, b"JSON", b"{}"), "a chunk ends after the end of the file"),
        ("short.glb", glb(15, 2, b"JSON", b"{}"), "no JSON chunk"),
    ] {
        fs::write(folder.path().join(name), bytes).unwrap();
        refused(folder.path(), name, &["is truncated", part]);
    }
}

#[test]
fn nested_values_are_refused_before_they_exhaust_the_stack() {
    let folder = folder();
    let (open, close) = ("[".repeat(1_000_000), "]".repeat(1_000_000));
    let text = format!(r#"{{"asset":{{"version":"2.0"}},"materials":[{{"extensions":{{"ACME_a":{open}{close}}}}}]}}"#);
    fs::write(folder.path().join("deep.gltf"), text).unwrap();
    refused(folder.path(), "deep.gltf", &["line 1", "recursion"]);
}

#[test]
fn what_is_no_regular_file_is_not_opened() {
    let folder = folder();
    let fifo = |name: &str| {
        assert!(Command::new("mkfifo").arg(folder.path().join(name)).status().unwrap().success());
    };
    fifo("pipe.gltf");
    refused(folder.path(), "pipe.gltf", &["no regular file"]);
    refused(folder.path(), "/dev/zero", &["no regular file"]);
    fifo("pipe.bin");
    std::os::unix::fs::symlink("/dev/zero", folder.path().join("zero.bin")).unwrap();
    for (name, why) in [("pipe.bin", "no regular file"), ("zero.bin", "a link that leads outside the folder")] {
        write(folder.path(), "scene.gltf", &triangle(name));
        refused(folder.path(), "scene.gltf", &["buffer 0", name, why]);
    }
}

/// Small files whose decoders would expand to the sizes that they state: counts, and sizes in headers.
#[test]
fn compressed_and_instanced_files_are_added_up() {
    let folder = folder();
    let mut zeros = triangle(INLINE);
    let stated = json!({"buffer": 0, "byteLength": 36, "byteStride": 16, "count": 1u64 << 36, "mode": "ATTRIBUTES"});
    zeros["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": stated});
    write(folder.path(), "meshopt.gltf", &zeros);
    refused(folder.path(), "meshopt.gltf", &["of memory", "bytes in its files"]);

    let mut draco = triangle(INLINE);
    draco["accessors"][0] = json!({"componentType": 5126, "count": 4_000_000_000u64, "type": "VEC3"});
    let stated = json!({"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}});
    draco["meshes"][0]["primitives"][0]["extensions"] = stated;
    write(folder.path(), "draco.gltf", &draco);
    refused(folder.path(), "draco.gltf", &["of memory", "fewer triangles"]);

    let mut crowd = triangle(INLINE);
    let places = json!({"componentType": 5126, "count": 4_000_000, "type": "VEC3"});
    crowd["accessors"].as_array_mut().unwrap().push(places);
    let shown = json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}});
    crowd["nodes"] = Value::Array(vec![shown; 100]);
    crowd["scenes"][0]["nodes"] = (0..100).collect();
    write(folder.path(), "crowd.gltf", &crowd);
    refused(folder.path(), "crowd.gltf", &["of memory", "400.0 million instances of meshes", "fewer instances"]);

    // Headers of KTX 2 that state 16,384 × 16,384 texels of UASTC in a few bytes of zstd.
    let whole = include_bytes!("../../values/gltf/compressed/fading-uastc-zstd.ktx2");
    let side = 16384u32.to_le_bytes();
    let texels = (16384u64 * 16384).to_le_bytes();
    let large = [&whole[..20], &side, &side, &whole[28..96], &texels, &whole[104..]].concat();
    for i in 0..60 {
        fs::write(folder.path().join(format!("{i}.ktx2")), &large).unwrap();
    }
    write(folder.path(), "ktx2.gltf", &textured(60, |i| format!("{i}.ktx2")));
    refused(folder.path(), "ktx2.gltf", &["of memory", "texels in its textures"]);
}
