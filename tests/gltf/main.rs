//! The glTF loader: results for valid files, messages for damaged ones.

mod compressed;
mod damage;
mod files;
mod instanced;
mod load;
mod materials;
#[path = "../fuzz/random.rs"]
mod random;
mod textures;
mod tolerance;
#[path = "../common/valid.rs"]
mod valid;
