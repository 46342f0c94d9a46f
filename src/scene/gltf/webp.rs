//! EXT_texture_webp: checks of a WebP file before the crate `image` decodes it, because the crate trusts some of its
//! parts.

/// Bits of the flags of an extended file.
const ANIMATED: u8 = 2;
/// Bytes of the file's header, and of a chunk's.
const FILE: usize = 12;
const CHUNK: usize = 8;

/// Checks an extended file (WebP container, "Extended File Format"). Other files have one size, in their only chunk.
/// The error is the end of a sentence, for animations, and for a frame whose size differs from that of the file.
pub fn check(bytes: &[u8]) -> Result<(), &'static str> {
    let extended = bytes.starts_with(b"RIFF") && bytes.get(8..16) == Some(b"WEBPVP8X");
    let Some(head) = bytes.get(FILE + CHUNK..FILE + CHUNK + 10).filter(|_| extended) else { return Ok(()) };
    if head[0] & ANIMATED != 0 {
        return Err("is animated, which no texture is; save one image of it");
    }
    let side = |at: usize| 1 + u32::from_le_bytes([head[at], head[at + 1], head[at + 2], 0]);
    let stated = [side(4), side(7)];
    let mut rest = &bytes[FILE..];
    while let Some((chunk, after)) = rest.split_at_checked(CHUNK) {
        let length = u32::from_le_bytes([chunk[4], chunk[5], chunk[6], chunk[7]]) as usize;
        // A key frame of VP8 (RFC 6386, 9.1): sides of 14 bits after a tag and a start code of three bytes each.
        if let (b"VP8 ", Some(frame)) = (&chunk[..4], after.get(6..10)) {
            let side = |at: usize| u32::from(u16::from_le_bytes([frame[at], frame[at + 1]]) & 0x3fff);
            if [side(0), side(2)] != stated {
                return Err("holds an image of another size than it states; save it again");
            }
        }
        // Chunks have an even length.
        rest = after.get(length.saturating_add(length % 2)..).unwrap_or_default();
    }
    Ok(())
}
