//! The program in `examples/host/`.

use std::path::Path;
use std::process::Command;

/// The example is a program of its own: under the validation layer its last picture is what `twobounce render` writes.
#[test]
#[ignore = "it builds a program of its own: `make test-more`"]
fn the_example_draws_what_the_command_line_draws() {
    let twobounce = Path::new(env!("CARGO_BIN_EXE_twobounce"));
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let profile = if cfg!(debug_assertions) { "dev" } else { "release" };
    let build = ["build", "--locked", "--offline", "--quiet", "--example", "host", "--profile", profile];
    let built = Command::new(env!("CARGO")).current_dir(root).args(build).output().expect("cargo");
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let host = twobounce.with_file_name("examples").join("host");
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
