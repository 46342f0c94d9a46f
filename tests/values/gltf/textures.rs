//! Textures in the formats of extensions, WebP and KTX 2 (`compressed/make.mjs` made the files).

use super::damage::{change_bytes, check};
use super::files::{File, png, write};
use crate::random::Random;
use serde_json::json;
use twobounce::memory::Limit;
use twobounce::scene::{Image, LoadOptions, Scene};

const PNG: &[u8] = include_bytes!("compressed/fading.png");
const WEBP: &[u8] = include_bytes!("compressed/fading.webp");
const ETC1S: &[u8] = include_bytes!("compressed/fading-etc1s.ktx2");
const UASTC: &[u8] = include_bytes!("compressed/fading-uastc.ktx2");
const UASTC_ZSTD: &[u8] = include_bytes!("compressed/fading-uastc-zstd.ktx2");

const BASISU: &str = "KHR_texture_basisu";

/// A quad whose texture names an image of these bytes by the extension alone.
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
fn image(extension: &str, bytes: &[u8]) -> Image {
    let mut scene = strictly(&textured(extension, bytes)).unwrap();
    assert_eq!((scene.warnings.len(), scene.images.len()), (0, 1));
    scene.images.remove(0)
}

/// The square root of the mean squared difference of all bytes.
fn difference(a: &Image, b: &Image) -> f64 {
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

/// The hashes are those of what Basis Universal's own transcoder makes of the files (FNV-1a of 64 bits).
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

/// The extension's image stands before the plain one, which readers without the extension see.
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
        (12, 37, "holds texels that are not in Basis Universal's formats"),
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

/// A header that states 16,384² texels over a few bytes of zstd: counted before anything is made of it.
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

/// Bits flip, bytes change and ends are missing: a note, a sentence or an image.
#[test]
fn damaged_ktx_2_is_survived() {
    let mut random = Random(3);
    for whole in [ETC1S, UASTC, UASTC_ZSTD] {
        let mut unread = 0;
        for _ in 0..1000 {
            let mut bytes = whole.to_vec();
            // Headers more often than the rest.
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
