//! EXT_meshopt_compression and KHR_meshopt_compression: buffer views whose content is compressed.
//!
//! The decoders are written from the text of the extensions (KHR_meshopt_compression, appendices A and B), in safe Rust. A
//! stream is read once from front to back, and output grows as it is read, so no stated count makes them allocate more than
//! the stream is worth.

mod filters;
mod indices;
mod vertices;

use gltf::json::buffer::{Buffer, View};
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;

use super::accessor::{Problem, missing};
use super::container::shorten;
use super::document::Document;
use super::need::{Kind, Need};

/// The same bitstreams; the second name allows version 1 of the vertex codec and colours. Both are read under both names.
pub const NAMES: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// What is wrong with a stream, as the end of a sentence.
type Damage = &'static str;

const ENDS_EARLY: Damage = "end too early";
const GOES_ON: Damage = "go on after their end";

/// The extension's object at a buffer view.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Compressed {
    buffer: usize,
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
    /// Bytes of an element.
    byte_stride: usize,
    /// Elements.
    count: usize,
    mode: String,
    #[serde(default)]
    filter: Option<String>,
}

/// The content of every buffer view that is compressed; `None` for the others. `need` gets their sizes before they are made.
///
/// # Errors
/// A sentence that names the buffer view, for sizes that the extension excludes or that `need` does not allow, and for damaged
/// streams.
pub fn decode(
    document: &Document,
    buffers: &[Option<Vec<u8>>],
    need: &mut Need,
) -> Result<Vec<Option<Vec<u8>>>, Problem> {
    let found = document.buffer_views.iter().enumerate().map(|(index, view)| Compressed::of(index, view));
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

/// Whether a buffer only stands in for readers without the extension.
pub fn is_fallback(buffer: &Buffer) -> bool {
    let extensions = buffer.extensions.as_ref();
    let states = |name| extensions.and_then(|e| e.others.get(name)).and_then(|e| e.get("fallback"));
    NAMES.into_iter().any(|name| states(name).and_then(Value::as_bool) == Some(true))
}

impl Compressed {
    fn of(index: usize, view: &View) -> Result<Option<Self>, Problem> {
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

    /// What the extension demands of an object. The view's own length is not held against it: nothing depends on that.
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

    /// The stream.
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
        let mut out = match self.mode.as_str() {
            "TRIANGLES" => indices::triangles(bytes, count, stride)?,
            "INDICES" => indices::sequence(bytes, count, stride)?,
            _ => vertices::decode(bytes, count, stride)?,
        };
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

/// Bytes that are taken from the front.
struct Stream<'a>(&'a [u8]);

impl<'a> Stream<'a> {
    fn take(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        let (taken, rest) = self.0.split_at_checked(count).ok_or(ENDS_EARLY)?;
        self.0 = rest;
        Ok(taken)
    }

    fn byte(&mut self) -> Result<u8, Damage> {
        Ok(self.take(1)?[0])
    }

    /// Takes `count` bytes from the back.
    fn tail(&mut self, count: usize) -> Result<&'a [u8], Damage> {
        let start = self.0.len().checked_sub(count).ok_or(ENDS_EARLY)?;
        let (rest, tail) = self.0.split_at(start);
        self.0 = rest;
        Ok(tail)
    }

    /// Nothing may be left.
    fn end(self) -> Result<(), Damage> {
        if self.0.is_empty() { Ok(()) } else { Err(GOES_ON) }
    }
}

#[cfg(test)]
mod tests;
