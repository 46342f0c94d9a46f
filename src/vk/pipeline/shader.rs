//! The SPIR-V that the build compiled from `glsl/`, by the shader's path in that folder.

use super::bind::COUNTS;
use super::constants::{Constant, Value};
use super::reflect::{self, Binding, StageInfo, StructLayout};
use super::specialize::{Choices, specialize};
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::LazyLock;
#[cfg(feature = "hot-reload")]
use {
    std::sync::atomic::{AtomicU64, Ordering},
    std::sync::{PoisonError, RwLock},
};

/// A form of a shader that the build compiled.
struct Built {
    name: &'static str,
    /// The range of its words among those of all shaders.
    words: Range<usize>,
    /// The specialisation constants that it declares.
    constants: &'static [&'static str],
}

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// The names of all compiled shaders, sorted, such as `cones/voxelise.geom`.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHADERS.iter().map(|shader| shader.name)
}

/// The words of the shader `name`. Panics if no such file was compiled, which is a mistake in the program.
pub fn spirv(name: &str) -> &'static [u32] {
    entry(name).1
}

/// The specialisation constants that the shader `name` uses, with their default values.
pub fn constants(name: &str) -> Vec<(String, Value)> {
    reflect::constants(spirv(name))
}

/// The words of the shader `name`, specialised with these constants as for a pipeline.
pub fn specialized(name: &str, constants: &[Constant]) -> Vec<u32> {
    specialize(spirv(name), &Choices { constants, ..Choices::default() })
}

/// The module `words` with the changes for a driver that loses descriptors in loops: see `src/vk/pipeline/early.rs`.
pub fn loading_early(words: &[u32]) -> Vec<u32> {
    specialize(words, &Choices { loads_early: true, ..Choices::default() })
}

/// The stage of the shader `name`, and its bindings without counting.
pub fn reflected(name: &str) -> (StageInfo, Vec<Binding>) {
    let module = reflect::module(entry(name));
    (module.info, module.bindings.into_iter().filter(|binding| binding.name != COUNTS).collect())
}

/// Whether the shader `name`, or any header, declares the specialisation constant `constant`.
pub(in crate::vk) fn declares(name: &str, constant: &str) -> bool {
    SHADERS[place(name)].constants.contains(&constant) || HEADER_CONSTANTS.contains(&constant)
}

/// Shaders of hot reload that replace those of the build.
#[cfg(feature = "hot-reload")]
static REPLACED: RwLock<BTreeMap<&str, &[u32]>> = RwLock::new(BTreeMap::new());

/// The number of replacements so far.
#[cfg(feature = "hot-reload")]
static GENERATION: AtomicU64 = AtomicU64::new(0);

/// The number of replacements so far: pipelines of different generations may have different words.
pub(in crate::vk) fn generation() -> u64 {
    #[cfg(feature = "hot-reload")]
    return GENERATION.load(Ordering::Acquire);
    #[cfg(not(feature = "hot-reload"))]
    0
}

/// Whether shaders were edited since the program was built. Edited ones need not use everything that passes give them.
pub(in crate::vk) fn are_edited() -> bool {
    generation() > 0
}

/// Replaces the words of these shaders, whether or not they are in use, and returns their number. The words are never
/// freed, because pipelines may still read them.
///
/// # Errors
/// A shader uses a resource that the program does not give it. Then nothing is replaced.
#[cfg(feature = "hot-reload")]
pub(in crate::vk) fn replace(shaders: BTreeMap<String, Vec<u32>>) -> crate::Result<usize> {
    let mut found = Vec::new();
    for (name, words) in shaders {
        // No pass uses a shader that was added after the build.
        if let Ok(index) = find(&name) {
            let own = built(index);
            let new: &'static [u32] = words.leak();
            reflect::check_same_interface(own, (own.0, new))?;
            found.push((own.0, new));
        }
    }
    let count = found.len();
    REPLACED.write().unwrap_or_else(PoisonError::into_inner).extend(found);
    GENERATION.fetch_add(1, Ordering::Release);
    Ok(count)
}

/// Name and words, which live as long as the program.
pub(in crate::vk) fn entry(name: &str) -> (&'static str, &'static [u32]) {
    let own = built(place(name));
    #[cfg(feature = "hot-reload")]
    if let Some(words) = REPLACED.read().unwrap_or_else(PoisonError::into_inner).get(own.0) {
        return (own.0, words);
    }
    own
}

fn find(name: &str) -> Result<usize, usize> {
    SHADERS.binary_search_by(|shader| shader.name.cmp(name))
}

fn place(name: &str) -> usize {
    find(name).unwrap_or_else(|_| panic!("there is no shader glsl/{name}"))
}

fn built(place: usize) -> (&'static str, &'static [u32]) {
    static WORDS: LazyLock<Vec<u32>> = LazyLock::new(|| {
        let compressed = include_bytes!(concat!(env!("OUT_DIR"), "/shaders.zst"));
        let bytes = zstd::decode_all(&compressed[..]).expect("the build compressed it");
        bytemuck::pod_collect_to_vec(&bytes)
    });
    let shader = &SHADERS[place];
    (shader.name, &WORDS[shader.words.clone()])
}

/// The compiler's layout of every named struct in the buffers and push blocks of shader `name`: offsets and sizes in
/// bytes.
pub fn structs(name: &str) -> BTreeMap<String, StructLayout> {
    reflect::structs(entry(name))
}
