//! Textures in the formats of extensions, WebP and KTX 2 (`compressed/make.mjs` made the files).

use std::io::Write;

use super::damage::{change_bytes, check};
use super::files::{File, png, write};
use crate::random::Random;
use serde_json::json;
use twobounce::memory::Limit;
use twobounce::scene::{LoadOptions, Scene, TextureImage};

const PNG: &[u8] = include_bytes!("compressed/fading.png");
const WEBP: &[u8] = include_bytes!("compressed/fading.webp");
const ETC1S: &[u8] = include_bytes!("compressed/fading-etc1s.ktx2");
const UASTC: &[u8] = include_bytes!("compressed/fading-uastc.ktx2");
const UASTC_ZSTD: &[u8] = include_bytes!("compressed/fading-uastc-zstd.ktx2");

const BASISU: &str = "KHR_texture_basisu";

/// A quad whose texture names an image of these bytes only by the extension.
fn textured(extension: &str, bytes: &[u8]) -> File {
    let mut file = File::quad();
    let view = file.view(bytes);
    let image = file.push("images", json!({"bufferView": view}));
    let texture = file.push("textures", json!({"extensions": {extension: {"source": image}}}));
    file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}}));
    file.json["extensionsUsed"] = json!([extension]);
    file.json["extensionsRequired"] = json!([extension]);
    file
}

fn strictly(file: &File) -> Result<Scene, String> {
    let (_folder, path) = write("scene.glb", &file.glb());
    Scene::load(&path, &LoadOptions { strict: true, ..LoadOptions::default() }).map_err(|e| e.to_string())
}

/// The only image of a file that loads without a note.
fn image(extension: &str, bytes: &[u8]) -> TextureImage {
    let mut scene = strictly(&textured(extension, bytes)).unwrap();
    assert_eq!((scene.warnings.len(), scene.images.len()), (0, 1));
    scene.images.remove(0)
}

/// The square root of the mean squared difference of all bytes.
fn difference(a: &TextureImage, b: &TextureImage) -> f64 {
    assert_eq!((a.width, a.height, a.rgba.len()), (b.width, b.height, b.rgba.len()));
    let squared = |(a, b): (&u8, &u8)| f64::from(i32::from(*a) - i32::from(*b)).powi(2);
    (a.rgba.iter().zip(&b.rgba).map(squared).sum::<f64>() / a.rgba.len() as f64).sqrt()
}

#[test]
fn webp_holds_the_plain_image() {
    let plain = image("EXT_texture_webp", PNG);
    assert_eq!((plain.width, plain.height, &plain.rgba[..8]), (30, 18, &[0, 0, 90, 255, 8, 0, 90, 247][..]));
    assert_eq!(image("EXT_texture_webp", WEBP).rgba, plain.rgba);
}

/// The hashes are those of the output of Basis Universal's own transcoder (FNV-1a of 64 bits).
#[test]
fn ktx_2_holds_the_plain_image_and_the_reference_transcoders_bytes() {
    let plain = image(BASISU, PNG);
    for (bytes, hash, most) in [
        (ETC1S, 0x3287_4dcd_573d_6e8d, 10.0),
        (UASTC, 0x9d2c_3382_68ac_cac9, 1.6),
        (UASTC_ZSTD, 0x9d2c_3382_68ac_cac9, 1.6),
    ] {
        let image = image(BASISU, bytes);
        let off = difference(&image, &plain);
        assert!(off < most, "{off}");
        let fnv = |h: u64, b: &u8| (h ^ u64::from(*b)).wrapping_mul(0x100_0000_01b3);
        assert_eq!(image.rgba.iter().fold(0xcbf2_9ce4_8422_2325, fnv), hash, "of {} bytes", bytes.len());
    }
}

