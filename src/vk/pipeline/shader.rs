//! The SPIR-V that the build compiled from `glsl/`, by the shader's path below that folder.

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

/// A form of a shader, as the build compiled it.
struct Built {
    name: &'static str,
    /// Where its words stand among those of all.
    words: Range<usize>,
    /// The specialisation constants that it declares.
    constants: &'static [&'static str],
}

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// The names of all compiled shaders, sorted, such as `cones/voxelise.geom`.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHADERS.iter().map(|shader| shader.name)
}

/// The words of the shader called `name`. Panics when no such file was compiled: a programming error.
pub fn spirv(name: &str) -> &'static [u32] {
    entry(name).1
}

/// The specialisation constants that the shader called `name` depends on, with their default values.
pub fn constants(name: &str) -> Vec<(String, Value)> {
    reflect::constants(spirv(name))
}

/// The words of the shader called `name` as a pipeline takes it that is given these constants.
pub fn specialized(name: &str, constants: &[Constant]) -> Vec<u32> {
    specialize(spirv(name), &Choices { constants, ..Choices::default() })
}

/// The module `words` as it is given to a driver that loses descriptors in loops: see `src/vk/pipeline/early.rs`.
pub fn loading_early(words: &[u32]) -> Vec<u32> {
    specialize(words, &Choices { loads_early: true, ..Choices::default() })
}

/// The stage of the shader called `name`, and what it binds where it counts nothing.
pub fn reflected(name: &str) -> (StageInfo, Vec<Binding>) {
    let module = reflect::module(entry(name));
    (module.info, module.bindings.into_iter().filter(|binding| binding.name != COUNTS).collect())
}

/// Whether the shader called `name`, or any header, declares the specialisation constant `constant`.
pub(in crate::vk) fn declares(name: &str, constant: &str) -> bool {
    SHADERS[place(name)].constants.contains(&constant) || HEADER_CONSTANTS.contains(&constant)
}

/// Shaders that hot reload put in the place of those that the build compiled.
#[cfg(feature = "hot-reload")]
static REPLACED: RwLock<BTreeMap<&str, &[u32]>> = RwLock::new(BTreeMap::new());

/// How often shaders were replaced.
#[cfg(feature = "hot-reload")]
static GENERATION: AtomicU64 = AtomicU64::new(0);

/// Pipelines of different generations may be made of different words.
pub(in crate::vk) fn generation() -> u64 {
    #[cfg(feature = "hot-reload")]
    return GENERATION.load(Ordering::Acquire);
    #[cfg(not(feature = "hot-reload"))]
    0
}

/// Whether shaders were edited since the program was built: they need not take everything that passes give them.
pub(in crate::vk) fn are_edited() -> bool {
    generation() > 0
}

/// Takes other words for shaders of these names, whether or not they are read now; how many those are. The words are
/// never freed: pipelines under way may read them.
///
/// # Errors
/// One takes what the program does not give it. Then all stays as it is.
#[cfg(feature = "hot-reload")]
pub(in crate::vk) fn replace(shaders: BTreeMap<String, Vec<u32>>) -> crate::Result<usize> {
    let mut found = Vec::new();
    for (name, words) in shaders {
        // A shader that the program was built without is read by nothing.
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

/// Name and words, both with the life of the program.
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

/// The layout of every named struct that the buffers and push blocks of shader `name` hold, as the compiler laid it
/// out: offsets and sizes in bytes.
pub fn structs(name: &str) -> BTreeMap<String, StructLayout> {
    reflect::structs(entry(name))
}
