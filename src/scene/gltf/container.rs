//! The bytes of a `.gltf` or `.glb` file and of the buffers and images that it names by relative path or data URI.

use std::borrow::Cow;
use std::fs::File;
use std::io::{Cursor, ErrorKind, Read, Seek};
use std::path::{Component, Path, PathBuf};

use base64::engine::general_purpose::{GeneralPurpose, NO_PAD};
use base64::{Engine, alphabet};
use percent_encoding::percent_decode_str;

use super::accessor::Problem;
use super::need::{Kind, Need};
use crate::Error;
use crate::output::file::is_standard;

/// The two parts of a file: its JSON and, in a `.glb`, the binary chunk.
pub struct Container {
    pub json: Vec<u8>,
    pub binary: Option<Section>,
}

/// A section of a file that is read once it is known how much of it is used.
pub struct Section {
    /// A reader at the section's first byte.
    file: Box<dyn Content>,
    pub bytes: u64,
}

/// A file, or the content of standard input.
trait Content: Read + Seek + Send {}
impl<T: Read + Seek + Send> Content for T {}

const MAGIC: &[u8; 4] = b"glTF";
/// Bytes of a `.glb` before its first chunk, and of a chunk before its content.
const HEADER: usize = 12;
const CHUNK_HEADER: u64 = 8;
/// The number of chunks that are examined, because a file may have millions of empty ones.
const CHUNKS_MAX: usize = 1000;

/// Reads the JSON of the file at `path` and finds the binary chunk. Its first bytes decide the format, not its name.
pub fn read(path: &Path, need: &mut Need) -> Result<Container, Error> {
    if is_standard(path) {
        return standard_input(path, need);
    }
    let problem = |problem| Error::file(path, problem);
    let failed = |e: std::io::Error| problem(unreadable(&e));
    if path.is_dir() {
        return Err(problem("is a directory; name the .gltf or .glb file in it".into()));
    }
    let length = length_of(path).map_err(problem)?.ok_or_else(|| problem("does not exist; check the path".into()))?;
    let file = File::open(path).map_err(failed)?;
    parts(path, Section { file: Box::new(file), bytes: length }, need)
}

/// Reads standard input, whose length is unknown before its end: at most as much as fits into memory.
fn standard_input(path: &Path, need: &mut Need) -> Result<Container, Error> {
    let (mut bytes, room) = (Vec::new(), need.room());
    let read = std::io::stdin().lock().take(room.saturating_add(1)).read_to_end(&mut bytes);
    read.map_err(|e| Error::file(path, format!("standard input cannot be read ({e})")))?;
    if bytes.len() as u64 > room {
        return Err(Error::file(
            path,
            format!("standard input holds more than {}; name a smaller scene", need.limit()),
        ));
    }
    if bytes.is_empty() {
        return Err(Error::file(path, "standard input is empty; send a scene to it"));
    }
    held(path, bytes, need)
}

/// A file in memory; errors call it `path`.
pub fn held(path: &Path, bytes: Vec<u8>, need: &mut Need) -> Result<Container, Error> {
    let length = bytes.len() as u64;
    need.add(Kind::Bytes, length, 1);
    parts(path, Section { file: Box::new(Cursor::new(bytes)), bytes: length }, need)
}

fn parts(path: &Path, whole: Section, need: &mut Need) -> Result<Container, Error> {
    let Section { mut file, bytes: length } = whole;
    let problem = |problem| Error::file(path, problem);
    let failed = |e: std::io::Error| problem(unreadable(&e));
    let mut start = Vec::new();
    (&mut file).take(HEADER as u64).read_to_end(&mut start).map_err(failed)?;
    if start.starts_with(MAGIC) {
        return split_glb(path, &start, Section { file, bytes: length }, need);
    }
    let no_gltf = || problem("is neither glTF JSON nor a binary .glb; export the scene as glTF 2.0".into());
    // A file of another format is not read completely.
    let first = |bytes: &[u8]| bytes.iter().find(|b| !b.is_ascii_whitespace()).copied();
    if first(&start).is_some_and(|byte| !matches!(byte, b'{' | 0xEF)) {
        return Err(no_gltf());
    }
    need.add(Kind::Bytes, length, 1);
    need.check().map_err(problem)?;
    let mut json = start;
    text(&mut file, length.saturating_sub(HEADER as u64), &mut json).map_err(failed)?;
    if json.starts_with(b"\xEF\xBB\xBF") {
        json.drain(..3);
    }
    if first(&json).is_none() {
        return Err(no_gltf());
    }
    Ok(Container { json, binary: None })
}

