//! Checks the whole document before anything is loaded, including objects that the scene does not use: a file with an index
//! out of range or a view past the end of its buffer is damaged.

use gltf::json::Index;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked;

use super::accessor::{Data, Problem, missing};
use super::document::image_of;

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
    for (index, accessor) in document.accessors.iter().enumerate() {
        let view = accessor.buffer_view.map(|v| v.value());
        exists("buffer view", view, document.buffer_views.len())?;
        if view.is_none_or(|v| data.has(v)) {
            data.check(index)?;
        }
    }
    for (mesh, primitive) in
        document.meshes.iter().enumerate().flat_map(|(m, mesh)| mesh.primitives.iter().map(move |p| (m, p)))
    {
        let targets =
            primitive.targets.iter().flatten().flat_map(|t| [&t.positions, &t.normals, &t.tangents]).flatten();
        for accessor in primitive.attributes.values().chain(targets).chain(&primitive.indices) {
            exists("accessor", Some(accessor.value()), document.accessors.len())?;
        }
        exists("material", primitive.material.as_ref().map(Index::value), document.materials.len())?;
        compressed(data, mesh, primitive)?;
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

/// Refuses a compressed primitive without an uncompressed copy: its accessors would all be zeros.
fn compressed(data: &Data, mesh: usize, primitive: &Primitive) -> Result<(), Problem> {
    const DRACO: &str = "KHR_draco_mesh_compression";
    let position = primitive.attributes.get(&Checked::Valid(Semantic::Positions));
    let position = position.map(|a| &data.document.accessors[a.value()]);
    let compressed = primitive.extensions.as_ref().is_some_and(|e| e.others.contains_key(DRACO));
    if compressed && position.is_some_and(|p| p.buffer_view.is_none()) {
        return Err(format!(
            "mesh {mesh} is compressed by {DRACO}, which is not supported; export the scene without it"
        ));
    }
    Ok(())
}
