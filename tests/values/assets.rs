//! The scenes in `assets/`: equal to the output of the code, valid glTF, closed solids, all promised features.

use std::collections::HashMap;
use std::path::Path;

use gltf::Gltf;
use gltf::material::AlphaMode;
use twobounce::scene::{LoadOptions, Scene};

fn scenes() -> Vec<(&'static str, Vec<u8>)> {
    twobounce::assets::all().unwrap()
}

fn parse(name: &str) -> Gltf {
    let bytes = scenes().into_iter().find(|(n, _)| *n == name).unwrap().1;
    Gltf::from_slice(&bytes).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn triangles(gltf: &Gltf) -> usize {
    gltf.meshes().flat_map(|mesh| mesh.primitives()).map(|p| p.indices().unwrap().count() / 3).sum()
}

#[test]
fn committed_files_are_current() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    for (name, bytes) in scenes() {
        let committed = std::fs::read(folder.join(name)).unwrap();
        assert!(committed == bytes, "assets/{name} is out of date: run `twobounce make-assets`");
        assert!(bytes.len() < 1_500_000, "{name} has {} bytes", bytes.len());
    }
}

#[test]
fn an_error_names_the_folder_that_cannot_be_created() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    std::fs::write(&file, "").unwrap();
    let error = twobounce::assets::write(&file).unwrap_err().to_string();
    assert!(error.contains(file.to_str().unwrap()), "{error}");
}

/// All meshes except double-sided sheets and single-sided lamps are closed: every edge occurs once in each direction.
/// Vertices with equal bits of their positions are one vertex.
#[test]
fn solids_are_closed() {
    for (name, _) in scenes() {
        let gltf = parse(name);
        let blob = gltf.blob.as_deref().unwrap();
        for mesh in gltf.meshes() {
            for primitive in mesh.primitives() {
                let lamp = ["lamp", "panel"].contains(&mesh.name().unwrap());
                let walled = name.starts_with("cornell") && mesh.name().unwrap().ends_with("block");
                if (primitive.material().double_sided() && !walled) || lamp {
                    continue;
                }
                let reader = primitive.reader(|_| Some(blob));
                let corners: Vec<[u32; 3]> = reader.read_positions().unwrap().map(|p| p.map(f32::to_bits)).collect();
                let indices: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|i| i as usize).collect();
                let mut edges: HashMap<_, i32> = HashMap::new();
                for triangle in indices.chunks(3) {
                    for (a, b) in [(0, 1), (1, 2), (2, 0)] {
                        let (a, b) = (corners[triangle[a]], corners[triangle[b]]);
                        assert_ne!(a, b, "{name}: {:?} has a degenerate triangle", mesh.name());
                        *edges.entry((a, b)).or_default() += 1;
                    }
                }
                for ((a, b), count) in &edges {
                    assert_eq!(edges.get(&(*b, *a)), Some(count), "{name}: {:?} is open", mesh.name());
                }
            }
        }
    }
}

/// Normals are on the front of their faces and have unit length.
#[test]
fn normals_agree_with_winding() {
    for (name, _) in scenes() {
        let gltf = parse(name);
        let blob = gltf.blob.as_deref().unwrap();
        for primitive in gltf.meshes().flat_map(|mesh| mesh.primitives()) {
            let reader = primitive.reader(|_| Some(blob));
            let positions: Vec<glam::Vec3> = reader.read_positions().unwrap().map(Into::into).collect();
            let normals: Vec<glam::Vec3> = reader.read_normals().unwrap().map(Into::into).collect();
            // Components are rounded to 2⁻²⁰.
            assert!(normals.iter().all(|n| (n.length() - 1.0).abs() < 4e-6), "{name}");
            let indices: Vec<usize> = reader.read_indices().unwrap().into_u32().map(|i| i as usize).collect();
            for triangle in indices.chunks(3) {
                let [a, b, c] = [0, 1, 2].map(|k| positions[triangle[k]]);
                let face = (b - a).cross(c - a);
                assert!(triangle.iter().all(|&k| face.dot(normals[k]) > 0.0), "{name}: {triangle:?} is reversed");
            }
        }
    }
}

#[test]
fn the_cornell_boxes_differ_by_their_lamp() {
    let (area, point) = (parse("cornell-area.glb"), parse("cornell-point.glb"));
    assert_eq!((triangles(&area), triangles(&point)), (36, 34));
    assert_eq!(area.lights().map_or(0, |lights| lights.count()), 0);
    assert_eq!(point.lights().map_or(0, |lights| lights.count()), 1);
    assert_eq!(area.materials().filter(|m| m.emissive_factor() != [0.0; 3]).count(), 1);
    assert_eq!(area.cameras().len(), 1);
}