/// The extension's image takes precedence over the plain one, which readers without the extension use.
#[test]
fn the_plain_image_is_a_fallback() {
    let mut file = textured(BASISU, UASTC);
    let view = file.view(&png(1, 1, &[7; 4]));
    let plain = file.push("images", json!({"bufferView": view, "mimeType": "image/png"}));
    file.json["textures"][0]["source"] = json!(plain);
    assert_eq!(file.scene().images[0].width, 30);
    file.json["textures"][0]["extensions"] = json!({});
    assert_eq!(file.scene().images[0].width, 1);
    file.json["textures"][0]["extensions"] = json!({BASISU: {"source": 9}});
    assert!(file.load().unwrap_err().contains("image 9 is used but does not exist"));
}

#[test]
fn wrong_headers_of_ktx_2_are_refused_by_name() {
    let refused = |bytes: Vec<u8>, expected: &str| {
        let file = textured(BASISU, &bytes);
        let refusal = strictly(&file).unwrap_err();
        assert!(refusal.contains("image 0") && refusal.contains(expected), "expected \"{expected}\" in: {refusal}");
        check(Err(refusal));
        let notes = file.scene().warnings;
        assert!(notes.len() == 1 && notes[0].contains(expected) && notes[0].contains("factors alone"), "{notes:?}");
    };
    let descriptor = u32::from_le_bytes(UASTC[48..52].try_into().unwrap()) as usize;
    for (at, value, expected) in [
        (12, 37, "has a largest level of another size"),
        (12, 131, "holds texels that are not of 8 or 16 bits a channel"),
        (12, 97, "holds texels that are not of 8 or 16 bits a channel"),
        (20, 0, "is no image of two dimensions"),
        (28, 1, "is no image of two dimensions"),
        (32, 2, "is no image of two dimensions"),
        (36, 6, "is no image of two dimensions"),
        (40, 0, "is no image of two dimensions"),
        (40, u32::MAX, "is no image of two dimensions"),
        (44, 1, "is supercompressed in a way that its format excludes"),
        (44, 3, "is supercompressed in a way that its format excludes"),
        (24, 400, "has a largest level of another size"),
        (48, u32::MAX, "has no data format descriptor"),
        (52, 0, "has no data format descriptor"),
        (80, u32::MAX, "ends within its largest level"),
        (92, u32::MAX, "ends within its largest level"),
        (descriptor + 12, 0x0202_01a3, "is supercompressed in a way that its format excludes"),
        (descriptor + 12, 0x0202_0101, "holds texels that are not in Basis Universal's formats"),
    ] {
        let mut bytes = UASTC.to_vec();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        refused(bytes, expected);
    }
    for length in [12, 79, 90] {
        refused(UASTC[..length].to_vec(), "ends within its header");
    }
    let global = u64::from_le_bytes(ETC1S[64..72].try_into().unwrap()) as usize;
    for (at, expected) in [
        (64, "ends within its global data"),
        (72, "ends within its global data"),
        (global + 4, "ends within its global data"),
        (global + 12, "ends within its global data"),
        (global + 24, "has a largest level of another size"),
        (global + 32, "has a largest level of another size"),
    ] {
        let mut bytes = ETC1S.to_vec();
        bytes[at..at + 4].copy_from_slice(&0x7fff_ffff_u32.to_le_bytes());
        refused(bytes, expected);
    }
    let mut torn = UASTC_ZSTD.to_vec();
    let level = u64::from_le_bytes(torn[80..88].try_into().unwrap()) as usize;
    torn[level + 20..].fill(0);
    refused(torn, "has a damaged largest level");
}

/// A file of 2 × 2 texels of Vulkan's format `number`, whose only level is stored in that scheme.
fn plain_ktx2(number: u32, scheme: u32, texels: &[u8], key_values: &[u8]) -> Vec<u8> {
    let stored = match scheme {
        2 => zstd::encode_all(texels, 3).unwrap(),
        3 => {
            let mut encoder = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::default());
            encoder.write_all(texels).unwrap();
            encoder.finish().unwrap()
        }
        _ => texels.to_vec(),
    };
    let mut bytes = b"\xABKTX 20\xBB\r\n\x1A\n".to_vec();
    let words = [number, 1, 2, 2, 0, 0, 1, 1, scheme, 0, 0, 104, key_values.len() as u32, 0, 0, 0, 0];
    bytes.extend(words.iter().flat_map(|word| word.to_le_bytes()));
    let level = [104 + key_values.len() as u64, stored.len() as u64, texels.len() as u64];
    bytes.extend(level.iter().flat_map(|long| long.to_le_bytes()));
    [bytes, key_values.to_vec(), stored].concat()
}

