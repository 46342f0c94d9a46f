//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views whose content is compressed.
//!
//! The crate `meshoptimizer-rs` decodes the streams (KHR_meshopt_compression, appendix A), in Rust without unsafe code.
//! Before it allocates memory for a stated count, it checks that the stream can hold as many elements. The filters
//! (appendix B) are implemented here, because the crate refuses elements outside the ranges that the extension allows,
//! which files have for unused vertices.

mod filters;

use gltf::json::buffer::{Buffer, View};
use meshoptimizer_rs::{Limits, Workspace, codec};
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;

use super::accessor::{Problem, missing};
use super::container::shorten;
use super::document::Document;
use super::need::{Kind, Need};

/// Names of two extensions with the same bitstreams; the second allows version 1 of the vertex codec and colours. Both
/// are read under both names.
pub const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Description of a fault in a stream, as the end of a sentence.
type Damage = &'static str;

/// Decodes a number of elements of a number of bytes each.
type Decoder = fn(usize, usize, &[u8], &mut Workspace) -> Result<Vec<u8>, meshoptimizer_rs::Error>;

/// The extension's object at a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    /// Bytes per element.
    byte_stride: usize,
    /// The number of elements.
    count: usize,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

/// The content of every compressed buffer view; `None` for the others. `need` counts their sizes before they are
/// allocated. The error is a sentence that names the buffer view, for sizes that are not allowed and for damaged
/// streams.
pub fn decode(
    document: &Document,
    buffers: &[Option<Vec<u8>>],
    need: &mut Need,
) -> Result<Vec<Option<Vec<u8>>>, Problem> {
    let found = document.buffer_views.iter().enumerate().map(|(index, view)| Compressed::of_view(index, view));
    let found = found.collect::<Result<Vec<_>, Problem>>()?;
    for compressed in found.iter().flatten() {
        need.add(Kind::Bytes, (compressed.count as u64).saturating_mul(compressed.byte_stride as u64), 1);
    }
    need.check()?;
    let decode = |(index, compressed): (usize, Option<Compressed>)| {
        let Some(compressed) = compressed else { return Ok(None) };
        let bytes = compressed.bytes(buffers).map_err(|problem| format!("buffer view {index}: {problem}"))?;
        compressed.decode(bytes).map(Some).map_err(|damage| {
            format!("buffer view {index} is compressed by meshopt and its bytes {damage}; export the file again")
        })
    };
    found.into_par_iter().enumerate().map(decode).collect()
}

/// Whether a buffer is only a fallback for readers without the extension.
pub fn is_fallback(buffer: &Buffer) -> bool {
    let extensions = buffer.extensions.as_ref();
    let states = |name| extensions.and_then(|e| e.others.get(name)).and_then(|e| e.get("fallback"));
    NAMES.into_iter().any(|name| states(name).and_then(Value::as_bool) == Some(true))
}

impl Compressed {
    fn of_view(index: usize, view: &View) -> Result<Option<Self>, Problem> {
        let extensions = view.extensions.as_ref();
        let stated = NAMES.into_iter().find_map(|name| extensions.and_then(|e| e.others.get(name)));
        let Some(stated) = stated else { return Ok(None) };
        let wrong =
            |what: String| format!("buffer view {index} is compressed by meshopt, {what}; export the file again");
        let found = Self::deserialize(stated)
            .map_err(|e| wrong(format!("but how is not stated ({})", shorten(&e.to_string()))))?;
        found.check().map_err(wrong)?;
        Ok(Some(found))
    }

    /// Checks the requirements of the extension. The view's own length is ignored, because nothing depends on it.
    fn check(&self) -> Result<(), String> {
        let Self { byte_stride: stride, count, .. } = *self;
        let filter = self.filter.as_deref().unwrap_or("NONE");
        let filter_fits = match filter {
            "NONE" => true,
            "OCTAHEDRAL" | "COLOR" => [4, 8].contains(&stride),
            "QUATERNION" => stride == 8,
            "EXPONENTIAL" => stride.is_multiple_of(4),
            other => return Err(format!("with the unknown filter \"{}\"", shorten(other))),
        };
        let fits = match self.mode.as_str() {
            "ATTRIBUTES" => filter_fits && stride.is_multiple_of(4) && (4..=256).contains(&stride),
            "TRIANGLES" => [2, 4].contains(&stride) && count.is_multiple_of(3) && filter == "NONE",
            "INDICES" => [2, 4].contains(&stride) && filter == "NONE",
            other => return Err(format!("in the unknown mode \"{}\"", shorten(other))),
        };
        if fits {
            return Ok(());
        }
        let mode = &self.mode;
        Err(format!("but mode {mode} with filter {filter} cannot hold {count} elements of {stride} bytes"))
    }

    /// The bytes of the stream.
    fn bytes<'b>(&self, buffers: &'b [Option<Vec<u8>>]) -> Result<&'b [u8], Problem> {
        let number = self.buffer;
        let buffer = buffers.get(number).ok_or_else(|| missing("buffer", number))?;
        let buffer = buffer.as_ref().ok_or_else(|| format!("buffer {number} has no data; export the file again"))?;
        let end = self.byte_offset.checked_add(self.byte_length);
        end.and_then(|end| buffer.get(self.byte_offset..end))
            .ok_or_else(|| format!("its compressed bytes end after the end of buffer {number}; export the file again"))
    }

    fn decode(&self, bytes: &[u8]) -> Result<Vec<u8>, Damage> {
        let Self { byte_stride: stride, count, .. } = *self;
        let (versions, decode): (&[u8], Decoder) = match self.mode.as_str() {
            "TRIANGLES" => (&[0xe1], codec::decode_index_buffer),
            "INDICES" => (&[0xd1], codec::decode_index_sequence),
            _ => (&[0xa0, 0xa1], codec::decode_vertex_buffer),
        };
        if !bytes.first().is_some_and(|version| versions.contains(version)) {
            return Err("are of an unknown version");
        }
        // The size was checked against the memory limit before.
        let limits = Limits { max_bytes: usize::MAX, max_work: u64::MAX };
        // Indices of 16 bits are decoded to 32 bits, because the decoder truncates larger ones in damaged streams.
        let is_short = stride == 2 && self.mode != "ATTRIBUTES";
        let decoded = decode(count, if is_short { 4 } else { stride }, bytes, &mut Workspace::new(limits));
        let damage = "are damaged, or too few or too many for what is stated";
        let mut out = decoded.map_err(|_| damage)?;
        if is_short {
            let fits = out.chunks_exact(4).all(|index| index[2..] == [0, 0]);
            out = if fits {
                out.chunks_exact(4).flat_map(|index| [index[0], index[1]]).collect()
            } else {
                return Err(damage);
            };
        }
        match (self.filter.as_deref(), stride) {
            (Some("OCTAHEDRAL"), 4) => filters::octahedral_8(&mut out),
            (Some("OCTAHEDRAL"), _) => filters::octahedral_16(&mut out),
            (Some("QUATERNION"), _) => filters::quaternion(&mut out),
            (Some("EXPONENTIAL"), _) => filters::exponential(&mut out),
            (Some("COLOR"), 4) => filters::color_8(&mut out),
            (Some("COLOR"), _) => filters::color_16(&mut out),
            _ => {}
        }
        Ok(out)
    }
}

#[cfg(test)]
mod tests;
