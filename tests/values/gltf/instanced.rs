//! EXT_mesh_gpu_instancing: positions of instances, their motion, and refusals.

use super::files::{File, write};
use glam::DVec3;
use serde_json::json;
use twobounce::memory::Limit;
use twobounce::scene::{LoadOptions, Scene};

/// Four instances by translation, rotation and scale, at a node with a transform of its own.
fn instanced() -> File {
    let mut file = File::triangle();
    let translations = file.floats("VEC3", &[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0, 0.0, 4.0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    let turned = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, half, half, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0];
    let rotations = file.floats("VEC4", &turned);
    let scales = file.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 1.0, -1.0, 1.0, 1.0, 1.0, 1.0]);
    let attributes = json!({"TRANSLATION": translations, "ROTATION": rotations, "SCALE": scales});
    file.json["nodes"][0]["extensions"] = json!({"EXT_mesh_gpu_instancing": {"attributes": attributes}});
    file.json["nodes"][0]["translation"] = json!([10, 0, 0]);
    for key in ["extensionsUsed", "extensionsRequired"] {
        file.json[key] = json!(["EXT_mesh_gpu_instancing"]);
    }
    file
}

/// World positions of each instance's second and third vertex, which are (1,0,0) and (0,1,0) in the mesh.
fn ends(scene: &Scene) -> Vec<[DVec3; 2]> {
    let world = scene.pose(None, 0.0).world_from_instance;
    world.iter().map(|world| [DVec3::X, DVec3::Y].map(|at| (world.transform_point3(at) * 1e6).round() / 1e6)).collect()
}

#[test]
fn instances_stand_where_their_attributes_say() {
    let scene = instanced().scene();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.warnings.len()), (1, 4, 0));
    let at = |x, y, z| DVec3::new(x, y, z);
    let expected = [
        [at(11.0, 0.0, 0.0), at(10.0, 1.0, 0.0)],
        // Twice as large, turned by a quarter about z, moved by 2 in x.
        [at(12.0, 2.0, 0.0), at(10.0, 0.0, 0.0)],
        [at(11.0, 3.0, 0.0), at(10.0, 2.0, 0.0)],
        // A rotation of zero length counts as none.
        [at(11.0, 0.0, 4.0), at(10.0, 1.0, 4.0)],
    ];
    assert_eq!(ends(&scene), expected);
    // Each attribute may be absent.
    for (absent, second) in [
        ("TRANSLATION", [at(10.0, 2.0, 0.0), at(8.0, 0.0, 0.0)]),
        ("ROTATION", [at(14.0, 0.0, 0.0), at(12.0, 2.0, 0.0)]),
        ("SCALE", [at(12.0, 1.0, 0.0), at(11.0, 0.0, 0.0)]),
    ] {
        let mut file = instanced();
        let extension = &mut file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
        extension.as_object_mut().unwrap().remove(absent);
        assert_eq!(ends(&file.scene())[1], second, "without {absent}");
    }
    let mut file = instanced();
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({});
    assert_eq!(ends(&file.scene()), [[at(11.0, 0.0, 0.0), at(10.0, 1.0, 0.0)]]);
}

/// A motion of the node moves its instances, and a mesh that another node shows too stays one mesh.
#[test]
fn instances_follow_their_node() {
    let mut file = instanced();
    file.node(json!({"mesh": 0}));
    let times = file.floats("SCALAR", &[0.0, 1.0]);
    let moves = file.floats("VEC3", &[0.0, 0.0, 0.0, 0.0, 8.0, 0.0]);
    file.push(
        "animations",
        json!({"samplers": [{"input": times, "output": moves}],
        "channels": [{"sampler": 0, "target": {"node": 0, "path": "translation"}}]}),
    );
    let scene = file.scene();
    assert_eq!((scene.meshes.len(), scene.instances.len()), (1, 5));
    let pose = scene.pose(Some(0), 0.5);
    let origins: Vec<DVec3> = pose.world_from_instance.iter().map(|world| world.translation).collect();
    let expected = [[0.0, 4.0, 0.0], [2.0, 4.0, 0.0], [0.0, 7.0, 0.0], [0.0, 4.0, 4.0], [0.0; 3]];
    assert_eq!(origins, expected.map(DVec3::from));
}

#[test]
fn wrong_instances_are_refused_by_name() {
    let mut file = instanced();
    let three = file.floats("VEC3", &[1.0; 9]);
    let broken = file.floats("VEC3", &[f32::NAN; 12]);
    for (value, expected) in [
        (json!({"TRANSLATION": 99}), "accessor 99 is used but does not exist"),
        (
            json!({"TRANSLATION": "x"}),
            "node 0 has EXT_mesh_gpu_instancing with TRANSLATION that is no accessor's index",
        ),
        (json!({"TRANSLATION": 1, "SCALE": three}), "with attributes of different lengths"),
        (json!({"TRANSLATION": broken}), "with a transform that is not finite (instance 0)"),
        (json!({"TRANSLATION": 2}), "does not fit its use"),
    ] {
        file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = value;
        let sentence = file.load().unwrap_err();
        assert!(sentence.contains(expected), "expected \"{expected}\" in: {sentence}");
    }
}

/// Instances are counted before the first is made: accessors without data hold millions in a few bytes.
#[test]
fn many_instances_are_refused_by_what_they_need() {
    let mut file = instanced();
    let many = file.push("accessors", json!({"componentType": 5126, "type": "VEC3", "count": 1_000_000}));
    file.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"] = json!({"TRANSLATION": many});
    let (_folder, path) = write("scene.glb", &file.glb());
    let memory = Some(Limit { bytes: 1 << 30, words: "the test's limit".into() });
    let sentence = Scene::load(&path, &LoadOptions { memory, ..LoadOptions::default() }).unwrap_err().to_string();
    assert!(sentence.contains("1.0 million instances of meshes, more than the test's limit"), "{sentence}");
}
