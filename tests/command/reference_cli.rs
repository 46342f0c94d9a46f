//! The commands `twobounce reference` and `twobounce compare`: files, messages, exit codes.

use crate::cli_common::{Folder, root, text};
use twobounce::layers::{Aov, Layers};

impl Folder {
    /// Runs the program; returns the exit code and the output of both streams.
    fn said(&self, args: &[&str]) -> (Option<i32>, String) {
        let output = self.run(args);
        (output.status.code(), text(&output.stdout) + &text(&output.stderr))
    }

    fn reference(&self, output: &str, more: &[&str]) -> (Option<i32>, String) {
        self.sized(output, "16x12", more)
    }

    fn sized(&self, output: &str, size: &str, more: &[&str]) -> (Option<i32>, String) {
        let scene = root().join("tests/truth/cornell-area/cornell-area.glb");
        let scene = scene.to_str().expect("a path in UTF-8");
        self.said(&[&["reference", scene, "--size", size, "-o", output], more].concat())
    }
}

#[test]
fn a_reference_has_its_layers_and_states_its_noise() {
    let folder = Folder::empty();
    let layers = ["--spp", "8", "--aov", "direct,indirect,ao,normal,depth,albedo,diffuse"];
    let (code, said) = folder.reference("a.exr", &layers);
    assert!(code == Some(0) && said.contains("8 samples per pixel, noise "), "{said}");
    let (image, header) = Layers::read_exr(&folder.path("a.exr")).expect("it can be read");
    assert_eq!((image.width, image.height), (16, 12));
    // --transparent adds the channel alpha.
    let mut asked = Aov::ALL.iter().filter(|aov| **aov != Aov::Alpha);
    assert!(asked.all(|aov| image.get(*aov).is_some()), "a layer is missing");
    let keys: Vec<_> = header.keys().map(String::as_str).collect();
    assert!(["depth", "noise", "samplesPerPixel", "seed"].iter().all(|k| keys.contains(k)), "{keys:?}");
    let (code, said) = folder.reference("b.exr", &layers);
    assert!(code == Some(0) && said.contains("taken from the cache"), "{said}");
    let read = |name| std::fs::read(folder.path(name)).expect("it can be read");
    assert!(read("a.exr") == read("b.exr"), "the same command gives different bytes");
}

#[test]
fn compare_prints_writes_and_judges() {
    let folder = Folder::empty();
    folder.reference("a.exr", &["--spp", "8", "--aov", "direct,diffuse"]);
    folder.reference("b.exr", &["--spp", "8", "--aov", "direct", "--depth", "1"]);
    let files = ["compare", "b.exr", "a.exr"];
    let (code, said) =
        folder.said(&[&files[..], &["--json", "c.json", "--out", "pictures", "--max-rel", "0.5"]].concat());
    assert!(code == Some(0) && said.contains("indirect"), "{said}");
    let json = std::fs::read_to_string(folder.path("c.json")).expect("the report");
    let report: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    let keys: Vec<_> = report.as_object().expect("an object").keys().map(String::as_str).collect();
    let documented = [
        "exceeded",
        "flip",
        "height",
        "image",
        "image_nonfinite",
        "indirect",
        "indirect_diffuse",
        "reference",
        "reference_nonfinite",
        "total",
        "version",
        "width",
    ];
    assert_eq!(keys, documented);
    assert_eq!(report["version"], 1);
    for part in ["indirect", "indirect_diffuse"] {
        assert!(said.contains(&format!("\n{part:>16} ")), "{said}");
        assert!(report[part]["energy"].as_f64().is_some_and(|e| (0.3..0.9).contains(&e)), "{json}");
    }
    let png = image::open(folder.path("pictures/compare.png")).expect("a picture");
    assert_eq!((png.width(), png.height()), (64, 12));
    let (code, said) = folder.said(&[&files[..], &["--max-indirect-energy", "0.05"]].concat());
    assert!(code == Some(1) && said.contains("indirect energy's distance from 1 is "), "{said}");
    let (code, said) = folder.said(&[&files[..], &["--max-indirect-diffuse-rel", "0.05"]].concat());
    assert!(code == Some(1) && said.contains("indirect_diffuse rel is "), "{said}");
    let (code, said) = folder.said(&["compare", "a.exr", "b.exr"]);
    assert!(code == Some(0) && said.contains("needs the diffuse layer in the reference"), "{said}");
}

