//! `render` on any device.

use std::fs;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::cli_common::{folder, names};
use twobounce::layers::{Aov, Layers};

/// Small enough for a CPU device, and one pass over the image.
const SMALL: [&str; 7] = ["--size", "24x16", "--set", "voxels=16", "--set", "image.samples=1", "--noise=off"];

fn command(folder: &Path, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    command.current_dir(folder).arg("render").args(args).args(SMALL);
    command
}

fn render(folder: &Path, args: &[&str]) -> Output {
    command(folder, args).output().unwrap()
}

/// Standard output of a render; fails if the command fails.
fn rendered(folder: &Path, args: &[&str]) -> String {
    let output = render(folder, args);
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

fn refused(folder: &Path, args: &[&str]) -> String {
    let output = render(folder, args);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert_eq!(message.lines().filter(|line| !line.contains("note: ")).count(), 1, "{args:?}: {message}");
    message
}

fn layers(path: &Path) -> Layers {
    Layers::read_exr(path).unwrap().0
}

#[test]
fn the_same_command_writes_the_same_bytes() {
    let folder = folder();
    let at = |name: &str| fs::read(folder.path().join(name)).unwrap();
    let layers = ["--aov", "normal,depth,direct", "--preset", "printed"];
    // Another run gives the same image, and so do earlier frames of the same run, though its shadow cones are jittered.
    for (name, more) in [("a.exr", &[][..]), ("b.exr", &[]), ("repeated.exr", &["--repeat", "3"])] {
        rendered(folder.path(), &[&["scene.gltf", "-o", name], &layers[..], more].concat());
    }
    assert!(at("a.exr") == at("b.exr") && at("a.exr") == at("repeated.exr"));
    let (image, header) = Layers::read_exr(&folder.path().join("a.exr")).unwrap();
    assert_eq!((image.width, image.height), (24, 16));
    let aovs: Vec<Aov> = image.layers.iter().map(|(aov, _)| *aov).collect();
    assert_eq!(aovs, [Aov::Beauty, Aov::Direct, Aov::Normal, Aov::Depth]);
    for key in [
        "writer",
        "scene",
        "sceneHash",
        "camera",
        "time",
        "sky",
        "method",
        "settings",
        "equalTerms",
        "device",
        "driver",
    ] {
        assert!(header.contains_key(key), "the header lacks {key}");
    }
    let mut settings = twobounce::settings::Settings::default();
    settings.merge_toml(&header["settings"]).unwrap();
    assert_eq!(
        (settings.voxels, settings.of.cones.ledger),
        (16, twobounce::settings::Settings::printed().of.cones.ledger)
    );
}

#[test]
fn the_printed_exposure_gives_the_same_image() {
    let folder = folder();
    let told = rendered(folder.path(), &["scene.gltf", "-o", "auto.png", "--method", "none"]);
    let ev = told.split("(--exposure ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    rendered(folder.path(), &["scene.gltf", "-o", "same.png", "--method", "none", "--exposure", ev]);
    rendered(folder.path(), &["scene.gltf", "-o", "dark.png", "--method", "none", "--exposure=-4"]);
    let at = |name: &str| fs::read(folder.path().join(name)).unwrap();
    assert!(at("auto.png") == at("same.png"));
    assert!(at("auto.png") != at("dark.png"));
}

#[test]
fn a_sequence_is_numbered_and_reports_are_whole() {
    let folder = folder();
    let reports = ["--timings", "--json", "t.json", "--trace", "t.trace", "--submit", "pass"];
    let sequence = ["scene.gltf", "-o", "out_%03d.png", "--frames", "3", "--fps", "24", "--method", "none"];
    let told = rendered(folder.path(), &[&sequence[..], &reports].concat());
    let expected = ["other.toml", "out_000.png", "out_001.png", "out_002.png", "scene.gltf", "t.json", "t.trace"];
    assert_eq!(names(folder.path()), expected);
    for name in &expected[1..4] {
        assert_eq!(image::open(folder.path().join(name)).unwrap().to_rgb8().dimensions(), (24, 16));
    }
    let json = |name: &str| -> serde_json::Value {
        serde_json::from_slice(&fs::read(folder.path().join(name)).unwrap()).unwrap()
    };
    let report = json("t.json");
    assert_eq!((&report["frames"], &report["warm_up_frames"], &report["width"]), (&3.into(), &2.into(), &24.into()));
    assert_eq!(report["counters"]["triangles"], 1);
    let passes = report["passes"].as_array().unwrap();
    for pass in passes {
        let name = pass["name"].as_str().unwrap();
        assert!(told.lines().any(|line| line.starts_with(name)), "{name} is not in the table");
        assert!(pass["cpu_ms"]["median"].as_f64().unwrap() >= 0.0);
    }
    // Two events that name the track, 3 frames, and the passes of each. After the warm-up a frame rebuilds nothing but
    // the visible surfaces and the image.
    let trace = json("t.trace");
    let events: Vec<&str> =
        trace["traceEvents"].as_array().unwrap().iter().filter_map(|e| e["name"].as_str()).collect();
    assert_eq!(events.iter().filter(|name| **name == "image").count(), 3);
    assert_eq!(events.len(), 2 + 3 * 3 + 2 * (passes.len() - 2), "{events:?}");
    let memory = &report["memory"];
    let bytes = |key: &str| memory[key].as_f64().unwrap();
    let sizes: Vec<u64> =
        memory["resources"].as_array().unwrap().iter().map(|of| of["bytes"].as_u64().unwrap()).collect();
    assert_eq!(sizes.iter().sum::<u64>() as f64, bytes("planned_bytes"));
    // The driver rounds sizes up to 64 bytes, which is a large part of such small resources.
    let rounded: u64 = sizes.iter().map(|size| size.max(&1).next_multiple_of(64)).sum();
    assert!((bytes("allocated_bytes") / rounded as f64 - 1.0).abs() < 0.05, "{memory}");
}

#[test]
fn without_a_method_the_image_is_the_direct_layer() {
    let folder = folder();
    rendered(folder.path(), &["scene.gltf", "-o", "cones.exr", "--aov", "direct"]);
    rendered(folder.path(), &["scene.gltf", "-o", "none.exr", "--method", "none"]);
    let [cones, none] = ["cones.exr", "none.exr"].map(|name| layers(&folder.path().join(name)));
    assert_eq!(cones.get(Aov::Direct).unwrap(), none.beauty());
    assert!(none.beauty().iter().any(|p| p[0] > 0.0));
}

/// Positions are f64 until they are converted to voxels: at a distance of 10⁷ m nothing may change that 1 m in 10⁹
/// would not.
#[test]
fn a_scene_far_away_renders_as_at_home() {
    let folder = folder();
    let text = fs::read_to_string(folder.path().join("scene.gltf")).unwrap();
    let far = text.replace("{\"mesh\":0}", "{\"mesh\":0,\"translation\":[1e7,-1e7,1e7]}");
    let far = far.replace("\"translation\":[0,0,2]", "\"translation\":[10000000,-10000000,10000002]");
    fs::write(folder.path().join("far.gltf"), far).unwrap();
    for name in ["scene", "far"] {
        rendered(folder.path(), &[&format!("{name}.gltf"), "-o", &format!("{name}.exr"), "--method", "none"]);
    }
    let [home, far] = ["scene.exr", "far.exr"].map(|name| layers(&folder.path().join(name)));
    let sum = |image: &Layers| image.beauty().iter().map(|p| f64::from(p[0])).sum::<f64>();
    let apart: f64 = home.beauty().iter().zip(far.beauty()).map(|(a, b)| f64::from((a[0] - b[0]).abs())).sum();
    // f64 keeps 2·10⁻⁹ m here, which the framing camera's direction magnifies by a small factor.
    assert!(sum(&home) > 0.0 && apart <= 1e-5 * sum(&home), "they differ by {}", apart / sum(&home));
}

/// An image without surfaces is no error: it shows the sky.
#[test]
fn a_scene_without_triangles_shows_the_sky() {
    let folder = folder();
    fs::write(folder.path().join("empty.gltf"), r#"{"asset":{"version":"2.0"}}"#).unwrap();
    rendered(folder.path(), &["empty.gltf", "-o", "sky.exr", "--sky", "0.25,0.5,2", "--aov", "depth"]);
    let sky = layers(&folder.path().join("sky.exr"));
    assert!(sky.beauty().iter().all(|p| *p == [0.25, 0.5, 2.0]), "{:?}", sky.beauty()[0]);
    assert!(sky.get(Aov::Depth).unwrap().iter().all(|p| *p == [f32::INFINITY; 3]));
}

#[test]
fn a_dark_scene_gets_a_light_and_says_so() {
    let folder = folder();
    let text = fs::read_to_string(folder.path().join("scene.gltf")).unwrap();
    fs::write(folder.path().join("dark.gltf"), text.replace("\"nodes\":[0,1]", "\"nodes\":[0]")).unwrap();
    let brightness = |flags: &[&str], said: &str| {
        let args = [&["dark.gltf", "-o", "dark.exr", "--method", "none"], flags].concat();
        let output = render(folder.path(), &args);
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success() && message.lines().count() == 1 && message.contains(said), "{message}");
        layers(&folder.path().join("dark.exr")).beauty().iter().map(|p| p[1]).sum::<f32>()
    };
    assert!(brightness(&[], "added a studio: softboxes, a directional light") > 0.0);
    assert_eq!(brightness(&["--default-light", "off"], "will be black"), 0.0);
}

#[test]
fn too_little_memory_is_refused_with_the_grid_that_fits() {
    let folder = folder();
    let limited = ["scene.gltf", "-o", "a.png", "--method", "cones", "--memory-limit", "40MiB", "--set", "voxels=128"];
    // The last --set wins, and SMALL comes last; this one concerns a grid of 128.
    let output = Command::new(env!("CARGO_BIN_EXE_twobounce"))
        .current_dir(folder.path())
        .arg("render")
        .args(limited)
        .args(["--size", "24x16"])
        .output()
        .unwrap();
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains("voxels=64") && message.contains("--memory-limit"), "{message}");
    assert_eq!(names(folder.path()), ["other.toml", "scene.gltf"]);
}

/// As [`folder`], with a scene oak.gltf whose texture oak.png does not exist yet.
fn folder_of_oak() -> tempfile::TempDir {
    let folder = folder();
    let text = fs::read_to_string(folder.path().join("scene.gltf")).unwrap();
    let parts = r#""images":[{"uri":"oak.png"}],"textures":[{"source":0}],"materials":[{"emissiveTexture":{"index":0}}],"scenes""#;
    let text = text.replace("\"scenes\"", parts).replace("{\"attributes\"", "{\"material\":0,\"attributes\"");
    fs::write(folder.path().join("oak.gltf"), text).unwrap();
    folder
}

#[test]
fn textures_larger_than_the_devices_memory_are_refused_before_they_are_decoded() {
    let folder = folder_of_oak();
    image::RgbImage::new(1024, 1024).save(folder.path().join("oak.png")).unwrap();
    let message = refused(folder.path(), &["oak.gltf", "-o", "a.png", "--memory-limit", "5MiB", "--method", "none"]);
    assert!(message.contains("1.0 million texels, which need 6 MiB on the device"), "{message}");
    assert!(message.contains("more than the --memory-limit of 5 MiB: use smaller textures"), "{message}");
    assert_eq!(names(folder.path()), ["oak.gltf", "oak.png", "other.toml", "scene.gltf"]);
}

#[test]
fn textures_are_scaled_down_on_demand() {
    let folder = folder_of_oak();
    image::RgbImage::from_fn(1024, 512, |x, _| image::Rgb([(x / 4) as u8; 3]))
        .save(folder.path().join("oak.png"))
        .unwrap();
    let said = |args: &[&str]| {
        let fixed = ["oak.gltf", "-o", "a.png", "--method", "none", "--memory-limit", "5MiB"];
        let output = render(folder.path(), &[&fixed[..], args].concat());
        (output.status.code(), String::from_utf8(output.stderr).unwrap())
    };
    let (code, text) = said(&["--max-texture", "300"]);
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("1 images were halved until they had at most 300 texels a side"), "{text}");
    let (code, text) = said(&["--max-texture", "1024"]);
    assert!(code == Some(0) && !text.contains("halved"), "{text}");
}

