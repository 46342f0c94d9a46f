//! Mesa's shader cache on disk must tell vector widths apart: code for 256 bits must not run on a driver with 128.

use std::fs;
use std::process::Command;

use crate::cli_common::{Folder, root, text};

/// Draws through a geometry shader with vectors of this many bits. The driver keeps the shader's outputs in memory of
/// its own; glibc's checked heap finds writes past the end of a block.
fn rendered(folder: &Folder, cache: &str, bits: &str) -> Vec<u8> {
    let out = folder.path("a.png");
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    command.args(["render", "assets/cornell-point.glb", "--preset=printed", "--size=16x16", "--set=voxels=16", "-q"]);
    command.arg("-o").arg(&out).current_dir(root()).env("XDG_CACHE_HOME", folder.path(cache));
    command.env_remove("MESA_SHADER_CACHE_DIR").env("LP_NATIVE_VECTOR_WIDTH", bits);
    command.env("LD_PRELOAD", "libc_malloc_debug.so.0").env("MALLOC_CHECK_", "3").env("MALLOC_PERTURB_", "165");
    let output = command.output().unwrap();
    assert!(output.status.success(), "{bits} bits, {cache}: {}, {}", output.status, text(&output.stderr));
    fs::read(out).unwrap()
}

#[test]
fn a_cache_of_wider_vectors_is_not_read() {
    let folder = Folder::empty();
    let wide = rendered(&folder, "shared", "256");
    assert!(rendered(&folder, "shared", "128") == wide, "128 bits after 256");
    assert!(rendered(&folder, "shared", "256") == wide, "256 bits after 128");
}
