//! A frame contains only what its scene needs: no empty pass, no bytes or pipelines that no pass uses, and no pass for
//! features that the scene lacks.

use crate::gpu;
use crate::kinds;
use crate::more;
use crate::studio::asset;

use twobounce::profile::audit::{Audit, PLACEHOLDER};
use twobounce::renderer::RenderOptions;
use twobounce::scene::{Scene, Still, View};
use twobounce::settings::{PRESETS, Settings};

fn audit(scene: &Scene, settings: &Settings) -> Audit {
    let context = gpu::context();
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
    let options = RenderOptions::new((16, 16), bounds);
    let audit = Audit::of_frame(&context, Still::new(scene, &pose, &view), settings, options).unwrap();
    gpu::assert_clean(&context);
    audit
}

fn settings(preset: &str, changes: &[&str]) -> Settings {
    let mut settings = Settings::preset(preset).unwrap();
    ["voxels=16"].iter().chain(changes).for_each(|change| settings.set(change).unwrap());
    settings
}

#[test]
fn nothing_runs_or_is_taken_that_nothing_asks_for() {
    let scene = asset("cornell-point.glb");
    let presets = PRESETS.iter().map(|preset| (preset.name, vec![]));
    let others =
        [("fast", vec!["method=none"]), ("fast", vec!["bounces=1"]), ("fast", vec!["bounces=all", "rays.passes=0"])];
    // Of 14 entries.
    for (preset, changes) in more::every(3, presets.chain(others)) {
        let audit = audit(&scene, &settings(preset, &changes));
        let superfluous = audit.superfluous();
        assert!(superfluous.is_empty(), "{preset} {changes:?}: {superfluous:?}");
    }
}

/// Each object added to a scene adds only what it needs to the frame: its own passes, and bytes of its own kind.
#[test]
fn what_a_scene_has_adds_what_it_asks_for() {
    const THING: [&str; 12] = [
        "materials",
        "record draws",
        "scene indices",
        "scene vertices",
        "slots",
        "tree boxes",
        "tree links",
        "triangles",
        "triangles' attributes",
        // Where the device traces rays.
        "query corners",
        "acceleration structure",
        "acceleration scratch",
    ];
    let own = |name: &str| -> &[&str] {
        match name {
            "map of the sky" => &["frame"],
            "map with a sun" => &["frame", "lights"],
            "sun" => &["lights"],
            "lamp" => &["lamps", "lamp nodes"],
            "blending" => &["blended triangles", "blended fragments", "visibility", "gathered light"],
            "metal" => &["item lobes", "gathered light"],
            "glass" | "mask" | "no light" | "even sky alone" | "sky with a gradient" => &[],
            other => panic!("{other} is not known here"),
        }
    };
    // 0 where the resource does not exist.
    let bytes = |audit: &Audit, name: &str| audit.resources.iter().find(|other| other.name == name).map(|r| r.bytes);
    let plain = asset("cornell-point.glb");
    let before = audit(&plain, &settings("fast", &[]));
    for scene in more::every(2, kinds::kinds(&plain)) {
        let audit = audit(&scene, &settings("fast", &[]));
        let superfluous = audit.superfluous();
        assert!(superfluous.is_empty(), "{}: {superfluous:?}", scene.name);
        let names = |audit: &Audit| audit.passes.iter().map(|pass| pass.name).collect::<Vec<_>>();
        assert_eq!(names(&audit), names(&before), "{}", scene.name);
        let thing = scene.meshes.len() > plain.meshes.len();
        for resource in &audit.resources {
            let bytes = bytes(&before, resource.name);
            let asked = own(&scene.name).contains(&resource.name) || (thing && THING.contains(&resource.name));
            assert!(
                asked || Some(resource.bytes) == bytes,
                "{}: {} has {} bytes, was {bytes:?}",
                scene.name,
                resource.name,
                resource.bytes
            );
        }
        for name in own(&scene.name) {
            assert!(bytes(&audit, name) > bytes(&before, name), "{}: {name} is as before", scene.name);
        }
        // Blended surfaces are drawn, listed, sorted and shaded by pipelines of their own. Fragments that reflect or
        // transmit light along lobes are shaded by one more.
        let further = match scene.name.as_str() {
            "blending" => 4,
            "metal" | "glass" => 1,
            _ => 0,
        };
        assert_eq!(
            audit.used.len(),
            before.used.len() + further,
            "{}: {:?}",
            scene.name,
            audit.used.difference(&before.used)
        );
    }
}

/// Skins and morph targets add their pass, and nothing that no pass uses.
#[test]
fn a_scene_that_deforms_has_one_pass_more() {
    let demo = asset("demo.glb");
    for preset in ["fast", "photons"] {
        let audit = audit(&demo, &settings(preset, &[]));
        let superfluous = audit.superfluous();
        assert!(superfluous.is_empty(), "{preset}: {superfluous:?}");
        assert_eq!(audit.passes.iter().filter(|pass| pass.name == "deform").count(), 1, "{preset}");
    }
    let still = audit(&asset("cornell-point.glb"), &settings("fast", &[]));
    assert!(still.passes.iter().all(|pass| pass.name != "deform"));
}

/// A scene without lamps, skins, blending and sky has none of their passes and resources.
#[test]
fn a_plain_box_has_the_passes_of_a_plain_box() {
    let plain = audit(&asset("cornell-point.glb"), &settings("fast", &[]));
    let names: Vec<&str> = plain.passes.iter().map(|pass| pass.name).collect();
    let expected = [
        "reset",
        "record",
        "tree",
        "voxelise",
        "cells",
        "group",
        "ask",
        "split",
        "shade 1",
        "shade 2",
        "visibility",
        "gather",
        "image",
    ];
    assert_eq!(names, expected);
    let bytes = |name: &str| plain.resources.iter().find(|resource| resource.name == name).unwrap().bytes;
    for name in [
        "lamps",
        "lamp nodes",
        "blended triangles",
        "item samples",
        "item lobes",
        "last list items",
        "last voxel cells",
    ] {
        assert!(bytes(name) <= PLACEHOLDER, "{name}: {} bytes", bytes(name));
    }
    // Direct light alone needs the triangles, their tree and the image.
    let direct = audit(&asset("cornell-point.glb"), &settings("fast", &["method=none"]));
    let names: Vec<&str> = direct.passes.iter().map(|pass| pass.name).collect();
    assert_eq!(names, ["reset", "record", "tree", "visibility", "image"]);
    let dark = audit(
        &asset("cornell-point.glb"),
        &settings("fast", &["method=none", "lights.shadows=none", "lights.lamps=gathered"]),
    );
    assert!(dark.passes.iter().all(|pass| pass.name != "tree"), "{:?}", dark.passes);
    assert!(dark.bytes() < direct.bytes());
}
