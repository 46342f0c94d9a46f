//! A new method takes four additions: a folder in `src/gi`, one in `glsl/gi`, a table of settings in
//! `src/settings/methods`, and a line in the list there. The test adds one to a copy of the source, builds it, and
//! finds it in the image, the layers, the memory plan, the timings, the settings, a chart's rows and a profile.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use twobounce::layers::{Aov, Layers};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn copy(from: &Path, to: &Path) {
    if from.is_file() {
        let new = fs::read(from).unwrap();
        // An unchanged file keeps its time stamp, so that it is not built again.
        if fs::read(to).ok().as_ref() != Some(&new) {
            fs::create_dir_all(to.parent().unwrap()).unwrap();
            fs::write(to, new).unwrap();
        }
        return;
    }
    for entry in fs::read_dir(from).unwrap().flatten() {
        copy(&entry.path(), &to.join(entry.file_name()));
    }
}

/// Builds a copy of the source with the method `constant`, and returns its program.
fn house_with_one_more() -> PathBuf {
    let house = Path::new(env!("CARGO_TARGET_TMPDIR")).join("one-more-method");
    // Files that an earlier run copied, and that no longer exist, would be built too.
    for folder in ["src", "glsl"] {
        fs::remove_dir_all(house.join(folder)).ok();
    }
    let pages = ["docs/json.md", "docs/notes/ledger.md", "docs/notes/lpv.md", "docs/notes/photons.md"];
    for name in ["src", "glsl", "build.rs", "Cargo.lock"].into_iter().chain(pages) {
        copy(&root().join(name), &house.join(name));
    }
    copy(&root().join("tests/new_method/mod.rs"), &house.join("src/gi/constant/mod.rs"));
    copy(&root().join("tests/new_method/settings.rs"), &house.join("src/settings/methods/constant.rs"));
    copy(&root().join("tests/new_method/look_up.glsl"), &house.join("glsl/gi/constant/look_up.glsl"));
    let methods = fs::read_to_string(root().join("src/settings/methods/mod.rs")).unwrap();
    let last = "            Rays = \"rays\" in rays,\n";
    assert_eq!(methods.matches(last).count(), 1);
    let line = format!("{last}            /// To be thrown away.\n            Constant = \"constant\" in constant,\n");
    write_anew(&house.join("src/settings/methods/mod.rs"), &methods.replace(last, &line));
    // Another name, so that it replaces no other program; unoptimised, because that builds sooner.
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let name = "name = \"twobounce\"";
    assert_eq!(manifest.matches(name).count(), 1);
    let manifest = manifest.replace(name, "name = \"one-more-method\"");
    let parts =
        "\n[lib]\nname = \"twobounce\"\n\n[profile.release.package.one-more-method]\nopt-level = 0\n\n[workspace]\n";
    write_anew(&house.join("Cargo.toml"), &(manifest + parts));
    let lock = fs::read_to_string(root().join("Cargo.lock")).unwrap();
    write_anew(&house.join("Cargo.lock"), &lock.replace("name = \"twobounce\"", "name = \"one-more-method\""));

    let target = Path::new(env!("CARGO_BIN_EXE_twobounce")).ancestors().nth(2).unwrap();
    let mut build = Command::new(env!("CARGO"));
    build.current_dir(&house).args(["build", "--release", "--offline", "--quiet"]).env("CARGO_TARGET_DIR", target);
    let shaderc = root().join(".cache/shaderc");
    if shaderc.is_dir() {
        build.env("SHADERC_LIB_DIR", shaderc);
    }
    let built = build.output().unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    target.join("release/one-more-method")
}

fn write_anew(path: &Path, text: &str) {
    if fs::read_to_string(path).ok().as_deref() != Some(text) {
        fs::write(path, text).unwrap();
    }
}

#[test]
#[ignore = "it builds the program once more: `make test-more`"]
fn a_fourth_method_takes_four_places() {
    let program = house_with_one_more();
    let folder = tempfile::tempdir().unwrap();
    let scene = root().join("assets/cornell-point.glb");
    let run = |args: &[&str]| {
        let mut command = Command::new(&program);
        command.current_dir(folder.path()).env("TWOBOUNCE_CACHE", folder.path().join("cache"));
        command.arg(args[0]).arg(&scene).args(&args[1..]).args([
            "--size",
            "24x24",
            "--set",
            "voxels=16",
            "--validation",
        ]);
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{args:?}: {said}");
        said
    };

    // The image is direct light plus constant light on the surfaces, whether gathered apart or pixel by pixel.
    for resolution in ["image.gather_resolution=half", "image.gather_resolution=full"] {
        let light = ["--method", "constant", "--set", "constant.radiance=0.25", "--set", resolution];
        let layers = ["--aov", "indirect,albedo,ao", "--timings"];
        let said = run(&[&["render", "-o", "image.exr"], &light[..], &layers[..]].concat());
        assert!(
            said.contains("\nconstant  ") && said.contains("constant light"),
            "no pass, or no row of memory: {said}"
        );
        let (image, header) = Layers::read_exr(&folder.path().join("image.exr")).unwrap();
        assert_eq!(header["method"], "constant");
        let pairs = image.get(Aov::Indirect).unwrap().iter().zip(image.get(Aov::Albedo).unwrap());
        let mut seen = 0;
        for (indirect, albedo) in pairs.filter(|(_, albedo)| albedo[0] > 0.1) {
            // The box has Lambertian walls: their radiance is albedo times the arriving light. f16 keeps 11 bits of
            // gathered light.
            assert!((0..3).all(|c| (indirect[c] - 0.25 * albedo[c]).abs() < 1e-3), "{indirect:?} {albedo:?}");
            seen += 1;
        }
        assert!(seen > 400, "{seen} pixels are a test of little");
    }

    // The method is swept, stored and charted like any other.
    let noise = ["--reference-noise", "30", "--presets", "fast", "--sweep", "method=constant,none"];
    run(&[&["chart", "-o", "chart"], &noise[..]].concat());
    let rows: serde_json::Value =
        serde_json::from_slice(&fs::read(folder.path().join("chart/rows.json")).unwrap()).unwrap();
    let row = |name: &str| rows["rows"].as_array().unwrap().iter().find(|row| row["name"] == name).unwrap().clone();
    let constant = row("fast method=constant");
    assert_eq!(constant["settings"]["method"], "constant");
    let passes = constant["measured"]["passes"].as_array().unwrap();
    assert!(passes.iter().any(|pass| pass["name"] == "constant"), "{passes:?}");
    assert_ne!(constant["key"], row("fast method=none")["key"]);

    let said = run(&["profile", "--method", "constant", "--frames", "1"]);
    assert!(said.contains("\nconstant  ") && said.contains("ns/voxel"), "{said}");
}
