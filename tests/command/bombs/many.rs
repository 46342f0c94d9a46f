//! Valid files with very many entries of one kind: work for each entry must not be repeated for each other entry. The
//! tests measure processor time, which other work on the machine hardly lengthens.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use super::{INLINE, folder, most_memory_kib, triangle, write};

/// A run that the program itself ended, not a signal; `said` is its last output.
struct ProgramRun {
    said: String,
    /// Processor time of all threads in seconds.
    seconds: f64,
    memory_kib: u64,
}

/// Renders the scene until it is refused, or for a minute at most. Unless `device`, there is no driver, so that the
/// scene is only read.
fn run(folder: &Path, scene: &str, device: bool) -> Option<ProgramRun> {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    let args = ["render", scene, "-o", "a.png", "--size", "64x64", "--set", "voxels=32", "--preset", "fast"];
    command.current_dir(folder).args(args).stdout(Stdio::null()).stderr(Stdio::piped());
    if !device {
        command.env("VK_DRIVER_FILES", "/none").env("VK_ICD_FILENAMES", "/none");
    }
    let mut child = command.spawn().unwrap();
    let (mut seconds, mut memory_kib) = (0.0f64, 0);
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        seconds = seconds.max(processor_seconds(child.id()));
        memory_kib = memory_kib.max(most_memory_kib(child.id()));
        if seconds > 60.0 {
            child.kill().unwrap();
        }
        std::thread::sleep(std::time::Duration::from_millis(2));
    };
    let mut said = String::new();
    child.stderr.unwrap().read_to_string(&mut said).unwrap();
    println!("{scene}: {seconds} s of a processor, {} MiB: {said}", memory_kib >> 10);
    assert!(status.code().is_some(), "{scene} took a minute");
    (status.code() == Some(2)).then_some(ProgramRun { said, seconds, memory_kib })
}

/// Processor time of all threads of a process so far, in steps of 0.01 s.
fn processor_seconds(process: u32) -> f64 {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    // The name stands in parentheses; after it come the fields utime and stime of proc(5).
    let fields = stat.rsplit_once(") ").map_or("", |(_, fields)| fields);
    fields.split(' ').skip(11).take(2).filter_map(|ticks| ticks.parse::<f64>().ok()).sum::<f64>() / 100.0
}

/// Fails unless the scene is read within these seconds of processor time and this memory.
fn read(folder: &Path, scene: &str, seconds: f64, memory_mib: u64) {
    let run = run(folder, scene, false).expect("there is no device");
    assert!(run.said.contains("twobounce: there is no Vulkan device"), "{scene}: {}", run.said);
    assert!(run.seconds < seconds, "{scene} took {} s of a processor", run.seconds);
    assert!(run.memory_kib < memory_mib << 10, "{scene} took {} KiB", run.memory_kib);
}