/// Pipes carry the bytes that files hold, and nothing else.
#[test]
fn scenes_and_results_go_through_pipes() {
    let folder = folder();
    let fixed = ["--method", "none"];
    rendered(folder.path(), &[&["scene.gltf", "-o", "a.png"], &fixed[..]].concat());
    let piped = |args: &[&str]| {
        let scene = fs::File::open(folder.path().join("scene.gltf")).unwrap();
        let output = command(folder.path(), &[args, &fixed[..]].concat()).stdin(scene).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
        output
    };
    let image = piped(&["-", "-o", "-"]);
    assert_eq!(image.stdout, fs::read(folder.path().join("a.png")).unwrap());
    assert!(String::from_utf8_lossy(&image.stderr).contains("wrote standard output"));
    assert!(piped(&["-", "-o", "-", "--aov", "direct"]).stdout.starts_with(&[0x76, 0x2f, 0x31, 0x01]), "an .exr");
    let report: serde_json::Value =
        serde_json::from_slice(&piped(&["-", "-o", "b.png", "--json", "-"]).stdout).unwrap();
    assert_eq!(report["scene"]["name"].as_str().or(report["scene"].as_str()), Some("stdin"), "{report}");
    let message = refused(folder.path(), &["scene.gltf", "-o", "-", "--json", "-"]);
    assert!(message.contains("two outputs"), "{message}");
    assert_eq!(names(folder.path()), ["a.png", "b.png", "other.toml", "scene.gltf"]);
}