/// Appends the next `count` bytes up to the first zero byte, and skips the rest. No text contains zeros, but a sparse
/// file can have gigabytes of them. Some exporters pad the text with zeros, which are dropped. Text after a zero is
/// kept, so that the parser refuses it.
fn text(file: &mut dyn Content, count: u64, text: &mut Vec<u8>) -> std::io::Result<()> {
    const PART: u64 = 1 << 20;
    let (mut left, mut from) = (count, text.len());
    while left > 0 && !text[from..].contains(&0) {
        from = text.len();
        let read = file.take(left.min(PART)).read_to_end(text)? as u64;
        if read == 0 {
            break;
        }
        left -= read;
    }
    let padding = |b: &u8| *b == 0 || b.is_ascii_whitespace();
    if let Some(zero) = text.iter().position(|b| *b == 0).filter(|zero| text[*zero..].iter().all(padding)) {
        text.truncate(zero);
    }
    file.seek_relative(left as i64)
}

/// The length of a regular file; `None` if there is no file. Other files are refused before they are opened, because a
/// pipe may never deliver anything, and a device may never end.
fn length_of(path: &Path) -> Result<Option<u64>, Problem> {
    match std::fs::metadata(path) {
        Ok(found) if found.is_file() => Ok(Some(found.len())),
        Ok(_) => Err("is no regular file; copy what it holds into one and name that".into()),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(None),
        Err(e) => Err(unreadable(&e)),
    }
}

fn unreadable(e: &std::io::Error) -> Problem {
    format!("cannot be read ({e}); check its permissions")
}

fn split_glb(path: &Path, start: &[u8], part: Section, need: &mut Need) -> Result<Container, Error> {
    let Section { mut file, bytes: on_disk } = part;
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(start.get(at..at + 4)?.try_into().ok()?)) };
    let truncated = |what: &str| Error::file(path, format!("is truncated: {what}; copy or export the file again"));
    let failed = |e: std::io::Error| Error::file(path, unreadable(&e));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(truncated("it ends within its header"));
    };
    if version != 2 {
        let name = if version == 1 { "glTF 1.0 binary".into() } else { format!("binary glTF version {version}") };
        return Err(Error::file(path, format!("is {name}, only 2.0 can be read; convert it to glTF 2.0")));
    }
    let length = u64::from(length);
    if length > on_disk {
        return Err(truncated(&format!("its header states {length} bytes and the file has {on_disk}")));
    }
    // Bytes from here to the end that the header states.
    let mut left = length.saturating_sub(HEADER as u64);
    let mut json: Option<Vec<u8>> = None;
    // The specification says that unknown chunks are ignored; some exporters write them even before the binary chunk.
    for _ in 0..CHUNKS_MAX {
        if left < CHUNK_HEADER {
            break;
        }
        let mut head = [0; CHUNK_HEADER as usize];
        file.read_exact(&mut head).map_err(failed)?;
        left -= CHUNK_HEADER;
        let (size, kind) = (u64::from(u32::from_le_bytes([head[0], head[1], head[2], head[3]])), &head[4..]);
        match (&json, kind) {
            (None, b"JSON") | (Some(_), b"BIN\0") if size > left => {
                return Err(truncated("a chunk ends after the end of the file"));
            }
            (None, b"JSON") => {
                need.add(Kind::Bytes, size, 1);
                need.check().map_err(|problem| Error::file(path, problem))?;
                let json = json.insert(Vec::new());
                text(&mut file, size, json).map_err(failed)?;
            }
            (None, _) => break,
            (Some(_), b"BIN\0") => {
                return Ok(Container { json: json.unwrap_or_default(), binary: Some(Section { file, bytes: size }) });
            }
            _ if size > left => break,
            _ => drop(file.seek_relative(size as i64).map_err(failed)?),
        }
        left -= size;
    }
    let json = json.filter(|json| !json.is_empty()).ok_or_else(|| truncated("it has no JSON chunk"))?;
    Ok(Container { json, binary: None })
}

