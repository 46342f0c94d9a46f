//! Typed reading of accessors with bounds checks: strides, sparse substitution, normalised integers.

use gltf::json::accessor::ComponentType;
use gltf::json::buffer::View;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Index};

use super::document::{Document, size};
use super::draco::Unpacked;

/// Elements that an accessor without a buffer view may declare. All other sizes are limited by the size of the file, so
/// a damaged file cannot make the loader allocate much more memory than the file has bytes.
const UNBACKED_ELEMENTS_MAX: usize = 1 << 22;

/// Description of a fault in a file, as a sentence without the file's name.
pub type Problem = String;

/// A document and the bytes of its buffers.
pub struct Data<'a> {
    pub document: &'a Document,
    pub buffers: &'a [Option<Vec<u8>>],
    /// Content of compressed buffer views; `None` for the others.
    pub decoded: &'a [Option<Vec<u8>>],
    /// Content of the stream of the primitive that is read, if it is compressed.
    pub unpacked: Option<&'a Unpacked>,
    /// For each material, the two sets of texture coordinates that its meshes keep.
    pub uv_sets: &'a [[u32; 2]],
    /// The vertices that are read; `None` for all.
    pub picked: Option<Picked<'a>>,
}

/// A small subset of the vertices of a primitive.
#[derive(Clone, Copy)]
pub struct Picked<'a> {
    pub vertices: &'a [u32],
    /// The number of vertices of the primitive; all indices are smaller.
    pub of: usize,
}

/// One component as f64, and the value that represents 1 if it is normalised.
fn number(component: ComponentType, b: &[u8]) -> (f64, f32) {
    match component {
        ComponentType::I8 => (f64::from(b[0] as i8), 127.0),
        ComponentType::U8 => (f64::from(b[0]), 255.0),
        ComponentType::I16 => (f64::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
        ComponentType::U16 => (f64::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
        ComponentType::U32 => (f64::from(u32::from_le_bytes([b[0], b[1], b[2], b[3]])), u32::MAX as f32),
        ComponentType::F32 => (f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])), 1.0),
    }
}

/// `count` elements of `size` bytes each, from byte `offset` of a buffer view.
struct Range {
    offset: usize,
    size: usize,
    count: usize,
}

/// Elements in `bytes`, `stride` bytes apart; all of them lie within.
struct Elements<'a> {
    bytes: &'a [u8],
    range: Range,
    stride: usize,
}

impl<'a> Elements<'a> {
    /// The bytes of each element.
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        (0..self.range.count).map(|i| self.at(i))
    }

    fn at(&self, index: usize) -> &'a [u8] {
        let Self { bytes, range: Range { offset, size, .. }, stride } = *self;
        &bytes[offset + index * stride..][..size]
    }
}

/// Layout that an accessor declares: elements of `width` components each.
pub struct Layout<'a> {
    accessor: &'a Accessor,
    pub component: ComponentType,
    pub width: usize,
}