#[test]
fn the_gallery_has_all_promised_features() {
    let gltf = parse("gallery.glb");
    assert!((5_000..30_000).contains(&triangles(&gltf)), "{}", triangles(&gltf));
    let materials: Vec<_> = gltf.materials().collect();
    let metals: Vec<f32> = materials
        .iter()
        .map(|m| m.pbr_metallic_roughness())
        .filter(|pbr| pbr.metallic_factor() == 1.0 && pbr.metallic_roughness_texture().is_none())
        .filter(|pbr| pbr.base_color_factor()[0] > 0.9 && pbr.base_color_factor()[2] < 0.5)
        .map(|pbr| pbr.roughness_factor())
        .collect();
    assert!(metals.len() == 5 && metals.is_sorted(), "{metals:?}");
    assert_eq!(materials.iter().filter(|m| m.transmission().is_some() && m.volume().is_some()).count(), 1);
    assert_eq!(materials.iter().filter(|m| m.emissive_strength().is_some()).count(), 3);
    assert_eq!(materials.iter().filter(|m| m.normal_texture().is_some()).count(), 1);
    assert!(materials.iter().any(|m| m.alpha_mode() == AlphaMode::Mask));
    assert!(materials.iter().any(|m| m.alpha_mode() == AlphaMode::Blend));
    assert!(gltf.meshes().flat_map(|m| m.primitives()).any(|p| p.get(&gltf::Semantic::Colors(0)).is_some()));
    let lights: Vec<_> = gltf.lights().unwrap().collect();
    assert!(lights.iter().any(|light| light.extras().as_ref().is_some_and(|e| e.get().contains("radius"))));
    assert_eq!(lights.len(), 2);
    assert_eq!(gltf.animations().len(), 1);
    assert_eq!(gltf.cameras().filter_map(|camera| camera.name()).collect::<Vec<_>>(), ["gallery", "spheres"]);
}

#[test]
fn the_demo_moves_all_that_can_move() {
    let gltf = parse("demo.glb");
    let animation = gltf.animations().next().unwrap();
    assert_eq!((gltf.animations().len(), gltf.skins().len(), animation.name()), (1, 5, Some("demo")));
    use gltf::animation::Property::{MorphTargetWeights, Rotation, Translation};
    let moves = |name: &str, property| {
        animation.channels().any(|channel| {
            let target = channel.target();
            target.node().name() == Some(name) && target.property() == property
        })
    };
    assert!(moves("door", Rotation) && moves("amber lamp", Translation) && moves("rolling light", Translation));
    assert!(moves("clay ball", MorphTargetWeights) && moves("joint", Rotation));
    assert!(moves("flight", Rotation) && moves("flight", Translation));
    assert!(gltf.materials().any(|m| m.transmission().is_some()));
    assert!(
        gltf.materials().any(|m| m.pbr_metallic_roughness().roughness_factor() == 0.0 && m.name() == Some("mirror"))
    );

    let scene = Scene::load_glb("demo", twobounce::assets::demo().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(f64::from(scene.animations[0].duration), twobounce::assets::DEMO_S);
    let nodes = |time| scene.pose(Some(0), time);
    // The door stands still for a second, and is open after four.
    let turned =
        |time| nodes(time).world_from_instance.iter().map(|m| m.transform_vector3(glam::DVec3::Z)).collect::<Vec<_>>();
    let door = turned(0.0)
        .iter()
        .zip(turned(4.0))
        .filter(|(a, b)| (a.angle_between(*b).to_degrees() - 104.0).abs() < 0.1)
        .count();
    assert_eq!(door, 1);
}

/// The loader accepts every scene without a warning, and the gallery has the intended bounds and animation.
#[test]
fn the_loader_reads_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let load = |name: &str| Scene::load(&folder.join(name), &LoadOptions::default()).unwrap();
    for (name, _) in scenes() {
        assert_eq!(load(name).warnings, [] as [String; 0], "{name}");
    }
    let gallery = load("gallery.glb");
    assert_eq!(gallery.lights.iter().map(|light| light.radius).fold(0.0, f32::max), 0.06);
    // The knot rotates inside the room, so the room's corners are the bounds at all times.
    let bounds = gallery.bounds(Some(0));
    assert!((bounds.min - glam::dvec3(-1.7, 0.0, -2.1)).length() < 1e-5, "{bounds:?}");
    assert!((bounds.max - glam::dvec3(1.7, 2.5, 2.15)).length() < 1e-5, "{bounds:?}");
    let turned = |time: f32| gallery.pose(Some(0), time).world_from_instance;
    let moved = turned(0.0).iter().zip(turned(0.5)).filter(|(a, b)| !a.abs_diff_eq(*b, 1e-9)).count();
    assert_eq!(moved, 1, "one object moves");
    // One rotation in the two seconds of the loop.
    assert!(turned(0.0).iter().zip(turned(2.0)).all(|(a, b)| a.abs_diff_eq(b, 1e-5)));
}
