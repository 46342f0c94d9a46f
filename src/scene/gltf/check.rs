//! Checks what nothing on screen may use: a file with a dangling index or a view past its buffer is damaged, and says so
//! before it is half loaded.

use super::accessor::{Data, Problem, missing};
use super::document::Primitive;

/// Every buffer view, accessor, primitive, texture and image of the document.
pub fn document(data: &Data) -> Result<(), Problem> {
    let document = data.document;
    let exists = |what: &str, index: Option<usize>, count: usize| match index {
        Some(index) if index >= count => Err(missing(what, index)),
        _ => Ok(()),
    };
    for (index, view) in document.buffer_views.iter().enumerate() {
        exists("buffer", Some(view.buffer), data.buffers.len())?;
        // Buffers without data belong to extensions, which may leave the views on them unused.
        if data.buffers[view.buffer].is_some() {
            data.view(index)?;
        }
    }
    for (index, accessor) in document.accessors.iter().enumerate() {
        exists("buffer view", accessor.buffer_view, document.buffer_views.len())?;
        let has_data = |view: usize| data.buffers[document.buffer_views[view].buffer].is_some();
        if accessor.buffer_view.is_none_or(has_data) {
            data.check(index)?;
        }
    }
    for (mesh, primitive) in
        document.meshes.iter().enumerate().flat_map(|(m, mesh)| mesh.primitives.iter().map(move |p| (m, p)))
    {
        let accessors = primitive.attributes.values().chain(primitive.targets.iter().flat_map(|t| t.values()));
        for &accessor in accessors.chain(&primitive.indices) {
            exists("accessor", Some(accessor), document.accessors.len())?;
        }
        exists("material", primitive.material, document.materials.len())?;
        compressed(data, mesh, primitive)?;
    }
    for texture in &document.textures {
        exists("image", texture.source, document.images.len())?;
        exists("sampler", texture.sampler, document.samplers.len())?;
    }
    document.images.iter().try_for_each(|image| exists("buffer view", image.buffer_view, document.buffer_views.len()))
}

/// An optional compression extension without an uncompressed copy beside it leaves accessors of zeros.
fn compressed(data: &Data, mesh: usize, primitive: &Primitive) -> Result<(), Problem> {
    const DRACO: &str = "KHR_draco_mesh_compression";
    let position = primitive.attributes.get("POSITION").map(|&a| &data.document.accessors[a]);
    if primitive.extensions.contains_key(DRACO) && position.is_some_and(|p| p.buffer_view.is_none()) {
        return Err(format!(
            "mesh {mesh} is compressed by {DRACO}, which is not supported; export the scene without it"
        ));
    }
    Ok(())
}
