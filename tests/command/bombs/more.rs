//! Further files of this kind: each took gigabytes, seconds or the whole stack of some program that reads such formats.

use std::fs;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;

use serde_json::{Value, json};
use twobounce::memory::Limit;
use twobounce::scene::{LoadOptions, Scene};

use super::{INLINE, folder, png, png_header, refused, refused_by, textured, triangle, write};

/// As [`refused`] with --strict, which refuses an image that cannot be read instead of leaving it out.
fn refused_strictly(folder: &Path, scene: &str, parts: &[&str]) {
    refused_by(folder, &["render", scene, "--strict", "-o", "a.png"], scene, parts);
}

/// A sparse file that has data only at its start.
fn hole(folder: &Path, name: &str, start: &[u8], bytes: u64) {
    fs::write(folder.join(name), start).unwrap();
    fs::File::options().write(true).open(folder.join(name)).unwrap().set_len(bytes).unwrap();
}

/// A zlib stream of this many times 258 zeros, in 13 bits each (RFC 1951, 3.2.6: a length of 258 at a distance of 1).
fn zeros(times: usize) -> Vec<u8> {
    let (mut out, mut bits, mut filled) = (vec![0x78, 0x9c], 0u64, 0);
    let mut put = |code: u64, count: u32| {
        bits |= code << filled;
        filled += count;
        while filled >= 8 {
            out.push(bits as u8);
            (bits, filled) = (bits >> 8, filled - 8);
        }
    };
    // The last block, with fixed codes; codes are written from their highest bit on.
    put(0b011, 3);
    put(0b0000_1100, 8); // a zero
    for _ in 0..times {
        put(0b1010_0011, 8); // 258 of them
        put(0, 5);
    }
    put(0, 7);
    put(0, 7);
    out
}

#[test]
fn what_is_beside_the_texels_of_an_image_is_bounded() {
    let folder = folder();
    let header = [&1u32.to_be_bytes()[..], &1u32.to_be_bytes(), &[8, 2, 0, 0, 0]].concat();
    // A colour profile of 516 MB, and twenty texts of that size.
    let large = [b"x\0\0".to_vec(), zeros(2_000_000)].concat();
    let profile = png(&[(b"IHDR", &header), (b"iCCP", &large), (b"IDAT", &[0x78]), (b"IEND", &[])]);
    fs::write(folder.path().join("profile.png"), profile).unwrap();
    write(folder.path(), "profile.gltf", &textured(1, |_| "profile.png".into()));
    refused_strictly(folder.path(), "profile.gltf", &["image 0", "cannot be decoded"]);
    let text: (&[u8; 4], &[u8]) = (b"zTXt", &large);
    let texts = [&[(b"IHDR", &header[..])][..], &[text; 20], &[(b"IDAT", &[0x78]), (b"IEND", &[])]].concat();
    fs::write(folder.path().join("texts.png"), png(&texts)).unwrap();
    write(folder.path(), "texts.gltf", &textured(1, |_| "texts.png".into()));
    refused_strictly(folder.path(), "texts.gltf", &["image 0", "beside them"]);
}

