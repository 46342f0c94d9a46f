//! Edges of shadows are as smooth as edges of surfaces: both are compared with the exact share of each pixel.

use crate::gpu;

use glam::{DAffine3, DQuat, DVec2, DVec3, Vec3};
use twobounce::layers::Aov;
use twobounce::scene::{LightKind, Material, Mesh, Projection, Scene, View};
use twobounce::settings::Settings;

const SIZE: u32 = 48;
/// The image's side in metres.
const HALF: f64 = 1.0;
/// The edge goes through the image's middle at this angle, so that it cuts pixels in all ways.
const TURN: f64 = 0.37;

fn quad(scene: &mut Scene, height: f32, half: bool) {
    let white = scene.add_material(Material { double_sided: true, ..Material::lambert("white", Vec3::splat(0.8)) });
    let (corner, depth) = (Vec3::new(-4.0, height, -4.0), if half { 4.0 } else { 8.0 });
    let mesh = Mesh::quad("quad", white, corner, Vec3::Z * depth, Vec3::X * 8.0);
    scene.add_mesh(mesh, DAffine3::from_quat(DQuat::from_rotation_y(TURN)));
}

/// A light from above, and either the edge of a floor or the edge of a shadow on a larger floor.
fn scene(shadow: bool) -> Scene {
    let mut scene = Scene::empty("edge");
    quad(&mut scene, 0.0, !shadow);
    if shadow {
        quad(&mut scene, 1.0, true);
    }
    let down = DAffine3::from_quat(DQuat::from_rotation_arc(DVec3::NEG_Z, DVec3::NEG_Y));
    scene.add_light(LightKind::Directional, Vec3::splat(3.0), down);
    scene
}

/// The share of each pixel on the side of the edge where z < 0 before the turn.
fn shares() -> Vec<f64> {
    const FINE: u32 = 32;
    let center = |i: u32| (f64::from(i) + 0.5) / f64::from(SIZE * FINE) * 2.0 * HALF - HALF;
    // Right is −x and down −z: the camera looks down and its up is +z.
    let inside = |x: u32, y: u32| DVec2::new(-center(x), -center(y)).dot(DVec2::new(TURN.sin(), TURN.cos())) < 0.0;
    let share = |pixel: u32| {
        let (x, y) = (pixel % SIZE * FINE, pixel / SIZE * FINE);
        let fine = (0..FINE * FINE).filter(|i| inside(x + i % FINE, y + i / FINE)).count();
        fine as f64 / f64::from(FINE * FINE)
    };
    (0..SIZE * SIZE).map(share).collect()
}

/// Root mean square of the error of the pixels that the edge cuts, as a share of a whole pixel's light.
fn error(shadow: bool, preset: &str) -> f64 {
    // Direct light is equal with every method.
    let settings = gpu::with(Settings::preset(preset).expect("a preset"), &["method=none", "voxels=16"]);
    let projection = Projection::Orthographic { half_height: HALF as f32, near: 0.01, far: 10.0 };
    let view = View { eye: DVec3::Y * 0.5, forward: DVec3::NEG_Y, up: DVec3::Z, projection };
    let renderer = gpu::render_layers(&gpu::context(), &scene(shadow), &settings, SIZE, view, vec![Aov::Direct]);
    let image = renderer.read();
    let direct = image.get(Aov::Direct).expect("asked for");
    let whole = 3.0 * 0.8 / std::f64::consts::PI;
    let found = direct.iter().map(|p| f64::from(p[1]) / whole);
    let lit = |share: f64| if shadow { 1.0 - share } else { share };
    let (mut sum, mut cut) = (0.0, 0);
    for (found, share) in found.zip(shares()) {
        let off = found - lit(share);
        if share > 0.0 && share < 1.0 {
            (sum, cut) = (sum + off * off, cut + 1);
        } else {
            assert!(off.abs() < 2e-3, "{preset}: {off} beside the edge"); // f16
        }
    }
    assert!(cut > SIZE as usize, "{cut} pixels are cut");
    (sum / f64::from(cut as u32)).sqrt()
}

#[test]
fn a_shadows_edge_is_as_smooth_as_a_surfaces() {
    for preset in ["balanced", "fast", "accurate", "cones", "lpv", "photons"] {
        let [surface, shadow] = [false, true].map(|shadow| error(shadow, preset));
        // Four samples a pixel; `fast` has one.
        let most = if preset == "fast" { 0.35 } else { 0.15 };
        assert!(surface < most, "{preset}: a surface's edge is off by {surface}");
        // The hardware snaps a surface's corners to 1/256 of a pixel, a ray does not.
        assert!(shadow < surface + 0.01, "{preset}: a shadow's edge is off by {shadow}, a surface's by {surface}");
    }
}