impl<'a> Data<'a> {
    /// Whether a buffer view has bytes. A buffer without data belongs to an extension, and only the extension uses its
    /// views.
    pub fn has(&self, view: usize) -> bool {
        let buffer = self.document.buffer_views.get(view).and_then(|view| self.buffers.get(view.buffer.value()));
        self.decoded.get(view).is_some_and(Option::is_some) || buffer.is_some_and(Option::is_some)
    }

    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<&'a [u8], Problem> {
        if let Some(Some(bytes)) = self.decoded.get(index) {
            return Ok(bytes);
        }
        let view = self.document.buffer_views.get(index).ok_or_else(|| missing("buffer view", index))?;
        let number = view.buffer.value();
        let buffer = self.buffers.get(number).ok_or_else(|| missing("buffer", number))?;
        let buffer = buffer.as_deref().ok_or_else(|| format!("buffer {number} has no data; export the file again"))?;
        let offset = view.byte_offset.map_or(0, size);
        let end = offset.checked_add(size(view.byte_length)).filter(|end| *end <= buffer.len());
        let end = end.ok_or_else(|| {
            format!(
                "buffer view {index} ends after the end of buffer {number} of {} bytes; export the file again",
                buffer.len()
            )
        })?;
        Ok(&buffer[offset..end])
    }

    /// The elements of `range` in a buffer view. `what` is for messages.
    fn elements(&self, what: &str, view: usize, range: Range) -> Result<Elements<'a>, Problem> {
        let Range { offset, size, count } = range;
        let bytes = self.view(view)?;
        let stride = self.document.buffer_views[view].byte_stride.map(|s| s.0).filter(|s| *s > 0).unwrap_or(size);
        if stride < size {
            return Err(format!(
                "buffer view {view} has a stride of {stride} below the {size} bytes of an element; export the file again"
            ));
        }
        let end = match count {
            0 => Some(offset),
            _ => (count - 1).checked_mul(stride).and_then(|n| n.checked_add(size)).and_then(|n| n.checked_add(offset)),
        };
        match end {
            Some(end) if end <= bytes.len() => Ok(Elements { bytes, range, stride }),
            _ => Err(format!(
                "{what} needs {count} elements of {size} bytes and buffer view {view} has only {} bytes; export the file again",
                bytes.len()
            )),
        }
    }

    /// Layout that accessor `index` declares.
    pub fn layout(&self, index: usize) -> Result<Layout<'a>, Problem> {
        let accessor = self.document.accessors.get(index).ok_or_else(|| missing("accessor", index))?;
        let stated = |key: &str| self.document.stated(&format!("/accessors/{index}/{key}"));
        let Checked::Valid(component) = accessor.component_type else {
            let code = stated("componentType");
            return Err(format!(
                "accessor {index} has component type {code}, which glTF does not define; export the file again"
            ));
        };
        let Checked::Valid(kind) = accessor.type_ else {
            return Err(format!(
                "accessor {index} has type \"{}\", which glTF does not define; export the file again",
                stated("type")
            ));
        };
        Ok(Layout { accessor, component: component.0, width: kind.multiplicity() })
    }

    /// The elements of an accessor without its sparse part; `None` without data.
    fn base(&self, index: usize, layout: &Layout) -> Result<Option<Elements<'a>>, Problem> {
        let Layout { accessor, component, width } = layout;
        let (bytes, count) = (component.size() * width, size(accessor.count));
        if let Some(unpacked) = self.unpacked.and_then(|unpacked| unpacked.accessors.get(&index)) {
            let range = Range { offset: 0, size: bytes, count: unpacked.len() / bytes };
            return Ok(Some(Elements { bytes: unpacked, range, stride: bytes }));
        }
        let Some(view) = accessor.buffer_view else {
            if count > UNBACKED_ELEMENTS_MAX {
                return Err(format!(
                    "accessor {index} declares {count} elements without data; at most {UNBACKED_ELEMENTS_MAX} can be read"
                ));
            }
            return Ok(None);
        };
        let range = Range { offset: accessor.byte_offset.map_or(0, size), size: bytes, count };
        self.elements(&format!("accessor {index}"), view.value(), range).map(Some)
    }

    /// The number of elements of accessor `index`.
    pub fn count(&self, index: usize) -> Result<usize, Problem> {
        let layout = self.layout(index)?;
        let elements = self.base(index, &layout)?;
        Ok(elements.map_or_else(|| size(layout.accessor.count), |elements| elements.range.count))
    }

    /// Whether accessor `index` lies within its buffer view. Sparse parts are checked when they are read.
    pub fn check(&self, index: usize) -> Result<(), Problem> {
        self.base(index, &self.layout(index)?).map(drop)
    }

    /// Accessor `index` as vectors of `N` components, converted by `convert`, with sparse substitution. Elements
    /// without data are zero. Elements with fewer components are allowed only with `pad`, which completes them.
    fn vectors<const N: usize, T: Copy + Default>(
        &self,
        index: usize,
        pad: Option<[T; N]>,
        convert: impl Fn(&Layout, &[u8]) -> Result<T, Problem>,
    ) -> Result<Vec<[T; N]>, Problem> {
        let layout = self.layout(index)?;
        let Layout { accessor, component, width } = layout;
        if width != N && (pad.is_none() || width > N) {
            let kind = self.document.stated(&format!("/accessors/{index}/type"));
            return Err(format!("accessor {index} has type {kind}, which does not fit its use; export the file again"));
        }
        let fill = pad.unwrap_or([T::default(); N]);
        let zero = std::array::from_fn(|i| if i < width { T::default() } else { fill[i] });
        let read = |bytes: &[u8]| {
            let mut value = fill;
            for (slot, b) in value.iter_mut().zip(bytes.chunks_exact(component.size())) {
                *slot = convert(&layout, b)?;
            }
            Ok(value)
        };
        let count = size(accessor.count);
        let base = self.base(index, &layout)?;
        let has = base.as_ref().map_or(count, |elements| elements.range.count);
        if let Some(Picked { of, .. }) = self.picked.filter(|picked| picked.of != has) {
            return Err(format!("accessor {index} has {has} elements for {of} vertices; export the file again"));
        }
        let picked = |all: &dyn Fn(usize) -> Result<[T; N], Problem>| {
            let picked = self.picked.into_iter().flat_map(|picked| picked.vertices);
            picked.map(|&vertex| all(vertex as usize)).collect()
        };
        let mut out = match (base, &accessor.sparse) {
            (Some(elements), None) if self.picked.is_some() => return picked(&|vertex| read(elements.at(vertex))),
            (Some(elements), _) => elements.iter().map(read).collect::<Result<Vec<_>, Problem>>()?,
            (None, None) if self.picked.is_some() => return picked(&|_| Ok(zero)),
            (None, _) => vec![zero; count],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(out) };
        let Checked::Valid(key) = sparse.indices.component_type else {
            return Err(format!(
                "accessor {index} has sparse indices that are not unsigned integers; export the file again"
            ));
        };
        let what = format!("accessor {index} (sparse)");
        let part = |view: Index<View>, offset: USize64, bytes: usize| {
            self.elements(&what, view.value(), Range { offset: size(offset), size: bytes, count: size(sparse.count) })
        };
        let keys = part(sparse.indices.buffer_view, sparse.indices.byte_offset, key.0.size())?;
        let values = part(sparse.values.buffer_view, sparse.values.byte_offset, component.size() * width)?;
        for (at, value) in keys.iter().zip(values.iter()) {
            let at = number(key.0, at).0 as usize;
            let slot = out
                .get_mut(at)
                .ok_or_else(|| format!("accessor {index} has sparse index {at} of {count}; export the file again"))?;
            *slot = read(value)?;
        }
        if self.picked.is_some() { picked(&|vertex| Ok(out[vertex])) } else { Ok(out) }
    }

    /// Accessor `index` as vectors of `N` floats; `pad` completes shorter elements. glTF 2.0, 3.6.2.2 and 3.11:
    /// normalised signed integers are clamped at −1.
    pub fn floats<const N: usize>(&self, index: usize, pad: Option<[f32; N]>) -> Result<Vec<[f32; N]>, Problem> {
        self.vectors(index, pad, |layout, bytes| {
            let (value, one) = number(layout.component, bytes);
            let normalized = layout.accessor.normalized && layout.component != ComponentType::F32;
            Ok(if normalized { (value as f32 / one).max(-1.0) } else { value as f32 })
        })
    }

    /// Accessor `index` as vectors of `N` unsigned integers (indices, joints).
    pub fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, Problem> {
        self.vectors(index, None, |layout, bytes| match layout.component {
            ComponentType::U8 | ComponentType::U16 | ComponentType::U32 => Ok(number(layout.component, bytes).0 as u32),
            _ => Err(format!("accessor {index} must hold unsigned integers; export the file again")),
        })
    }
}

/// The message for an index `index` into the document's list of `what` that is out of range.
pub fn missing(what: &str, index: usize) -> Problem {
    format!("{what} {index} is used but does not exist; export the file again")
}
