//! Compiles every shader under `glsl/` to SPIR-V (Vulkan 1.2) and writes the table that `vk::shader` includes.
//! An error or a warning stops the build with `file:line: message`.
//!
//! A shader says at its head in which further forms it is compiled, a line each:
//! - `//! per method`: once for every folder of `glsl/gi`, in which `method/…` is then looked for; `except NAME` leaves one out.
//!   Shaders in a method's own folder find `method/…` there.
//! - `//! with NAME`: once with the macro NAME and once without; `except METHOD` as above.
//! - One that includes `common/count.glsl`: once more as `counted/…`, with what it reads being counted.
//!
//! `ground/image/image.frag` of the method `rays` with `AOVS` is called `ground/image/image.frag rays AOVS`.

use rspirv::binary::Assemble;
use shaderc::{
    CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv,
};
use std::cell::RefCell;
use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fs, process, thread};
use used::keep_used;

#[path = "src/vk/used.rs"]
mod used;

const ROOT: &str = "glsl";
const COUNTING: &str = "common/count.glsl";

fn main() {
    // A folder is watched with everything below it, so this covers includes and new files too.
    println!("cargo:rerun-if-changed={ROOT}");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src/vk/used.rs");
    // With `RUSTDOCFLAGS="--cfg internals"` the documentation has what is not for hosts, too.
    println!("cargo:rustc-check-cfg=cfg(internals)");
    let mut shaders = Vec::new();
    find_shaders(Path::new(ROOT), &mut shaders);
    shaders.sort();
    let methods = methods();

    let out = PathBuf::from(env::var_os("OUT_DIR").expect("cargo sets OUT_DIR"));
    let next = AtomicUsize::new(0);
    let (names, errors) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    let threads = thread::available_parallelism().map_or(1, |n| n.get()).min(shaders.len());
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let compiler = Compiler::new().expect("shaderc starts");
                while let Some(shader) = shaders.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match compile_forms(&compiler, shader, &methods, &out) {
                        Ok(forms) => names.lock().expect("no compiling thread panicked").extend(forms),
                        Err(message) => errors.lock().expect("no compiling thread panicked").push(message),
                    }
                }
            });
        }
    });

    let errors = errors.into_inner().expect("no compiling thread panicked");
    if !errors.is_empty() {
        eprintln!("\n{}", errors.join("\n"));
        process::exit(1);
    }
    let names = names.into_inner().expect("no compiling thread panicked");
    fs::write(out.join("shaders.rs"), table(names)).expect("OUT_DIR is writable");
}

fn kind(path: &Path) -> Option<ShaderKind> {
    match path.extension()?.to_str()? {
        "vert" => Some(ShaderKind::Vertex),
        "geom" => Some(ShaderKind::Geometry),
        "frag" => Some(ShaderKind::Fragment),
        "comp" => Some(ShaderKind::Compute),
        _ => None,
    }
}

/// The folders of `glsl/gi`.
fn methods() -> Vec<String> {
    let folders = fs::read_dir(Path::new(ROOT).join("gi")).into_iter().flatten().flatten();
    let mut names: Vec<String> = folders.map(|folder| folder.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

fn find_shaders(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            find_shaders(&path, found);
        } else if kind(&path).is_some() {
            found.push(path);
        }
    }
}

/// The name a shader goes by: its path below `glsl/`, with `/` on every system.
fn name(path: &Path) -> String {
    let below = path.strip_prefix(ROOT).expect("shaders lie below the root");
    below.to_string_lossy().replace('\\', "/")
}

fn output_file(name: &str) -> String {
    name.replace(['/', ' '], "_") + ".spv"
}

/// One form of a shader.
#[derive(Clone)]
struct Form {
    method: Option<String>,
    defines: Vec<String>,
}

impl Form {
    /// Of the shader called `plain`.
    fn name(&self, plain: &str, per_method: bool) -> String {
        let method = self.method.iter().filter(|_| per_method).map(String::as_str);
        let parts = std::iter::once(plain).chain(method).chain(self.defines.iter().map(String::as_str));
        parts.collect::<Vec<_>>().join(" ")
    }
}