/// Without a folder for the cache a note says so, and the image is the same.
#[test]
fn a_reference_needs_no_cache() {
    let folder = Folder::empty();
    let (code, _) = folder.reference("a.exr", &["--spp", "2"]);
    assert_eq!(code, Some(0));
    std::fs::remove_dir_all(folder.path("cache")).expect("a cache");
    std::fs::write(folder.path("cache"), b"a file").expect("written");
    let (code, said) = folder.reference("b.exr", &["--spp", "2"]);
    assert!(code == Some(0) && said.contains("references are not kept"), "{said}");
    let read = |name: &str| std::fs::read(folder.path(name)).expect("an image");
    assert!(read("a.exr") == read("b.exr"));
    let output = folder.run(&["reference", "-q", "none.glb", "-o", "-"]);
    assert!(output.status.code() == Some(2) && output.stdout.is_empty());
}

/// The header of an image states more pixels than memory holds.
#[test]
fn a_huge_image_is_refused_by_its_header() {
    let folder = Folder::empty();
    folder.reference("a.exr", &["--spp", "2"]);
    let mut bytes = std::fs::read(folder.path("a.exr")).expect("an image");
    let windows: Vec<usize> =
        (0..bytes.len() - 8).filter(|&at| bytes[at..].starts_with(b"dataWindow\0box2i\0")).collect();
    for at in windows {
        let corner = at + b"dataWindow\0box2i\0".len() + 4 + 8;
        bytes[corner..corner + 8].copy_from_slice(&[0xff, 0xff, 0x0f, 0, 0xff, 0xff, 0x0f, 0]);
    }
    std::fs::write(folder.path("huge.exr"), bytes).expect("written");
    let start = std::time::Instant::now();
    let (code, said) = folder.said(&["compare", "huge.exr", "a.exr"]);
    assert!(code == Some(2) && said.contains("huge.exr: ") && start.elapsed().as_secs() < 2, "{said}");
}

#[test]
fn invalid_arguments_give_one_sentence() {
    let folder = Folder::empty();
    folder.reference("a.exr", &["--spp", "2"]);
    folder.sized("small.exr", "8x8", &["--spp", "2"]);
    std::fs::write(folder.path("noise.exr"), b"no image").expect("written");
    for (args, part) in [
        (&["compare", "a.exr", "small.exr"][..], "the image is 16x12, the reference 8x8"),
        (&["compare", "a.exr", "a.exr", "--max-indirect-rel", "1"], "needs the direct layer"),
        (&["compare", "a.exr", "a.exr", "--max-indirect-diffuse-rel", "1"], "needs the diffuse layer"),
        (&["compare", "a.exr", "none.exr"], "none.exr: cannot be read"),
        #[cfg(unix)]
        (&["compare", "/dev/zero", "a.exr"], "/dev/zero: is no regular file"),
        (&["compare", "noise.exr", "a.exr"], "noise.exr: is not a readable OpenEXR image"),
        (&["compare", "a.exr", "a.exr", "--json", "a.exr"], "is read and written by the same command"),
        (&["compare", "a.exr", "a.exr", "--json", "./a.exr"], "is read and written by the same command"),
        (&["compare", "a.exr", "a.exr", "--out", "noise.exr"], "is a file; --out takes a folder"),
        (&["compare", "a.exr", "a.exr", "--max-rel=-1"], "at least 0"),
    ] {
        let (code, said) = folder.said(args);
        assert!(code == Some(2) && said.contains(part) && said.trim_end().lines().count() == 1, "{args:?}: {said}");
    }
    for (more, part) in [
        (&["--noise", "0"][..], "write a percentage above 0"),
        (&["--depth", "some"], "write a number of indirect bounces, direct or full"),
        (&["--spp", "0"], "--spp"),
        (&["-o", "x.png"], "cannot be used multiple times"),
    ] {
        let (code, said) = folder.reference("x.exr", more);
        assert!(code == Some(2) && said.contains(part), "{more:?}: {said}");
        assert!(!folder.path("x.exr").exists(), "{more:?} left an image");
    }
}
