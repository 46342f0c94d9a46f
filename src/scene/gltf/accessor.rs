//! Typed reading of accessors with bounds checks: strides, sparse substitution, normalised integers.

use gltf::json::accessor::ComponentType;
use gltf::json::buffer::View;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor, Index};

use super::document::{Document, size};

/// Elements that an accessor without a buffer view may declare. All other sizes are limited by the size of the file, so a
/// damaged file cannot make the loader allocate much more memory than the file has bytes.
const UNBACKED_ELEMENTS_MAX: usize = 1 << 22;

/// What is wrong with a file, as a sentence without the file's name.
pub type Problem = String;

/// A document and the bytes of its buffers.
pub struct Data<'a> {
    pub document: &'a Document,
    pub buffers: &'a [Option<Vec<u8>>],
}

/// One component as a float. glTF 2.0, 3.6.2.2 and 3.11: normalised signed integers are clamped at −1.
fn read_f32(component: ComponentType, b: &[u8], normalized: bool) -> f32 {
    let (value, max) = match component {
        ComponentType::I8 => (f32::from(b[0] as i8), 127.0),
        ComponentType::U8 => (f32::from(b[0]), 255.0),
        ComponentType::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
        ComponentType::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
        ComponentType::U32 => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32, u32::MAX as f32),
        ComponentType::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
    };
    if normalized { (value / max).max(-1.0) } else { value }
}

/// One component as an unsigned integer; `None` if it is signed or a float.
fn read_u32(component: ComponentType, b: &[u8]) -> Option<u32> {
    match component {
        ComponentType::U8 => Some(u32::from(b[0])),
        ComponentType::U16 => Some(u32::from(u16::from_le_bytes([b[0], b[1]]))),
        ComponentType::U32 => Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        _ => None,
    }
}

/// `count` elements of `size` bytes each, from byte `offset` of a buffer view on.
#[derive(Clone, Copy)]
struct Range {
    offset: usize,
    size: usize,
    count: usize,
}

/// The bytes of a [`Range`], whose elements lie `stride` bytes apart. All elements are inside `bytes`.
struct Span<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Span<'a> {
    fn elements(&self) -> impl Iterator<Item = &'a [u8]> + '_ {
        (0..self.count).map(|i| &self.bytes[i * self.stride..i * self.stride + self.size])
    }
}

/// The elements that an accessor declares: `count` of `width` components each.
struct Layout<'a> {
    accessor: &'a Accessor,
    component: ComponentType,
    width: usize,
    count: usize,
}

impl<'a> Data<'a> {
    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<&'a [u8], Problem> {
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

