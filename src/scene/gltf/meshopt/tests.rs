//! Tests of the decoders with streams of meshoptimizer's encoder, against the results of its own decoder
//! (`tests/values/gltf/compressed/make.mjs`), and with damaged streams.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::{Value, json};

use super::Compressed;

/// All streams: the kind of compression, the bytes, and the known properties of the content.
fn streams() -> Vec<(Compressed, Vec<u8>, Value)> {
    let text = include_str!("../../../../tests/values/gltf/compressed/streams.json");
    let list: Vec<Value> = serde_json::from_str(text).unwrap();
    let read = |mut stream: Value| {
        (stream["buffer"], stream["byteLength"]) = (json!(0), json!(0));
        let bytes = STANDARD.decode(stream["bytes"].as_str().unwrap()).unwrap();
        (serde_json::from_value(stream.clone()).unwrap(), bytes, stream)
    };
    list.into_iter().map(read).collect()
}

/// FNV-1a of 64 bits.
fn fnv(bytes: &[u8]) -> u64 {
    bytes.iter().fold(0xcbf2_9ce4_8422_2325, |h, b| (h ^ u64::from(*b)).wrapping_mul(0x100_0000_01b3))
}

#[test]
fn streams_of_the_reference_encoder_give_its_decoders_bytes() {
    let mut seen = std::collections::BTreeSet::new();
    for (compressed, bytes, stream) in streams() {
        compressed.check().unwrap();
        let decoded = compressed.decode(&bytes).unwrap();
        let (mode, filter) = (compressed.mode.clone(), compressed.filter.clone().unwrap());
        let what = format!("{mode} {filter}, {} of {}", compressed.count, compressed.byte_stride);
        if let Some(hash) = stream["fnv"].as_str() {
            assert_eq!(format!("{:x}", fnv(&decoded)), hash, "{what}");
        } else {
            // The extension allows one unit in the last place.
            let expected = STANDARD.decode(stream["decoded"].as_str().unwrap()).unwrap();
            assert_eq!(decoded.len(), expected.len(), "{what}");
            let width = compressed.byte_stride / 4;
            let number =
                |b: &[u8]| if width == 1 { i32::from(b[0]) } else { i32::from(u16::from_le_bytes([b[0], b[1]])) };
            let modulus = 1 << (8 * width);
            let near = |(a, b): (&[u8], &[u8])| (number(a) - number(b) + 1).rem_euclid(modulus) <= 2;
            assert!(decoded.chunks_exact(width).zip(expected.chunks_exact(width)).all(near), "{what}");
        }
        seen.insert((mode, filter, bytes[0]));
    }
    // The streams cover both versions of the vertex codec, both of indices, and every filter.
    assert_eq!(seen.len(), 8, "{seen:?}");
}

/// Bits flip, bytes change, and streams end early or late. The decoder never panics and never returns other sizes than
/// stated.
#[test]
fn damaged_streams_are_decoded_to_the_stated_size_or_refused() {
    let mut state = 1u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let (mut refused, mut decoded) = (0, 0);
    for (compressed, bytes, _) in streams() {
        for _ in 0..1500 {
            let mut damaged = bytes.clone();
            for _ in 0..=random(3) {
                let at = random(damaged.len());
                damaged[at] = if random(2) == 0 { random(256) as u8 } else { damaged[at] ^ 1 << random(8) };
            }
            match random(8) {
                0 => damaged.truncate(random(bytes.len())),
                1 => damaged.extend(bytes.iter().take(random(40))),
                _ => {}
            }
            match compressed.decode(&damaged) {
                Ok(out) => {
                    decoded += 1;
                    assert_eq!(out.len(), compressed.count * compressed.byte_stride);
                }
                Err(_) => refused += 1,
            }
        }
    }
    assert!(refused > 10_000 && decoded > 10_000, "{refused} refused, {decoded} decoded");
}

#[test]
fn a_stated_count_alone_takes_no_memory() {
    for mode in ["ATTRIBUTES", "TRIANGLES", "INDICES"] {
        let stated =
            json!({"buffer": 0, "byteLength": 0, "byteStride": 4, "count": 3_000_000_000_000u64, "mode": mode});
        let compressed: Compressed = serde_json::from_value(stated).unwrap();
        compressed.check().unwrap();
        for first in [0xa0, 0xa1, 0xe1, 0xd1] {
            assert!(compressed.decode(&[&[first][..], &[0; 60]].concat()).is_err());
        }
    }
}

#[test]
fn sizes_that_the_extension_excludes_are_refused() {
    for (mode, filter, stride, count) in [
        ("ATTRIBUTES", "NONE", 0, 3),
        ("ATTRIBUTES", "NONE", 6, 3),
        ("ATTRIBUTES", "NONE", 260, 3),
        ("ATTRIBUTES", "OCTAHEDRAL", 12, 3),
        ("ATTRIBUTES", "QUATERNION", 4, 3),
        ("ATTRIBUTES", "SPIRAL", 4, 3),
        ("TRIANGLES", "NONE", 1, 3),
        ("TRIANGLES", "NONE", 2, 4),
        ("TRIANGLES", "COLOR", 4, 3),
        ("INDICES", "NONE", 3, 3),
        ("WORDS", "NONE", 4, 3),
    ] {
        let stated =
            json!({"buffer": 0, "byteLength": 0, "byteStride": stride, "count": count, "mode": mode, "filter": filter});
        assert!(serde_json::from_value::<Compressed>(stated.clone()).unwrap().check().is_err(), "{stated}");
    }
}
