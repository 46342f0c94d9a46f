//! Nodes of glTF 2.0: transforms, hierarchies, scenes, and visibility.

use std::f64::consts::FRAC_1_SQRT_2;

use super::files::{File, assert_near, corners, write};
use glam::DVec3;
use serde_json::json;
use twobounce::scene::{LoadOptions, Scene};

#[test]
fn node_transforms_keep_f64() {
    let mut file = File::triangle();
    file.json["nodes"][0]["translation"] = json!([10000000.25, -0.1, 3.0]);
    assert_eq!(corners(&file.scene())[0], DVec3::new(10000000.25, -0.1, 3.0));
}

#[test]
fn parents_come_before_children_whatever_the_file_order() {
    let mut file = File::triangle();
    let child = json!({"mesh": 0, "translation": [0.0, 0.0, 1.0]});
    file.json["nodes"][0] = child;
    let parent =
        json!({"children": [0], "scale": [-2.0, 2.0, 2.0], "rotation": [0.0, 0.0, FRAC_1_SQRT_2, FRAC_1_SQRT_2]});
    file.push("nodes", parent);
    file.json["scenes"][0]["nodes"] = json!([1]);
    let scene = file.scene();
    assert!(scene.nodes.iter().enumerate().all(|(i, n)| n.parent.is_none_or(|p| p < i)));
    // The mirrored scale maps x = 1 to −2; the quarter rotation around z maps that to y = −2.
    assert_near(corners(&scene)[1], DVec3::new(0.0, -2.0, 2.0), 1e-12);
    assert!(scene.pose(None, 0.0).world_from_instance[0].matrix3.determinant() < 0.0);
}

#[test]
fn nodes_that_share_a_mesh_share_its_triangles() {
    let mut file = File::triangle();
    file.node(json!({"mesh": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1]}));
    let scene = file.scene();
    assert_eq!((scene.meshes.len(), scene.instances.len(), scene.triangle_count()), (1, 2, 2));
    assert_eq!(corners(&scene)[3], DVec3::new(5.0, 0.0, 0.0));
}

#[test]
fn scenes_are_chosen_by_name_index_or_default() {
    let mut file = File::triangle();
    file.push("scenes", json!({"name": "empty", "nodes": []}));
    let (_folder, path) = write("scene.glb", &file.glb());
    let triangles = |scene: Option<&str>| {
        let options = LoadOptions { scene: scene.map(str::to_string), ..LoadOptions::default() };
        Scene::load(&path, &options).map(|s| s.triangle_count()).map_err(|e| e.to_string())
    };
    assert_eq!(triangles(None), Ok(1));
    assert_eq!(triangles(Some("empty")), Ok(0));
    assert_eq!(triangles(Some("1")), Ok(0));
    let refused = triangles(Some("emty")).unwrap_err();
    assert!(refused.contains("--scene") && refused.contains("1 \"empty\""), "{refused}");

    file.json["scenes"] = json!([]);
    file.json.as_object_mut().unwrap().remove("scene");
    let scene = file.scene();
    assert_eq!(scene.triangle_count(), 1);
    assert!(scene.warnings[0].contains("no scene"));
}

/// KHR_node_visibility hides meshes and lights at a node and below it, but neither cameras nor joints.
#[test]
fn hidden_nodes_show_nothing() {
    let hidden = json!({"KHR_node_visibility": {"visible": false}});
    let shown = json!({"KHR_node_visibility": {"visible": true}});
    let mut file = File::triangle();
    file.json["extensionsUsed"] = json!(["KHR_node_visibility", "KHR_lights_punctual"]);
    file.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [{"type": "point"}]}});
    file.push("cameras", json!({"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}));
    let light = json!({"KHR_lights_punctual": {"light": 0}});
    let lamp = file.push("nodes", json!({"extensions": light}));
    // A visible node below a hidden node is hidden.
    let child = file.push("nodes", json!({"mesh": 0, "camera": 0, "extensions": shown, "children": [lamp]}));
    let parent = file.node(json!({"children": [child], "extensions": hidden}));
    let instanced = json!({"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": 0}}, "KHR_node_visibility": {"visible": false}});
    file.node(json!({"mesh": 0, "extensions": instanced}));
    let counts = |file: &File| {
        let scene = file.scene();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        (scene.instances.len(), scene.lights.len(), scene.cameras.len())
    };
    assert_eq!(counts(&file), (1, 0, 1));
    for seen in [json!({}), json!({"KHR_node_visibility": {}}), shown] {
        file.json["nodes"][parent]["extensions"] = seen;
        assert_eq!(counts(&file), (2, 1, 1));
    }
}
