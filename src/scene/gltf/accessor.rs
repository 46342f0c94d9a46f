//! Typed, bounds-checked reading of accessors: strides, sparse substitution, normalised integers.

use super::document::{Accessor, Document};

/// Elements without any bytes behind them (no buffer view) that an accessor may declare. Everything else is bounded by
/// the file's own size, so that no damaged file makes the loader allocate much more than it holds.
const UNBACKED_ELEMENTS_MAX: usize = 1 << 22;

/// What is wrong, without the file's name.
pub type Problem = String;

/// A document and its buffers' bytes.
pub struct Data<'a> {
    pub document: &'a Document,
    pub buffers: &'a [Option<Vec<u8>>],
}

#[derive(Clone, Copy, PartialEq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn from_code(code: u32) -> Option<Self> {
        Some(match code {
            5120 => Self::I8,
            5121 => Self::U8,
            5122 => Self::I16,
            5123 => Self::U16,
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// glTF 2.0, 3.6.2.2 and 3.11: normalised signed integers clamp at −1.
    fn read_f32(self, b: &[u8], normalized: bool) -> f32 {
        let (value, max) = match self {
            Self::I8 => (f32::from(b[0] as i8), 127.0),
            Self::U8 => (f32::from(b[0]), 255.0),
            Self::I16 => (f32::from(i16::from_le_bytes([b[0], b[1]])), 32767.0),
            Self::U16 => (f32::from(u16::from_le_bytes([b[0], b[1]])), 65535.0),
            Self::U32 => (u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32, u32::MAX as f32),
            Self::F32 => return f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        };
        if normalized { (value / max).max(-1.0) } else { value }
    }

    fn read_u32(self, b: &[u8]) -> Option<u32> {
        match self {
            Self::U8 => Some(u32::from(b[0])),
            Self::U16 => Some(u32::from(u16::from_le_bytes([b[0], b[1]]))),
            Self::U32 => Some(u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
            _ => None,
        }
    }
}

/// Where `count` elements of `size` bytes lie, `stride` apart. Proven to be inside `bytes`.
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

impl<'a> Data<'a> {
    /// The bytes of a buffer view.
    pub fn view(&self, index: usize) -> Result<&'a [u8], Problem> {
        let view = self.document.buffer_views.get(index).ok_or_else(|| missing("buffer view", index))?;
        let buffer = self.buffers.get(view.buffer).ok_or_else(|| missing("buffer", view.buffer))?;
        let buffer =
            buffer.as_deref().ok_or_else(|| format!("buffer {} has no data; export the file again", view.buffer))?;
        let end = view.byte_offset.checked_add(view.byte_length).filter(|end| *end <= buffer.len());
        let end = end.ok_or_else(|| {
            format!(
                "buffer view {index} ends behind buffer {} of {} bytes; export the file again",
                view.buffer,
                buffer.len()
            )
        })?;
        Ok(&buffer[view.byte_offset..end])
    }

    fn span(&self, what: &str, view: usize, offset: usize, size: usize, count: usize) -> Result<Span<'a>, Problem> {
        let bytes = self.view(view)?;
        let stride = self.document.buffer_views[view].byte_stride.filter(|stride| *stride > 0).unwrap_or(size);
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

    fn accessor(&self, index: usize) -> Result<(&'a Accessor, Component, usize), Problem> {
        let accessor = self.document.accessors.get(index).ok_or_else(|| missing("accessor", index))?;
        let component = Component::from_code(accessor.component_type).ok_or_else(|| {
            format!("accessor {index} has component type {}, which glTF does not know", accessor.component_type)
        })?;
        let width = match accessor.kind.as_str() {
            "SCALAR" => 1,
            "VEC2" => 2,
            "VEC3" => 3,
            "VEC4" | "MAT2" => 4,
            "MAT3" => 9,
            "MAT4" => 16,
            other => {
                return Err(format!(
                    "accessor {index} has type \"{}\", which glTF does not know",
                    super::container::shorten(other)
                ));
            }
        };
        if accessor.buffer_view.is_none() && accessor.count > UNBACKED_ELEMENTS_MAX {
            return Err(format!(
                "accessor {index} declares {} elements without data; at most {UNBACKED_ELEMENTS_MAX} can be read",
                accessor.count
            ));
        }
        Ok((accessor, component, width))
    }

    /// Whether accessor `index` lies within its buffer view. Sparse parts are checked when they are read.
    pub fn check(&self, index: usize) -> Result<(), Problem> {
        let (accessor, component, width) = self.accessor(index)?;
        let Some(view) = accessor.buffer_view else { return Ok(()) };
        let size = component.size() * width;
        self.span(&format!("accessor {index}"), view, accessor.byte_offset, size, accessor.count).map(drop)
    }

    /// Reads every element as `read` makes it, with sparse substitution; elements without data are `zero`.
    fn collect<T: Clone>(
        &self,
        index: usize,
        zero: T,
        mut read: impl FnMut(Component, &[u8]) -> Result<T, Problem>,
    ) -> Result<Vec<T>, Problem> {
        let (accessor, component, width) = self.accessor(index)?;
        let size = component.size() * width;
        let mut out = match accessor.buffer_view {
            Some(view) => {
                let span = self.span(&format!("accessor {index}"), view, accessor.byte_offset, size, accessor.count)?;
                span.elements().map(|bytes| read(component, bytes)).collect::<Result<Vec<_>, _>>()?
            }
            None => vec![zero; accessor.count],
        };
        let Some(sparse) = &accessor.sparse else { return Ok(out) };
        let key = Component::from_code(sparse.indices.component_type).filter(|c| c.read_u32(&[0; 4]).is_some());
        let key = key.ok_or_else(|| format!("accessor {index} has sparse indices that are no unsigned integers"))?;
        let what = format!("accessor {index} (sparse)");
        let keys =
            self.span(&what, sparse.indices.buffer_view, sparse.indices.byte_offset, key.size(), sparse.count)?;
        let values = self.span(&what, sparse.values.buffer_view, sparse.values.byte_offset, size, sparse.count)?;
        for (at, value) in keys.elements().zip(values.elements()) {
            let at = key.read_u32(at).unwrap_or(u32::MAX);
            let slot = out.get_mut(at as usize);
            *slot.ok_or_else(|| {
                format!("accessor {index} has sparse index {at} of {}; export the file again", accessor.count)
            })? = read(component, value)?;
        }
        Ok(out)
    }

    /// Accessor `index` as vectors of `N` floats. Elements may have fewer components only where `pad` is given.
    pub fn floats<const N: usize>(&self, index: usize, pad: Option<[f32; N]>) -> Result<Vec<[f32; N]>, Problem> {
        let (accessor, _, width) = self.accessor(index)?;
        if width != N && (pad.is_none() || width > N) {
            return Err(format!("accessor {index} has type {}, which does not fit its use", accessor.kind));
        }
        let fill = pad.unwrap_or([0.0; N]);
        let zero = std::array::from_fn(|i| if i < width { 0.0 } else { fill[i] });
        self.collect(index, zero, |component, bytes| {
            let mut value = fill;
            for (slot, b) in value.iter_mut().zip(bytes.chunks_exact(component.size())) {
                *slot = component.read_f32(b, accessor.normalized);
            }
            Ok(value)
        })
    }

    /// Accessor `index` as vectors of `N` unsigned integers (indices, joints).
    pub fn integers<const N: usize>(&self, index: usize) -> Result<Vec<[u32; N]>, Problem> {
        let (accessor, _, width) = self.accessor(index)?;
        if width != N {
            return Err(format!("accessor {index} has type {}, which does not fit its use", accessor.kind));
        }
        self.collect(index, [0; N], |component, bytes| {
            let mut value = [0; N];
            for (slot, b) in value.iter_mut().zip(bytes.chunks_exact(component.size())) {
                *slot = component.read_u32(b).ok_or_else(|| format!("accessor {index} must hold unsigned integers"))?;
            }
            Ok(value)
        })
    }
}

/// "x 7 does not exist", for indices into the document's lists.
pub fn missing(what: &str, index: usize) -> Problem {
    format!("{what} {index} is used but does not exist; export the file again")
}
