//! Compiles the GLSL in a folder to SPIR-V (Vulkan 1.2). The build includes this file, and so does hot reload.
//!
//! The head of a shader declares the forms in which it is compiled, one per line:
//! - `//! per method`: once for every folder of `gi`, which then provides the includes `method/…`. `except NAMES`
//!   leaves some out. In a method's own folder, `method/…` is that folder.
//! - `//! with NAME`: once with the macro NAME and once without. `except METHODS` is as above, and `only METHOD` leaves
//!   out all other methods.
//!
//! `ground/image/image.comp` of the method `rays` with `AOVS` is called `ground/image/image.comp rays AOVS`.
//!
//! A header (`*.glsl`) includes everything that it uses, so that it compiles alone, which a test checks. Its head
//! declares the forms of the test like a shader, and in addition:
//! - `//! fragment`: only fragment shaders include it. Without this line the test includes it in a compute shader.
//! - `//! given LINE`: shaders declare LINE, possibly with another value, before they include the header. The test
//!   inserts LINE there.
//!
//! A macro that is only used with `#ifdef` needs no line.
//!
//! Resources and constants are bound by name, so no number is written by hand. Buffers, images and samplers are
//! declared without set and binding, and a pipeline numbers those of all its stages. A specialisation constant is
//! declared as `layout(constant_id) const uint NAME = 1u;`. A workgroup size that is a constant is declared as
//! `layout(local_size_x_id) in;`, and the constant is called `local_size_x`. This file numbers the constants of each
//! shader, and writes their names into the module.

use super::used::keep_used;
use rspirv::binary::Assemble;
use rspirv::dr::{Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op};
use shaderc::{
    CompileOptions, Compiler, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, SpirvVersion, TargetEnv,
};
use std::cell::RefCell;
use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, thread};

/// A compiled form of a shader.
pub struct Compiled {
    pub name: String,
    /// The specialisation constants that it declares, of which it may use fewer.
    #[allow(dead_code, reason = "only the build reads them: a running program cannot give other constants")]
    pub constants: Vec<String>,
}

/// A store of compiled shaders.
pub trait Store: Sync {
    /// Whether the store has the shader `name`, compiled from this preprocessed text.
    fn has(&self, name: &str, text: &str) -> bool;

    /// # Errors
    /// Adds a shader. The error says why it cannot be stored.
    fn put(&self, name: &str, text: &str, words: Vec<u32>) -> Result<(), String>;
}