/// A texture may name plain texels by its own source, without an extension.
fn plain_image(bytes: &[u8]) -> Result<(Vec<u8>, Vec<String>), String> {
    let mut file = File::quad();
    let texture = file.texture(bytes);
    file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture}}}));
    let scene = file.load()?;
    Ok((scene.images.first().map(|image| image.rgba.clone()).unwrap_or_default(), scene.warnings))
}

#[test]
fn plain_texels_of_ktx_2_are_read() {
    // Red, green, blue and alpha of four texels.
    let rgba: Vec<u8> = (0..16).map(|i| 15 * i).collect();
    let texels =
        |channels: &[usize]| -> Vec<u8> { rgba.chunks(4).flat_map(|t| channels.iter().map(|c| t[*c])).collect() };
    let shown = |channels: &[usize]| -> Vec<u8> {
        rgba.chunks(4)
            .flat_map(|t| (0..4).map(|c| if channels.contains(&c) { t[c] } else { [0, 0, 0, 255][c] }))
            .collect()
    };
    for (numbers, channels) in [
        ([9, 15], &[0][..]),
        ([16, 22], &[0, 1]),
        ([23, 29], &[0, 1, 2]),
        ([30, 36], &[2, 1, 0]),
        ([37, 43], &[0, 1, 2, 3]),
        ([51, 57], &[0, 1, 2, 3]),
        ([44, 50], &[2, 1, 0, 3]),
    ] {
        for (number, scheme) in numbers.into_iter().flat_map(|number| [0, 2, 3].map(|scheme| (number, scheme))) {
            let (image, warnings) = plain_image(&plain_ktx2(number, scheme, &texels(channels), &[])).unwrap();
            assert_eq!((image, warnings.len()), (shown(channels), 0), "format {number}, scheme {scheme}: {warnings:?}");
        }
    }
    for (number, channels) in [(70, &[0][..]), (77, &[0, 1]), (84, &[0, 1, 2]), (91, &[0, 1, 2, 3])] {
        // 257 times a byte is an equal share of 65535.
        let wide: Vec<u8> = texels(channels).iter().flat_map(|b| [*b, *b]).collect();
        let (image, warnings) = plain_image(&plain_ktx2(number, 2, &wide, &[])).unwrap();
        assert_eq!((image, warnings.len()), (shown(channels), 1), "{warnings:?}");
        assert!(warnings[0].contains("16 bits per channel are rounded to 8"), "{warnings:?}");
    }
}

#[test]
fn key_values_of_ktx_2_say_how_texels_are_shown() {
    let entry = |text: &[u8]| {
        let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
        bytes.extend(text);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        bytes
    };
    let shown = |key_values: &[u8]| plain_image(&plain_ktx2(9, 0, &[10, 20, 30, 40], key_values)).unwrap().0;
    let grey = shown(&[entry(b"KTXorientation\0rd\0"), entry(b"KTXswizzle\0rrr1\0")].concat());
    assert_eq!(grey, [[10, 10, 10, 255], [20, 20, 20, 255], [30, 30, 30, 255], [40, 40, 40, 255]].concat());
    let reds = |key_values: &[u8]| shown(key_values).iter().step_by(4).copied().collect::<Vec<u8>>();
    assert_eq!(reds(&entry(b"KTXorientation\0ru\0")), [30, 40, 10, 20]);
    assert_eq!(reds(&entry(b"KTXorientation\0ld\0")), [20, 10, 40, 30]);
    for odd in [&entry(b"KTXswizzle\0rrr9\0")[..], &entry(b"KTXswizzle"), b"\xff\xff\xff\xff", b"\x09\0\0\0KTX", &[1]] {
        assert_eq!(reds(odd), [10, 20, 30, 40], "{odd:?}");
    }
}

