//! Features of glTF 2.0: one small file made in code per feature, checked against values computed by hand.

use super::files::{F32, File, I8, I16, U8, U16, U32, assert_near, corners, load_bytes, png, write};
use glam::{DVec3, Vec2, Vec3, Vec4};
use serde_json::json;
use twobounce::scene::{LightKind, LoadOptions, Mip, Projection, Scene, Wrap};

#[test]
fn every_index_width_and_triangle_mode_is_read() {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let flat_up = |scene: &Scene| {
        let c = corners(scene);
        assert_eq!(c.len(), 6);
        assert!(c.chunks(3).all(|t| (t[1] - t[0]).cross(t[2] - t[0]).z == 1.0), "{c:?}");
    };
    for (width, bytes) in [
        (U8, vec![0, 1, 2, 3]),
        (U16, vec![0, 0, 1, 0, 2, 0, 3, 0]),
        (U32, [0u32, 1, 2, 3].iter().flat_map(|i| i.to_le_bytes()).collect()),
    ] {
        let mut file = File::empty();
        let positions = file.floats("VEC3", &square);
        let indices = file.accessor(width, "SCALAR", 4, &bytes);
        file.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 5}));
        flat_up(&file.scene());
    }
    let mut file = File::empty();
    let positions = file.floats("VEC3", &square);
    let indices = file.accessor(U8, "SCALAR", 4, &[0, 1, 3, 2]);
    file.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices, "mode": 6}));
    flat_up(&file.scene());
}

#[test]
fn points_and_lines_are_left_out_with_one_warning() {
    let mut file = File::triangle();
    for mode in 0..4 {
        file.json["meshes"][0]["primitives"]
            .as_array_mut()
            .unwrap()
            .push(json!({"attributes": {"POSITION": 0}, "mode": mode}));
    }
    let scene = file.scene();
    assert_eq!((scene.triangle_count(), scene.warnings.len()), (1, 1));
}

#[test]
fn interleaved_and_normalised_attributes_are_read() {
    let mut file = File::empty();
    // Per vertex: three i16 (normalised), two bytes of padding, two u8 uvs (normalised), three i8 normal, one u8 pad.
    let mut bytes = Vec::new();
    for [x, y] in [[0i16, 0], [32767, 0], [0, -32768]] {
        [x, y, 0, 0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        bytes.extend([if x > 0 { 255 } else { 0 }, if y < 0 { 51 } else { 0 }, 0, 0, 127, 0, 0, 0]);
    }
    let view = file.view(&bytes);
    file.json["bufferViews"][view]["byteStride"] = json!(16);
    let mut attribute = |component: u32, kind: &str, offset: usize| {
        let accessor = json!({"bufferView": view, "byteOffset": offset, "componentType": component, "type": kind, "count": 3, "normalized": true});
        file.push("accessors", accessor)
    };
    let attributes = json!({"POSITION": attribute(I16, "VEC3", 0), "TEXCOORD_0": attribute(U8, "VEC2", 8), "NORMAL": attribute(I8, "VEC3", 10)});
    file.mesh(json!({"attributes": attributes}));
    file.json["extensionsRequired"] = json!(["KHR_mesh_quantization"]);
    let mesh = &file.scene().meshes[0];
    // −32768 / 32767 is clamped at −1.
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::NEG_Y]);
    assert_eq!(mesh.uvs[0], [Vec2::ZERO, Vec2::X, Vec2::new(0.0, 0.2)]);
    assert_eq!(mesh.normals, [Vec3::Z; 3]);
}

#[test]
fn unnormalised_integers_keep_their_values() {
    let mut file = File::empty();
    let positions = file.accessor(U16, "VEC3", 3, &[0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0]);
    file.mesh(json!({"attributes": {"POSITION": positions}}));
    assert_eq!(file.scene().meshes[0].positions, [Vec3::ZERO, 7.0 * Vec3::X, 256.0 * Vec3::Y]);
}

