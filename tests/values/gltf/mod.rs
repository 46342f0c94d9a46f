//! The glTF loader: results for valid files, messages for damaged ones.

mod compressed;
mod damage;
mod files;
mod folders;
mod instanced;
mod load;
mod materials;
mod nodes;
mod textures;
mod tolerance;
