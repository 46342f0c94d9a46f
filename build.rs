//! Compiles every shader under `glsl/`, by `src/vk/pipeline/compile.rs`, and writes the table that `vk::shader`
//! includes. An error or a warning stops the build with `file:line: message`.

use compile::{Compiled, Store, compile_all, find_files, numbered};
use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::{env, fs, io, process};

#[path = "src/vk/pipeline/compile.rs"]
mod compile;
#[path = "src/vk/pipeline/used.rs"]
mod used;

const ROOT: &str = "glsl";
/// Text of the build's own sources, on which a compiled shader also depends.
const MADE_BY: &str = concat!(
    include_str!("build.rs"),
    include_str!("src/vk/pipeline/compile.rs"),
    include_str!("src/vk/pipeline/used.rs")
);

fn main() {
    // Watching a folder covers everything below it, also includes and new files.
    println!("cargo:rerun-if-changed={ROOT}");
    for script in ["build.rs", "src/vk/pipeline/compile.rs", "src/vk/pipeline/used.rs"] {
        println!("cargo:rerun-if-changed={script}");
    }
    // With `RUSTDOCFLAGS="--cfg internals"` the documentation also has the modules that hosts do not use.
    println!("cargo:rustc-check-cfg=cfg(internals)");
    let folder = Folder(PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR")));
    match compile_all(Path::new(ROOT), &folder) {
        Ok(shaders) => folder.write_table(&shaders).expect("OUT_DIR is writable"),
        Err(errors) => {
            eprintln!("\n{errors}");
            process::exit(1);
        }
    }
}

/// Stores each compiled shader beside its source text, so that a change compiles only the shaders that it affects.
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

/// The specialisation constants that headers declare.
fn header_constants() -> io::Result<Vec<String>> {
    let mut headers = Vec::new();
    find_files(Path::new(ROOT), &mut headers, &|path| path.extension().is_some_and(|extension| extension == "glsl"));
    let texts = headers.iter().map(fs::read_to_string).collect::<io::Result<Vec<_>>>()?;
    let names: BTreeSet<String> = texts.iter().flat_map(|text| numbered(text).1).collect();
    Ok(names.into_iter().collect())
}

fn output_file(name: &str) -> String {
    name.replace(['/', ' '], "_") + ".spv"
}

impl Folder {
    /// Writes all words, compressed, and Rust source: the shaders, sorted by name, and the constants that headers
    /// declare.
    fn write_table(&self, shaders: &[Compiled]) -> io::Result<()> {
        let mut all = Vec::new();
        let words = |bytes: usize| bytes / size_of::<u32>();
        let mut text = format!("static HEADER_CONSTANTS: &[&str] = &{:?};\n", header_constants()?);
        text += "static SHADERS: &[Built] = &[\n";
        for Compiled { name, constants } in shaders {
            let begin = words(all.len());
            all.extend(fs::read(self.0.join(output_file(name)))?);
            let end = words(all.len());
            writeln!(text, "    Built {{ name: {name:?}, words: {begin}..{end}, constants: &{constants:?} }},")
                .expect("fmt");
        }
        fs::write(self.0.join("shaders.zst"), compressed(&all)?)?;
        fs::write(self.0.join("shaders.rs"), text + "];\n")
    }
}

/// Forms of a shader share most functions, but far apart: the window holds all of them.
fn compressed(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = zstd::Encoder::new(Vec::new(), 9)?;
    encoder.long_distance_matching(true)?;
    encoder.window_log(bytes.len().next_power_of_two().ilog2().clamp(10, 27))?;
    encoder.write_all(bytes)?;
    encoder.finish()
}
