//! The glTF loader: what it makes of good files and how it refuses bad ones.

mod damage;
mod files;
mod load;
