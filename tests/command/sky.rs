//! `--sky` with a map, and `--transparent`: valid files, unusual ones and invalid ones.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

use crate::cli_common::{folder, names};
use twobounce::layers::{Aov, Layers};
use twobounce::output::exr::Metadata;

fn run(folder: &Path, args: &[&str]) -> Output {
    let small = ["--size", "24x16", "--set", "voxels=16", "--set", "image.samples=1", "--noise=off"];
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    command.current_dir(folder).args(["render", "scene.gltf"]).args(args).args(small).output().unwrap()
}

/// Standard error of a render; fails if the command fails.
fn rendered(folder: &Path, args: &[&str]) -> String {
    let output = run(folder, args);
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{args:?}: {said}");
    said
}

/// Fails unless the sky `name` is refused at once, in one sentence that names it and contains `part`, and no file is
/// left.
fn refused(folder: &Path, name: &str, part: &str) {
    let (before, start) = (names(folder), Instant::now());
    let output = run(folder, &["-o", "a.png", "--sky", name]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{name}: {message}");
    assert_eq!(message.lines().count(), 1, "{name}: {message}");
    assert!(message.contains(name) && message.contains(part), "{name} should say {part:?}: {message}");
    assert!(start.elapsed() < Duration::from_secs(5), "{name} took {:?}", start.elapsed());
    assert_eq!(names(folder), before, "{name} left something behind");
}

/// A Radiance file without run lengths; texels as stored, three mantissas and an exponent above 128.
fn hdr(width: usize, height: usize, texels: impl Fn(usize) -> [u8; 4]) -> Vec<u8> {
    let mut bytes = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    bytes.extend((0..width * height).flat_map(texels));
    bytes
}

/// A texel of radiance (¼, ½, 1).
const EVEN: [u8; 4] = [32, 64, 128, 129];

fn layers(path: &Path) -> Layers {
    Layers::read_exr(path).unwrap().0
}

#[test]
fn an_even_map_is_the_even_sky() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("even.hdr"), hdr(8, 4, |_| EVEN)).unwrap();
    let even = Layers::new(8, 4, vec![[0.25, 0.5, 1.0]; 32]);
    even.write_exr(&at("even.exr"), &Metadata::new()).unwrap();
    rendered(folder.path(), &["-o", "colour.exr", "--sky", "0.25,0.5,1", "--sky-intensity", "3"]);
    for map in ["even.hdr", "even.exr"] {
        rendered(folder.path(), &["-o", "map.exr", "--sky", map, "--sky-intensity", "3", "--sky-rotation", "-70"]);
        assert_eq!(layers(&at("map.exr")), layers(&at("colour.exr")), "{map}");
    }
}

#[test]
fn a_map_is_seen_turned_and_scaled_down() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    // The map is brighter to the right of its middle, which is towards +Z.
    fs::write(at("half.hdr"), hdr(64, 32, |i| if i % 64 < 32 { [64, 64, 64, 128] } else { EVEN })).unwrap();
    let away = ["--eye", "9,0,0", "--target", "9,0,9"];
    let seen = |name: &str, more: &[&str]| {
        let said = rendered(folder.path(), &[&["-o", name, "--sky", "half.hdr"], &away[..], more].concat());
        (layers(&at(name)).beauty()[24 * 8 + 12], said)
    };
    assert_eq!(seen("a.exr", &[]).0, [0.25, 0.5, 1.0], "towards +Z");
    assert_eq!(seen("b.exr", &["--sky-rotation", "180"]).0, [0.25; 3]);
    let (middle, said) = seen("c.exr", &["--max-texture", "16"]);
    assert!(said.contains("half.hdr was scaled down from 64x32 to 16x8 texels"), "{said}");
    assert_eq!(middle, [0.25, 0.5, 1.0]);
}

#[test]
fn odd_texels_are_mended_and_that_is_said() {
    let folder = folder();
    let mut texels = vec![[0.25, 0.5, 1.0]; 32];
    (texels[3], texels[9], texels[20]) = ([f32::NAN, 1.0, 0.0], [-3.0, 0.5, 1.0], [f32::INFINITY, 0.5, 1.0]);
    let odd = Layers::new(8, 4, texels);
    odd.write_exr(&folder.path().join("odd.exr"), &Metadata::new()).unwrap();
    let said = rendered(folder.path(), &["-o", "a.exr", "--sky", "odd.exr"]);
    assert!(said.contains("odd.exr has 3 texels that are negative or NaN"), "{said}");
    assert!(layers(&folder.path().join("a.exr")).beauty().iter().flatten().all(|c| c.is_finite()));
    fs::write(folder.path().join("tall.hdr"), hdr(8, 8, |i| [i as u8, 0, 0, 128])).unwrap();
    let said = rendered(folder.path(), &["-o", "b.exr", "--sky", "tall.hdr"]);
    assert!(said.contains("tall.hdr is not twice as wide as high"), "{said}");
    fs::write(folder.path().join("black.hdr"), hdr(8, 4, |_| [0; 4])).unwrap();
    let said = rendered(folder.path(), &["-o", "c.exr", "--sky", "black.hdr"]);
    assert!(said.contains("the sky's map black.hdr is black"), "{said}");
}

