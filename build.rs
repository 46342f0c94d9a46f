//! Compiles every shader under `glsl/`, by `src/vk/compile.rs`, and writes the table that `vk::shader` includes.
//! An error or a warning stops the build with `file:line: message`.

use compile::{Store, compile_all};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, process};

#[path = "src/vk/compile.rs"]
mod compile;
#[path = "src/vk/used.rs"]
mod used;

const ROOT: &str = "glsl";
/// What else a compiled shader depends on.
const MADE_BY: &str =
    concat!(include_str!("build.rs"), include_str!("src/vk/compile.rs"), include_str!("src/vk/used.rs"));

fn main() {
    // A folder is watched with everything below it, so this covers includes and new files too.
    println!("cargo:rerun-if-changed={ROOT}");
    for script in ["build.rs", "src/vk/compile.rs", "src/vk/used.rs"] {
        println!("cargo:rerun-if-changed={script}");
    }
    // With `RUSTDOCFLAGS="--cfg internals"` the documentation has what is not for hosts, too.
    println!("cargo:rustc-check-cfg=cfg(internals)");
    let folder = Folder(PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")));
    match compile_all(Path::new(ROOT), &folder) {
        Ok(names) => fs::write(folder.0.join("shaders.rs"), table(names)).expect("OUT_DIR is writable"),
        Err(errors) => {
            eprintln!("\n{errors}");
            process::exit(1);
        }
    }
}

/// Keeps each shader beside the text that it was made of: a change costs what it changes.
struct Folder(PathBuf);

impl Store for Folder {
    fn has(&self, name: &str, text: &str) -> bool {
        let file = self.0.join(output_file(name));
        file.exists()
            && fs::read_to_string(file.with_extension("text")).is_ok_and(|old| old == [MADE_BY, text].concat())
    }

    fn put(&self, name: &str, text: &str, words: Vec<u32>) -> Result<(), String> {
        let file = self.0.join(output_file(name));
        let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(&file, bytes).map_err(|e| e.to_string())?;
        fs::write(file.with_extension("text"), [MADE_BY, text].concat()).map_err(|e| e.to_string())
    }
}

fn output_file(name: &str) -> String {
    name.replace(['/', ' '], "_") + ".spv"
}

/// Rust source: a slice of (name, SPIR-V bytes), sorted by name.
fn table(names: Vec<String>) -> String {
    let mut text = String::from("static SHADERS: &[(&str, &AlignedWords)] = &[\n");
    for name in names {
        let file = output_file(&name);
        writeln!(text, "    ({name:?}, &Aligned(*include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{file}\")))),")
            .expect("fmt");
    }
    text + "];\n"
}
