//! The SPIR-V that the build compiled from `glsl/`, by the shader's path below that folder.

use super::reflect::{self, StructLayout};
use std::collections::BTreeMap;
#[cfg(feature = "hot-reload")]
use {
    crate::Result,
    std::sync::atomic::{AtomicU64, Ordering},
    std::sync::{PoisonError, RwLock},
};

/// SPIR-V is a sequence of words; the bytes of a file alone would only be aligned to 1.
#[repr(C, align(4))]
struct Aligned<B: ?Sized>(B);
type AlignedWords = Aligned<[u8]>;

include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// The names of all compiled shaders, sorted, such as `cones/voxelise.geom`.
pub fn names() -> impl Iterator<Item = &'static str> {
    SHADERS.iter().map(|(name, _)| *name)
}

/// The words of the shader called `name`. Panics when no such file was compiled: a programming error.
pub fn spirv(name: &str) -> &'static [u32] {
    entry(name).1
}

/// The form of the shader called `name` that counts what it reads, where there is one; else the name itself.
pub(super) fn counted(name: &str) -> &str {
    let wanted = format!("counted/{name}");
    SHADERS.binary_search_by(|(known, _)| (*known).cmp(&wanted)).map_or(name, |index| SHADERS[index].0)
}

/// What hot reload put in the place of what the build compiled.
#[cfg(feature = "hot-reload")]
static REPLACED: RwLock<BTreeMap<&str, &[u32]>> = RwLock::new(BTreeMap::new());

/// How often shaders were replaced.
#[cfg(feature = "hot-reload")]
static GENERATION: AtomicU64 = AtomicU64::new(0);

/// Pipelines of different generations may be made of different words.
#[cfg(feature = "hot-reload")]
pub(super) fn generation() -> u64 {
    GENERATION.load(Ordering::Acquire)
}

/// Takes other words for shaders of these names, whether or not they are read now; how many those are. The words are never
/// freed: pipelines under way may read them.
///
/// # Errors
/// One takes what the program does not give it. Then all stays as it is.
#[cfg(feature = "hot-reload")]
pub(super) fn replace(shaders: BTreeMap<String, Vec<u32>>) -> Result<usize> {
    let mut found = Vec::new();
    for (name, words) in shaders {
        // A shader that the program was built without is read by nothing.
        if let Ok(index) = SHADERS.binary_search_by(|(known, _)| (*known).cmp(&name)) {
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
pub(super) fn entry(name: &str) -> (&'static str, &'static [u32]) {
    let index = SHADERS
        .binary_search_by(|(known, _)| (*known).cmp(name))
        .unwrap_or_else(|_| panic!("there is no shader glsl/{name}"));
    let own = built(index);
    #[cfg(feature = "hot-reload")]
    if let Some(words) = REPLACED.read().unwrap_or_else(PoisonError::into_inner).get(own.0) {
        return (own.0, words);
    }
    own
}

fn built(index: usize) -> (&'static str, &'static [u32]) {
    let (name, bytes) = SHADERS[index];
    (name, bytemuck::cast_slice(&bytes.0))
}

/// The layout of every named struct that the buffers and push blocks of shader `name` hold, as the compiler laid it
/// out: offsets and sizes in bytes.
pub fn structs(name: &str) -> BTreeMap<String, StructLayout> {
    reflect::structs(entry(name))
}
