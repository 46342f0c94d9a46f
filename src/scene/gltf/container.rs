//! The bytes of a `.gltf` or `.glb` file and of the buffers and images that it names by relative path or data URI.

use std::path::Path;

use super::accessor::Problem;
use crate::Error;

/// The two parts of a file: its JSON and, in a `.glb`, the binary chunk.
pub struct Container {
    pub json: Vec<u8>,
    pub binary: Option<Vec<u8>>,
}

const MAGIC: &[u8; 4] = b"glTF";
/// Bytes of a `.glb` before its first chunk.
const HEADER: usize = 12;

/// Reads the file at `path`. Its first bytes decide the format, not its name.
pub fn read(path: &Path) -> Result<Container, Error> {
    let bytes = read_file(path)?;
    if bytes.starts_with(MAGIC) {
        return split_glb(path, &bytes);
    }
    let first = bytes.iter().find(|b| !b.is_ascii_whitespace());
    let json = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(&bytes);
    match first {
        Some(b'{' | 0xEF) => Ok(Container { json: json.to_vec(), binary: None }),
        _ => Err(Error::file(path, "is neither glTF JSON nor a binary .glb; export the scene as glTF 2.0")),
    }
}

fn read_file(path: &Path) -> Result<Vec<u8>, Error> {
    if path.is_dir() {
        return Err(Error::file(path, "is a directory; name the .gltf or .glb file in it"));
    }
    std::fs::read(path).map_err(|e| match e.kind() {
        std::io::ErrorKind::NotFound => Error::file(path, "does not exist; check the path"),
        _ => Error::file(path, format!("cannot be read ({e}); check its permissions")),
    })
}

fn split_glb(path: &Path, bytes: &[u8]) -> Result<Container, Error> {
    let word = |at: usize| -> Option<u32> { Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?)) };
    let truncated = |what: &str| Error::file(path, format!("is truncated: {what}; copy or export the file again"));
    let (Some(version), Some(length)) = (word(4), word(8)) else {
        return Err(truncated("it ends within its header"));
    };
    if version != 2 {
        let name = if version == 1 { "glTF 1.0 binary".into() } else { format!("binary glTF version {version}") };
        return Err(Error::file(path, format!("is {name}, only 2.0 can be read; convert it to glTF 2.0")));
    }
    if length as usize > bytes.len() {
        return Err(truncated(&format!("its header states {length} bytes and the file has {}", bytes.len())));
    }
    let mut rest = bytes.get(HEADER..length as usize).unwrap_or_default();
    // The next chunk, if it is of this kind. The specification says that unknown chunks are ignored.
    let mut chunk = |kind: &[u8]| {
        let Some((head, after)) = rest.split_first_chunk::<8>().filter(|(head, _)| head[4..] == *kind) else {
            return Ok(None);
        };
        let size = u32::from_le_bytes([head[0], head[1], head[2], head[3]]) as usize;
        let (content, after) =
            after.split_at_checked(size).ok_or_else(|| truncated("a chunk ends after the end of the file"))?;
        rest = after;
        Ok(Some(content.to_vec()))
    };
    let json = chunk(b"JSON")?.filter(|json| !json.is_empty()).ok_or_else(|| truncated("it has no JSON chunk"))?;
    Ok(Container { json, binary: chunk(b"BIN\0")? })
}

/// The bytes that `uri` names: inline data, or a file relative to `folder`. `what` ("buffer 3") is for messages.
pub fn resolve(folder: &Path, what: &str, uri: &str) -> Result<Vec<u8>, Problem> {
    let refuse = |problem: String| Err(format!("{what}: {problem}"));
    if let Some(data) = uri.strip_prefix("data:") {
        let Some((head, body)) = data.split_once(',') else {
            return refuse("its data URI has no comma; export the file again".into());
        };
        let bytes = if head.ends_with(";base64") { decode_base64(body) } else { Some(decode_percent(body)) };
        return bytes.map_or_else(|| refuse("its data URI is not valid base64; export the file again".into()), Ok);
    }
    // This also refuses Windows drive letters, which are no relative paths either.
    let scheme =
        uri.split_once(':').is_some_and(|(s, _)| s.bytes().all(|b| b.is_ascii_alphanumeric() || b"+-.".contains(&b)));
    if scheme || uri.starts_with('/') || uri.starts_with('\\') {
        return refuse(format!(
            "\"{}\" is not a relative path; only files in the folder of the scene are read",
            shorten(uri)
        ));
    }
    let Ok(relative) = String::from_utf8(decode_percent(uri)) else {
        return refuse(format!("\"{}\" is not UTF-8; rename the file", shorten(uri)));
    };
    if relative.contains('\0') {
        return refuse("its path contains a zero byte; export the file again".into());
    }
    // Some exporters do not percent-encode: if only a file with the raw name exists, that file is meant.
    let verbatim = Some(folder.join(uri)).filter(|file| file.exists() && !folder.join(&relative).exists());
    std::fs::read(verbatim.unwrap_or(folder.join(&relative))).or_else(|e| {
        let name = shorten(&relative);
        match e.kind() {
            std::io::ErrorKind::NotFound => {
                refuse(format!("\"{name}\" does not exist in the folder of the scene; put it there"))
            }
            _ => refuse(format!("\"{name}\" cannot be read ({e}); check the file")),
        }
    })
}

/// At most 80 characters of a text from a file, without control characters, for messages.
pub fn shorten(text: &str) -> String {
    let clean: String = text.chars().take(80).map(|c| if c.is_control() { '?' } else { c }).collect();
    if text.chars().count() > 80 { clean + "…" } else { clean }
}

fn decode_percent(text: &str) -> Vec<u8> {
    let hex = |byte: u8| (byte as char).to_digit(16);
    let mut out = Vec::with_capacity(text.len());
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let code = after.first_chunk().filter(|_| byte == b'%').and_then(|&[a, b]| Some(hex(a)? * 16 + hex(b)?));
        out.push(code.map_or(byte, |code| code as u8));
        rest = if code.is_some() { &after[2..] } else { after };
    }
    out
}

/// RFC 4648, either alphabet, padding optional.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut filled) = (0u32, 0);
    for byte in text.trim_end_matches('=').bytes() {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            _ => return None,
        };
        bits = bits << 6 | u32::from(value);
        filled += 6;
        if filled >= 8 {
            filled -= 8;
            out.push((bits >> filled) as u8);
        }
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_decodes_the_vectors_of_rfc_4648() {
        for (text, bytes) in
            [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYg", "foob"), ("Zm9vYmE=", "fooba")]
        {
            assert_eq!(decode_base64(text).as_deref(), Some(bytes.as_bytes()));
        }
        assert_eq!(decode_base64("Zm9v!"), None);
    }

    #[test]
    fn percent_sequences_decode_and_stray_percents_stay() {
        assert_eq!(decode_percent("a%20b%E2%99%BB 100%"), "a b♻ 100%".as_bytes());
    }
}