/// The bytes of a buffer or an image. Files are opened when they are read, because a scene may have more files than a
/// process may open.
pub enum ByteSource {
    File {
        path: PathBuf,
        /// The name of the file for messages.
        name: String,
        bytes: u64,
    },
    Chunk(Section),
    /// The bytes of a data URI.
    Inline(Vec<u8>),
}

impl ByteSource {
    pub fn bytes(&self) -> u64 {
        match self {
            Self::File { bytes, .. } | Self::Chunk(Section { bytes, .. }) => *bytes,
            Self::Inline(bytes) => bytes.len() as u64,
        }
    }

    /// The first `count` bytes, or fewer at the end. `what` is for messages.
    pub fn read(self, what: &str, count: u64) -> Result<Vec<u8>, Problem> {
        let count = count.min(self.bytes());
        let read = |file: Box<dyn Content>| {
            let mut bytes = Vec::new();
            file.take(count).read_to_end(&mut bytes).map(|_| bytes)
        };
        match self {
            Self::File { path, name, .. } => File::open(path)
                .and_then(|file| read(Box::new(file)))
                .map_err(|e| format!("{what}: \"{name}\" {}", unreadable(&e))),
            Self::Chunk(part) => read(part.file).map_err(|e| format!("{what} {}", unreadable(&e))),
            Self::Inline(mut bytes) => {
                bytes.truncate(count as usize);
                Ok(bytes)
            }
        }
    }
}

/// The folders from which a scene may read files: its own, and one that the user named.
#[derive(Clone, Copy, Debug)]
pub struct Folders<'a> {
    /// The folder of the scene, to which relative paths refer.
    pub scene: &'a Path,
    pub assets: Option<&'a Path>,
}

impl Folders<'_> {
    /// Whether `path` lies in one of the folders by its text alone, so that files outside are not even looked up.
    fn hold_text(&self, path: &Path) -> bool {
        let Some(path) = without_dots(path) else { return false };
        self.each().any(|folder| without_dots(folder).is_some_and(|folder| path.starts_with(folder)))
    }

    /// Whether the file `path` lies in one of the folders after every link is resolved.
    fn hold_file(&self, path: &Path) -> bool {
        self.each().any(|folder| folder.canonicalize().is_ok_and(|folder| path.starts_with(folder)))
    }

    fn each(&self) -> impl Iterator<Item = &Path> {
        let scene = if self.scene.as_os_str().is_empty() { Path::new(".") } else { self.scene };
        std::iter::once(scene).chain(self.assets)
    }
}

/// An absolute path without `.` and `..`, resolved by text; `None` if that is impossible.
fn without_dots(path: &Path) -> Option<PathBuf> {
    let mut whole = PathBuf::new();
    for part in std::path::absolute(path).ok()?.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir => {
                whole.pop();
            }
            other => whole.push(other),
        }
    }
    Some(whole)
}

const OUTSIDE: &str =
    "outside the folder of the scene; copy the file there, or name a folder that the scene may read with --assets DIR";

/// Text after the scheme of a data URI; `None` for another URI.
pub fn inline(uri: &str) -> Option<&str> {
    let (scheme, rest) = uri.trim_start().split_once(':')?;
    scheme.eq_ignore_ascii_case("data").then_some(rest)
}

