//! The SPIR-V that the build compiled from `glsl/`, by the shader's path below that folder.

use super::reflect::{self, StructLayout};
use std::collections::BTreeMap;

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

/// Name and words, both with the life of the program.
pub(super) fn entry(name: &str) -> (&'static str, &'static [u32]) {
    let index = SHADERS
        .binary_search_by(|(known, _)| (*known).cmp(name))
        .unwrap_or_else(|_| panic!("there is no shader glsl/{name}"));
    let (name, bytes) = SHADERS[index];
    (name, bytemuck::cast_slice(&bytes.0))
}

/// The layout of every named struct that the buffers and push blocks of shader `name` hold, as the compiler laid it
/// out: offsets and sizes in bytes.
pub fn structs(name: &str) -> BTreeMap<String, StructLayout> {
    reflect::structs(entry(name))
}
