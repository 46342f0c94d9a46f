//! `demo`: images, benchmark, window.

use crate::cli_common;

use std::path::Path;
use std::process::{Command, Output};

use cli_common::names;
use serde_json::Value;

/// Small enough for a CPU device.
const SMALL: [&str; 6] = ["--size", "64x36", "--set", "voxels=16", "--validation", "--fps=0.25"];

fn run(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_twobounce")).args(arguments).current_dir(folder).output().unwrap()
}

fn done(folder: &Path, arguments: &[&str]) -> String {
    let output = run(folder, arguments);
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// Twelve seconds at one image every four seconds; each equals the image that `render` makes of that moment.
#[test]
fn its_images_are_those_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    done(folder, &[&["demo", "-o", "out_%d.png"], &SMALL[..]].concat());
    assert_eq!(names(folder), ["out_0.png", "out_1.png", "out_2.png"]);
    let bytes = |name: &str| std::fs::read(folder.join(name)).unwrap();
    assert_ne!(bytes("out_1.png"), bytes("out_2.png"));
    let moment = ["render", "demo:", "-o", "same.png", "--time=4", "--preset=fast", "--exposure=0.5", "--noise=off"];
    done(folder, &[&moment, &SMALL[..5]].concat());
    assert_eq!(bytes("out_1.png"), bytes("same.png"));
}

#[test]
fn its_benchmark_times_every_pass() {
    let folder = tempfile::tempdir().unwrap();
    let said = done(folder.path(), &[&["demo", "--benchmark", "--json", "b.json"], &SMALL[..]].concat());
    assert_eq!(names(folder.path()), ["b.json"], "no image is written");
    let json: Value = serde_json::from_slice(&std::fs::read(folder.path().join("b.json")).unwrap()).unwrap();
    assert_eq!((&json["version"], &json["frames"], &json["width"]), (&1.into(), &3.into(), &64.into()));
    let passes = json["passes"].as_array().unwrap();
    for of in [&json["frame_gpu_ms"], &json["frame_wall_ms"]].into_iter().chain(passes.iter().map(|p| &p["gpu_ms"])) {
        let [min, median, p99] = ["min", "median", "p99"].map(|key| of[key].as_f64().unwrap());
        assert!(0.0 <= min && min <= median && median <= p99, "{of}");
    }
    // Everything moves: the lists are rebuilt in every frame.
    assert!(passes.iter().any(|pass| pass["name"] == "voxelise" && pass["frames"] == 3), "{passes:?}");
    for pass in passes {
        assert!(said.contains(&format!("| {} |", pass["name"].as_str().unwrap())), "{said}");
    }
    let (device, driver) = (json["device"].as_str().unwrap(), json["driver"].as_str().unwrap());
    assert!(said.contains(device) && said.contains(driver) && said.contains("preset fast"), "{said}");
}

#[test]
fn what_is_wrong_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let wrong: [(&[&str], &str); 5] = [
        (&["-o", "out.png"], "out_%04d.png"),
        (&["-o", "out_%d.gif"], ".png, .jpg or .exr"),
        (&["--json", "b.json"], "--benchmark"),
        (&["--benchmark", "-o", "out_%d.png"], "--benchmark"),
        (&["--fps", "0"], "frames per second"),
    ];
    for (arguments, words) in wrong {
        let output = run(folder.path(), &[&["demo"], arguments].concat());
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(words) && text.lines().count() == 1, "{text}");
    }
    assert!(names(folder.path()).is_empty());
}

#[cfg(feature = "window")]
mod window {
    use super::*;

    #[test]
    fn without_a_display_it_names_the_flag_for_images() {
        let folder = tempfile::tempdir().unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
        command.arg("demo").current_dir(folder.path());
        let output = command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains("twobounce demo -o") && text.lines().count() == 1, "{text}");
    }

    /// The demo plays until it is paused; then the printed command renders the picture in the window.
    #[test]
    fn it_plays_in_the_window() {
        let folder = tempfile::tempdir().unwrap();
        let script = "panel closed\nwait 1\nkey Space\nrest\ngrab a.png\nkey C\nquit";
        std::fs::write(folder.path().join("script"), script).unwrap();
        let display = cli_common::Display::open();
        let mut command = display.command(&[env!("CARGO_BIN_EXE_twobounce"), "demo", "--script", "script"]);
        let output = command.args(&SMALL[..5]).current_dir(folder.path()).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        let said = String::from_utf8(output.stdout).unwrap();
        let command = said.lines().find_map(|line| line.strip_prefix("twobounce ")).expect("a command");
        let time = command.split("--time=").nth(1).unwrap().split(' ').next().unwrap();
        assert!(time.parse::<f64>().unwrap() > 0.5, "it did not play: {command}");
        done(folder.path(), &command.split(' ').collect::<Vec<_>>());
        let pixels = |name: &str| image::open(folder.path().join(name)).unwrap().into_rgb8();
        assert_eq!(pixels("a.png"), pixels("image.png"));
    }
}