    fn span(&self, what: &str, view: usize, range: Range) -> Result<Span<'a>, Problem> {
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
            Some(end) if end <= bytes.len() => Ok(Span { bytes: &bytes[offset..], stride, size, count }),
            _ => Err(format!(
                "{what} needs {count} elements of {size} bytes and buffer view {view} has only {} bytes; export the file again",
                bytes.len()
            )),
        }
    }

    fn accessor(&self, index: usize) -> Result<Layout<'a>, Problem> {
        let accessor = self.document.accessors.get(index).ok_or_else(|| missing("accessor", index))?;
        let stated = |key: &str| self.document.stated(&format!("/accessors/{index}/{key}"));
        let Checked::Valid(component) = accessor.component_type else {
            let code = stated("componentType");
            return Err(format!("accessor {index} has component type {code}, which glTF does not define"));
        };
        let Checked::Valid(kind) = accessor.type_ else {
            return Err(format!("accessor {index} has type \"{}\", which glTF does not define", stated("type")));
        };
        let count = size(accessor.count);
        if accessor.buffer_view.is_none() && count > UNBACKED_ELEMENTS_MAX {
            return Err(format!(
                "accessor {index} declares {count} elements without data; at most {UNBACKED_ELEMENTS_MAX} can be read"
            ));
        }
        Ok(Layout { accessor, component: component.0, width: kind.multiplicity(), count })
    }

    /// The bytes of an accessor; `None` without a buffer view.
    fn base(&self, index: usize, layout: &Layout) -> Result<Option<Span<'a>>, Problem> {
        let Some(view) = layout.accessor.buffer_view else { return Ok(None) };
        let offset = layout.accessor.byte_offset.map_or(0, size);
        let range = Range { offset, size: layout.component.size() * layout.width, count: layout.count };
        self.span(&format!("accessor {index}"), view.value(), range).map(Some)
    }

    /// Whether accessor `index` lies within its buffer view. Sparse parts are checked when they are read.
    pub fn check(&self, index: usize) -> Result<(), Problem> {
        self.base(index, &self.accessor(index)?).map(drop)
    }

    /// Converts every element by `read`, with sparse substitution. Elements without data are `zero`.
    fn collect<T: Clone>(
        &self,
        index: usize,
        zero: T,
        mut read: impl FnMut(ComponentType, &[u8]) -> Result<T, Problem>,
    ) -> Result<Vec<T>, Problem> {
        let layout = self.accessor(index)?;
        let Layout { accessor, component, width, count } = layout;
        let mut out = match self.base(index, &layout)? {
            Some(span) => span.elements().map(|bytes| read(component, bytes)).collect::<Result<Vec<_>, _>>()?,
            None => vec![zero; count],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(out) };
        let (indices, values) = (&sparse.indices, &sparse.values);
        let Checked::Valid(key) = indices.component_type else {
            return Err(format!("accessor {index} has sparse indices that are not unsigned integers"));
        };
        let what = format!("accessor {index} (sparse)");
        let part = |view: Index<View>, offset: USize64, bytes: usize| {
            self.span(&what, view.value(), Range { offset: size(offset), size: bytes, count: size(sparse.count) })
        };
        let keys = part(indices.buffer_view, indices.byte_offset, key.0.size())?;
        let values = part(values.buffer_view, values.byte_offset, component.size() * width)?;
        for (at, value) in keys.elements().zip(values.elements()) {
            let at = read_u32(key.0, at).unwrap_or(u32::MAX);
            let slot = out.get_mut(at as usize);
            *slot
                .ok_or_else(|| format!("accessor {index} has sparse index {at} of {count}; export the file again"))? =
                read(component, value)?;
        }
        Ok(out)
    }

    fn misfit(&self, index: usize) -> Problem {
        let kind = self.document.stated(&format!("/accessors/{index}/type"));
        format!("accessor {index} has type {kind}, which does not fit its use")
    }

    /// Accessor `index` as vectors of `N` floats. Only with `pad` may elements have fewer components; `pad` gives the others.
    pub fn floats<const N: usize>(&self, index: usize, pad: Option<[f32; N]>) -> Result<Vec<[f32; N]>, Problem> {
        let Layout { accessor, width, .. } = self.accessor(index)?;
        if width != N && (pad.is_none() || width > N) {
            return Err(self.misfit(index));
        }
        let fill = pad.unwrap_or([0.0; N]);
        let zero = std::array::from_fn(|i| if i < width { 0.0 } else { fill[i] });
        self.collect(index, zero, |component, bytes| {
            let mut value = fill;
            for (slot, b) in value.iter_mut().zip(bytes.chunks_exact(component.size())) {
                *slot = read_f32(component, b, accessor.normalized);
            }
            Ok(value)
        })
    }

    /// Accessor `index` as vectors of `N` unsigned integers (indices, joints).
    pub fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, Problem> {
        if self.accessor(index)?.width != N {
            return Err(self.misfit(index));
        }
        self.collect(index, [0; N], |component, bytes| {
            let mut value = [0; N];
            for (slot, b) in value.iter_mut().zip(bytes.chunks_exact(component.size())) {
                *slot =
                    read_u32(component, b).ok_or_else(|| format!("accessor {index} must hold unsigned integers"))?;
            }
            Ok(value)
        })
    }
}

/// The message for an index `index` into the document's list of `what` that is out of range.
pub fn missing(what: &str, index: usize) -> Problem {
    format!("{what} {index} is used but does not exist; export the file again")
}
