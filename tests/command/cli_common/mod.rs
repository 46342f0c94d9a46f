//! Scenes, folders and checks for tests of the command line. Every test file uses a part of this.
#![allow(dead_code)]

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use serde_json::Value;

/// One triangle, one point light, in a glTF file with its buffer inside.
pub fn write_scene(path: &Path) {
    let json = r#"{"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
        "extensions":{"KHR_lights_punctual":{"lights":[{"type":"point"}]}},"scenes":[{"nodes":[0,1]}],
        "nodes":[{"mesh":0},{"extensions":{"KHR_lights_punctual":{"light":0}},"translation":[0,0,2]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
        "bufferViews":[{"buffer":0,"byteLength":36}],
        "buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;
    fs::write(path, json).unwrap();
}

/// A folder with `scene.gltf` and `other.toml`.
pub fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    write_scene(&folder.path().join("scene.gltf"));
    fs::write(folder.path().join("other.toml"), "voxels = 32\ncones.set = 16\n").unwrap();
    folder
}

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A folder in which commands run, with a cache of its own.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn empty() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    /// As [`Self::empty`], with the box with a point light as `name`.
    pub fn with_box(name: &str) -> Self {
        let folder = Self::empty();
        fs::copy(root().join("assets/cornell-point.glb"), folder.path(name)).unwrap();
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The rows of the chart in `output`.
    pub fn rows(&self, output: &str) -> Vec<Value> {
        let text = fs::read_to_string(self.path(output).join("rows.json")).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()["rows"].as_array().unwrap().clone()
    }

    pub fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
        command.current_dir(self.0.path()).env("TWOBOUNCE_CACHE", self.path("cache")).args(args);
        command
    }

    pub fn run(&self, args: &[&str]) -> Output {
        self.command(args).output().unwrap()
    }

    /// Standard output of a command; fails if the command fails.
    pub fn done(&self, args: &[&str]) -> String {
        let output = self.run(args);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}", text(&output.stderr));
        text(&output.stdout)
    }

    /// The message with which a command is refused; fails if it is not.
    pub fn refused(&self, args: &[&str]) -> String {
        let output = self.run(args);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.trim_end().lines().count() == 1, "{args:?}: {said}");
        said
    }

    pub fn json(&self, name: &str) -> serde_json::Value {
        serde_json::from_str(&fs::read_to_string(self.path(name)).unwrap()).unwrap()
    }
}

/// An X server of 640×480 in memory, until it is dropped.
pub struct Display(Child, String);

impl Display {
    pub fn open() -> Self {
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-screen", "0", "640x480x24", "-nolisten", "tcp"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb is missing: install package xvfb");
        // The server writes the number of its display when it is ready.
        let mut number = String::new();
        BufReader::new(server.stdout.take().unwrap()).read_line(&mut number).unwrap();
        assert!(!number.is_empty(), "Xvfb did not start");
        Self(server, format!(":{}", number.trim()))
    }

    /// Starts a program that opens windows on this display; `timeout` ends it after ten minutes.
    pub fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new("timeout");
        command.args(["-k", "10", "600"]).args(words).env("DISPLAY", &self.1).env_remove("WAYLAND_DISPLAY");
        command
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.0.kill().ok();
        self.0.wait().ok();
    }
}

/// The folder's files in order.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Starts a command that fills a chart's folder and waits for its first row.
pub fn after_first_row(command: &mut Command, folder: &Path) -> Child {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
    let end = Instant::now() + Duration::from_secs(120);
    while finished(folder).is_empty() {
        assert!(Instant::now() < end && child.try_wait().unwrap().is_none(), "no row while the command runs");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

/// Presses Ctrl-C.
#[cfg(unix)]
pub fn interrupted(child: Child) -> Output {
    // SAFETY: the child has not been waited for, so its process number is still its own.
    assert_eq!(unsafe { libc::kill(child.id() as i32, libc::SIGINT) }, 0);
    child.wait_with_output().unwrap()
}

/// The file name and bytes of every row that a chart's folder keeps.
pub fn finished(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let files = fs::read_dir(folder.join("rows")).into_iter().flatten().map(|entry| entry.unwrap().path());
    let mut rows: Vec<_> = files.filter(|f| f.extension().is_some_and(|e| e == "toml")).collect();
    rows.sort();
    rows.into_iter().map(|file| (file.clone(), fs::read(file).unwrap())).collect()
}
