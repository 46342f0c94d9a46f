//! Files that are written: their bits, and that they are there whole or not at all.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use twobounce::layers::{Aov, Layers};
use twobounce::output::{exr, file, png};

/// An image with awkward values in every layer.
fn awkward() -> Layers {
    let (width, height) = (37, 19);
    let pixels = |seed: u32| -> Vec<[f32; 3]> {
        let mut state = seed;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f32::from_bits(state)
        };
        (0..width * height).map(|_| [next(), next(), next()]).collect()
    };
    let mut beauty = pixels(1);
    beauty[..4].copy_from_slice(&[[f32::INFINITY; 3], [-0.0; 3], [f32::MIN_POSITIVE / 2.0; 3], [65_504.0, 1e-6, 1e30]]);
    let layers = vec![(Aov::Beauty, beauty), (Aov::Direct, pixels(2)), (Aov::Depth, pixels(3))];
    Layers { width, height, layers }
}

fn bits(image: &Layers) -> Vec<(Aov, Vec<[u32; 3]>)> {
    image.layers.iter().map(|(aov, p)| (*aov, p.iter().map(|p| p.map(f32::to_bits)).collect())).collect()
}

fn entries(folder: &Path) -> Vec<String> {
    fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn exr_gives_back_every_bit_and_the_header() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.exr");
    let metadata = BTreeMap::from([
        ("twobounce.scene".to_owned(), "Größe 数\nsecond line".to_owned()),
        ("twobounce.settings".to_owned(), "x = 1\n".repeat(100)),
        ("empty".to_owned(), String::new()),
    ]);
    let image = awkward();
    image.write_exr(&path, &metadata).unwrap();
    let (read, header) = Layers::read_exr(&path).unwrap();
    assert_eq!((read.width, read.height), (image.width, image.height));
    assert_eq!(bits(&read), bits(&image));
    for (name, value) in &metadata {
        assert_eq!(header.get(name), Some(value), "{name}");
    }
    assert_eq!(entries(folder.path()), ["image.exr"]);
}

/// The exr crate keeps attributes in a hash map with a random order; twenty runs would show it.
#[test]
fn the_same_image_gives_the_same_bytes() {
    let metadata: BTreeMap<String, String> = (0..12).map(|i| (format!("key{i}"), format!("{i}"))).collect();
    let image = awkward();
    let (first_exr, first_png) = (exr::encode(&image, &metadata).unwrap(), png::encode(&image, 0.0).unwrap());
    for _ in 0..20 {
        assert!(exr::encode(&image, &metadata).unwrap() == first_exr);
        assert!(png::encode(&image, 0.0).unwrap() == first_png);
    }
}

#[test]
fn damaged_exr_files_are_refused_in_a_sentence() {
    let whole = exr::encode(&awkward(), &BTreeMap::new()).unwrap();
    for bytes in [&[][..], b"\x89PNG\r\n\x1a\n", &whole[..4], &whole[..200], &whole[..whole.len() - 1]] {
        let problem = exr::decode(bytes).unwrap_err();
        assert!(!problem.is_empty() && !problem.contains('\n'), "{problem}");
    }
    let missing = Layers::read_exr(Path::new("no/such.exr")).unwrap_err().to_string();
    assert!(missing.starts_with("no/such.exr: cannot be read"), "{missing}");
}

#[test]
fn srgb_codes_are_those_of_the_standard() {
    assert_eq!([0.0, 1.0, 0.5, 0.214_041, 0.002].map(png::srgb_code), [0, 255, 188, 127, 7]);
    assert_eq!([-1.0, 2.0, f32::NAN, f32::INFINITY].map(png::srgb_code), [0, 255, 0, 255]);
}

