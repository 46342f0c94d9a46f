//! `examples/ci`, the recipe for other people's continuous integration: its script passes on its scene, and fails when
//! light changes.
#![cfg(unix)]

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use tempfile::TempDir;

fn recipe() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/ci")
}

/// A copy of the recipe's scenes for changes.
fn scenes() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("scenes")).unwrap();
    for entry in fs::read_dir(recipe().join("scenes")).unwrap() {
        let from = entry.unwrap().path();
        fs::copy(&from, folder.path().join("scenes").join(from.file_name().unwrap())).unwrap();
    }
    folder
}

fn light(folder: &TempDir, task: &str) -> (Option<i32>, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_twobounce")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let mut command = Command::new(recipe().join("light.sh"));
    command.arg(task).current_dir(folder.path()).env("PATH", path).env("CARGO_HOME", "/nowhere");
    let here = folder.path();
    command.env("SCENES", here.join("scenes")).env("OUT", here.join("out")).env("PREFIX", here.join("nowhere"));
    let Output { status, stdout, stderr } = command.output().unwrap();
    (status.code(), String::from_utf8(stdout).unwrap() + &String::from_utf8(stderr).unwrap())
}

/// Replaces text of a scene by text of equal length, so that the binary file stays valid.
fn change(folder: &TempDir, from: &str, to: &str) {
    assert_eq!(from.len(), to.len());
    let path = folder.path().join("scenes/room.glb");
    let mut bytes = fs::read(&path).unwrap();
    let at: Vec<usize> = (0..bytes.len() - from.len()).filter(|at| bytes[*at..].starts_with(from.as_bytes())).collect();
    assert!(!at.is_empty(), "the scene has no {from}");
    at.iter().for_each(|at| bytes[*at..at + to.len()].copy_from_slice(to.as_bytes()));
    fs::write(path, bytes).unwrap();
}

#[test]
fn the_committed_reference_is_kept() {
    let folder = scenes();
    let (code, said) = light(&folder, "check");
    assert_eq!(code, Some(0), "{said}");
    assert!(
        folder.path().join("out/room/compare.png").exists() && folder.path().join("out/room/compare.json").exists()
    );
}

#[test]
fn a_scene_or_a_renderer_that_changes_is_found() {
    let lamp = |folder: &TempDir| change(folder, "\"intensity\":1.25", "\"intensity\":1.30");
    let wall = |folder: &TempDir| change(folder, "0.61,0.055,0.045", "0.31,0.055,0.045");
    let dark = |folder: &TempDir| fs::write(folder.path().join("scenes/room.render"), "--method none").unwrap();
    let rough = |folder: &TempDir| fs::write(folder.path().join("scenes/room.render"), "--preset lpv").unwrap();
    type Change<'a> = (&'a str, &'a dyn Fn(&TempDir));
    let changes: [Change; 4] = [
        ("a lamp that is 4 % brighter", &lamp),
        ("a wall with half the red", &wall),
        ("no indirect light", &dark),
        ("another preset", &rough),
    ];
    for (what, change) in changes {
        let folder = scenes();
        change(&folder);
        let (code, said) = light(&folder, "check");
        assert!(code == Some(1) && said.contains("above"), "{what}: {code:?} {said}");
        assert!(folder.path().join("out/room/compare.png").exists(), "{what}");
    }
}

#[test]
fn what_is_missing_is_told() {
    let missing = |name: &str, sentence: &str| {
        let folder = scenes();
        fs::remove_file(folder.path().join("scenes").join(name)).unwrap();
        let (code, said) = light(&folder, "check");
        assert!(code == Some(2) && said.contains(sentence), "{name}: {code:?} {said}");
    };
    missing("room.exr", "room.exr is missing; make it with: light.sh reference");
    missing("room.limits", "room.limits is missing; write limits of twobounce compare into it");
    missing("room.glb", "no .glb or .gltf is in");
    let (code, said) = light(&scenes(), "");
    assert!(code == Some(2) && said.contains("say what to do"), "{said}");
}

/// A failure of one scene is not hidden by another that passes; an error is worse than a limit.
#[test]
fn the_worst_scene_decides() {
    let folder = scenes();
    let at = |name: &str| folder.path().join("scenes").join(name);
    for kind in ["exr", "glb", "limits", "view", "render"] {
        fs::copy(at(&format!("room.{kind}")), at(&format!("dark.{kind}"))).unwrap();
    }
    fs::write(at("dark.render"), "--method none").unwrap();
    let (code, said) = light(&folder, "check");
    assert!(code == Some(1) && said.contains("== dark") && said.contains("== room"), "{said}");
    fs::remove_file(at("room.exr")).unwrap();
    assert_eq!(light(&folder, "check").0, Some(2));
}

/// The container file and the workflow have no commands of their own.
#[test]
fn both_forms_call_the_one_script() {
    let script = fs::read_to_string(recipe().join("light.sh")).unwrap();
    let called = |file: &str, before: &str| -> Vec<String> {
        let text = fs::read_to_string(recipe().join(file)).unwrap();
        text.lines().filter_map(|line| line.trim().strip_prefix(before)).map(str::to_owned).collect()
    };
    let runs = [called("workflow.yml", "- run: ci/light.sh "), called("Containerfile", "RUN /light/light.sh ")];
    assert_eq!(runs.map(|runs| runs.join(" ")), ["install check stability", "install"]);
    assert_eq!(called("workflow.yml", "- run: ").len(), 3);
    for task in ["install", "check", "stability"] {
        assert!(script.contains(&format!("  {task}) ")), "light.sh has no {task}");
    }
}
