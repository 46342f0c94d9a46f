//! `profile` on any device.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use crate::cli_common::{folder, names};
use serde_json::Value;

/// Small enough for a CPU device.
const SMALL: [&str; 8] = ["--size", "24x16", "--frames", "2", "--set", "voxels=16", "--set", "image.samples=1"];

fn profile(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    command.current_dir(folder).arg("profile").args(args).args(SMALL).output().unwrap()
}

fn profiled(folder: &Path, args: &[&str]) -> String {
    let output = profile(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn costs_are_over_what_was_counted() {
    let folder = folder();
    let told = profiled(
        folder.path(),
        &["scene.gltf", "--preset", "cones", "--validation", "--submit", "pass", "--json", "p.json"],
    );
    for word in ["ns/voxel", "of copy", "a model", "CPU ms", "shade 2"] {
        assert!(told.contains(word), "{word} is not in\n{told}");
    }
    let report: Value = serde_json::from_str(&fs::read_to_string(folder.path().join("p.json")).unwrap()).unwrap();
    assert_eq!((&report["version"], &report["render"]["frames"]), (&1.into(), &2.into()));
    assert!(report["copy"]["buffer_gb_per_s"].as_f64().unwrap() > 0.01);
    let render = &report["render"];
    let timed: Vec<_> = render["passes"].as_array().unwrap().iter().map(|pass| &pass["name"]).collect();
    let costs = report["costs"].as_array().unwrap();
    assert_eq!(costs.iter().map(|cost| &cost["name"]).collect::<Vec<_>>(), timed);
    let voxels = render["counters"]["occupied_voxels"].as_f64().unwrap();
    for (cost, pass) in costs.iter().zip(render["passes"].as_array().unwrap()) {
        let ns = pass["gpu_ms"]["median"].as_f64().unwrap() * 1e6;
        let name = cost["name"].as_str().unwrap();
        let per = |key: &str| cost[key].as_f64();
        if name.starts_with("shade") {
            assert!((per("ns_per_occupied_voxel").unwrap() * voxels / ns - 1.0).abs() < 1e-9, "{cost}");
        }
        if name == "render" {
            assert!((per("ns_per_pixel").unwrap() * 24.0 * 16.0 / ns - 1.0).abs() < 1e-9, "{cost}");
            let steps = cost["counts"]["cone_steps"].as_f64().unwrap();
            assert!(steps > 0.0 && (per("ns_per_cone_step").unwrap() * steps / ns - 1.0).abs() < 1e-9, "{cost}");
        }
        let bytes = cost["fetched_bytes"].as_f64().unwrap() + cost["written_bytes"].as_f64().unwrap();
        // Passes over cells write a number of bytes that only the device knows; it counts as 0.
        assert!((cost["gb_per_s"].as_f64().unwrap() * ns - bytes).abs() <= 1e-9 * bytes, "{cost}");
    }
    assert_eq!(report["growth"], Value::Array(vec![]));
}

#[test]
fn growth_has_three_axes_and_a_picture() {
    let folder = folder();
    // 128³ voxels do not fit: that run is left out, and a note says so.
    let flags = ["--growth", "--plot", "growth.svg", "--json", "p.json", "--memory-limit", "100MiB"];
    let told = profiled(folder.path(), &[&["scene.gltf", "--method", "none"], &flags[..]].concat());
    assert!(told.contains("exponent"), "{told}");
    let told =
        profiled(folder.path(), &[&["scene.gltf", "--method", "cones", "--set", "bounces=1"], &flags[..]].concat());
    assert!(told.contains("left out: 128 voxels"), "{told}");
    let report: Value = serde_json::from_str(&fs::read_to_string(folder.path().join("p.json")).unwrap()).unwrap();
    let values = |axis: usize| report["growth"][axis]["values"].clone();
    assert_eq!(values(0), serde_json::json!([16.0, 32.0, 64.0]));
    assert_eq!(values(1), serde_json::json!([1.0, 4.0, 16.0]));
    assert_eq!(values(2), serde_json::json!([6.0 * 4.0, 12.0 * 8.0, 24.0 * 16.0]));
    let svg = fs::read_to_string(folder.path().join("growth.svg")).unwrap();
    assert!(svg.starts_with("<svg") && svg.matches("<polyline").count() >= 3, "{svg}");
}

#[test]
fn bad_input_is_one_sentence_and_leaves_nothing() {
    let folder = folder();
    let before = names(folder.path());
    let scene = fs::read(folder.path().join("scene.gltf")).unwrap();
    for (args, word) in [
        (&["missing.gltf"][..], "missing.gltf"),
        (&["scene.gltf", "--frames", "0"], "--frames"),
        (&["scene.gltf", "--plot", "growth.svg"], "--growth"),
        (&["scene.gltf", "--json", "scene.gltf"], "is read and written"),
        (&["scene.gltf", "--growth", "--json", "a", "--plot", "a"], "two outputs"),
        (&["scene.gltf", "--json", "nowhere/p.json"], "nowhere"),
        (&["scene.gltf", "--set", "voxels=17"], "voxels"),
        (&["scene.gltf", "--memory-limit", "1MiB", "--json", "p.json"], "--memory-limit"),
        (&["scene.gltf", "--device", "none such"], "none such"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_twobounce"))
            .current_dir(folder.path())
            .arg("profile")
            .args(args)
            .args(["--size", "8x8"])
            .output()
            .unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
        assert!(message.contains(word) && message.lines().count() == 1, "{args:?}: {message}");
    }
    assert_eq!(names(folder.path()), before);
    assert!(fs::read(folder.path().join("scene.gltf")).unwrap() == scene);
}
