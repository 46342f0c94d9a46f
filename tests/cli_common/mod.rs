//! A scene to render and what became of a folder, for tests of the command line. Every test file uses a part of this.
#![allow(dead_code)]

use std::fs;
use std::path::Path;

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
    fs::write(folder.path().join("other.toml"), "voxels = 32\ncones = 16\n").unwrap();
    folder
}

/// The folder's files in order.
pub fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
