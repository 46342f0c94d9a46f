//! KHR_draco_mesh_compression: primitives whose vertices and triangles are one Draco stream.
//!
//! The crate `draco-core` decodes the streams. It is Rust without unsafe code and limits the size of its results. The
//! limits are the sizes that the glTF accessors state and [`super::need`] has counted before.

use std::collections::BTreeMap;

use draco_core::{DataType, DecodeLimits, DecoderBuffer, ErrorKind, MeshDecoder, PointAttribute, PointIndex};
use gltf::json::accessor::ComponentType;
use gltf::json::mesh::{Primitive, Semantic};
use gltf::json::validation::Checked::Valid;
use serde::Deserialize;

use super::accessor::{Data, Problem, missing};
use super::container::shorten;
use super::document::{Document, size};

pub const NAME: &str = "KHR_draco_mesh_compression";

/// Bytes per vertex of a stream in addition to the attributes that glTF names.
const OTHER_BYTES: u64 = 64;

/// The extension's object at a primitive.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer_view: usize,
    /// Numbers of the stream's attributes, by the names of the primitive's attributes.
    attributes: BTreeMap<String, u32>,
}

/// Content of a stream.
pub struct Unpacked {
    /// For each accessor, by its number, the elements of its type one after another.
    pub accessors: BTreeMap<usize, Vec<u8>>,
    /// Three vertices per triangle.
    pub corners: Vec<u32>,
}

/// Whether a primitive is compressed.
pub fn is_packed(primitive: &Primitive) -> bool {
    primitive.extensions.as_ref().is_some_and(|e| e.others.contains_key(NAME))
}

/// The accessors of a primitive by their attributes' names.
fn accessors(primitive: &Primitive) -> impl Iterator<Item = (String, usize)> {
    primitive.attributes.iter().filter_map(|(name, accessor)| match name {
        Valid(semantic) => Some((semantic.to_string(), accessor.value())),
        _ => None,
    })
}

/// The maximum number of bytes of a stream's attributes, as stated by the accessors of its primitive.
pub fn bytes(document: &Document, primitive: &Primitive) -> u64 {
    let of = |accessor: usize| document.accessors.get(accessor);
    let element = |accessor: &gltf::json::Accessor| match (&accessor.component_type, &accessor.type_) {
        (Valid(component), Valid(kind)) => (component.0.size() * kind.multiplicity()) as u64,
        _ => 0,
    };
    let each = accessors(primitive).filter_map(|(_, accessor)| of(accessor)).map(element).sum::<u64>() + OTHER_BYTES;
    let position = primitive.attributes.get(&Valid(Semantic::Positions)).and_then(|a| of(a.value()));
    position.map_or(0, |position| size(position.count) as u64).saturating_mul(each)
}

/// Decodes a primitive; `None` if it is not compressed. `what` ("mesh 3 primitive 0") is for messages. The error is a
/// sentence, for damaged streams and for streams that hold other vertices or triangles than the accessors state.
pub fn unpack(data: &Data, primitive: &Primitive, what: &str) -> Result<Option<Unpacked>, Problem> {
    let Some(stated) = primitive.extensions.as_ref().and_then(|e| e.others.get(NAME)) else { return Ok(None) };
    let compressed = Compressed::deserialize(stated).map_err(|e| {
        let e = shorten(&e.to_string());
        format!("{what} is compressed by Draco, but how is not stated ({e}); export the file again")
    })?;
    let wrong = |problem: &str| format!("{what} is compressed by Draco and its bytes {problem}; export the file again");
    let count = |accessor: usize| {
        let accessor = data.document.accessors.get(accessor).ok_or_else(|| missing("accessor", accessor));
        accessor.map(|accessor| size(accessor.count))
    };
    let position = primitive.attributes.get(&Valid(Semantic::Positions)).map(|a| a.value());
    let vertices = position.map_or(Ok(0), count)?;
    let corners = primitive.indices.map_or(Ok(vertices), |indices| count(indices.value()))?;
    let limits = DecodeLimits::permissive()
        .with_max_points(vertices as u64)
        .with_max_faces(corners as u64 / 3)
        .with_max_decoded_bytes(bytes(data.document, primitive));
    let mut stream = DecoderBuffer::new(data.view(compressed.buffer_view)?).with_limits(limits);
    let mut mesh = draco_core::Mesh::new();
    MeshDecoder::new().decode(&mut stream, &mut mesh).map_err(|e| match e.kind() {
        ErrorKind::LimitExceeded => wrong("hold more than its accessors state"),
        _ => wrong("are damaged"),
    })?;
    if mesh.num_points() != vertices || 3 * mesh.num_faces() != corners {
        let (points, faces) = (mesh.num_points(), mesh.num_faces());
        let stated = corners / 3;
        return Err(wrong(&format!(
            "hold {points} vertices and {faces} triangles where its accessors state {vertices} and {stated}"
        )));
    }
    let mut unpacked = BTreeMap::new();
    for (name, accessor) in accessors(primitive) {
        let Some(&id) = compressed.attributes.get(&name) else { continue };
        let attribute = mesh.attribute_by_unique_id(id).ok_or_else(|| wrong(&format!("hold no {name}")))?;
        let component = data.layout(accessor)?;
        if usize::from(attribute.num_components()) != component.width {
            return Err(wrong(&format!("hold {name} of another type than accessor {accessor} states")));
        }
        let values = values(attribute, vertices, component.component);
        unpacked.insert(accessor, values.ok_or_else(|| wrong(&format!("hold no {name} for some vertex")))?);
    }
    let corners = mesh.faces().iter().flat_map(|face| face.map(|point| point.0)).collect();
    Ok(Some(Unpacked { accessors: unpacked, corners }))
}

/// The values of all vertices, converted to another component type, which can hold them if the file follows the
/// extension.
fn values(attribute: &PointAttribute, vertices: usize, component: ComponentType) -> Option<Vec<u8>> {
    let (kind, stride) = (attribute.data_type(), usize::try_from(attribute.byte_stride()).ok()?);
    let (width, bytes) = (usize::from(attribute.num_components()), attribute.buffer().data());
    let size = kind.byte_length();
    let mut out = Vec::with_capacity(vertices * width * component.size());
    for vertex in 0..vertices {
        let at = (attribute.mapped_index(PointIndex(vertex as u32)).0 as usize).checked_mul(stride)?;
        for value in bytes.get(at..at.checked_add(size * width)?)?.chunks_exact(size) {
            push(&mut out, component, number(kind, value)?);
        }
    }
    Some(out)
}

fn number(kind: DataType, b: &[u8]) -> Option<f64> {
    Some(match kind {
        DataType::Int8 => f64::from(i8::from_le_bytes([b[0]])),
        DataType::Uint8 => f64::from(b[0]),
        DataType::Int16 => f64::from(i16::from_le_bytes([b[0], b[1]])),
        DataType::Uint16 => f64::from(u16::from_le_bytes([b[0], b[1]])),
        DataType::Int32 => f64::from(i32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        DataType::Uint32 => f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        DataType::Float32 => f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        _ => return None,
    })
}

fn push(out: &mut Vec<u8>, component: ComponentType, value: f64) {
    match component {
        ComponentType::I8 => out.extend((value as i8).to_le_bytes()),
        ComponentType::U8 => out.push(value as u8),
        ComponentType::I16 => out.extend((value as i16).to_le_bytes()),
        ComponentType::U16 => out.extend((value as u16).to_le_bytes()),
        ComponentType::U32 => out.extend((value as u32).to_le_bytes()),
        ComponentType::F32 => out.extend((value as f32).to_le_bytes()),
    }
}
