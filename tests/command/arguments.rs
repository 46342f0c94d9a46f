//! The command line through the built program, without a GPU.

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use crate::cli_common::{folder, names};

fn twobounce(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    // No Vulkan driver is found, so that nothing here depends on the machine's devices.
    command.env("VK_DRIVER_FILES", "/none").env("VK_ICD_FILENAMES", "/none").env_remove("TWOBOUNCE_DEVICE");
    command.current_dir(folder).args(args).output().unwrap()
}

/// Fails unless the command exits with 2, prints exactly one sentence that contains all `parts`, and leaves no file.
fn refused(folder: &Path, args: &[&str], parts: &[&str]) {
    let before = names(folder);
    let output = twobounce(folder, args);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert!(message.starts_with("twobounce: ") && message.trim_end().lines().count() == 1, "{args:?}: {message}");
    assert!(parts.iter().all(|part| message.contains(part)), "{args:?} should say {parts:?}: {message}");
    assert_eq!(names(folder), before, "{args:?} left something behind");
}

fn effective(folder: &Path, args: &[&str]) -> String {
    let output = twobounce(folder, &[&["settings", "--toml"], args].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

/// The preset applies first, then the file, then keys, wherever they stand on the line; of equal keys the last one
/// wins.
#[test]
fn settings_win_in_the_stated_order() {
    let folder = folder();
    let printed = effective(folder.path(), &["--preset", "printed"]);
    assert!(printed.contains("voxels = 128\n") && printed.contains("cones.ledger.d1 = \"printed\"\n"));
    for order in [
        ["--preset", "printed", "--config", "other.toml", "--set", "voxels=16", "--set", "voxels=64"],
        ["--set", "voxels=16", "--set", "voxels=64", "--config", "other.toml", "--preset", "printed"],
    ] {
        let all = effective(folder.path(), &order);
        assert_eq!(
            all,
            printed.replace("voxels = 128\n", "voxels = 64\n").replace("cones.set = \"5\"", "cones.set = \"16\"")
        );
    }
    fs::write(folder.path().join("again.toml"), &printed).unwrap();
    assert_eq!(effective(folder.path(), &["--config", "again.toml"]), printed);
}

#[test]
fn what_was_mistyped_is_named_with_the_nearest() {
    let folder = folder();
    let refused = |args: &[&str], parts: &[&str]| refused(folder.path(), args, parts);
    refused(&["rendr"], &["'rendr'", "'render'"]);
    refused(&["render", "scene.gltf", "-o", "a.png", "--exposre", "1"], &["'--exposre'", "'--exposure'"]);
    refused(&["render", "scene.gltf", "-o", "a.png", "--method", "cone"], &["'cone'", "'cones'"]);
    refused(&["render", "scene.gltf", "-o", "a.exr", "--aov", "direct,norml"], &["'norml'", "'normal'"]);
    refused(&["render", "scene.gltf", "-o", "a.png", "--set", "voxel=64"], &["--set", "\"voxel\"", "\"voxels\""]);
    refused(&["render", "scene.gltf", "-o", "a.png", "--preset", "printd"], &["--preset", "\"printed\""]);
    refused(&["render", "scene.gltf", "-o", "a.png", "--config", "none.toml"], &["none.toml", "cannot be read"]);
    fs::write(folder.path().join("bad.toml"), "voxels = 64\ncones.fil = \"facing\"\n").unwrap();
    refused(
        &["render", "scene.gltf", "-o", "a.png", "--config", "bad.toml"],
        &["bad.toml", "\"cones.fil\"", "\"cones.fill\""],
    );
    #[cfg(target_os = "linux")]
    refused(&["settings", "--config", "/dev/zero"], &["/dev/zero", "larger than 1 MiB"]);
    for (text, parts) in [
        ("voxels = \"64\"", ["\"voxels\"", "quotes", "write 64 without"]),
        ("cones.jitter = \"true\"", ["\"cones.jitter\"", "quotes", "write true without"]),
        ("grid.center = \"1,2,3\"", ["\"grid.center\"", "quotes", "write [1.0, 2.0, 3.0] without"]),
    ] {
        fs::write(folder.path().join("quoted.toml"), text).unwrap();
        refused(&["settings", "--config", "quoted.toml"], &parts);
    }
    refused(&["render", "scene.gltf"], &["--output"]);
    refused(&["render", "-o", "a.png"], &["SCENE"]);
}

#[test]
fn values_out_of_range_are_refused_before_anything_is_done() {
    let folder = folder();
    let with = |flags: &[&str], parts: &[&str]| {
        refused(folder.path(), &[&["render", "scene.gltf", "-o", "a.png"], flags].concat(), parts);
    };
    for size in ["0x0", "0x720", "100000x100000", "16385x1", "1280", "1280x", "-1x5", "1.5x2", "axb"] {
        with(&[&format!("--size={size}")], &["--size", "1 to 16384"]);
    }
    with(&["--eye", "nan,0,0", "--target", "0,0,0"], &["--eye", "three finite numbers"]);
    with(&["--eye", "1,2", "--target", "0,0,0"], &["--eye", "three finite numbers"]);
    with(&["--eye", "-1,0,-0.5", "--target", "-1,0,-0.5"], &["--eye and --target are the same point"]);
    with(&["--eye", "0,5,0", "--target", "0,0,0"], &["--up", "along the view"]);
    with(&["--eye", "0,5,0"], &["--target"]);
    with(&["--up", "0,0,1"], &["--eye"]);
    with(&["--eye", "0,0,5", "--target", "0,0,0", "--camera", "0"], &["--camera", "cannot be used with"]);
    for fov in ["0", "180", "-20", "NaN"] {
        with(&["--eye", "0,0,5", "--target", "0,0,0", &format!("--fov={fov}")], &["--fov", "between 0 and 180"]);
    }
    with(&["--sky=-1,0,0"], &["--sky", "at least 0"]);
    with(&["--sky=inf,0,0"], &["--sky", "finite"]);
    with(&["--sky=1,1,1", "--default-light=on"], &["--default-light on and --sky", "leave one"]);
    with(&["--time=-1"], &["--time"]);
    with(&["--time=inf"], &["--time"]);
    with(&["--exposure=nan"], &["--exposure", "between -60 and 60"]);
    with(&["--exposure=1e9"], &["--exposure", "between -60 and 60"]);
    with(&["--repeat", "0"], &["--repeat"]);
    for size in ["0MiB", "512", "-1GiB", "lots", "1e30GiB", "NaNGiB"] {
        with(&[&format!("--memory-limit={size}")], &["--memory-limit", "512MiB or 2GiB"]);
    }
    with(&["--frames", "0"], &["--frames"]);
    with(&["--frames", "3", "--repeat", "2"], &["--frames", "--repeat"]);
    with(&["--fps", "24"], &["--frames"]);
    with(&["--frames", "3"], &["out_%04d.png"]);
    with(&["--aov", "direct"], &["--aov", ".exr"]);
}

#[test]
fn outputs_that_cannot_be_written_are_refused_before_anything_is_done() {
    let folder = folder();
    fs::create_dir(folder.path().join("sub.png")).unwrap();
    let to = |output: &str, flags: &[&str], parts: &[&str]| {
        refused(folder.path(), &[&["render", "scene.gltf", "-o", output], flags].concat(), parts);
    };
    to("a.gif", &[], &["a.gif", ".png, .jpg or .exr"]);
    to("image", &[], &["image", ".png, .jpg or .exr"]);
    to("a.jpg", &["--transparent"], &["transparent", ".png"]);
    to("a.exr", &["--tonemap", "agx"], &["--tonemap", ".png"]);
    to("a.png", &["--tonemap", "filmic"], &["filmic", "agx", "neutral"]);
    to("none/a.png", &[], &["none/a.png", "no folder none"]);
    to("scene.gltf/a.png", &[], &["scene.gltf is not a folder"]);
    to("sub.png", &[], &["sub.png", "is a folder"]);
    to("a_%04d.png", &[], &["--frames"]);
    to("a_%s.png", &["--frames", "2"], &["out_%04d.png"]);
    #[cfg(target_os = "linux")]
    to("/proc/a.png", &[], &["/proc/a.png", "/proc takes no new files", "choose another folder"]);
    to("none/a_%04d.png", &["--frames", "2"], &["no folder none"]);
    to("a.exr", &["--exposure", "1"], &["--exposure", ".png"]);
    to("a.png", &["--json", "none/t.json"], &["none/t.json", "no folder none"]);
    to("a.png", &["--trace", "a.png"], &["a.png", "two outputs"]);
    to("a.png", &["--json", "scene.gltf"], &["scene.gltf", "read and written"]);
    to("a.png", &["--json", "other.toml", "--config", "other.toml"], &["other.toml", "read and written"]);
}

#[test]
fn damaged_scenes_are_refused_in_a_sentence() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::create_dir(at("folder.glb")).unwrap();
    fs::write(at("empty.glb"), "").unwrap();
    fs::write(at("head.glb"), b"glTF\x02\0\0\0\xff\0\0\0").unwrap();
    fs::write(at("noise.gltf"), "{\"asset\":").unwrap();
    fs::write(at("old.gltf"), "{\"asset\":{\"version\":\"1.0\"}}").unwrap();
    let text = fs::read_to_string(at("scene.gltf")).unwrap();
    fs::write(at("count.gltf"), text.replace("\"count\":3", "\"count\":300")).unwrap();
    fs::write(at("node.gltf"), text.replace("\"nodes\":[0,1]", "\"nodes\":[0,7]")).unwrap();
    fs::write(at("nan.gltf"), text.replace("base64,AAAA", "base64,AADA/w")).unwrap();
    for name in [
        "none.glb",
        "folder.glb",
        "empty.glb",
        "head.glb",
        "noise.gltf",
        "old.gltf",
        "count.gltf",
        "node.gltf",
        "nan.gltf",
    ] {
        refused(folder.path(), &["render", name, "-o", "a.png"], &[name]);
    }
    let texture = "\"images\":[{\"uri\":\"oak.png\"}],\"textures\":[{\"source\":0}],\"materials\":[{\"emissiveTexture\":{\"index\":0}}],";
    fs::write(at("oak.gltf"), text.replace("\"scenes\"", &format!("{texture}\"scenes\""))).unwrap();
    refused(
        folder.path(),
        &["render", "oak.gltf", "-o", "a.png", "--strict"],
        &["oak.gltf", "oak.png", "does not exist"],
    );
    // Without --strict only the driver is missing.
    let lenient = twobounce(folder.path(), &["render", "oak.gltf", "-o", "a.png"]);
    let message = String::from_utf8(lenient.stderr).unwrap();
    let [note, refusal] = message.lines().collect::<Vec<_>>()[..] else { panic!("{message}") };
    assert!(note.contains("note: oak: image 0: \"oak.png\"") && refusal.contains("Vulkan"), "{message}");
    for (flag, value) in [("--scene", "Hall"), ("--camera", "3"), ("--animation", "walk")] {
        refused(folder.path(), &["render", "scene.gltf", "-o", "a.png", flag, value], &[value]);
    }
}

/// A valid command where no driver is installed: opening the device is the last check before rendering.
#[test]
fn a_missing_driver_is_said_in_a_sentence() {
    let folder = folder();
    fs::write(folder.path().join("a.png"), "kept").unwrap();
    refused(folder.path(), &["render", "scene.gltf", "-o", "a.png"], &["Vulkan"]);
    assert_eq!(fs::read_to_string(folder.path().join("a.png")).unwrap(), "kept");
}

#[test]
fn help_and_version_are_no_errors_but_nothing_at_all_is() {
    let folder = folder();
    for args in [&["--help"][..], &["--version"], &["render", "--help"], &["help", "settings"]] {
        let output = twobounce(folder.path(), args);
        assert!(output.status.success() && !output.stdout.is_empty() && output.stderr.is_empty(), "{args:?}");
    }
    let nothing = twobounce(folder.path(), &[]);
    assert_eq!(nothing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&nothing.stderr).contains("Usage"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_closed_pipe_is_quiet_and_a_full_disk_is_not() {
    let program = env!("CARGO_BIN_EXE_twobounce");
    let (read, write) = std::io::pipe().unwrap();
    drop(read);
    let closed = Command::new(program).arg("settings").stdout(write).stderr(Stdio::piped()).output().unwrap();
    assert!(closed.status.success() && closed.stderr.is_empty(), "{}", String::from_utf8_lossy(&closed.stderr));
    for args in [&[][..], &["render"], &["settings", "--preset", "x"]] {
        let (read, write) = std::io::pipe().unwrap();
        drop(read);
        let deaf = Command::new(program).args(args).stderr(write).output().unwrap();
        assert_eq!(deaf.status.code(), Some(2), "{args:?} with a closed standard error");
    }
    let full = fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
    let full = Command::new(program).arg("settings").stdout(full).stderr(Stdio::piped()).output().unwrap();
    assert_eq!(full.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&full.stderr).starts_with("twobounce: cannot write to standard output"));
}
