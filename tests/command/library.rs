//! Pictures by one call of the library: their bytes, notes and refusals equal the command's.

use std::path::Path;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};

use glam::{DVec3, Vec3};
use twobounce::output::display::ToneMap;
use twobounce::renderer::{Context, ContextOptions};
use twobounce::{Aov, Error, Noise, Options, PathTracing, Scene, Sky, Viewpoint, When, path_trace, render};

use crate::cli_common::{Folder, root, text};

/// Small, rough pictures on a device with validation.
fn small(preset: &str) -> Options {
    let mut options = Options::preset(preset).unwrap();
    options.size = (48, 32);
    options.validation = true;
    options.noise = Some(Noise::AtMost(0.1));
    options.set("voxels=16").unwrap();
    options
}

/// With options the library writes the bytes that the command writes with flags, as an .exr and as a .png, and the same
/// number of notes.
fn are_equal(scene: &Path, preset: &str, flags: &[&str], change: impl Fn(&mut Options)) {
    let folder = Folder::empty();
    let scene_words = scene.display().to_string();
    let preset_flag = format!("--preset={preset}");
    let common = ["render", &scene_words, &preset_flag, "--size=48x32", "--set=voxels=16", "--validation"];
    let mut options = small(preset);
    change(&mut options);
    let image = render(&Scene::open(scene).unwrap(), &options).unwrap();
    let is_shown = |flag: &&&str| flag.starts_with("--tonemap") || flag.starts_with("--exposure");
    for (name, own) in [("a.png", "b.png"), ("a.exr", "b.exr")] {
        let mut args = common.to_vec();
        args.extend(flags.iter().filter(|flag| name == "a.png" || !is_shown(flag)));
        args.extend(["--noise=10", "-o", name]);
        if name == "a.exr" && !options.layers.is_empty() {
            args.push("--aov=depth,albedo");
        }
        let said = folder.run(&args);
        assert!(said.status.success(), "{args:?}: {}", text(&said.stderr));
        image.save(folder.path(own)).unwrap();
        let [theirs, ours] = [name, own].map(|name| std::fs::read(folder.path(name)).unwrap());
        assert!(theirs == ours, "{args:?} writes other bytes");
        if name == "a.png" {
            let notes: Vec<String> = text(&said.stderr).lines().map(str::to_owned).collect();
            assert_eq!(notes.len(), image.notes.len(), "{notes:?} {:?}", image.notes);
            image.notes.iter().zip(&notes).for_each(|(note, line)| assert!(line.ends_with(note), "{note:?} {line:?}"));
        }
    }
    assert!(image.settings.as_ref().unwrap().image.passes > 1 && image.noise.unwrap() <= 0.1);
    assert_eq!(image.shown().len(), 48 * 32);
}

#[test]
fn a_bare_model_is_framed_lit_and_refined() {
    are_equal(&root().join("tests/values/gltf/compressed/knot.glb"), "fast", &[], |_| {});
}

#[test]
fn options_are_what_flags_are() {
    let flags = ["--transparent", "--tonemap=agx", "--exposure=1", "--sky=0.2,0.3,0.5", "--fov=30"];
    let look = ["--eye=2.5,1.2,2", "--target=0,1,0"];
    are_equal(&root().join("assets/stairs.glb"), "balanced", &[&flags[..], &look].concat(), |options| {
        options.transparent = true;
        (options.tone, options.exposure_ev) = (ToneMap::Agx, Some(1.0));
        options.layers = vec![Aov::Albedo, Aov::Depth];
        options.stage.sky = Sky::Even(Vec3::new(0.2, 0.3, 0.5));
        options.stage.fov_degrees = Some(30.0);
        let (eye, target) = (DVec3::new(2.5, 1.2, 2.0), DVec3::new(0.0, 1.0, 0.0));
        options.stage.viewpoint = Viewpoint::LookAt { eye, target, up: DVec3::Y };
    });
}

/// Each is an error of one sentence, not a panic.
#[test]
fn options_that_make_no_sense_are_refused() {
    let scene = Scene::open(root().join("assets/cornell-point.glb")).unwrap();
    let context = Context::new(&ContextOptions { device: None, validation: true }).unwrap();
    type Change = fn(&mut Options);
    let cases: [(&str, Change); 15] = [
        ("1 to 16384", |o| o.size = (0, 8)),
        ("1 to 16384", |o| o.size = (8, 20_000)),
        ("between -60 and 60", |o| o.exposure_ev = Some(f32::NAN)),
        ("must be above 0", |o| o.noise = Some(Noise::AtMost(f64::NAN))),
        ("between 0 and 180", |o| o.stage.fov_degrees = Some(180.0)),
        ("at least 0", |o| o.stage.time_s = f64::INFINITY),
        ("at least 0", |o| o.stage.sky = Sky::Even(Vec3::splat(-1.0))),
        ("turns a map", |o| o.stage.sky_rotation_degrees = 5.0),
        ("both give a sky", |o| {
            (o.stage.sky, o.stage.default_light) = (Sky::Even(Vec3::ONE), When::On);
        }),
        ("same point", |o| {
            o.stage.viewpoint = Viewpoint::LookAt { eye: DVec3::ONE, target: DVec3::ONE, up: DVec3::Y };
        }),
        ("camera", |o| o.stage.viewpoint = Viewpoint::OfFile("nobody".into())),
        ("image.samples", |o| o.settings.image.samples = 77),
        ("image.passes", |o| o.settings.image.passes = 0),
        ("voxels", |o| o.settings.voxels = 0),
        ("lights.lamp_points", |o| o.settings.lights.lamp_points = u32::MAX),
    ];
    for (words, change) in cases {
        let mut options = small("fast");
        options.context = Some(context.clone());
        change(&mut options);
        let error = render(&scene, &options).map(drop).unwrap_err();
        assert!(matches!(error, Error::Usage(_)) && error.to_string().contains(words), "{words}: {error}");
    }
    assert!(small("fast").set("voxels=7").is_err() && Options::preset("fastest").is_err());
}

