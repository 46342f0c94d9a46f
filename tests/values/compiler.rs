//! Faults of the compiler itself that affect programs, to recognise a toolchain that has one.

use std::io::Write;
use std::path::Path;
use std::process::Command;
use std::{env, fs, io};

/// The first release of Rust that passes `FREES_TWICE`, by measurement: 1.95.0, 1.96.0 and 1.96.1 abort, 1.97.0 passes.
const MENDED: (u32, u32) = (1, 97);

/// rust-lang/rust#155241: both closures get one vector's bytes instead of a vector each.
const FREES_TWICE: &str = "
fn with(f: impl FnOnce(Vec<usize>)) {
    f(Vec::new())
}
fn main() {
    with(|mut given| given.resize(2, 1));
    with(|given| assert!(given.is_empty()));
}
";

/// The compiler beside the cargo that built these tests.
fn rustc() -> Command {
    let beside = Path::new(env!("CARGO")).with_file_name("rustc");
    Command::new(env::var_os("RUSTC").unwrap_or_else(|| if beside.exists() { beside.into() } else { "rustc".into() }))
}

#[test]
fn a_compiler_that_frees_a_moved_argument_twice_is_known() {
    let version = rustc().arg("--version").output().expect("rustc runs").stdout;
    let version = String::from_utf8(version).expect("text");
    let numbers: Vec<u32> = version.split([' ', '.']).filter_map(|part| part.parse().ok()).collect();
    let [major, minor, ..] = numbers[..] else { panic!("{version:?} has no number") };

    let folder = tempfile::tempdir().expect("a folder");
    let (source, program) = (folder.path().join("frees_twice.rs"), folder.path().join("frees_twice"));
    fs::write(&source, FREES_TWICE).expect("written");
    let compiled = rustc().args(["-C", "opt-level=3", "-o"]).args([&program, &source]).output().expect("rustc runs");
    assert!(compiled.status.success(), "{}", String::from_utf8_lossy(&compiled.stderr));
    let ran = Command::new(&program).output().expect("it starts");
    if ran.status.success() {
        return;
    }

    let how = format!("{} frees a moved closure argument twice (rust-lang/rust#155241)", version.trim());
    assert!((major, minor) < MENDED, "{how}, which {}.{} no longer did: move MENDED", MENDED.0, MENDED.1);
    // Written to the terminal itself, because the harness captures the text of macros.
    let note =
        format!("note: {how}; CONTRIBUTING.md says what that means, and Rust {}.{} mends it\n", MENDED.0, MENDED.1);
    io::stderr().write_all(note.as_bytes()).expect("written");
}
