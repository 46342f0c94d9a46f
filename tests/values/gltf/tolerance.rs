//! Files that are incomplete or not strictly valid, and load nevertheless: a note names the omitted part, and `strict`
//! refuses the file.

use super::files::{F32, File, U8, load_bytes, png, write};
use serde_json::{Value, json};
use twobounce::scene::{LoadOptions, Material, Scene};

fn load_strictly(file: &File) -> Result<Scene, String> {
    let (_folder, path) = write("scene.glb", &file.glb());
    Scene::load(&path, &LoadOptions { strict: true, ..LoadOptions::default() }).map_err(|e| e.to_string())
}

/// Every slot holds the texture of a good image or of the one that `bad` describes, in turns.
fn half_textured(bad: &Value) -> File {
    let mut file = File::quad();
    let broken = file.view(b"\x89PNG\r\n\x1a\n, and no more");
    let good = file.texture(&png(2, 1, &[9; 8]));
    let mut bad = bad.clone();
    if bad["bufferView"] == json!("broken") {
        bad["bufferView"] = json!(broken);
    }
    let image = file.push("images", bad);
    let bad = file.push("textures", json!({"source": image}));
    let last = file.texture(&png(1, 1, &[7; 4]));
    let slot = |index: usize| json!({"index": index});
    file.material(json!({
        "pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0.125, 1], "baseColorTexture": slot(bad), "metallicRoughnessTexture": slot(good)},
        "normalTexture": slot(bad), "occlusionTexture": slot(bad), "emissiveTexture": slot(last),
        "extensions": {
            "KHR_materials_specular": {"specularTexture": slot(bad), "specularColorTexture": slot(bad)},
            "KHR_materials_transmission": {"transmissionTexture": slot(bad)},
            "KHR_materials_volume": {"thicknessTexture": slot(bad)}}
    }));
    file
}

#[test]
fn a_texture_that_cannot_be_read_is_left_out_with_a_note() {
    for (bad, said) in [
        (json!({"uri": "none.png"}), "image 1: \"none.png\" does not exist"),
        (json!({"uri": "https://example.com/a.png"}), "image 1: \"https://example.com/a.png\" is not a relative path"),
        (json!({"uri": "data:image/png;base64,AAAA", "name": "oak"}), "image 1 (\"oak\") cannot be decoded"),
        (json!({"bufferView": "broken", "mimeType": "image/png"}), "image 1 (\"\") cannot be decoded"),
        (json!({"name": "oak"}), "image 1 has neither a URI nor a buffer view"),
    ] {
        let file = half_textured(&bad);
        let scene = file.scene();
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(
            scene.warnings[0].starts_with(said) && scene.warnings[0].contains("factors alone"),
            "{:?}",
            scene.warnings
        );
        let m = &scene.materials[1];
        assert_eq!((m.texture_slots().count(), m.base_color.to_array()), (2, [0.5, 0.25, 0.125, 1.0]));
        let width = |slot: Option<twobounce::scene::TextureRef>| {
            scene.images[scene.textures[slot.expect("a texture").texture].image].width
        };
        assert_eq!([width(m.metallic_roughness_texture), width(m.emissive_texture)], [2, 1]);
        assert_eq!((scene.textures.len(), scene.images.len()), (2, 2));
        let refusal = load_strictly(&file).unwrap_err();
        assert!(refusal.contains(said) && !refusal.contains("factors alone"), "{refusal}");
    }
}