#[test]
fn images_hold_the_texels_that_they_state() {
    let folder = folder();
    let whole = include_bytes!("../../fuzz/corpus/progressive.jpg");
    let frame = whole.windows(2).position(|pair| pair == [0xff, 0xc2]).unwrap();
    let size = [16000u16.to_be_bytes(), 16000u16.to_be_bytes()].concat();
    let wide = [&whole[..frame + 5], &size, &whole[frame + 9..]].concat();
    // A hundred scans, each of which covers the whole image.
    let scan = wide.windows(2).position(|pair| pair == [0xff, 0xda]).unwrap();
    let scans = [&wide[..wide.len() - 2], &wide[scan..wide.len() - 2].repeat(100)].concat();
    let texel = png(&[(b"IHDR", &[0, 0, 64, 0, 0, 0, 64, 0, 1, 0, 0, 0, 0]), (b"IDAT", &[0x78; 99])]);
    for (name, bytes) in [("wide.jpg", &wide), ("scans.jpg", &scans), ("wide.png", &texel)] {
        fs::write(folder.path().join(name), bytes).unwrap();
        write(folder.path(), "image.gltf", &textured(1, |_| name.into()));
        refused_strictly(folder.path(), "image.gltf", &["image 0", name, "is too short for the"]);
    }
    // One buffer view that twenty thousand images share.
    const IMAGES: usize = 20_000;
    let mut shared = textured(IMAGES, |_| String::new());
    let mut file = png_header(4096, 4096);
    file.resize(4000, 0);
    fs::write(folder.path().join("shared.png"), file).unwrap();
    shared["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 4000, "uri": "shared.png"}));
    shared["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 1, "byteLength": 4000}));
    shared["images"] = Value::Array(vec![json!({"bufferView": 1}); IMAGES]);
    write(folder.path(), "shared.gltf", &shared);
    refused(folder.path(), "shared.gltf", &["of memory", "texels", "use smaller textures"]);
}

/// Four images of 16384² texels that take 16 GiB, and 24 of 4096² that fit into memory but not on a small device.
#[test]
fn textures_are_held_against_the_machine_and_the_device() {
    let folder = folder();
    let limit = |gibi: u64| Some(Limit { bytes: gibi << 30, words: "the test's limit".into() });
    let load = |images: usize, side: u32, options: LoadOptions| {
        fs::write(folder.path().join("wide.png"), png_header(side, side)).unwrap();
        let mut scene = textured(images, |_| "wide.png".into());
        let primitive = |material| json!({"attributes": {"POSITION": 0}, "material": material});
        scene["meshes"][0]["primitives"] = (0..images).map(primitive).collect();
        write(folder.path(), "wide.gltf", &scene);
        Scene::load(&folder.path().join("wide.gltf"), &options).unwrap_err().to_string()
    };
    let sentence = load(4, 16384, LoadOptions { memory: limit(16), ..LoadOptions::default() });
    assert!(sentence.contains("1073.7 million texels in its textures, more than the test's limit"), "{sentence}");
    let options = LoadOptions { memory: limit(64), texture_memory: limit(2), ..LoadOptions::default() };
    let sentence = load(24, 4096, options);
    assert!(sentence.contains("402.7 million texels, which need 2304 MiB on the device"), "{sentence}");
    // The header tells the size, so that no texel is decoded.
    let texture_side = Some((16384, "the 16384 texels a side of an image of the test".to_owned()));
    let sentence = load(1, 16384, LoadOptions { memory: limit(16), texture_side, ..LoadOptions::default() });
    let words =
        "has a texture of 16384 × 16384 texels, which needs more than the 16384 texels a side of an image of the test";
    assert!(sentence.contains(words) && sentence.contains("--max-texture"), "{sentence}");
}

/// Two bytes of text become forty-eight bytes of the scene in memory.
#[test]
fn a_file_has_a_bounded_number_of_scenes() {
    let folder = folder();
    let text =
        triangle(INLINE).to_string().replace(r#""scenes":["#, &format!(r#""scenes":[{}"#, "{},".repeat(1_000_000)));
    fs::write(folder.path().join("scenes.gltf"), text).unwrap();
    refused(folder.path(), "scenes.gltf", &["is not valid glTF", "a list of at most 65536"]);
}

/// A few bytes state any number of instances, of one node or of many.
#[test]
fn instances_without_data_are_added_up() {
    let folder = folder();
    for (nodes, instances) in [(1, 1_000_000), (1, 16_385), (20_000, 100)] {
        let mut scene = triangle(INLINE);
        scene["extensionsUsed"] = json!(["EXT_mesh_gpu_instancing"]);
        scene["accessors"]
            .as_array_mut()
            .unwrap()
            .push(json!({"componentType": 5126, "count": instances, "type": "VEC3"}));
        let instanced =
            json!({"mesh": 0, "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}}});
        scene["nodes"] = Value::Array(vec![instanced; nodes]);
        scene["scenes"][0]["nodes"] = (0..nodes).collect();
        write(folder.path(), "many.gltf", &scene);
        refused(folder.path(), "many.gltf", &["instances of meshes without data", "more than the 16384 that are read"]);
    }
}

#[test]
fn zstd_keeps_no_more_than_it_makes() {
    let folder = folder();
    let whole = include_bytes!("../../values/gltf/compressed/fading-uastc-zstd.ktx2");
    let start = u64::from_le_bytes(whole[80..88].try_into().unwrap()) as usize;
    // A frame whose window is 128 MiB, and blocks of 128 KiB that take four bytes each.
    let block = [2, 0, 16, 0];
    let frame = [&[0x28, 0xb5, 0x2f, 0xfd, 0, 0x88][..], &block.repeat(20_000)].concat();
    let bytes = [&whole[..88], &(frame.len() as u64).to_le_bytes(), &whole[96..start], &frame].concat();
    fs::write(folder.path().join("zeros.ktx2"), bytes).unwrap();
    write(folder.path(), "zeros.gltf", &textured(1, |_| "zeros.ktx2".into()));
    refused_strictly(folder.path(), "zeros.gltf", &["image 0", "asks for more memory than it holds"]);
}

/// The counts fit into memory, but the streams hold almost nothing of them.
#[test]
fn streams_are_held_to_what_they_hold() {
    let folder = folder();
    for (mode, stride) in [("ATTRIBUTES", 4), ("TRIANGLES", 2), ("INDICES", 4)] {
        let mut scene = triangle(INLINE);
        let stated = json!({"buffer": 0, "byteLength": 36, "byteStride": stride, "count": 300_000_000, "mode": mode});
        scene["bufferViews"][0]["extensions"] = json!({"KHR_meshopt_compression": stated});
        write(folder.path(), "meshopt.gltf", &scene);
        refused(folder.path(), "meshopt.gltf", &["buffer view 0", "unknown version"]);
    }
    let whole = include_bytes!("../../fuzz/corpus/draco-sequential.glb");
    let stream = whole.windows(5).position(|bytes| bytes == b"DRACO").unwrap();
    let mut bytes = whole.to_vec();
    // The counts of triangles and vertices, seven bits a byte, after eleven bytes of a header.
    bytes[stream + 11..stream + 21].copy_from_slice(&[0xff, 0xff, 0xff, 0xff, 0x0f].repeat(2));
    fs::write(folder.path().join("draco.glb"), bytes).unwrap();
    refused(folder.path(), "draco.glb", &["mesh 0 primitive 0 is compressed by Draco", "export the file again"]);
}

#[test]
fn small_buffers_hold_no_billions() {
    let folder = folder();
    let mut crowd = triangle(INLINE);
    crowd["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 1}}});
    for (view, part) in
        [(json!(0), "accessor 1 needs 1000000000 elements"), (json!(null), "accessor 1 declares 1000000000")]
    {
        let mut places = json!({"componentType": 5126, "count": 1_000_000_000, "type": "VEC3", "bufferView": view});
        if view.is_null() {
            places.as_object_mut().unwrap().remove("bufferView");
        }
        crowd["accessors"] = json!([crowd["accessors"][0], places]);
        write(folder.path(), "crowd.gltf", &crowd);
        refused(folder.path(), "crowd.gltf", &[part]);
    }
    // A million keys, which ten thousand channels share.
    let mut keys = triangle(INLINE);
    hole(folder.path(), "keys.bin", &[], 12 << 20);
    keys["buffers"].as_array_mut().unwrap().push(json!({"byteLength": 12 << 20, "uri": "keys.bin"}));
    keys["bufferViews"].as_array_mut().unwrap().push(json!({"buffer": 1, "byteLength": 12 << 20}));
    for kind in ["SCALAR", "VEC3"] {
        let accessor = json!({"bufferView": 1, "componentType": 5126, "count": 1 << 20, "type": kind});
        keys["accessors"].as_array_mut().unwrap().push(accessor);
    }
    let channel = json!({"sampler": 0, "target": {"node": 0, "path": "translation"}});
    keys["animations"] = json!([{"samplers": [{"input": 1, "output": 2}], "channels": vec![channel; 10_000]}]);
    write(folder.path(), "keys.gltf", &keys);
    refused(folder.path(), "keys.gltf", &["of memory", "animations", "fewer keys"]);
}

#[test]
fn text_ends_at_a_hole_on_the_disk() {
    let folder = folder();
    hole(folder.path(), "hole.gltf", br#"{"asset":{"version":"2.0"},"x":""#, 8 << 30);
    refused(folder.path(), "hole.gltf", &["line 1, column 32"]);
    let words = [2, 20 + (1u32 << 31), 1 << 31].map(u32::to_le_bytes).concat();
    hole(folder.path(), "hole.glb", &[b"glTF", &words[..], b"JSON{"].concat(), 20 + (1 << 31));
    refused(folder.path(), "hole.glb", &["line 1, column 1"]);
    // A quarter of a billion empty chunks.
    let words = [2, u32::MAX, 4].map(u32::to_le_bytes).concat();
    hole(folder.path(), "chunks.glb", &[b"glTF", &words[..], b"JSON{}  "].concat(), 1 << 32);
    refused(folder.path(), "chunks.glb", &["states no asset.version"]);
}

#[test]
fn trees_with_a_hundred_thousand_nodes_are_walked_without_the_stack() {
    let folder = folder();
    const NODES: usize = 100_000;
    let mut scene = triangle(INLINE);
    scene["nodes"] = (0..NODES).map(|i| json!({"children": [(i + 1) % NODES]})).collect();
    write(folder.path(), "ring.gltf", &scene);
    refused(folder.path(), "ring.gltf", &["their own ancestors"]);
    // A chain that ends in a node that does not exist.
    scene["nodes"] = (0..NODES).map(|i| json!({"children": [i + 1]})).collect();
    write(folder.path(), "chain.gltf", &scene);
    refused(folder.path(), "chain.gltf", &["node 100000 is used but does not exist"]);
    let mut twins = triangle(INLINE);
    twins["nodes"].as_array_mut().unwrap().push(json!({"children": vec![0; 1_000_000]}));
    write(folder.path(), "twins.gltf", &twins);
    refused(folder.path(), "twins.gltf", &["node 0 has two parents"]);
}

#[test]
fn a_list_of_names_is_cut_short() {
    let folder = folder();
    let mut scene = triangle(INLINE);
    scene["scenes"] = (0..60_000).map(|i| json!({"name": format!("s\n{i}"), "nodes": [0]})).collect();
    scene["animations"] =
        (0..60_000).map(|i| json!({"name": format!("a\n{i}"), "samplers": [], "channels": []})).collect();
    write(folder.path(), "names.gltf", &scene);
    for (flag, subject) in [("--scene", "names.gltf"), ("--animation", "--animation none")] {
        refused_by(folder.path(), &["render", "names.gltf", flag, "none", "-o", "a.png"], subject, &["?19\", …"]);
    }
}

#[test]
fn skies_and_images_that_state_too_much_are_refused() {
    let folder = folder();
    write(folder.path(), "scene.gltf", &triangle(INLINE));
    let start = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n";
    fs::write(folder.path().join("wide.hdr"), format!("{start}\n-Y 50000 +X 100000\n")).unwrap();
    hole(folder.path(), "endless.hdr", start.as_bytes(), 4 << 30);
    fs::write(folder.path().join("lines.hdr"), format!("{start}{}", "A=B\n".repeat(1 << 20))).unwrap();
    let whole = include_bytes!("../../fuzz/corpus/half.exr");
    let window = whole.windows(11).position(|w| w == b"dataWindow\0").unwrap() + 11 + 6 + 4;
    let large = |most: i32| {
        [&whole[..window], &[-most, -most, most, most].map(i32::to_le_bytes).concat(), &whole[window + 16..]].concat()
    };
    fs::write(folder.path().join("vast.exr"), large(i32::MAX / 2 - 1)).unwrap();
    fs::write(folder.path().join("wide.exr"), large(9000)).unwrap();
    for (name, part) in [
        ("wide.hdr", "more than 16384 texels a side"),
        ("endless.hdr", "its header does not end"),
        ("lines.hdr", "its header does not end"),
        ("vast.exr", ""),
        ("wide.exr", ""),
    ] {
        refused_by(folder.path(), &["render", "scene.gltf", "--sky", name, "-o", "a.png"], name, &[part]);
    }
    for name in ["vast.exr", "wide.exr"] {
        refused_by(folder.path(), &["compare", name, name], name, &[]);
    }
}

#[test]
fn no_other_kind_of_file_is_taken_for_one() {
    let folder = folder();
    fs::create_dir(folder.path().join("folder.bin")).unwrap();
    symlink("loop.bin", folder.path().join("loop.bin")).unwrap();
    let _socket = UnixListener::bind(folder.path().join("socket.bin")).unwrap();
    for (name, part) in
        [("folder.bin", "no regular file"), ("loop.bin", "cannot be read"), ("socket.bin", "no regular file")]
    {
        write(folder.path(), "buffer.gltf", &triangle(name));
        refused(folder.path(), "buffer.gltf", &["buffer 0", name, part]);
        write(folder.path(), "image.gltf", &textured(1, |_| name.into()));
        refused_strictly(folder.path(), "image.gltf", &["image 0", name, part]);
    }
    refused_by(folder.path(), &["stability", "--markdown", "/dev/zero"], "/dev/zero", &["larger than 1 MiB"]);
    refused_by(folder.path(), &["compare", "/dev/zero", "/dev/zero"], "/dev/zero", &["no regular file"]);
}

#[test]
fn settings_and_data_in_text_are_bounded() {
    let folder = folder();
    for text in [
        "a.".repeat(400_000) + "a = 1",
        format!("a = {}", "[".repeat(900_000)),
        format!("a = {}", "{a=".repeat(300_000)),
    ] {
        fs::write(folder.path().join("deep.toml"), text).unwrap();
        refused_by(folder.path(), &["settings", "--config", "deep.toml"], "deep.toml", &["line 1"]);
    }
    fs::write(folder.path().join("deep.toml"), "#".repeat(2 << 20)).unwrap();
    refused_by(folder.path(), &["settings", "--config", "deep.toml"], "deep.toml", &["larger than 1 MiB"]);
    // A data URI of 24 MB that is invalid at its end.
    write(folder.path(), "inline.gltf", &triangle(&format!("{INLINE}{}!", "A".repeat(24 << 20))));
    refused(folder.path(), "inline.gltf", &["buffer 0", "not valid base64"]);
}