#[test]
fn damaged_plain_texels_of_ktx_2_get_a_note() {
    let texels = [7; 12];
    let mut long = plain_ktx2(23, 0, &texels, &[]);
    long.push(0);
    long[88] += 1;
    let mut torn = [2, 3].map(|scheme| plain_ktx2(23, scheme, &texels, &[]));
    torn.iter_mut().for_each(|bytes| bytes[108..].fill(0xff));
    let mut vast = plain_ktx2(23, 2, &texels, &[]);
    vast[20..28].fill(0xff);
    let mut wide = plain_ktx2(23, 2, &texels, &[]);
    wide[20..24].copy_from_slice(&65536u32.to_le_bytes());
    wide[96..104].copy_from_slice(&(65536u64 * 2 * 3).to_le_bytes());
    let [zstd, zlib] = torn;
    for (bytes, expected) in [
        (plain_ktx2(23, 0, &texels[1..], &[]), "has a largest level of another size"),
        (plain_ktx2(23, 2, &texels[1..], &[]), "has a largest level of another size"),
        (plain_ktx2(23, 1, &texels, &[]), "is supercompressed in a way that its format excludes"),
        (long, "has a largest level of another size"),
        (zstd, "has a damaged largest level"),
        (zlib, "has a damaged largest level"),
        (vast, "has a largest level of another size"),
    ] {
        let (image, notes) = plain_image(&bytes).unwrap();
        let said = notes.len() == 1 && notes[0].contains(expected);
        assert!(image.is_empty() && said, "{expected}: {image:?} {notes:?}");
    }
    assert!(plain_image(&wide).unwrap_err().contains("has more than 16384 texels a side"));
}

/// A header that states 16,384² texels over a few bytes of zstd: the memory is counted before the image is decoded.
#[test]
fn a_large_size_in_a_small_file_is_refused_by_what_it_needs() {
    let mut bytes = UASTC_ZSTD.to_vec();
    for at in [20, 24] {
        bytes[at..at + 4].copy_from_slice(&16384u32.to_le_bytes());
    }
    bytes[96..104].copy_from_slice(&(16384u64 * 16384).to_le_bytes());
    let (_folder, path) = write("scene.glb", &textured(BASISU, &bytes).glb());
    let memory = Some(Limit { bytes: 1 << 30, words: "the test's limit".into() });
    let sentence = Scene::load(&path, &LoadOptions { memory, ..LoadOptions::default() }).unwrap_err().to_string();
    assert!(sentence.contains("texels in its textures, more than the test's limit"), "{sentence}");
    bytes[20..24].copy_from_slice(&65536u32.to_le_bytes());
    bytes[96..104].copy_from_slice(&(65536u64 * 16384).to_le_bytes());
    let sentence = textured(BASISU, &bytes).load().unwrap_err();
    assert!(sentence.contains("has more than 16384 texels a side"), "{sentence}");
}

/// Flipped bits, changed bytes and missing ends: each gives a note, an error or an image.
#[test]
fn damaged_ktx_2_is_survived() {
    let mut random = Random(3);
    for whole in [ETC1S, UASTC, UASTC_ZSTD] {
        let mut unread = 0;
        for _ in 0..1000 {
            let mut bytes = whole.to_vec();
            // Headers are damaged more often than the rest.
            let part = |random: &mut Random| 0..if random.below(3) == 0 { 104 } else { whole.len() };
            change_bytes(&mut random, &mut bytes, part);
            if random.below(8) == 0 {
                bytes.truncate(random.below(whole.len()));
            }
            let outcome = textured(BASISU, &bytes).load();
            unread += usize::from(outcome.as_ref().map_or(true, |scene| scene.images.is_empty()));
            check(outcome);
        }
        assert!((125..975).contains(&unread), "{unread} of 1000 were not read");
    }
}
