//! Checks the whole document before anything is loaded, including objects that the scene does not use: a file with an
//! index out of range or a view past the end of its buffer is damaged.

use std::collections::BTreeSet;

use gltf::json::Index;
use gltf::json::mesh::Primitive;

use super::accessor::{Data, Problem, missing};
use super::document::image_of;
use super::draco;

/// Checks every buffer view, accessor, primitive, texture and image of the document.
pub fn document(data: &Data) -> Result<(), Problem> {
    let document = data.document;
    let exists = |what: &str, index: Option<usize>, count: usize| match index {
        Some(index) if index >= count => Err(missing(what, index)),
        _ => Ok(()),
    };
    for (index, view) in document.buffer_views.iter().enumerate() {
        exists("buffer", Some(view.buffer.value()), data.buffers.len())?;
        if data.has(index) {
            data.view(index)?;
        }
    }
    let packed = primitives(data).filter(|p| draco::is_packed(p));
    let packed = packed.flat_map(|p| p.attributes.values().chain(&p.indices)).map(Index::value);
    let packed: BTreeSet<usize> = packed.collect();
    for (index, accessor) in document.accessors.iter().enumerate() {
        let view = accessor.buffer_view.map(|v| v.value());
        exists("buffer view", view, document.buffer_views.len())?;
        // Accessors of a compressed primitive without a view describe data that is known only when it is decoded.
        if view.map_or(!packed.contains(&index), |view| data.has(view)) {
            data.check(index)?;
        }
    }
    for primitive in primitives(data) {
        let targets =
            primitive.targets.iter().flatten().flat_map(|t| [&t.positions, &t.normals, &t.tangents]).flatten();
        for accessor in primitive.attributes.values().chain(targets).chain(&primitive.indices) {
            exists("accessor", Some(accessor.value()), document.accessors.len())?;
        }
        exists("material", primitive.material.as_ref().map(Index::value), document.materials.len())?;
    }
    for texture in &document.textures {
        exists("image", image_of(texture), document.images.len())?;
        exists("sampler", texture.sampler.as_ref().map(Index::value), document.samplers.len())?;
    }
    for image in &document.images {
        exists("buffer view", image.buffer_view.as_ref().map(Index::value), document.buffer_views.len())?;
    }
    Ok(())
}

fn primitives<'a>(data: &Data<'a>) -> impl Iterator<Item = &'a Primitive> + use<'a> {
    data.document.meshes.iter().flat_map(|mesh| &mesh.primitives)
}