/// An image with a valid header and damaged rows.
#[test]
fn a_half_image_is_left_out_as_if_it_were_not_named() {
    let noise: Vec<u8> = (0..64 * 64 * 4u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let whole = png(64, 64, &noise);
    let mut file = File::quad();
    let texture = file.texture(&whole[..whole.len() / 2]);
    file.material(json!({"normalTexture": {"index": texture}}));
    let (scene, without) = (file.scene(), File::quad().scene());
    assert!(scene.warnings[0].starts_with("image 0 (\"\") cannot be decoded"), "{:?}", scene.warnings);
    assert!((scene.images.is_empty(), scene.textures.is_empty()) == (true, true));
    assert_eq!(scene.meshes[0].tangents, without.meshes[0].tangents);
    assert_eq!(scene.meshes[0].indices, without.meshes[0].indices);
    assert!(load_strictly(&file).unwrap_err().contains("cannot be decoded"));
}

/// A texture in a format of an unknown extension alone has no source that can be read.
#[test]
fn a_texture_without_an_image_is_left_out_with_a_note() {
    let mut file = File::quad();
    let texture = file.push("textures", json!({"extensions": {"MSFT_texture_dds": {"source": 0}}}));
    file.material(json!({"emissiveTexture": {"index": texture}}));
    let scene = file.scene();
    assert_eq!(scene.warnings, ["texture 0 has no image in a format that can be read and was left out"]);
    assert_eq!(scene.materials[1].texture_slots().count(), 0);
    assert!(load_strictly(&file).unwrap_err().contains("texture 0 has no image in a format that can be read; add one"));
}

#[test]
fn required_extensions_refuse_only_where_geometry_or_decoding_depend_on_them() {
    let mut file = File::quad();
    for name in ["KHR_materials_variants", "ADOBE_materials_thin_transparency", "EXT_lights_image_based"] {
        file.json["extensionsUsed"] = json!([name]);
        file.json["extensionsRequired"] = json!([name]);
        let scene = file.scene();
        assert!(scene.warnings.len() == 1 && scene.warnings[0].contains(name), "{:?}", scene.warnings);
        let surroundings = name == "EXT_lights_image_based";
        assert_eq!(scene.warnings[0].contains("--sky FILE.hdr"), surroundings, "{:?}", scene.warnings);
        let refusal = load_strictly(&file).unwrap_err();
        assert!(refusal.contains(name) && refusal.contains("--strict"), "{refusal}");
    }
    for name in ["KHR_gaussian_splatting", "EXT_mesh_manifold", "MSFT_lod", "MSFT_texture_dds", "ACME_materials"] {
        file.json["extensionsRequired"] = json!([name]);
        for refusal in [file.load().unwrap_err(), load_strictly(&file).unwrap_err()] {
            assert!(refusal.contains(&format!("requires the extension {name}, which is not supported")), "{refusal}");
        }
    }
    file.json["extensionsRequired"] = json!(["KHR_materials_ior", "KHR_texture_transform"]);
    assert!(load_strictly(&file).is_ok());
}

#[test]
fn whole_numbers_may_be_written_as_fractions() {
    let mut file = File::quad();
    file.material(json!({"name": "1.0", "alphaCutoff": 0.5, "pbrMetallicRoughness": {"metallicFactor": 1.0}}));
    let plain = file.json.to_string();
    let (binary, expected) = (file.binary.clone(), file.scene());
    let text = plain.replace("\"mesh\":0", "\"mesh\":0.0").replace("\"count\":4", "\"count\":4e0");
    let text =
        text.replace("\"componentType\":5126", "\"componentType\":5126.0").replace("\"scene\":0", "\"scene\":0.0");
    assert!(text != plain && serde_json::from_str::<Value>(&text).unwrap()["accessors"][0]["count"].is_f64());
    let (folder, path) =
        write("scene.gltf", text.replace("{\"byteLength\"", "{\"uri\":\"a.bin\",\"byteLength\"").as_bytes());
    std::fs::write(folder.path().join("a.bin"), binary).unwrap();
    let scene = Scene::load(&path, &LoadOptions { strict: true, ..LoadOptions::default() }).unwrap();
    assert_eq!(
        (&scene.meshes[0].positions, &scene.meshes[0].indices),
        (&expected.meshes[0].positions, &expected.meshes[0].indices)
    );
    let names = |scene: &Scene| scene.materials.iter().map(|m: &Material| m.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&scene), ["default", "1.0"]);
    let wrong = load_bytes("scene.gltf", text.replace("\"mesh\":0.0", "\"mesh\":0.5").as_bytes()).unwrap_err();
    assert!(wrong.contains("is not valid glTF at line 1") && wrong.contains("0.5"), "{wrong}");
}

#[test]
fn unknown_chunks_may_stand_before_the_binary_one() {
    let glb = File::triangle().glb();
    let json_end = 20 + u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let unknown = [&4u32.to_le_bytes()[..], b"ACMEdata"].concat();
    let length = (glb.len() + unknown.len()) as u32;
    let with = [&glb[..8], &length.to_le_bytes(), &glb[12..json_end], &unknown, &glb[json_end..]].concat();
    assert_eq!(load_bytes("scene.glb", &with).unwrap().triangle_count(), 1);
}

#[test]
fn file_uris_name_files_on_this_machine() {
    let elsewhere = tempfile::tempdir().unwrap();
    let mut file = File::triangle();
    std::fs::write(elsewhere.path().join("a b.bin"), &file.binary).unwrap();
    let folder = elsewhere.path().to_str().unwrap();
    // The user lets the scene read that folder: `paths_outside_the_folder_of_the_scene_are_refused` checks the other
    // case.
    let options = LoadOptions { assets: Some(elsewhere.path().to_owned()), ..LoadOptions::default() };
    let mut load = |uri: String| {
        file.json["buffers"][0]["uri"] = json!(uri);
        let (_folder, path) = write("scene.gltf", file.json.to_string().as_bytes());
        Scene::load(&path, &options).map(|scene| scene.triangle_count()).map_err(|e| e.to_string())
    };
    for uri in [format!("file://{folder}/a%20b.bin"), format!("file://localhost{folder}/a%20b.bin")] {
        assert_eq!(load(uri), Ok(1));
    }
    let missing = load(format!("file://{folder}/none.bin")).unwrap_err();
    assert!(missing.contains("none.bin\" does not exist; put it there"), "{missing}");
    let remote = load("file://server/a.bin".into()).unwrap_err();
    assert!(remote.contains("is not a relative path"), "{remote}");
}

