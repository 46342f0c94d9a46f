//! Properties of every loaded scene, whatever its file.

use twobounce::scene::surface::SurfacePoint;
use twobounce::scene::texture::Textures;
use twobounce::scene::{Scene, View};

/// Fails unless the parts of a scene fit together and its numbers are in the ranges that renderers expect.
pub fn assert_valid(scene: &Scene) {
    scene.check().expect("what the loader made");
    for mesh in &scene.meshes {
        assert!(mesh.uvs.iter().flatten().all(|uv| uv.is_finite()));
        // Rounding of a normalisation in f32.
        assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5));
        assert!(mesh.tangents.iter().all(|t| (t.truncate().length() - 1.0).abs() < 1e-5 && t.w.abs() == 1.0));
    }
    let textures = Textures::of_materials(scene, &scene.materials);
    let point = SurfacePoint { uvs: [glam::Vec2::splat(0.3); 2], color: glam::Vec4::ONE, footprint: [0.1; 2] };
    for material in &scene.materials {
        material.evaluate(scene, &textures, &point);
    }
    let pose = scene.pose((!scene.animations.is_empty()).then_some(0), 0.5);
    assert_eq!(pose.world_from_instance.len(), scene.instances.len());
    (0..scene.cameras.len()).for_each(|camera| assert!(scene.view(&pose, camera).forward.is_normalized()));
    scene.degenerate_triangles(&pose);
    let bounds = scene.bounds(None);
    assert!(bounds.size().is_finite() && View::framing(bounds).eye.is_finite());
}