/// Compiles every form of every shader below `root` that the store lacks. Returns all forms, sorted by name.
///
/// # Errors
/// The messages for every shader with an error or a warning, each as `file:line: message`.
pub fn compile_all(root: &Path, store: &impl Store) -> Result<Vec<Compiled>, String> {
    let mut shaders = Vec::new();
    find_files(root, &mut shaders, &|path| kind(path).is_some());
    shaders.sort();
    let methods = methods(root);
    let next = AtomicUsize::new(0);
    let (compiled, errors) = (Mutex::new(Vec::new()), Mutex::new(Vec::new()));
    let threads = thread::available_parallelism().map_or(1, |n| n.get()).min(shaders.len());
    thread::scope(|scope| {
        let compile = || {
            let compiler = Compiler::new().expect("shaderc starts");
            while let Some(shader) = shaders.get(next.fetch_add(1, Ordering::Relaxed)) {
                match (Shader { compiler: &compiler, root, path: shader }).compile_forms(&methods, store) {
                    Ok(forms) => compiled.lock().expect("no compiling thread panicked").extend(forms),
                    Err(message) => errors.lock().expect("no compiling thread panicked").push(message),
                }
            }
        };
        for _ in 1..threads {
            // If no further thread can be started, the running ones compile everything.
            let _ = thread::Builder::new().spawn_scoped(scope, compile);
        }
        compile();
    });
    let mut errors = errors.into_inner().expect("no compiling thread panicked");
    if !errors.is_empty() {
        // An error in a header that several shaders include is reported once.
        errors.sort();
        errors.dedup();
        return Err(errors.join("\n"));
    }
    let mut compiled = compiled.into_inner().expect("no compiling thread panicked");
    compiled.sort_by(|a: &Compiled, b| a.name.cmp(&b.name));
    Ok(compiled)
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

/// The method folders in `gi`.
fn methods(root: &Path) -> Vec<String> {
    let folders = fs::read_dir(root.join("gi")).into_iter().flatten().flatten();
    let mut names: Vec<String> = folders.map(|folder| folder.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

/// All files in a folder that satisfy `is_wanted`.
pub fn find_files(folder: &Path, found: &mut Vec<PathBuf>, is_wanted: &dyn Fn(&Path) -> bool) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.is_dir() {
            find_files(&path, found, is_wanted);
        } else if is_wanted(&path) {
            found.push(path);
        }
    }
}

/// One form of a shader.
#[derive(Clone)]
struct ShaderForm {
    method: Option<String>,
    defines: Vec<String>,
}

impl ShaderForm {
    /// The name of this form of the shader `plain`.
    fn name(&self, plain: &str, per_method: bool) -> String {
        let method = self.method.iter().filter(|_| per_method).map(String::as_str);
        let parts = std::iter::once(plain).chain(method).chain(self.defines.iter().map(String::as_str));
        parts.collect::<Vec<_>>().join(" ")
    }
}

/// The forms that the head of a shader declares, and whether it is compiled per method.
fn forms(plain: &str, source: &str, methods: &[String]) -> (Vec<ShaderForm>, bool) {
    let own = plain.strip_prefix("gi/").and_then(|rest| rest.split_once('/')).map(|(method, _)| method.to_owned());
    let mut forms = vec![ShaderForm { method: own, defines: vec![] }];
    let mut per_method = false;
    for line in source.lines().filter_map(|line| line.strip_prefix("//! ")) {
        let (line, only) = line.split_once(" only ").map_or((line, None), |(line, only)| (line, Some(only)));
        let (what, except) = line.split_once(" except ").unwrap_or((line, ""));
        let excepts = |method: &str| except.split(' ').any(|name| name == method);
        if what == "per method" {
            per_method = true;
            let others = methods.iter().filter(|method| !excepts(method));
            forms = others.map(|method| ShaderForm { method: Some(method.clone()), defines: vec![] }).collect();
        } else if let Some(define) = what.strip_prefix("with ") {
            for mut form in forms.clone() {
                let method = form.method.as_deref();
                if !method.is_some_and(excepts) && only.is_none_or(|only| method == Some(only)) {
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
    /// The name of the shader: its path below the root, with `/` on every system.
    fn name(&self) -> String {
        let below = self.path.strip_prefix(self.root).expect("shaders lie below the root");
        below.to_string_lossy().replace('\\', "/")
    }

    /// Compiles the shader in all of its forms.
    fn compile_forms(&self, methods: &[String], store: &impl Store) -> Result<Vec<Compiled>, String> {
        let plain = self.name();
        let source = fs::read_to_string(self.path).map_err(|e| format!("{}: {e}", self.path.display()))?;
        let (forms, per_method) = forms(&plain, &source, methods);
        let compile = |form: &ShaderForm| self.compile(&source, form, form.name(&plain, per_method), store);
        forms.iter().map(compile).collect()
    }

    /// Compiles one form for the store.
    fn compile(&self, source: &str, form: &ShaderForm, name: String, store: &impl Store) -> Result<Compiled, String> {
        // Every file is included once per shader, so that common files need no include guards.
        let included = RefCell::new(HashSet::new());
        let mut options = CompileOptions::new().map_err(|e| e.to_string())?;
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_2 as u32);
        options.set_target_spirv(SpirvVersion::V1_5);
        // Optimisation is left to drivers: on llvmpipe, frames take the same time, and compilation takes a thirteenth.
        // The optimiser would also remove the names for binding. Unused parts are removed below.
        options.set_optimization_level(OptimizationLevel::Zero);
        options.set_warnings_as_errors();
        options.set_auto_bind_uniforms(true);
        form.defines.iter().for_each(|define| options.add_macro_definition(define, None));
        options.set_include_callback(|requested, _, _, _| {
            let of_method = || Some(format!("gi/{}/{}", form.method.as_ref()?, requested.strip_prefix("method/")?));
            let file = self.root.join(of_method().as_deref().unwrap_or(requested));
            let text = fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
            let resolved_name = file.to_string_lossy().into_owned();
            let first = included.borrow_mut().insert(resolved_name.clone());
            Ok(ResolvedInclude { resolved_name, content: if first { text } else { String::new() } })
        });
        let shader_kind = kind(self.path).expect("only shaders are collected");
        let file = self.path.to_string_lossy();
        let text = self.compiler.preprocess(source, &file, "main", Some(&options)).map_err(|e| messages(&e))?.as_text();
        let (text, constants) = numbered(&text);
        if !store.has(&name, &text) {
            let artifact = self
                .compiler
                .compile_into_spirv(&text, shader_kind, &file, "main", Some(&options))
                .map_err(|e| messages(&e))?;
            let words = finished(artifact.as_binary(), &constants).map_err(|e| format!("{file}: {e}"))?;
            store.put(&name, &text, words)?;
        }
        Ok(Compiled { name, constants })
    }
}

/// The messages of the compiler, one per line.
fn messages(error: &shaderc::Error) -> String {
    match error {
        shaderc::Error::CompilationError(_, text) => text.trim_end().to_owned(),
        other => other.to_string(),
    }
}

/// The `text` of a shader with a number for every specialisation constant, and their names in the order of numbers.
pub fn numbered(text: &str) -> (String, Vec<String>) {
    let outside = |c: char| !c.is_ascii_alphanumeric() && c != '_';
    let (mut done, mut names, mut copied) = (String::new(), Vec::new(), 0);
    for (at, id) in text.match_indices("_id") {
        let end = at + id.len();
        let (before, after) = (&text[..at], text[end..].trim_start());
        let begin = before.rfind(outside).map_or(0, |place| place + 1);
        let name = match &before[begin..] {
            // An example is `layout(constant_id) const uint NAME = 1u;`.
            "constant" if after.starts_with(')') => after.split(outside).filter(|word| !word.is_empty()).nth(2),
            size @ ("local_size_x" | "local_size_y" | "local_size_z") if after.starts_with([',', ')']) => Some(size),
            _ => None,
        };
        if let Some(name) = name {
            done += &format!("{} = {}", &text[copied..end], names.len());
            copied = end;
            names.push(name.to_owned());
        }
    }
    (done + &text[copied..], names)
}

/// The module without unused parts, in which every bound resource has its name.
///
/// # Errors
/// The number of a constant does not belong to one of `constants`.
fn finished(words: &[u32], constants: &[String]) -> Result<Vec<u32>, String> {
    let mut module = rspirv::dr::load_words(words).expect("shaderc writes SPIR-V");
    keep_used(&mut module);
    for (id, number) in numbers(&module) {
        let name = constants.get(number as usize).ok_or("a constant has a number: write layout(constant_id)")?;
        rename(&mut module, id, name);
    }
    for (id, name) in blocks(&module) {
        rename(&mut module, id, &name);
    }
    Ok(module.assemble())
}

/// The specialisation constants of a module and their numbers.
fn numbers(module: &Module) -> Vec<(u32, u32)> {
    let number = |i: &Instruction| match i.operands[..] {
        [Operand::IdRef(id), Operand::Decoration(Decoration::SpecId), Operand::LiteralBit32(number)] => {
            Some((id, number))
        }
        _ => None,
    };
    module.annotations.iter().filter_map(number).collect()
}

/// The blocks without an instance name, each with the name of its first member, by which GLSL refers to it.
fn blocks(module: &Module) -> Vec<(u32, String)> {
    let (mut members, mut named) = (HashMap::new(), HashSet::new());
    for i in &module.debug_names {
        match &i.operands[..] {
            [Operand::IdRef(id), Operand::LiteralBit32(0), Operand::LiteralString(name)] => {
                members.insert(*id, name.clone());
            }
            [Operand::IdRef(id), Operand::LiteralString(name)] if !name.is_empty() => {
                named.insert(*id);
            }
            _ => {}
        }
    }
    let globals = || module.types_global_values.iter();
    let pointers = globals().filter(|i| i.class.opcode == Op::TypePointer);
    let first_members: HashMap<u32, String> =
        pointers.filter_map(|i| Some((i.result_id?, members.get(&i.operands[1].id_ref_any()?)?.clone()))).collect();
    let variables = globals().filter(|i| i.class.opcode == Op::Variable);
    let block = |i: &Instruction| Some((i.result_id?, first_members.get(&i.result_type?)?.clone()));
    variables.filter_map(block).filter(|(id, _)| !named.contains(id)).collect()
}

fn rename(module: &mut Module, id: u32, name: &str) {
    let of_id = |i: &Instruction| i.class.opcode == Op::Name && i.operands[0] == Operand::IdRef(id);
    module.debug_names.retain(|i| !of_id(i));
    let operands = vec![Operand::IdRef(id), Operand::LiteralString(name.to_owned())];
    module.debug_names.push(Instruction::new(Op::Name, None, None, operands));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A store that accepts everything.
    struct Sink;

    impl Store for Sink {
        fn has(&self, _name: &str, _text: &str) -> bool {
            false
        }

        fn put(&self, _name: &str, _text: &str, _words: Vec<u32>) -> Result<(), String> {
            Ok(())
        }
    }

    /// Copies the headers, and adds a shader for each that includes it alone. Returns the number of headers.
    fn headers_alone(from: &Path, to: &Path, below: &str) -> usize {
        let mut count = 0;
        fs::create_dir_all(to.join(below)).unwrap();
        for entry in fs::read_dir(from.join(below)).unwrap().flatten() {
            let name = format!("{below}{}", entry.file_name().to_str().unwrap());
            if entry.path().is_dir() {
                count += headers_alone(from, to, &format!("{name}/"));
            } else if let Some(plain) = name.strip_suffix(".glsl") {
                let text = fs::read_to_string(entry.path()).unwrap();
                let head: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("//! ")).collect();
                let lines = |prefix: &str| head.iter().map(|line| format!("{prefix}{line}\n")).collect::<String>();
                let given = head.iter().filter_map(|line| line.strip_prefix("given "));
                // A header with its own main is a complete shader, unless main has another name.
                let main = text.contains("\nvoid main()") && !text.contains("#define main");
                let shader = format!(
                    "#version 460\n#extension GL_GOOGLE_include_directive : require\n\
                     #extension GL_EXT_scalar_block_layout : require\n{}{}\n#include \"{name}\"\n{}\n",
                    lines("//! "),
                    given.collect::<Vec<_>>().join("\n"),
                    if main { "" } else { "void main() {}" },
                );
                let stage = if head.contains(&"fragment") { "frag" } else { "comp" };
                fs::copy(entry.path(), to.join(&name)).unwrap();
                fs::write(to.join(format!("{plain}.{stage}")), shader).unwrap();
                count += 1;
            }
        }
        count
    }

    #[test]
    fn every_header_compiles_alone() {
        let folder = tempfile::tempdir().unwrap();
        let count = headers_alone(Path::new("glsl"), folder.path(), "");
        match compile_all(folder.path(), &Sink) {
            Ok(forms) => assert!(forms.len() >= count && count > 50, "{count} headers in {} forms", forms.len()),
            Err(messages) => panic!("a header uses what it does not include:\n{messages}"),
        }
    }

    #[test]
    fn constants_are_numbered_in_their_order() {
        let text = "layout(local_size_x_id, local_size_y = 2) in;\n\
                    layout(constant_id )const bool ON=true;\nint constant_id = 3;";
        let (numbered, names) = numbered(text);
        assert_eq!(names, ["local_size_x", "ON"]);
        let expected = text.replace("x_id", "x_id = 0").replace("constant_id )", "constant_id = 1 )");
        assert_eq!(numbered, expected);
    }
}