#[test]
fn a_mesh_with_a_skin_is_loaded_for_each_node_and_none_is_noted() {
    let mut file = File::triangle();
    let offsets = file.floats("VEC3", &[0.0, 0.0, 4.0].repeat(3));
    let joints = file.accessor(U8, "VEC4", 3, &[0; 12]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0].repeat(3));
    assert_eq!(file.json["accessors"][0]["componentType"], json!(F32));
    let attributes = json!({"POSITION": 0, "JOINTS_0": joints, "WEIGHTS_0": weights});
    for _ in 0..3 {
        let node = file.mesh(json!({"attributes": attributes, "targets": [{"POSITION": offsets}]}));
        file.json["nodes"][node]["skin"] = json!(0);
    }
    file.push("skins", json!({"joints": [0]}));
    let scene = file.scene();
    assert_eq!((scene.instances.len(), scene.deformers.len(), scene.warnings.len()), (4, 3, 0));
}

/// Data URIs in the forms of exporters and text editors.
#[test]
fn data_uris_may_be_broken_into_lines_and_percent_encoded() {
    const PLAIN: &str = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAPg8";
    let with = |uri: &str| {
        let mut file = File::triangle();
        file.json["buffers"][0] = json!({"byteLength": 36, "uri": uri});
        load_bytes("scene.gltf", file.json.to_string().as_bytes()).map(|scene| scene.meshes[0].positions.clone())
    };
    let plain = with(&format!("data:application/octet-stream;base64,{PLAIN}")).unwrap();
    assert_eq!((plain.len(), plain[1]), (3, glam::Vec3::X));
    let lines = PLAIN.as_bytes().chunks(7).map(|part| std::str::from_utf8(part).unwrap()).collect::<Vec<_>>();
    for uri in [
        format!("data:application/octet-stream;base64,{}", lines.join("\n")),
        format!("data:application/octet-stream;base64,\r\n{}\r\n", lines.join("\r\n    ")),
        format!("data:application/octet-stream;base64,{}", lines.join("%0D%0A")),
        format!("data:application/octet-stream;base64,{}%3D%3d", PLAIN.replace('h', "%68")),
        format!("data:;BASE64,{PLAIN}"),
        format!("DATA:application/gltf-buffer; base64,{PLAIN}"),
    ] {
        assert_eq!(with(&uri).as_ref(), Ok(&plain), "{uri}");
    }
    // 0xfb 0xff… has both letters that percent-encoding replaces.
    let odd = |text: &str| with(&format!("data:;base64,{text}{}", "A".repeat(44))).unwrap()[0].x.to_bits();
    for text in ["+/8B", "%2B%2f8B", "-_8B", "%2B/\n8B"] {
        assert_eq!(odd(text) & 0xff_ffff, 0x01_fffb, "{text}");
    }
    for text in ["AAAA!", "AA=AA", "AAAA%"] {
        assert!(with(&format!("data:;base64,{text}")).unwrap_err().contains("not valid base64"), "{text}");
    }
}

/// Zeros where the format has spaces; text after them is damage.
#[test]
fn json_may_end_in_zeros() {
    let glb = |padding: &[u8]| {
        let file = File::quad();
        let json = [file.json.to_string().as_bytes(), padding].concat();
        let chunk = |kind: &[u8], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
        let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &file.binary)].concat();
        [&b"glTF\x02\0\0\0"[..], &(12 + chunks.len() as u32).to_le_bytes(), &chunks].concat()
    };
    let load = |name: &str, bytes: &[u8]| load_bytes(name, bytes).map(|scene| scene.triangle_count());
    for padding in [&b"\0"[..], b"\0\0\0", b"  \0\0", b"\0 \n\0", &vec![0; 3 << 20]] {
        assert_eq!(load("scene.glb", &glb(padding)), Ok(2), "{} bytes", padding.len());
    }
    let mut file = File::quad();
    file.json["buffers"] = json!([]);
    file.json["nodes"] = json!([{}]);
    for key in ["meshes", "accessors", "bufferViews"] {
        file.json[key] = json!([]);
    }
    let text = [file.json.to_string().as_bytes(), b"\0\0"].concat();
    assert_eq!(load("scene.gltf", &text), Ok(0));
    for padding in [&b"\0{}"[..], b"\0\0x\0", b"x\0"] {
        let refusal = load("scene.glb", &glb(padding)).unwrap_err();
        assert!(refusal.contains("is not valid glTF"), "{refusal}");
    }
}
