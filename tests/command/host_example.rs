//! The programs in `examples/host/` and `examples/gbuffer/`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Builds an example and returns its program.
fn built(name: &str) -> PathBuf {
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let build = ["build", "--locked", "--offline", "--quiet", "--example", name, "--profile", profile];
    let built =
        Command::new(env!("CARGO")).current_dir(env!("CARGO_MANIFEST_DIR")).args(build).output().expect("cargo");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    Path::new(env!("CARGO_BIN_EXE_twobounce")).with_file_name("examples").join(name)
}

/// The example is a program of its own: under the validation layer its last picture equals that of `twobounce render`.
#[test]
#[ignore = "it builds a program of its own: `make test-more`"]
fn the_example_draws_what_the_command_line_draws() {
    let twobounce = Path::new(env!("CARGO_BIN_EXE_twobounce"));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let host = built("host");
    let folder = tempfile::tempdir().expect("a folder");
    let (own, other) = (folder.path().join("host.png"), folder.path().join("render.png"));
    let scene = root.join("assets/cornell-area.glb");
    let done =
        Command::new(&host).arg(&scene).arg(&own).args(["64x48", "voxels=32"]).env("HOST_VALIDATION", "1").output();
    let done = done.expect("the example");
    assert!(done.status.success() && done.stderr.is_empty(), "{}", String::from_utf8_lossy(&done.stderr));
    let flags =
        ["--preset", "fast", "--set", "voxels=32", "--size", "64x48", "--exposure", "0", "--noise", "off", "-q"];
    let done = Command::new(twobounce).arg("render").arg(&scene).arg("-o").arg(&other).args(flags).output();
    assert!(done.expect("twobounce").status.success());
    let pixels = |path| image::open(path).expect("a picture").into_rgb8();
    let (own, other) = (pixels(own), pixels(other));
    assert!(own == other, "the pictures differ");
    assert!(own.pixels().any(|pixel| pixel.0.iter().any(|&code| code > 100)), "it is not black");
    // A call with too few arguments is refused.
    let refused = Command::new(&host).arg(&scene).output().expect("the example");
    assert!(refused.status.code() == Some(2) && String::from_utf8_lossy(&refused.stderr).starts_with("call it with"));
}

/// An engine's own G-buffer is lit like the renderer's, under the validation layer. Pixels differ at edges, which the
/// engine does not smooth, and by the noise of 16 passes.
#[test]
#[ignore = "it builds a program of its own: `make test-more`"]
fn an_engines_own_surfaces_are_lit_as_the_renderers() {
    let twobounce = Path::new(env!("CARGO_BIN_EXE_twobounce"));
    let (engine, folder) = (built("gbuffer"), tempfile::tempdir().expect("a folder"));
    let (own, other) = (folder.path().join("own.png"), folder.path().join("render.png"));
    for method in ["rays", "cones", "photons", "lpv", "probes"] {
        let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/cornell-area.glb");
        let (size, method) = ("96x96", format!("method={method}"));
        let mut engine = Command::new(&engine);
        engine.arg(&scene).arg(&own).args([size, "voxels=32", &method]).env("HOST_VALIDATION", "1");
        let done = engine.output().expect("the example");
        assert!(done.status.success() && done.stderr.is_empty(), "{}", String::from_utf8_lossy(&done.stderr));
        let flags = ["--preset=fast", "--set=voxels=32", "--set=image.passes=16", "--set=image.gather_resolution=full"];
        let render = Command::new(twobounce)
            .arg("render")
            .arg(&scene)
            .arg("-o")
            .arg(&other)
            .args(flags)
            .args(["--size", size])
            .args(["--set", &method, "--exposure=0", "-q"])
            .status();
        assert!(render.expect("twobounce").success());
        let pixels = |path| image::open(path).expect("a picture").into_rgb8().into_raw();
        let (own, other) = (pixels(&own), pixels(&other));
        let off = own.iter().zip(&other).map(|(a, b)| f64::from(a.abs_diff(*b))).sum::<f64>() / own.len() as f64;
        assert!(off < 3.0, "{method}: codes differ by {off} in the mean");
        assert!(own.iter().filter(|code| **code > 60).count() > own.len() / 8, "{method}: it is not black");
    }
}