#[test]
fn a_picture_tells_how_far_it_is_and_ends_when_asked_to() {
    let scene = Scene::open(root().join("assets/cornell-area.glb")).unwrap();
    let (cancel, told) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(vec![])));
    let mut options = small("fast");
    options.noise = None;
    options.cancel = Some(cancel.clone());
    options.progress = Some(Arc::new({
        let (cancel, told) = (cancel.clone(), told.clone());
        move |progress| {
            told.lock().unwrap().push(progress);
            cancel.store(progress.has == 3, Ordering::Relaxed);
        }
    }));
    assert!(matches!(render(&scene, &options), Err(Error::Interrupted)));
    let told: Vec<_> = told.lock().unwrap().clone();
    assert_eq!(told.iter().map(|progress| progress.has).collect::<Vec<_>>(), [0, 1, 2, 3]);
    assert!(told[1].needed.is_none() && told[3].needed > Some(3), "{told:?}");
    // The call refuses at once, before any work.
    cancel.store(true, Ordering::Relaxed);
    let passes = Arc::new(AtomicU32::new(0));
    options.progress = Some(Arc::new({
        let passes = passes.clone();
        move |_| {
            passes.fetch_add(1, Ordering::Relaxed);
        }
    }));
    assert!(matches!(render(&scene, &options), Err(Error::Interrupted)));
    assert_eq!(passes.load(Ordering::Relaxed), 0);
}

#[test]
fn a_file_of_an_unknown_kind_is_not_written() {
    let scene = Scene::open(root().join("assets/cornell-point.glb")).unwrap();
    let mut options = small("fast");
    (options.noise, options.transparent) = (Some(Noise::Off), true);
    let image = render(&scene, &options).unwrap();
    let folder = Folder::empty();
    for (name, words) in [("a.gif", "unknown ending"), ("a.jpg", "transparent"), ("missing/a.png", "missing")] {
        let error = image.save(folder.path(name)).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
        assert!(!folder.path(name).exists());
    }
    assert!(Scene::open(folder.path("nothing.glb")).is_err());
}

#[test]
fn a_traced_picture_is_the_references() {
    let scene = root().join("assets/cornell-area.glb");
    let folder = Folder::empty();
    let words = scene.display().to_string();
    folder.done(&[
        "reference",
        &words,
        "-o=a.exr",
        "--size=48x32",
        "--spp=16",
        "--depth=full",
        "--seed=3",
        "--aov=ao,direct",
    ]);
    let options = Options { size: (48, 32), layers: vec![Aov::Ao, Aov::Direct], ..Options::default() };
    let how = PathTracing { bounces: None, samples: Some(16), seed: 3, ..PathTracing::default() };
    let opened = Scene::open(&scene).unwrap();
    let truth = path_trace(&opened, &options, &how, &|_| {}).unwrap();
    truth.save(folder.path("b.exr")).unwrap();
    let [theirs, ours] = ["a.exr", "b.exr"].map(|name| std::fs::read(folder.path(name)).unwrap());
    assert!(theirs == ours, "other bytes than the command's");
    // A picture is compared as `twobounce compare` does.
    let mut rendered = small("fast");
    rendered.layers = vec![Aov::Direct];
    let image = render(&opened, &rendered).unwrap();
    image.save(folder.path("image.exr")).unwrap();
    folder.done(&["compare", "image.exr", "a.exr", "--json=a.json"]);
    let compared = image.compare(&truth).unwrap();
    assert_eq!(folder.json("a.json")["total"]["rel"].as_f64(), Some(compared.total.rel));
    assert_eq!(folder.json("a.json")["indirect"]["rel"].as_f64(), compared.indirect.map(|indirect| indirect.rel));
    assert!(compared.indirect.is_some() && compared.total.rel < 0.2);
    for how in [PathTracing { samples: Some(1), ..how.clone() }, PathTracing { noise: 0.0, ..how.clone() }] {
        assert!(matches!(path_trace(&opened, &options, &how, &|_| {}), Err(Error::Usage(_))));
    }
}
