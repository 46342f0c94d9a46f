//! No access of a frame leaves a buffer: a device that checks accesses gives the same bits as one that does not.

use twobounce::scene::{LoadOptions, Scene};
use twobounce::settings::{PRESETS, Settings};
use twobounce::vk::{Features, required_features};

use crate::gpu::{render_from, with};
use crate::more::every;
use crate::vk_common::Host;

/// The bits of a frame of the gallery, which has lamps, blended surfaces, mirrors and textures, on a device with these
/// features.
fn bits(settings: &Settings, features: Features) -> Vec<[u32; 3]> {
    let host = Host::enabling(features);
    let context = host.adopt(|_| ()).expect("everything is enabled");
    let gallery = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/gallery.glb");
    let scene = Scene::load(gallery.as_ref(), &LoadOptions::default()).expect("a scene");
    let view = scene.view(&scene.pose(None, 0.0), 0);
    let renderer = render_from(&context, &scene, settings, 24, view);
    let found = renderer.read().beauty().iter().map(|pixel| pixel.map(f32::to_bits)).collect();
    drop((renderer, context));
    host.close();
    found
}

#[test]
fn robust_buffer_access_changes_no_bit() {
    for preset in every(3, PRESETS) {
        let settings = with((preset.settings)(), &["voxels=16"]);
        let geometry_shader = !settings.grid.conservative.needs().is_empty();
        let features = Features { geometry_shader, ..required_features() };
        let [without, robust] =
            [false, true].map(|on| bits(&settings, Features { robust_buffer_access: on, ..features }));
        assert!(without.iter().any(|pixel| *pixel != without[0]), "{}: an image of one colour", preset.name);
        assert!(without == robust, "{}: other bits", preset.name);
    }
}
