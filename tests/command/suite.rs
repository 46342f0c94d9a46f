//! `twobounce suite`: an image made with a known error gets that error, references are made again, and invalid input is
//! refused before anything is written.

use std::fs;

use twobounce::lab::table::{CsvRow, from_csv};
use twobounce::layers::{Aov, Layers};
use twobounce::output::exr::Metadata;

use crate::cli_common::{Folder, root};

/// A folder with a suite of one scene at two sides, with its references.
fn small() -> Folder {
    let folder = Folder::with_box("box.glb");
    let text = fs::read_to_string(root().join("suite/suite.toml")).unwrap();
    let (_, scenes) = text.split_once("[[scene]]").unwrap();
    let scene = scenes.split("[[scene]]").find(|scene| scene.contains("cornell-point")).unwrap();
    let scene = scene.replace("../assets/cornell-point.glb", "../box.glb").replace("samples = 64", "samples = 2");
    let head = "sides = [32, 16]\nseeds = [5, 6, 7]\nsettings = [\"voxels=16\", \"bounces=all\"]\n[[scene]]";
    fs::create_dir(folder.path("suite")).unwrap();
    fs::write(folder.path("suite/suite.toml"), head.to_owned() + &scene).unwrap();
    folder.done(&["suite", "--references", "-q"]);
    folder
}

fn image(folder: &Folder, to: &str, change: impl Fn(&mut Layers)) {
    let (mut image, _) = Layers::read_exr(&folder.path("suite/references/cornell-point-32.exr")).unwrap();
    change(&mut image);
    image.write_exr(&folder.path(to), &Metadata::new()).unwrap();
}

fn rows(folder: &Folder, output: &str) -> Vec<CsvRow> {
    from_csv(&fs::read_to_string(folder.path(output).join("rows.csv")).unwrap()).unwrap().1
}

#[test]
fn an_image_has_the_error_that_it_was_given() {
    let folder = small();
    let scaled =
        |factor: f32| move |image: &mut Layers| image.layers[0].1.iter_mut().flatten().for_each(|v| *v *= factor);
    image(&folder, "same.exr", |_| ());
    image(&folder, "bright.exr", scaled(1.25));
    let brighter = |image: &mut Layers| {
        let direct = image.get(Aov::Direct).unwrap().to_vec();
        let pixels = image.layers[0].1.iter_mut().flatten().zip(direct.iter().flatten());
        pixels.for_each(|(value, direct)| *value += 0.5 * (*value - direct).max(0.0));
        image.layers.truncate(1);
    };
    image(&folder, "indirect.exr", brighter);
    let list = "[[import]]\nname = \"Bright | one\"\nimage = \"bright.exr\"\nmilliseconds = 8\nby = \"Anna\"\n\
                device = \"a card\"\nnote = \"by <b>hand</b>\"\nscene = \"cornell-point\"\n";
    fs::write(folder.path("list.toml"), list).unwrap();
    let given = [
        "--import",
        "Same=same.exr,12.5",
        "--import",
        "Indirect=indirect.exr,3,exact-direct",
        "--imports",
        "list.toml",
    ];
    folder.done(&[&["suite", "cornell-point", "-o", "out"][..], &given].concat());
    let rows = rows(&folder, "out");
    let row = |name: &str| rows.iter().find(|row| row.cell("name") == name).unwrap_or_else(|| panic!("no row {name}"));
    let number = |name: &str, column: &str| row(name).number(column).unwrap();

    assert_eq!((number("Same", "total_rel"), number("Same", "total_energy")), (0.0, 1.0));
    assert_eq!((number("Same", "milliseconds"), row("Same").cell("diffuse_rel")), (12.5, ""));
    let [rel, energy] = ["total_rel", "total_energy"].map(|column| number("Bright | one", column));
    assert!((rel - 0.25).abs() < 1e-5 && (energy - 1.25).abs() < 1e-5, "{rel} and {energy}");
    assert_eq!([row("Bright | one").cell("by"), row("Bright | one").cell("device")], ["Anna", "a card"]);
    // Half as much again of the indirect light alone, where it exceeds the noise of the direct light.
    let [rel, energy] = ["diffuse_rel", "diffuse_energy"].map(|column| number("Indirect", column));
    assert!((rel - 0.5).abs() < 0.01 && (energy - 1.5).abs() < 0.01, "{rel} and {energy}");

    // The page shows the rows, and escapes all given text.
    let page = fs::read_to_string(folder.path("out/README.md")).unwrap();
    assert!(page.contains("| Same | 32×32 | 12 | 0.0000 | 1.000 | – | – |"), "{page}");
    assert!(page.contains("Bright \\| one") && page.contains("&lt;b>hand") && !page.contains("<b>"), "{page}");
    // A repeated call keeps the rows and measures a changed image again.
    image(&folder, "same.exr", scaled(1.5));
    folder.done(&["suite", "cornell-point", "--import", "Same=same.exr,12.5", "-o", "out"]);
    let again = self::rows(&folder, "out");
    let rel = again.iter().find(|row| row.cell("name") == "Same").unwrap().number("total_rel").unwrap();
    assert!(again.len() == 3 && (rel - 0.5).abs() < 1e-5, "{} rows, {rel}", again.len());
}

