//! From the GLSL below a folder to SPIR-V (Vulkan 1.2). The build includes this file, and so does hot reload.
//!
//! A shader says at its head in which further forms it is compiled, a line each:
//! - `//! per method`: once for every folder of `gi`, in which `method/…` is then looked for; `except NAME` leaves one out.
//!   Shaders in a method's own folder find `method/…` there.
//! - `//! with NAME`: once with the macro NAME and once without; `except METHOD` as above.
//! - One that includes `common/count.glsl`: once more as `counted/…`, with what it reads being counted.
//!
//! `ground/image/image.frag` of the method `rays` with `AOVS` is called `ground/image/image.frag rays AOVS`.

use super::used::keep_used;
use rspirv::binary::Assemble;
use shaderc::{
    CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv,
};
use std::cell::RefCell;
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, thread};

const COUNTING: &str = "common/count.glsl";

/// Where compiled shaders are kept.
pub trait Store: Sync {
    /// Whether the shader called `name` is there, made of this preprocessed text.
    fn has(&self, name: &str, text: &str) -> bool;

    /// # Errors
    /// Why it cannot be kept.
    fn put(&self, name: &str, text: &str, words: Vec<u32>) -> Result<(), String>;
}

/// Compiles every form of every shader below `root` that the store lacks. The names of all forms, sorted.
///
/// # Errors
/// The messages of every shader that has an error or a warning, each as `file:line: message`.
pub fn compile_all(root: &Path, store: &impl Store) -> Result<Vec<String>, String> {
    let mut shaders = Vec::new();
    find_shaders(root, &mut shaders);
    shaders.sort();
    let methods = methods(root);
    let next = AtomicUsize::new(0);
    let (names, errors) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    let threads = thread::available_parallelism().map_or(1, |n| n.get()).min(shaders.len());
    thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                let compiler = Compiler::new().expect("shaderc starts");
                while let Some(shader) = shaders.get(next.fetch_add(1, Ordering::Relaxed)) {
                    match (Shader { compiler: &compiler, root, path: shader }).compile_forms(&methods, store) {
                        Ok(forms) => names.lock().expect("no compiling thread panicked").extend(forms),
                        Err(message) => errors.lock().expect("no compiling thread panicked").push(message),
                    }
                }
            });
        }
    });
    let mut errors = errors.into_inner().expect("no compiling thread panicked");
    if !errors.is_empty() {
        // What several shaders include is said once.
        errors.sort();
        errors.dedup();
        return Err(errors.join("\n"));
    }
    let mut names = names.into_inner().expect("no compiling thread panicked");
    names.sort();
    Ok(names)
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

/// The folders of `gi`.
fn methods(root: &Path) -> Vec<String> {
    let folders = fs::read_dir(root.join("gi")).into_iter().flatten().flatten();
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

struct Shader<'a> {
    compiler: &'a Compiler,
    root: &'a Path,
    path: &'a Path,
}

impl Shader<'_> {
    /// The name it goes by: its path below the root, with `/` on every system.
    fn name(&self) -> String {
        let below = self.path.strip_prefix(self.root).expect("shaders lie below the root");
        below.to_string_lossy().replace('\\', "/")
    }

    /// Compiles it in all of its forms; the names of what was made.
    fn compile_forms(&self, methods: &[String], store: &impl Store) -> Result<Vec<String>, String> {
        let plain = self.name();
        let source = fs::read_to_string(self.path).map_err(|e| format!("{}: {e}", self.path.display()))?;
        let (forms, per_method) = forms(&plain, &source, methods);
        let mut names = Vec::new();
        for mut form in forms {
            let name = form.name(&plain, per_method);
            let included = self.compile(&source, &form, &name, store)?;
            if included.contains(COUNTING) {
                let counted = format!("counted/{name}");
                form.defines.push("COUNTED".to_owned());
                self.compile(&source, &form, &counted, store)?;
                names.push(counted);
            }
            names.push(name);
        }
        Ok(names)
    }

    /// Compiles one form for the store; the files that were included.
    fn compile(&self, source: &str, form: &Form, name: &str, store: &impl Store) -> Result<HashSet<String>, String> {
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
            let file = self.root.join(of_method().as_deref().unwrap_or(requested));
            let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            let first = included.borrow_mut().insert(requested.to_owned());
            let content = if first { text } else { String::new() };
            Ok(ResolvedInclude { resolved_name: file.to_string_lossy().into_owned(), content })
        });
        let shader_kind = kind(self.path).expect("only shaders are collected");
        let file = self.path.to_string_lossy();
        let text = self.compiler.preprocess(source, &file, "main", Some(&options)).map_err(|e| messages(&e))?.as_text();
        if !store.has(name, &text) {
            included.borrow_mut().clear();
            let artifact = self
                .compiler
                .compile_into_spirv(source, shader_kind, &file, "main", Some(&options))
                .map_err(|e| messages(&e))?;
            store.put(name, &text, used(artifact.as_binary()))?;
        }
        drop(options);
        Ok(included.into_inner())
    }
}

/// What the compiler says, a message a line.
fn messages(error: &shaderc::Error) -> String {
    match error {
        shaderc::Error::CompilationError(_, text) => text.trim_end().to_owned(),
        other => other.to_string(),
    }
}

/// The module without what it never reaches.
fn used(words: &[u32]) -> Vec<u32> {
    let mut module = rspirv::dr::load_words(words).expect("shaderc writes SPIR-V");
    keep_used(&mut module);
    module.assemble()
}