/// Khronos PBR Neutral: a grey of 0.5 loses the 0.04 offset; the curve is continuous, monotonic and bounded.
#[test]
fn the_tone_curve_keeps_its_promises() {
    assert_eq!(png::tone_curve([0.5; 3]), [0.46; 3]);
    assert_eq!(png::tone_curve([f32::NAN, 0.0, 0.0]), [0.0; 3]);
    let mut last = -1.0;
    for i in 0..4000 {
        let x = (i as f32 * 0.01 - 20.0).exp2();
        let [r, g, b] = png::tone_curve([x; 3]);
        assert!(r == g && g == b && r >= last && r <= 1.0, "{x} gives {r} after {last}");
        // 0.01 of a stop changes the input by 0.7 %, so the output by at most as much.
        assert!(last < 0.0 || r - last <= 0.007 * x.min(1.0) + 1e-6, "a jump at {x}");
        last = r;
    }
    assert!(last > 0.99);
    let saturated = png::tone_curve([f32::INFINITY, 0.0, 0.0]);
    assert!(saturated.iter().all(|c| (0.0..=1.0).contains(c)), "{saturated:?}");
}

#[test]
fn automatic_exposure_looks_at_surfaces_only() {
    let sky = [0.3, 0.5, 0.9];
    let mut pixels = vec![[0.05; 3]; 100];
    // 0.8 / 0.05 = 16: four stops.
    assert_eq!(png::automatic_exposure(&pixels, |_| sky), 4.0);
    pixels.extend([sky; 1000]);
    pixels.extend([[0.0; 3]; 1000]);
    pixels.extend([[f32::INFINITY; 3], [f32::NAN; 3]]);
    assert_eq!(png::automatic_exposure(&pixels, |_| sky), 4.0);
    assert_eq!(png::automatic_exposure(&[sky; 4], |_| sky), 0.0);
    assert_eq!(png::automatic_exposure(&[], |_| sky), 0.0);
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_beside() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("out.exr");
    fs::write(&path, "old").unwrap();
    let mut rights = fs::metadata(&path).unwrap().permissions();
    rights.set_readonly(true);
    fs::set_permissions(&path, rights).unwrap();
    let message = file::write(&path, b"new").unwrap_err().to_string();
    assert!(message.contains("read-only"), "{message}");
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(entries(folder.path()), ["out.exr"]);
}

#[test]
fn targets_that_cannot_be_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("file"), "").unwrap();
    for (path, part) in [
        (at("file/out.png"), "is not a folder"),
        (at("none/out.png"), "create it first"),
        (folder.path().to_owned(), "is a folder"),
        (at(&"x".repeat(300)), "name is too long"),
    ] {
        for message in [file::check_writable(&path).unwrap_err(), file::write(&path, b"x").unwrap_err()] {
            assert!(message.to_string().contains(part), "{message}");
        }
    }
    assert_eq!(entries(folder.path()), ["file"]);
}

#[cfg(target_os = "linux")]
#[test]
fn links_are_followed_and_a_full_disk_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::os::unix::fs::symlink("/dev/full", at("full.png")).unwrap();
    file::check_writable(&at("full.png")).unwrap();
    let message = file::write(&at("full.png"), b"x").unwrap_err().to_string();
    assert!(message.contains("the disk is full"), "{message}");

    fs::write(at("real.png"), "old").unwrap();
    std::os::unix::fs::symlink("real.png", at("link.png")).unwrap();
    file::write(&at("link.png"), b"new").unwrap();
    assert_eq!(fs::read(at("real.png")).unwrap(), b"new");
    assert!(fs::symlink_metadata(at("link.png")).unwrap().is_symlink());
}

/// Whatever byte of a file is damaged, reading it ends in an image or a sentence.
#[test]
fn damaged_bytes_never_panic() {
    let image = Layers::new(3, 2, vec![[0.25, 0.5, 1.0]; 6]);
    let whole = exr::encode(&image, &BTreeMap::from([("key".into(), "value".into())])).unwrap();
    for at in 0..whole.len() {
        for flip in [0x01, 0x80, 0xff] {
            let mut bytes = whole.clone();
            bytes[at] ^= flip;
            let _ = exr::decode(&bytes);
        }
    }
}