#[test]
fn presets_and_paths_are_measured_and_an_image_of_render_fits() {
    let folder = small();
    folder.done(&[
        "suite",
        "--presets",
        "fast",
        "--set",
        "rays.diffuse=4",
        "--paths",
        "2",
        "--side",
        "16",
        "-o",
        "out",
    ]);
    let rows = rows(&folder, "out");
    let names: Vec<&str> = rows.iter().map(|row| row.cell("name")).collect();
    assert_eq!(names, ["2 paths a pixel", "fast rays.diffuse=4"]);
    for row in &rows {
        let rel = row.number("total_rel").unwrap();
        assert!(rel > 0.0 && rel < 0.6 && row.number("milliseconds").unwrap() > 0.0, "{row:?}");
        assert_eq!((row.cell("side_pixels"), row.cell("device").is_empty()), ("16", false));
    }
    // An equal image by `render`, whose header names the scene and the camera.
    let render = ["render", "box.glb", "-q", "--noise=off", "--size", "16x16", "--preset", "fast", "-o", "own.exr"];
    let sets = ["--set", "voxels=16", "--set", "bounces=all", "--set", "rays.diffuse=4", "--aov", "direct"];
    folder.done(&[&render[..], &sets].concat());
    folder.done(&["suite", "cornell-point", "--import", "Own=own.exr,1", "-o", "out"]);
    let rows = self::rows(&folder, "out");
    let cell = |name: &str| rows.iter().find(|row| row.cell("name") == name).unwrap().cell("diffuse_rel").to_owned();
    assert_eq!(cell("Own"), cell("fast rays.diffuse=4"));
}

#[test]
fn references_are_the_same_bits_again() {
    let folder = small();
    let read = || {
        let mut files: Vec<_> =
            fs::read_dir(folder.path("suite/references")).unwrap().map(|file| file.unwrap().path()).collect();
        files.sort();
        files.into_iter().map(|file| fs::read(file).unwrap()).collect::<Vec<_>>()
    };
    let before = read();
    assert_eq!(before.len(), 4);
    fs::remove_dir_all(folder.path("cache")).unwrap();
    folder.done(&["suite", "--references", "-q"]);
    assert!(read() == before, "other bits from the same seeds");
    let text = fs::read_to_string(folder.path("suite/suite.toml")).unwrap();
    fs::write(folder.path("suite/suite.toml"), text.replace("[5, 6, 7]", "[5, 6, 8]")).unwrap();
    folder.done(&["suite", "--references", "-q"]);
    assert!(read() != before, "the seeds do not count");
}

#[test]
fn nonsense_is_refused_and_leaves_no_file() {
    let folder = small();
    image(&folder, "good.exr", |_| ());
    image(&folder, "nan.exr", |image| image.layers[0].1[7][1] = f32::NAN);
    image(&folder, "negative.exr", |image| image.layers[0].1[7][1] = -1.0);
    image(&folder, "small.exr", |image| {
        (image.width, image.height) = (8, 8);
        image.layers.iter_mut().for_each(|(_, pixels)| pixels.truncate(64));
    });
    fs::write(folder.path("text.exr"), "no image").unwrap();
    let cases: &[(&[&str], &[&str])] = &[
        (&["weather", "--import", "A=good.exr,1"], &["no scene \"weather\"", "cornell-point"]),
        (&["cornell-point", "--import", "A=good.exr,-1"], &["-1 ms", "above 0"]),
        (&["cornell-point", "--import", "A=good.exr,soon"], &["NAME=IMAGE.exr,MILLISECONDS"]),
        (&["cornell-point", "--import", "A=good.exr,NaN"], &["NaN ms"]),
        (&["cornell-point", "--import", "A=nan.exr,1"], &["1 NaN", "render it again"]),
        (&["cornell-point", "--import", "A=negative.exr,1"], &["1 negative"]),
        (&["cornell-point", "--import", "A=small.exr,1"], &["8x8", "32x32 or 16x16"]),
        (&["cornell-point", "--import", "A=text.exr,1"], &["no OpenEXR image"]),
        (&["cornell-point", "--import", "A=missing.exr,1"], &["missing.exr"]),
        (&["cornell-point", "--import", "A=good.exr,1", "--import", "B=nan.exr,1"], &["1 NaN"]),
        (&["--presets", "weather"], &["weather"]),
        (&["--presets", "fast", "--set", "bounces=2"], &["all light"]),
        (&["--presets", "fast", "--side", "8"], &["--side", "32x32 or 16x16"]),
        (&["--paths", "0"], &["0"]),
        (&["--suite", "nowhere"], &["nowhere"]),
    ];
    for (args, words) in cases {
        let said = folder.refused(&[&["suite", "-o", "new"][..], args].concat());
        assert!(words.iter().all(|word| said.contains(word)), "{args:?}: {said}");
        assert!(!folder.path("new").exists(), "{args:?} leaves a folder");
    }
    // A folder of something else keeps its files, and so does one with rows of another kind.
    for (name, text) in [("README.md", "My notes\n"), ("rows.csv", "a,b\n1,2\n")] {
        let _ = fs::remove_dir_all(folder.path("mine"));
        fs::create_dir(folder.path("mine")).unwrap();
        fs::write(folder.path("mine").join(name), text).unwrap();
        let said = folder.refused(&["suite", "cornell-point", "--import", "A=good.exr,1", "-o", "mine"]);
        assert!(said.contains("name another folder"), "{said}");
        assert_eq!(fs::read_to_string(folder.path("mine").join(name)).unwrap(), text);
    }
    // An image without its reference cannot be measured, and the message says how to make the reference.
    fs::remove_file(folder.path("suite/references/cornell-point-32.exr")).unwrap();
    let said = folder.refused(&["suite", "cornell-point", "--import", "A=good.exr,1", "-o", "new"]);
    assert!(said.contains("twobounce suite cornell-point --references") && !folder.path("new").exists(), "{said}");
}