#[test]
fn sparse_accessors_replace_values_with_and_without_a_base() {
    for base in [true, false] {
        let mut file = File::triangle();
        let keys = file.view(&[2, 0]);
        let values = file.view(&[0f32, 5.0, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<_>>());
        file.json["accessors"][0]["sparse"] = json!({"count": 1, "indices": {"bufferView": keys, "componentType": U16}, "values": {"bufferView": values}});
        if !base {
            file.json["accessors"][0].as_object_mut().unwrap().remove("bufferView");
        }
        let x = if base { Vec3::X } else { Vec3::ZERO };
        assert_eq!(file.scene().meshes[0].positions, [Vec3::ZERO, x, Vec3::new(0.0, 5.0, 1.0)]);
    }
}

#[test]
fn buffers_and_images_come_from_data_uris_and_percent_encoded_files() {
    let mut file = File::quad();
    let texture = file.push("textures", json!({"source": 0}));
    file.push("images", json!({"uri": "a%20b%E2%99%BB.png"}));
    file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}}));
    file.json["buffers"][0]["uri"] = json!("my%20data.bin");
    let (folder, path) = write("scene.gltf", file.json.to_string().as_bytes());
    std::fs::write(folder.path().join("my data.bin"), &file.binary).unwrap();
    std::fs::write(folder.path().join("a b♻.png"), png(1, 1, &[1, 2, 3, 4])).unwrap();
    let scene = Scene::load(&path, &LoadOptions::default()).unwrap();
    assert_eq!((scene.images[0].rgba.as_slice(), scene.triangle_count()), (&[1, 2, 3, 4][..], 2));

    let mut file = File::empty();
    // Base64 of three vertices: (0,0,0) (1,0,0) (0,1,0).
    file.json["buffers"][0] = json!({"byteLength": 36, "uri":
        "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"});
    let view = file.push("bufferViews", json!({"buffer": 0, "byteLength": 36}));
    let positions =
        file.push("accessors", json!({"bufferView": view, "componentType": F32, "type": "VEC3", "count": 3}));
    file.mesh(json!({"attributes": {"POSITION": positions}}));
    let scene = load_bytes("scene.gltf", file.json.to_string().as_bytes()).unwrap();
    assert_eq!(scene.meshes[0].positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

#[test]
fn lights_come_with_units_range_radius_and_cone() {
    let mut file = File::empty();
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [
        {"type": "point", "color": [1, 0.5, 0], "intensity": 4, "range": 7, "extras": {"radius": 0.25}},
        {"type": "spot", "spot": {"innerConeAngle": 0.1, "outerConeAngle": 0.2}},
        {"type": "directional", "name": "sun"}]}});
    for light in 0..3 {
        file.node(json!({"extensions": {"KHR_lights_punctual": {"light": light}}, "translation": [0, light, 0], "rotation": [1, 0, 0, 0]}));
    }
    let scene = file.scene();
    let [point, spot, sun] = &scene.lights[..] else { panic!("{} lights", scene.lights.len()) };
    assert_eq!((point.intensity, point.range, point.radius), (Vec3::new(4.0, 2.0, 0.0), 7.0, 0.25));
    assert_eq!((point.kind, sun.kind), (LightKind::Point, LightKind::Directional));
    assert_eq!(spot.kind, LightKind::Spot { inner: 0.1, outer: 0.2 });
    assert_eq!((spot.range, sun.name.as_str()), (f32::INFINITY, "sun"));
    let posed = scene.pose(None, 0.0).lights[1];
    assert_eq!(posed.position, DVec3::Y);
    // Half a rotation around x maps −z to +z.
    assert_near(posed.direction, DVec3::Z, 1e-15);
}

#[test]
fn cameras_are_perspective_or_orthographic() {
    let mut file = File::empty();
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    file.push(
        "cameras",
        json!({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 2, "znear": 0, "zfar": 9}, "name": "top"}),
    );
    file.node(json!({"camera": 0, "scale": [3, 3, 3], "translation": [0, 0, 2]}));
    file.node(json!({"camera": 1}));
    let scene = file.scene();
    assert_eq!(scene.cameras[0].projection, Projection::Perspective { fov: 0.5, near: 0.1, far: f32::INFINITY });
    assert_eq!(scene.cameras[1].projection, Projection::Orthographic { half_height: 2.0, near: 0.0, far: 9.0 });
    assert_eq!((scene.camera_named("top").unwrap(), scene.camera_named("0").unwrap()), (1, 0));
    let view = scene.view(&scene.pose(None, 0.0), 0);
    assert_eq!((view.eye, view.forward, view.up), (2.0 * DVec3::Z, DVec3::NEG_Z, DVec3::Y));
}

