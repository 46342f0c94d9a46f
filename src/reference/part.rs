//! A part of a reference's samples as a file for a merge: sums, counts, and the metadata of the image.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::cache::{decode, encode};
use super::film::Film;
use crate::layers::{Aov, Layers};
use crate::output::exr::Metadata;
use crate::output::file;
use crate::{Error, Result};

/// The first bytes of a part's file; the last one is the version of the format.
const MAGIC: [u8; 8] = *b"2bpart\0\x01";

/// A film with a part of the samples, and the description of its image.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Hash of everything that determines the samples.
    pub key: blake3::Hash,
    pub about: About,
    pub film: Film,
}

/// The metadata of the image.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct About {
    /// The header without entries that depend on the number of samples.
    pub header: Metadata,
    /// The names of further layers.
    pub layers: Vec<String>,
}

impl Part {
    /// Writes the part: magic, length of a JSON text, the text, and the film as in the cache.
    pub fn write(&self, path: &Path) -> Result<()> {
        let about = serde_json::to_vec(&self.about).map_err(|e| Error::file(path, e.to_string()))?;
        let length = (about.len() as u32).to_le_bytes();
        file::write(path, &[&MAGIC[..], &length, &about, &encode(&self.film, &self.key)].concat())
    }

    /// Reads a part; [`Error::File`] if the file has another format or version, or is damaged.
    pub fn read(path: &Path) -> Result<Self> {
        crate::output::read::about(path, "a film")?;
        let bytes = std::fs::read(path).map_err(|e| Error::file(path, format!("cannot be read: {e}")))?;
        Self::decode(&bytes).ok_or_else(|| {
            let text =
                "is no film of `twobounce reference --samples` of this version, or it is damaged; trace it again";
            Error::file(path, text)
        })
    }

    /// Decodes bytes that [`Self::write`] wrote; `None` if they are damaged.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let rest = bytes.strip_prefix(&MAGIC)?;
        let (length, rest) = rest.split_first_chunk::<4>()?;
        let (about, film) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        let about: About = serde_json::from_slice(about).ok()?;
        let (film, key) = decode(film)?;
        let is_whole = film.done() == film.started() && film.done() > 0;
        let known = about.layers.iter().all(|name| Aov::ALL.iter().any(|aov| aov.name() == name));
        (is_whole && known).then_some(Self { key, about, film })
    }

    /// The range of samples in words.
    pub fn samples(&self) -> String {
        format!("{}-{}", self.film.first, self.end() - 1)
    }

    /// The number after the last sample.
    fn end(&self) -> u32 {
        self.film.first + self.film.done()
    }

    /// Merges parts whose films follow each other, in any order. The bits are those of one film.
    ///
    /// # Errors
    /// [`Error::Usage`] if the images differ, samples are in two parts, or some are missing in between. `names` are
    /// those of the parts.
    pub fn merge(mut parts: Vec<(String, Self)>) -> Result<Self> {
        parts.sort_by_key(|(_, part)| part.film.first);
        let mut parts = parts.into_iter();
        let no_part = || Error::Usage("there is no film to merge".into());
        let (first_name, mut whole) = parts.next().ok_or_else(no_part)?;
        for (name, part) in parts {
            if (part.key, &part.about) != (whole.key, &whole.about) {
                return Err(Error::Usage(format!(
                    "{first_name} and {name} are of different images or layers; merge parts of one command"
                )));
            }
            let end = whole.end();
            if part.film.first < end {
                let both = part.film.first;
                return Err(Error::Usage(format!(
                    "{name} has samples {}, but sample {both} is in another film too; leave one out",
                    part.samples()
                )));
            }
            if part.film.first > end {
                let missing = format!("{end}-{}", part.film.first - 1);
                return Err(Error::Usage(format!(
                    "samples {missing} are in none of the films; make them with --samples {missing}"
                )));
            }
            whole.film.unite(&part.film);
        }
        Ok(whole)
    }

    /// The image, and its header.
    pub fn image(&self) -> (Layers, Metadata) {
        let layers: Vec<Aov> = self
            .about
            .layers
            .iter()
            .filter_map(|name| Aov::ALL.iter().find(|aov| aov.name() == name).copied())
            .collect();
        let mut header = self.about.header.clone();
        header.extend(self.film.header());
        (self.film.layers(&layers), header)
    }
}