/// Resolves `uri` to its own bytes or to a file of one of the folders. `what` ("buffer 3") is for messages.
pub fn find(folders: Folders, what: &str, uri: &str) -> Result<ByteSource, Problem> {
    let refuse = |problem: &str| Err(format!("{what}: {problem}"));
    if let Some(data) = inline(uri) {
        let Some((head, body)) = data.split_once(',') else {
            return refuse("its data URI has no comma; export the file again");
        };
        let encoding = head.rsplit(';').next().unwrap_or_default().trim();
        let base64 = head.contains(';') && encoding.eq_ignore_ascii_case("base64");
        let bytes = if base64 { decode_base64(body) } else { Some(percent_decode_str(body).collect()) };
        return match bytes {
            Some(bytes) => Ok(ByteSource::Inline(bytes)),
            None => refuse("its data URI is not valid base64; export the file again"),
        };
    }
    // The URI is an absolute path on this machine. Validators warn of it, but exporters write it.
    let local = uri.strip_prefix("file://").map(|rest| rest.strip_prefix("localhost").unwrap_or(rest));
    let local = local.filter(|path| path.starts_with('/'));
    // This also refuses Windows drive letters, which are not relative paths.
    let scheme =
        uri.split_once(':').is_some_and(|(s, _)| s.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b)));
    if local.is_none() && (scheme || uri.starts_with('/') || uri.starts_with('\\')) {
        let uri = shorten(uri);
        return refuse(&format!("\"{uri}\" is not a relative path; only files in the folder of the scene are read"));
    }
    let uri = local.unwrap_or(uri);
    let Ok(relative) = percent_decode_str(uri).decode_utf8() else {
        return refuse(&format!("\"{}\" is not UTF-8; rename the file", shorten(uri)));
    };
    if relative.contains('\0') {
        return refuse("its path contains a zero byte; export the file again");
    }
    let name = shorten(&relative);
    let [raw, decoded] = [uri, &*relative].map(|name| folders.scene.join(name));
    if !folders.hold_text(&raw) || !folders.hold_text(&decoded) {
        return refuse(&format!("\"{name}\" lies {OUTSIDE}"));
    }
    // Some exporters do not percent-encode. If only a file with the raw name exists, it is used.
    let path = if raw.exists() && !decoded.exists() { raw } else { decoded };
    // The file is opened by the path that was checked.
    let path = path.canonicalize().unwrap_or(path);
    if path.exists() && !folders.hold_file(&path) {
        return refuse(&format!("\"{name}\" is a link that leads {OUTSIDE}"));
    }
    match length_of(&path) {
        Ok(Some(bytes)) => Ok(ByteSource::File { path, name, bytes }),
        Ok(None) if name.starts_with('/') => refuse(&format!("\"{name}\" does not exist; put it there")),
        Ok(None) => refuse(&format!("\"{name}\" does not exist in the folder of the scene; put it there")),
        Err(problem) => refuse(&format!("\"{name}\" {problem}")),
    }
}

/// The number of names that a message lists.
const NAMES_MAX: usize = 20;

/// Names with their numbers for messages that list the alternatives.
pub fn list<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut list: Vec<String> =
        names.take(NAMES_MAX + 1).enumerate().map(|(i, name)| format!("{i} \"{}\"", shorten(name))).collect();
    if list.len() > NAMES_MAX {
        list[NAMES_MAX] = "…".into();
    }
    list.join(", ")
}

/// At most 80 characters of a text from a file, without control characters, for messages.
pub fn shorten(text: &str) -> String {
    let clean: String = text.chars().take(80).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().count() > 80 { clean + "…" } else { clean }
}

/// RFC 4648, either alphabet, padding optional; white space and percent-encoding as in other URIs.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let lenient = NO_PAD.with_decode_allow_trailing_bits(true);
    let mut text = Cow::from(percent_decode_str(text));
    if text.iter().any(u8::is_ascii_whitespace) {
        text.to_mut().retain(|b| !b.is_ascii_whitespace());
    }
    let end = text.iter().rposition(|b| *b != b'=').map_or(0, |last| last + 1);
    let engines = [alphabet::STANDARD, alphabet::URL_SAFE].map(|alphabet| GeneralPurpose::new(&alphabet, lenient));
    engines.iter().find_map(|engine| engine.decode(&text[..end]).ok())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_may_have_either_alphabet_no_padding_white_space_and_percent_encoding() {
        for text in ["+/8=", "-_8=", "+/8", "-_8", "-_9", "%2B%2f8%3D", "%2D_8", "+\r\n/ 8=\n", "\t+/%0A8 =", "+/8=%20"]
        {
            assert_eq!(decode_base64(text), Some(vec![0xfb, 0xff]), "{text}");
        }
        for text in ["Zm9v!", "Zm=9v", "Zm9v%", "Zm9v%00"] {
            assert_eq!(decode_base64(text), None, "{text}");
        }
    }
}