#[test]
fn samplers_default_to_repeat_and_trilinear() {
    let mut file = File::quad();
    let texture = file.texture(&png(1, 1, &[255; 4]));
    let other = file.push("textures", json!({"source": 0, "sampler": 0}));
    file.push("samplers", json!({"magFilter": 9728, "minFilter": 9985, "wrapS": 33071, "wrapT": 33648}));
    file.material(json!({"emissiveTexture": {"index": texture}, "normalTexture": {"index": other}}));
    let scene = file.scene();
    let [a, b] = [scene.materials[1].emissive_texture, scene.materials[1].normal_texture]
        .map(|t| scene.textures[t.unwrap().texture]);
    assert_eq!((a.wrap, a.mag_linear, a.min_linear, a.mip), ([Wrap::Repeat; 2], true, true, Mip::Linear));
    assert_eq!((b.wrap, b.mag_linear, b.min_linear, b.mip), ([Wrap::Clamp, Wrap::Mirror], false, true, Mip::Nearest));
    assert_eq!((a.image, b.image, scene.images.len()), (0, 0, 1));
}

#[test]
fn sixteen_bit_images_are_rounded_with_one_warning() {
    let deep = image::ImageBuffer::<image::Rgba<u16>, _>::from_raw(1, 1, vec![0u16, 257 * 77, 65535, 30000]).unwrap();
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::DynamicImage::ImageRgba16(deep).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let mut file = File::quad();
    let texture = file.texture(&bytes.into_inner());
    file.material(json!({"emissiveTexture": {"index": texture}}));
    let scene = file.scene();
    assert_eq!(scene.images[0].rgba, [0, 77, 255, 117]);
    assert_eq!(scene.warnings.len(), 1);
}

#[test]
fn vertex_colours_come_in_every_format() {
    for (component, kind, normalized, bytes) in [
        (U8, "VEC4", true, [0u8, 51, 255, 51].repeat(3)),
        (U16, "VEC4", true, [0u16, 13107, 65535, 13107].repeat(3).iter().flat_map(|v| v.to_le_bytes()).collect()),
        (F32, "VEC3", false, [0f32, 0.2, 1.0].repeat(3).iter().flat_map(|v| v.to_le_bytes()).collect()),
    ] {
        let mut file = File::triangle();
        let colors = file.accessor(component, kind, 3, &bytes);
        file.json["accessors"][colors]["normalized"] = json!(normalized);
        file.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        let alpha = if kind == "VEC3" { 1.0 } else { 0.2 };
        assert_eq!(file.scene().meshes[0].colors[1], Vec4::new(0.0, 0.2, 1.0, alpha));
    }
}