#[test]
fn a_field_of_view_changes_the_camera_that_frames_the_scene() {
    let folder = folder();
    let said = rendered(folder.path(), &["scene.gltf", "-o", "a.png", "--method", "none", "--fov", "20"]);
    assert!(said.contains("camera framing the scene fov 20"), "{said}");
}

/// No bit of the image depends on how the work of a frame is submitted.
#[test]
fn short_submissions_give_the_same_image() {
    let folder = folder();
    let image = |output: &str, submit: &str| {
        let args = ["--preset", "fast", "--set", "voxels=16", "--submit", submit];
        rendered(folder.path(), &[&["scene.gltf", "-o", output, "--timings"], &args[..]].concat());
        fs::read(folder.path().join(output)).unwrap()
    };
    assert!(image("short.png", "short") == image("frame.png", "frame"));
}

#[test]
fn an_unknown_device_is_refused_with_those_there_are() {
    let folder = folder();
    let message = refused(folder.path(), &["scene.gltf", "-o", "a.png", "--device", "Voodoo 2"]);
    assert!(message.contains("Voodoo 2") && message.contains("0: "), "{message}");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_leaves_no_half_image() {
    let folder = folder();
    std::os::unix::fs::symlink("/dev/full", folder.path().join("full.png")).unwrap();
    let message = refused(folder.path(), &["scene.gltf", "-o", "full.png", "--method", "none"]);
    assert!(message.contains("full.png") && message.contains("the disk is full"), "{message}");
    assert_eq!(names(folder.path()), ["full.png", "other.toml", "scene.gltf"]);
}

/// An unfinished image is not written, and the exit code tells the signal.
#[cfg(unix)]
#[test]
fn signals_end_a_long_frame_soon() {
    let folder = folder();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/gallery.glb");
    let before = names(folder.path());
    for (signal, code) in [("-TERM", 143), ("-HUP", 129), ("-INT", 130)] {
        // A program inherits the ignored signals of its caller, such as `nohup` or a shell's background job.
        let mut command = Command::new("env");
        command.args(["--default-signal", env!("CARGO_BIN_EXE_twobounce")]);
        command.args(["render", scene, "-o", "a.png", "--size", "4096x4096", "--preset", "accurate"]);
        let mut child =
            command.current_dir(folder.path()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let mut lines = BufReader::new(child.stdout.take().unwrap()).lines().map_while(Result::ok);
        assert!(lines.by_ref().any(|line| line.contains("triangles")), "it never began");
        std::thread::sleep(Duration::from_secs(3));
        let start = Instant::now();
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        // This is the program's last output. The rest is the system's part, which takes long where a driver's thread of
        // lowest priority must end.
        let mut said = BufReader::new(child.stderr.take().unwrap()).lines().map_while(Result::ok);
        assert!(said.any(|line| line == "twobounce: interrupted"));
        assert!(start.elapsed() < Duration::from_secs(2), "{signal} took {:?}", start.elapsed());
        assert_eq!(child.wait().unwrap().code(), Some(code));
        assert_eq!(names(folder.path()), before);
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_tidily_with_130() {
    let folder = folder();
    let args = ["scene.gltf", "-o", "out_%05d.png", "--frames", "99999", "--method", "none"];
    let mut child = command(folder.path(), &args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert!(lines.by_ref().map_while(Result::ok).any(|line| line.starts_with("wrote")), "no frame was written");
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let wrote = 1 + lines.map_while(Result::ok).filter(|line| line.starts_with("wrote")).count();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert!(String::from_utf8_lossy(&output.stderr).ends_with("twobounce: interrupted\n"));
    let images = names(folder.path()).len() - 2;
    assert_eq!(images, wrote, "every image that was announced is there, and nothing else");
    for name in names(folder.path()).iter().filter(|name| name.ends_with(".png")) {
        image::open(folder.path().join(name)).unwrap();
    }
}

/// Messages about an image that shows none of the scene.
fn said_of(folder: &Path, flags: &[&str]) -> String {
    // With --quiet: a slow run would print a line of progress.
    let output = render(folder, &[&["scene.gltf", "-q", "-o", "a.png"], flags].concat());
    assert_eq!(output.status.code(), Some(0));
    String::from_utf8(output.stderr).unwrap()
}

#[test]
fn an_image_that_shows_nothing_says_why() {
    let folder = folder();
    let path = folder.path();
    assert_eq!(said_of(path, &[]), "", "it shows something");
    let away = said_of(path, &["--eye", "0,0,50", "--target", "0,0,60"]);
    assert!(away.contains("behind the camera"), "{away}");
    let aside = said_of(path, &["--eye", "0,0,50", "--target", "60,0,49"]);
    assert!(aside.contains("outside the camera's view"), "{aside}");
    let dark = said_of(path, &["--exposure=-40"]);
    assert!(dark.contains("black with --exposure -40"), "{dark}");
    let white = said_of(path, &["--exposure", "40"]);
    assert!(white.contains("white with --exposure 40"), "{white}");
    fs::write(path.join("empty.gltf"), r#"{"asset":{"version":"2.0"}}"#).unwrap();
    let empty = String::from_utf8(render(path, &["empty.gltf", "-o", "a.png"]).stderr).unwrap();
    assert!(empty.contains("no triangles"), "{empty}");
}

#[test]
fn the_memory_plan_is_printed_where_it_is_asked_for() {
    let folder = folder();
    let at = |flags: &[&str]| rendered(folder.path(), &[&["scene.gltf", "-o", "a.png"], flags].concat());
    assert!(!at(&[]).contains("memory plan") && at(&[]).contains("wrote a.png"));
    assert!(at(&["-v"]).contains("memory plan:") && at(&["--timings"]).contains("memory plan:"));
    assert_eq!(at(&["-q"]), "");
}
