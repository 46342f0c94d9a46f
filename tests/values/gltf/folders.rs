//! A scene reads files of its own folder, and of one that the user names, whatever its URIs say.

use std::path::Path;

use serde_json::json;
use twobounce::scene::{LoadOptions, Scene};

use super::damage::refused;
use super::files::{File, write};

#[test]
fn paths_outside_the_folder_of_the_scene_are_refused() {
    for (uri, expected) in [
        ("none.bin", "does not exist in the folder of the scene"),
        ("/etc/passwd", "is not a relative path"),
        ("https://example.com/a.bin", "is not a relative path"),
        ("data:application/octet-stream;base64,@", "not valid base64"),
        ("data:nothing", "has no comma"),
        ("a%00b", "zero byte"),
    ] {
        let mut file = File::triangle();
        file.json["buffers"][0]["uri"] = json!(uri);
        refused(&file, expected);
    }
    // An existing file outside of the folder: buffers and images, by dots, by an absolute path, by a link.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("inner/scene.gltf");
    std::fs::create_dir_all(path.with_file_name("x")).unwrap();
    let secret = folder.path().join("secret.bin");
    std::fs::write(&secret, File::triangle().binary).unwrap();
    let absolute = secret.to_str().unwrap();
    let uris = vec![
        "../secret.bin".to_owned(),
        "%2e%2e/secret.bin".to_owned(),
        "%2E%2E%2Fsecret.bin".to_owned(),
        "./x/../../secret.bin".to_owned(),
        format!("file://{absolute}"),
        format!("file://localhost{absolute}"),
    ];
    #[cfg(unix)]
    let uris = {
        std::os::unix::fs::symlink(&secret, path.with_file_name("link.bin")).unwrap();
        std::os::unix::fs::symlink(folder.path(), path.with_file_name("out")).unwrap();
        [uris, vec!["link.bin".to_owned(), "out/secret.bin".to_owned()]].concat()
    };
    for uri in &uris {
        for of_image in [false, true] {
            let mut file = File::triangle();
            if of_image {
                file.json["images"] = json!([{ "uri": uri }]);
                file.json["textures"] = json!([{ "source": 0 }]);
                file.json["materials"] = json!([{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }]);
                file.json["meshes"][0]["primitives"][0]["material"] = json!(0);
                std::fs::write(path.with_file_name("own.bin"), &file.binary).unwrap();
                file.json["buffers"][0]["uri"] = json!("own.bin");
            } else {
                file.json["buffers"][0]["uri"] = json!(uri);
            }
            std::fs::write(&path, file.json.to_string()).unwrap();
            let load = |assets: Option<&Path>| {
                let options =
                    LoadOptions { assets: assets.map(Path::to_owned), strict: true, ..LoadOptions::default() };
                Scene::load(&path, &options).map(|scene| scene.triangle_count()).map_err(|e| e.to_string())
            };
            let sentence = load(None).expect_err(uri);
            assert!(
                sentence.contains("outside the folder of the scene") && sentence.contains("--assets DIR"),
                "{sentence}"
            );
            // The scene may read a folder that the user names; the file is no image, so that images fail all the same,
            // but with another message.
            match load(Some(folder.path())) {
                Ok(triangles) => assert!(!of_image && triangles == 1),
                Err(sentence) => assert!(of_image && !sentence.contains("outside the folder"), "{uri}: {sentence}"),
            }
        }
    }
    // The message does not tell either whether such a file exists.
    let mut file = File::triangle();
    file.json["buffers"][0]["uri"] = json!("../none.bin");
    refused(&file, "lies outside the folder of the scene");

    let mut file = File::triangle();
    file.json["buffers"][0]["uri"] = json!("short.bin");
    let (folder, path) = write("scene.gltf", file.json.to_string().as_bytes());
    std::fs::write(folder.path().join("short.bin"), [0; 35]).unwrap();
    let sentence = Scene::load(&path, &LoadOptions::default()).unwrap_err().to_string();
    assert!(sentence.contains("holds 35 of its 36 bytes"), "{sentence}");
}