/// The forms that a shader's head asks for, and whether it is compiled per method.
fn forms(plain: &str, source: &str, methods: &[String]) -> (Vec<Form>, bool) {
    let own = plain.strip_prefix("gi/").and_then(|rest| rest.split_once('/')).map(|(method, _)| method.to_owned());
    let mut forms = vec![Form { method: own, defines: vec![] }];
    let mut per_method = false;
    for line in source.lines().filter_map(|line| line.strip_prefix("//! ")) {
        let (what, except) = line.split_once(" except ").unwrap_or((line, ""));
        if what == "per method" {
            per_method = true;
            let others = methods.iter().filter(|method| *method != except);
            forms = others.map(|method| Form { method: Some(method.clone()), defines: vec![] }).collect();
        } else if let Some(define) = what.strip_prefix("with ") {
            for mut form in forms.clone() {
                if form.method.as_deref() != Some(except) {
                    form.defines.push(define.to_owned());
                    forms.push(form);
                }
            }
        }
    }
    (forms, per_method)
}

/// Compiles a shader in all of its forms; the names of what was made.
fn compile_forms(compiler: &Compiler, path: &Path, methods: &[String], out: &Path) -> Result<Vec<String>, String> {
    let plain = name(path);
    let source = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let (forms, per_method) = forms(&plain, &source, methods);
    let mut names = Vec::new();
    for mut form in forms {
        let name = form.name(&plain, per_method);
        let included = compile(compiler, path, &form, &out.join(output_file(&name)))?;
        if included.contains(COUNTING) {
            let counted = format!("counted/{name}");
            form.defines.push("COUNTED".to_owned());
            compile(compiler, path, &form, &out.join(output_file(&counted)))?;
            names.push(counted);
        }
        names.push(name);
    }
    Ok(names)
}

/// Writes SPIR-V to `out`; the files that were included.
fn compile(compiler: &Compiler, path: &Path, form: &Form, out: &Path) -> Result<HashSet<String>, String> {
    let source = fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    // Every file is included once per shader, so that common files need no guards.
    let included = RefCell::new(HashSet::new());
    let mut options = CompileOptions::new().map_err(|e| e.to_string())?;
    options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
    options.set_target_spirv(SpirvVersion::V1_5);
    // Drivers optimise for themselves: measured on llvmpipe, frames take as long, and this takes a thirteenth of the time.
    // The optimiser would also strip the names that reflection goes by. What is not used is dropped below.
    options.set_optimization_level(OptimizationLevel::Zero);
    options.set_warnings_as_errors();
    form.defines.iter().for_each(|define| options.add_macro_definition(define, None));
    options.set_include_callback(|requested, _, _, _| {
        let of_method = || Some(format!("gi/{}/{}", form.method.as_ref()?, requested.strip_prefix("method/")?));
        let file = Path::new(ROOT).join(of_method().as_deref().unwrap_or(requested));
        let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let first = included.borrow_mut().insert(requested.to_owned());
        let content = if first { text } else { String::new() };
        Ok(ResolvedInclude { resolved_name: file.to_string_lossy().into_owned(), content })
    });
    let shader_kind = kind(path).expect("only shaders are collected");
    let file = path.to_string_lossy();
    // What was compiled before of the same text, by the same script, is there already: a change costs what it changes.
    let text = compiler.preprocess(&source, &file, "main", Some(&options)).map_err(|e| e.to_string())?.as_text();
    let text = [include_str!("build.rs"), &text].concat();
    let made_of = out.with_extension("text");
    if !out.exists() || fs::read_to_string(&made_of).ok() != Some(text.clone()) {
        included.borrow_mut().clear();
        let artifact = compiler
            .compile_into_spirv(&source, shader_kind, &file, "main", Some(&options))
            .map_err(|e| e.to_string())?;
        let words: Vec<u8> = used(artifact.as_binary()).iter().flat_map(|word| word.to_le_bytes()).collect();
        fs::write(out, words).map_err(|e| e.to_string())?;
        fs::write(made_of, text).map_err(|e| e.to_string())?;
    }
    drop(options);
    Ok(included.into_inner())
}

/// The module without what it never reaches.
fn used(words: &[u32]) -> Vec<u32> {
    let mut module = rspirv::dr::load_words(words).expect("shaderc writes SPIR-V");
    keep_used(&mut module);
    module.assemble()
}

/// Rust source: a slice of (name, SPIR-V bytes), sorted by name.
fn table(mut names: Vec<String>) -> String {
    names.sort();
    let mut text = String::from("static SHADERS: &[(&str, &AlignedWords)] = &[\n");
    for name in names {
        let file = output_file(&name);
        writeln!(text, "    ({name:?}, &Aligned(*include_bytes!(concat!(env!(\"OUT_DIR\"), \"/{file}\")))),")
            .expect("fmt");
    }
    text + "];\n"
}