#[test]
fn missing_normals_become_flat_ones() {
    let mut file = File::empty();
    let positions = file.floats("VEC3", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
    let indices = file.accessor(U8, "SCALAR", 6, &[0, 1, 2, 0, 3, 1]);
    file.mesh(json!({"attributes": {"POSITION": positions}, "indices": indices}));
    let mesh = &file.scene().meshes[0];
    assert_eq!(mesh.normals, [Vec3::Z, Vec3::Z, Vec3::Z, Vec3::Y, Vec3::Y, Vec3::Y]);
    assert_eq!((mesh.uvs[0].len(), mesh.colors.len(), mesh.tangents.len()), (6, 6, 6));
}

#[test]
fn generated_bitangents_point_up_the_image() {
    let mut file = File::quad();
    let texture = file.texture(&png(1, 1, &[128, 128, 255, 255]));
    file.material(json!({"normalTexture": {"index": texture}}));
    // u increases along +x and v along −y. glTF's green channel points up, so n × t · w must be +y.
    assert_eq!(file.scene().meshes[0].tangents, [Vec4::new(1.0, 0.0, 0.0, 1.0); 4]);

    // Mirroring u reverses the tangent but not the bitangent.
    let uvs = file.floats("VEC2", &[1.0, 1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    file.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = json!(uvs);
    assert_eq!(file.scene().meshes[0].tangents, [Vec4::new(-1.0, 0.0, 0.0, -1.0); 4]);

    // The file's own tangents are kept.
    let tangents = file.floats("VEC4", &[0.0, 1.0, 0.0, -1.0].repeat(4));
    file.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = json!(tangents);
    assert_eq!(file.scene().meshes[0].tangents, [Vec4::new(0.0, 1.0, 0.0, -1.0); 4]);
}

#[test]
fn skins_take_the_pose_of_their_joints_and_morphs_their_weights() {
    let mut file = File::triangle();
    let joints = file.accessor(U8, "VEC4", 3, &[0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0]);
    let weights = file.floats("VEC4", &[1.0, 0.0, 0.0, 0.0, 0.5, 0.5, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
    let offsets = file.floats("VEC3", &[0.0, 0.0, 4.0].repeat(3));
    let primitive = &mut file.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["JOINTS_0"] = json!(joints);
    primitive["attributes"]["WEIGHTS_0"] = json!(weights);
    primitive["targets"] = json!([{"POSITION": offsets}]);
    file.json["meshes"][0]["weights"] = json!([0.25]);
    file.node(json!({"translation": [10, 0, 0]}));
    file.node(json!({"translation": [0, 20, 0]}));
    file.push("skins", json!({"joints": [1, 2]}));
    // The node's own transform must not affect a skinned mesh.
    file.json["nodes"][0]["translation"] = json!([100, 100, 100]);
    file.json["nodes"][0]["skin"] = json!(0);
    let scene = file.scene();
    let expected = [[10.0, 0.0, 1.0], [6.0, 10.0, 1.0], [0.0, 21.0, 1.0]];
    for (corner, expected) in corners(&scene).into_iter().zip(expected) {
        assert_near(corner, DVec3::from(expected), 2e-6);
    }
    assert_eq!(scene.warnings, [""; 0]);
}

#[test]
fn animated_weights_morph_the_nodes_own_mesh() {
    let mut file = File::triangle();
    let (up, right) =
        (file.floats("VEC3", &[0.0, 0.0, 4.0].repeat(3)), file.floats("VEC3", &[2.0, 0.0, 0.0].repeat(3)));
    file.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": up}, {"POSITION": right}]);
    file.json["meshes"][0]["weights"] = json!([0.25, 0.0]);
    // An animation morphs one of two nodes with the mesh.
    file.node(json!({"mesh": 0}));
    let (times, weights) = (file.floats("SCALAR", &[0.0, 2.0]), file.floats("SCALAR", &[0.0, 1.0, 1.0, 0.0]));
    file.push(
        "animations",
        json!({"samplers": [{"input": times, "output": weights}], "channels": [{"sampler": 0, "target": {"node": 0, "path": "weights"}}]}),
    );
    let scene = file.scene();
    let first = |instance: usize, pose: &twobounce::scene::Pose| {
        let mesh = scene.meshes[scene.instances[instance].mesh].posed(pose);
        (mesh.positions[mesh.indices[0] as usize], mesh.normals[0])
    };
    let at = |time: f32| scene.pose(Some(0), time);
    assert_eq!(first(0, &scene.pose(None, 0.0)).0, Vec3::new(0.0, 0.0, 1.0));
    assert_eq!(first(0, &at(1.0)), (Vec3::new(1.0, 0.0, 2.0), Vec3::Z));
    assert_eq!(first(1, &at(1.0)).0, Vec3::new(0.0, 0.0, 1.0));
    assert_eq!((scene.animations[0].duration, scene.bounds(Some(0)).max.z), (2.0, 4.0));
}

#[test]
fn animations_interpolate_as_the_specification_says() {
    let mut file = File::triangle();
    let times = file.floats("SCALAR", &[1.0, 3.0]);
    let moves = file.floats("VEC3", &[0.0, 0.0, 0.0, 4.0, 0.0, 0.0]);
    let turns = file.floats("VEC4", &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0]);
    // In-tangent, value, out-tangent per key.
    let cubic = file
        .floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let sampler =
        |output: usize, interpolation: &str| json!({"input": times, "output": output, "interpolation": interpolation});
    let animation = |name: &str, path: &str, sampler: serde_json::Value| json!({"name": name, "samplers": [sampler], "channels": [{"sampler": 0, "target": {"node": 0, "path": path}}]});
    file.push("animations", animation("linear", "translation", sampler(moves, "LINEAR")));
    file.push("animations", animation("step", "translation", sampler(moves, "STEP")));
    file.push("animations", animation("cubic", "translation", sampler(cubic, "CUBICSPLINE")));
    file.push("animations", animation("turn", "rotation", sampler(turns, "LINEAR")));
    let scene = file.scene();
    let place = |name: &str, time: f32| {
        let pose = scene.pose(Some(scene.animation_named(name).unwrap()), time);
        pose.world_from_instance[0].transform_point3(DVec3::ZERO).x
    };
    assert_eq!([0.0, 1.0, 1.5, 3.0, 9.0].map(|t| place("linear", t)), [0.0, 0.0, 1.0, 4.0, 4.0]);
    assert_eq!([0.0, 2.9, 3.0].map(|t| place("step", t)), [0.0, 0.0, 4.0]);
    // In the middle: ½·0 + ⅛·2·1 + ½·2 − ⅛·2·(−1) = 1.5.
    assert_eq!([1.0, 2.0, 3.0].map(|t| place("cubic", t)), [0.0, 1.5, 2.0]);
    let quarter = scene.pose(Some(3), 2.0).world_from_instance[0].transform_vector3(DVec3::X);
    assert_near(quarter, DVec3::Y, 1e-15);
    assert_eq!(scene.animations[0].duration, 3.0);
    // Over the whole animation the triangle covers 0 to 4 + 1.
    assert_eq!(scene.bounds(Some(0)).max.x, 5.0);
    assert!(scene.animation_named("walk").unwrap_err().to_string().contains("0 \"linear\""));
}

#[test]
fn unknown_extensions_warn_once_or_refuse() {
    let mut file = File::triangle();
    file.json["extensionsUsed"] = json!(["ACME_foo", "KHR_lights_punctual", "ACME_foo"]);
    assert_eq!(file.scene().warnings, ["the extension ACME_foo is not supported and was ignored"]);
    file.json["extensionsRequired"] = json!(["ACME_foo"]);
    assert!(file.load().unwrap_err().contains("requires the extension ACME_foo"));
}

#[test]
fn the_hash_covers_document_buffers_and_images() {
    let make = |texel: u8, x: f32, name: &str| {
        let mut file = File::quad();
        let texture = file.texture(&png(1, 1, &[texel; 4]));
        file.material(json!({"name": name, "emissiveTexture": {"index": texture}}));
        file.binary[..4].copy_from_slice(&x.to_le_bytes());
        file.scene().hash
    };
    let hashes = [make(1, 0.0, "a"), make(2, 0.0, "a"), make(1, -1.0, "a"), make(1, 0.0, "b")];
    assert_eq!(hashes[0], make(1, 0.0, "a"));
    assert!(hashes.iter().all(|h| h.len() == 64 && hashes.iter().filter(|g| *g == h).count() == 1));
}

#[test]
fn repairable_attributes_are_repaired_with_a_warning() {
    let mut file = File::quad();
    let normals = file.floats("VEC3", &[f32::NAN, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0]);
    let uvs = file.floats("VEC2", &[f32::INFINITY, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let colors = file.floats("VEC4", &[f32::NAN; 16]);
    let attributes = &mut file.json["meshes"][0]["primitives"][0]["attributes"];
    attributes["NORMAL"] = json!(normals);
    attributes["TEXCOORD_0"] = json!(uvs);
    attributes["COLOR_0"] = json!(colors);
    let scene = file.scene();
    let mesh = &scene.meshes[0];
    assert_eq!((&mesh.normals[..], mesh.uvs[0][0], mesh.colors[0]), (&[Vec3::Z; 4][..], Vec2::ZERO, Vec4::ONE));
    assert_eq!(scene.warnings.len(), 3);
}