/// A scene of `nodes` nodes; each has the mesh of [`triangle`] as many times as `places` has entries.
fn crowd(folder: &Path, nodes: usize, places: usize) -> Value {
    let mut scene = triangle(INLINE);
    let at: Vec<u8> = (0..3 * places).flat_map(|i| ((i * 37 % 101) as f32 / 10.0).to_le_bytes()).collect();
    fs::write(folder.join("places.bin"), &at).unwrap();
    scene["buffers"].as_array_mut().unwrap().push(json!({"byteLength": at.len(), "uri": "places.bin"}));
    scene["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 1, "byteLength": at.len()}));
    let of = json!({"bufferView": 1, "componentType": 5126, "count": places, "type": "VEC3"});
    scene["accessors"].as_array_mut().unwrap().push(of);
    scene["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
    let node = |i: usize| {
        json!({"mesh": 0, "translation": [i % 50, i / 50 % 50, i / 2500],
            "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}})
    };
    scene["nodes"] = (0..nodes).map(node).collect();
    scene["scenes"][0]["nodes"] = (0..nodes).collect();
    scene
}

#[test]
fn channels_are_not_looked_through_for_every_node() {
    let folder = folder();
    const NODES: usize = 20_000;
    let mut scene = triangle(INLINE);
    scene["nodes"] = Value::Array(vec![json!({"mesh": 0}); NODES]);
    scene["scenes"][0]["nodes"] = (0..NODES).collect();
    for kind in ["SCALAR", "VEC3"] {
        let accessor = json!({"bufferView": 0, "componentType": 5126, "count": 2, "type": kind});
        scene["accessors"].as_array_mut().unwrap().push(accessor);
    }
    let channel = |i: usize| json!({"sampler": 0, "target": {"node": i % NODES, "path": "translation"}});
    let animation = |i: usize| json!({"samplers": [{"input": 1, "output": 2}], "channels": [channel(i)]});
    scene["animations"] = (0..65_536).map(animation).collect();
    write(folder.path(), "channels.gltf", &scene);
    read(folder.path(), "channels.gltf", 4.0, 300);
}

#[test]
fn extensions_are_not_looked_through_for_every_extension() {
    let folder = folder();
    let mut scene = triangle(INLINE);
    const NAMES: usize = 100_000;
    scene["extensionsUsed"] = (0..NAMES).map(|i| format!("XX_materials_{i}")).collect();
    scene["extensionsRequired"] = (0..NAMES).rev().map(|i| format!("XX_materials_{i}")).collect();
    write(folder.path(), "names.gltf", &scene);
    read(folder.path(), "names.gltf", 4.0, 200);
}

#[test]
fn bounds_of_very_many_moving_instances_are_sampled_less_often() {
    let folder = folder();
    const KEYS: usize = 5000;
    let mut scene = crowd(folder.path(), 2000, 100);
    scene["nodes"].as_array_mut().unwrap().push(json!({"children": (0..2000).collect::<Vec<_>>()}));
    scene["scenes"][0]["nodes"] = json!([2000]);
    let times = (0..KEYS).map(|i| i as f32);
    let moved = (0..KEYS).flat_map(|i| [i as f32, 0.0, 0.0]);
    let keys: Vec<u8> = times.chain(moved).flat_map(f32::to_le_bytes).collect();
    fs::write(folder.path().join("keys.bin"), &keys).unwrap();
    scene["buffers"].as_array_mut().unwrap().push(json!({"byteLength": keys.len(), "uri": "keys.bin"}));
    for (first, bytes, kind) in [(0, 4 * KEYS, "SCALAR"), (4 * KEYS, 12 * KEYS, "VEC3")] {
        let views = scene["bufferViews"].as_array_mut().unwrap();
        views.push(json!({"buffer": 2, "byteOffset": first, "byteLength": bytes}));
        let view = views.len() - 1;
        let accessor = json!({"bufferView": view, "componentType": 5126, "count": KEYS, "type": kind});
        scene["accessors"].as_array_mut().unwrap().push(accessor);
    }
    scene["animations"] = json!([{"samplers": [{"input": 2, "output": 3}],
        "channels": [{"sampler": 0, "target": {"node": 2000, "path": "translation"}}]}]);
    write(folder.path(), "moving.gltf", &scene);
    read(folder.path(), "moving.gltf", 12.0, 400);
}

/// Two million instances are read within twice the scene's memory. They exceed the smallest buffer that devices must
/// bind, which is known before anything is built from them.
#[test]
fn instances_that_no_buffer_holds_are_refused_at_once() {
    let folder = folder();
    write(folder.path(), "crowd.gltf", &crowd(folder.path(), 20_000, 100));
    read(folder.path(), "crowd.gltf", 4.0, 800);
    // Other devices bind more.
    if let Some(run) = run(folder.path(), "crowd.gltf", true) {
        assert!(
            run.said.contains("the scene has too many instances: the buffer \"record draws\" needs"),
            "{}",
            run.said
        );
        assert!(run.said.trim_end().ends_with("use a scene of fewer"), "{}", run.said);
        assert!(run.seconds < 8.0, "it took {} s of a processor", run.seconds);
    }
}

/// Each primitive reads three of a million vertices, and not all of them.
#[test]
fn primitives_that_share_a_large_buffer_read_what_they_use() {
    let folder = folder();
    const VERTICES: usize = 1_000_000;
    let mut scene = triangle("vertices.bin");
    let mut bytes = vec![0; 12 * VERTICES];
    bytes[12..16].copy_from_slice(&1f32.to_le_bytes());
    bytes[28..32].copy_from_slice(&1f32.to_le_bytes());
    // Byte offset of the indices, which follow the positions.
    bytes.extend([0, 1, 2, 0]);
    fs::write(folder.path().join("vertices.bin"), &bytes).unwrap();
    scene["buffers"][0]["byteLength"] = json!(bytes.len());
    scene["bufferViews"] = json!([{"buffer": 0, "byteLength": 12 * VERTICES},
        {"buffer": 0, "byteOffset": 12 * VERTICES, "byteLength": 3}]);
    scene["accessors"][0]["count"] = json!(VERTICES);
    let indices = json!({"bufferView": 1, "componentType": 5121, "count": 3, "type": "SCALAR"});
    scene["accessors"].as_array_mut().unwrap().push(indices);
    scene["meshes"][0]["primitives"] = Value::Array(vec![json!({"attributes": {"POSITION": 0}, "indices": 1}); 1000]);
    write(folder.path(), "shared.gltf", &scene);
    read(folder.path(), "shared.gltf", 3.0, 100);
}
