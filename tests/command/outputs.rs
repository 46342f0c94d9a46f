//! Output files: their bits, and that each is complete or absent.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use twobounce::layers::{Aov, Layers};
use twobounce::output::display::{Display, ToneMap, srgb_code};
use twobounce::output::{exr, file, picture};

/// An image with extreme and non-finite values in every layer.
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

/// The exr crate keeps attributes in a hash map with a random order, which twenty runs would show.
#[test]
fn the_same_image_gives_the_same_bytes() {
    let metadata: BTreeMap<String, String> = (0..12).map(|i| (format!("key{i}"), format!("{i}"))).collect();
    let image = awkward();
    let (first_exr, first_png) =
        (exr::encode(&image, &metadata).unwrap(), picture::encode_png(&image, Display::default()).unwrap());
    for _ in 0..20 {
        assert!(exr::encode(&image, &metadata).unwrap() == first_exr);
        assert!(picture::encode_png(&image, Display::default()).unwrap() == first_png);
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
    assert_eq!([0.0, 1.0, 0.5, 0.214_041, 0.002].map(srgb_code), [0, 255, 188, 127, 7]);
    assert_eq!([-1.0, 2.0, f32::NAN, f32::INFINITY].map(srgb_code), [0, 255, 0, 255]);
}

/// Every curve keeps greys grey (AgX to the precision of its published matrices), is monotonic and continuous from 0 to
/// 1, and stays in bounds.
#[test]
fn tone_curves_keep_their_promises() {
    for tone in ToneMap::ALL {
        assert!(tone.apply([f32::NAN, 0.0, 0.0]).iter().all(|c| *c < 1e-6), "{tone}");
        let mut last = -1.0;
        for i in 0..4000 {
            let x = (i as f32 * 0.01 - 20.0).exp2();
            let [r, g, b] = tone.apply([x; 3]);
            assert!((r - g).abs().max((g - b).abs()) < 1e-3, "{tone}: {x} gives {r}, {g}, {b}");
            assert!(g >= last - 1e-6 && g <= 1.0, "{tone}: {x} gives {g} after {last}");
            // 0.01 of a stop changes the input by 0.7 %. No curve is steeper than 1.6 times the display's own exponent
            // of 2.2.
            assert!(last < 0.0 || g - last <= 0.007 * 1.6 * 2.2 * x.min(1.0) + 1e-6, "{tone}: a jump at {x}");
            last = g;
        }
        assert!(last > 0.99, "{tone}: {last}");
        for bright in [[f32::INFINITY, 0.0, 0.0], [0.0, 1e9, 2.0], [1.0, 0.0, 30.0]] {
            let shown = tone.apply(bright);
            assert!(shown.iter().all(|c| (0.0..=1.0).contains(c)), "{tone}: {shown:?}");
        }
    }
    // Khronos' formula subtracts 0.04; AgX shows 18 % grey as the code 0.5 of its display of exponent 2.2.
    assert_eq!(ToneMap::Neutral.apply([0.5; 3]), [0.46; 3]);
    assert!((ToneMap::Agx.apply([0.18; 3])[1] - 0.5f32.powf(2.2)).abs() < 1e-4);
    assert_eq!(ToneMap::Agx.apply([0.18 * 6.5f32.exp2(); 3]).map(srgb_code), [255; 3]);
    assert!(ToneMap::Reinhard.apply([1.0; 3]).iter().all(|c| (c - 0.5).abs() < 1e-6));
    assert_eq!(ToneMap::Linear.apply([0.25, 3.0, 0.0]), [0.25, 1.0, 0.0]);
    // Bright red loses saturation in AgX and Neutral, and keeps it in the others.
    let greens = ToneMap::ALL.iter().map(|tone| tone.apply([8.0, 0.0, 0.0])[1]).collect::<Vec<_>>();
    assert!(greens[0] > 0.2 && greens[1] > 0.2 && greens[2..] == [0.0, 0.0], "{greens:?}");
}

#[test]
fn automatic_exposure_is_what_it_says() {
    let linear = |pixels: &[[f32; 3]]| ToneMap::Linear.automatic_exposure(pixels);
    // An image of one grey: half-way between the stops that show it as 0.18 and as 0.85.
    let ev = ((0.18f32 * 0.85).sqrt() / 0.05).log2();
    assert!((linear(&[[0.05; 3]; 100]) - ev).abs() < 0.006);
    // A tenth of the pixels is 64 times as bright: the percentile lies among them, and without the bound they would be
    // shown at 1.5.
    let mixed = [vec![[0.05; 3]; 900], vec![[3.2; 3]; 100]].concat();
    assert!((linear(&mixed) - (0.945f32 / 3.2).log2()).abs() < 0.006);
    // Black and non-finite pixels do not count.
    let broken = [vec![[0.0; 3]; 1000], vec![[f32::INFINITY; 3], [f32::NAN; 3]], vec![[0.05; 3]; 100]].concat();
    assert_eq!(linear(&broken), linear(&[[0.05; 3]; 100]));
    assert_eq!((linear(&[]), linear(&[[0.0; 3]; 4])), (0.0, 0.0));
    // Whatever the saturation, at most 5 % of the pixels reach code 250.
    for seed in 0..20u32 {
        let noise = |i: u32| f32::from((i.wrapping_mul(2_654_435_761).rotate_left(seed) >> 16) as u16) / 65536.0;
        let stops = 1.0 + seed as f32;
        let pixels: Vec<[f32; 3]> =
            (0..3000u32).map(|i| [0, 1, 2].map(|k| ((noise(3 * i + k + seed) - 0.5) * stops).exp2())).collect();
        for tone in [ToneMap::Neutral, ToneMap::Linear] {
            let display = Display::automatic(tone, &pixels);
            let bright = pixels.iter().filter(|p| display.codes(**p).into_iter().any(|code| code >= 250)).count();
            assert!(20 * bright <= pixels.len(), "{tone}, seed {seed}: {bright} of {}", pixels.len());
        }
    }
}

#[test]
fn jpegs_show_what_pngs_do() {
    let side = 64u32;
    let ramp = |i: u32| [i % side, i / side, side].map(|c| c as f32 / side as f32);
    let image = Layers::new(side, side, (0..side * side).map(ramp).collect());
    let folder = tempfile::tempdir().unwrap();
    let mut shown = Vec::new();
    for name in ["a.png", "a.jpg", "a.JPEG"] {
        let path = folder.path().join(name);
        image.write_shown(&path, Display::default()).unwrap();
        shown.push(image::open(&path).unwrap().into_rgb8());
    }
    assert_eq!(shown[1], shown[2]);
    let apart = |(a, b): (&u8, &u8)| f64::from(a.abs_diff(*b));
    let mean = shown[0].iter().zip(shown[1].iter()).map(apart).sum::<f64>() / f64::from(3 * side * side);
    assert!(mean > 0.0 && mean < 2.0, "{mean} codes apart, by compression");
    let refused = image.write_shown(&folder.path().join("a.gif"), Display::default()).unwrap_err().to_string();
    assert!(refused.contains(".png or .jpg"), "{refused}");
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

/// A file with any one byte damaged gives an image or an error message.
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