#[test]
fn bad_maps_are_refused_in_a_sentence() {
    let folder = folder();
    let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
    let good = hdr(8, 4, |_| EVEN);
    let mut exr = Vec::new();
    Layers::new(8, 4, vec![[1.0; 3]; 32]).write_exr(&folder.path().join("good.exr"), &Metadata::new()).unwrap();
    exr.extend(fs::read(folder.path().join("good.exr")).unwrap());
    write("short.hdr", &good[..good.len() - 5]);
    write("text.hdr", b"this is no image");
    write("empty.hdr", b"");
    write("none.hdr", &hdr(0, 0, |_| EVEN));
    write("wide.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 99999\n");
    write("vast.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 16384 +X 16384\n");
    write("endless.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4294967295 +X 4294967295\n");
    write("short.exr", &exr[..exr.len() / 2]);
    write("text.exr", b"this is no image");
    fs::create_dir(folder.path().join("folder.hdr")).unwrap();
    for (name, part) in [
        ("missing.hdr", "cannot be read"),
        ("missing.exr", "cannot be read"),
        ("short.hdr", "not a readable Radiance image"),
        ("text.hdr", "not a readable Radiance image"),
        ("empty.hdr", "not a readable Radiance image"),
        ("none.hdr", ""),
        ("wide.hdr", "more than 16384 texels a side"),
        ("vast.hdr", "too short for the size that it states"),
        ("endless.hdr", ""),
        ("short.exr", "not a readable OpenEXR image"),
        ("text.exr", "not a readable OpenEXR image"),
        ("folder.hdr", "is a folder"),
        ("/dev/zero.hdr", "cannot be read"),
        ("sky.png", "ends in .hdr or .exr"),
    ] {
        refused(folder.path(), name, part);
    }
    // An OpenEXR header that claims more than there is: its data window ends at 16383, 16383.
    let window = exr.windows(11).position(|w| w == b"dataWindow\0").unwrap() + 11 + 6 + 4;
    exr[window + 8..window + 16].copy_from_slice(&[0xff, 0x3f, 0, 0, 0xff, 0x3f, 0, 0]);
    write("vast.exr", &exr);
    refused(folder.path(), "vast.exr", "");
    let output = run(folder.path(), &["-o", "good.exr", "--sky", "good.exr"]);
    assert!(String::from_utf8(output.stderr).unwrap().contains("is read and written by the same command"));
    for (args, part) in [
        (&["--sky-rotation", "30"][..], "--sky-rotation turns a map"),
        (&["--sky-intensity", "2"], "--sky-intensity is for a sky"),
        (&["--sky", "short.hdr", "--default-light", "on"], "both give a sky"),
    ] {
        let output = run(folder.path(), &[&["-o", "a.png"], args].concat());
        let message = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && message.contains(part), "{args:?}: {message}");
    }
}

#[test]
fn transparent_images_have_alpha() {
    let folder = folder();
    let at = |name: &str| folder.path().join(name);
    let sky = ["--sky", "1,1,1"];
    rendered(folder.path(), &[&["-o", "a.exr", "--transparent"], &sky[..]].concat());
    rendered(folder.path(), &[&["-o", "a.png", "--transparent", "--exposure", "0"], &sky[..]].concat());
    rendered(folder.path(), &[&["-o", "b.png", "--exposure", "0"], &sky[..]].concat());
    let image = layers(&at("a.exr"));
    let alpha = image.get(Aov::Alpha).expect("channel A");
    let png = image::open(at("a.png")).unwrap();
    assert!(!image::open(at("b.png")).unwrap().color().has_alpha());
    let (png, mut clear) = (png.as_rgba8().expect("8-bit RGBA"), 0);
    for ((p, a), shown) in image.beauty().iter().zip(alpha).zip(png.pixels()) {
        assert!(a[0] == 0.0 || a[0] == 1.0, "one sample a pixel");
        assert_eq!(shown.0[3], if a[0] == 1.0 { 255 } else { 0 });
        clear += usize::from(a[0] == 0.0);
        assert!(a[0] == 1.0 || *p == [0.0; 3], "what is clear is black");
    }
    assert!(clear > 10 && clear < 24 * 16 - 10, "{clear} pixels are clear");
}
