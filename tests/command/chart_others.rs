//! Rows of a chart that are not renderer settings: images of other programs, measured by the common definition, and the
//! program's own path tracer.

use std::fs;

use crate::cli_common::{Folder, names, text};
use serde_json::Value;
use twobounce::layers::{Aov, Layers};
use twobounce::output::exr::Metadata;

const SCENE: &str = "box.glb";
const SMALL: [&str; 6] = ["--size", "32x24", "--set", "voxels=16", "--reference-noise", "20"];

impl Folder {
    fn rows_of_chart(&self, output: &str, more: &[&str]) -> Vec<Value> {
        self.done(&[&["chart", SCENE, "-o", output][..], &SMALL, more].concat());
        self.rows(output)
    }

    /// The row of this name.
    fn row(rows: &[Value], name: &str) -> Value {
        rows.iter().find(|row| row["name"] == name).unwrap_or_else(|| panic!("no row {name}")).clone()
    }

    fn render(&self, output: &str, more: &[&str]) {
        self.done(&[&["render", SCENE, "-q", "--noise=off", "-o", output], &SMALL[..4], more].concat());
    }

    /// Copies an image without this word in its header, as another program would write it.
    fn foreign(&self, from: &str, to: &str, change: impl Fn(&mut Layers)) {
        let (mut image, _) = Layers::read_exr(&self.path(from)).unwrap();
        change(&mut image);
        image.write_exr(&self.path(to), &Metadata::new()).unwrap();
    }
}

fn first_pixel(image: &mut Layers) -> &mut [f32; 3] {
    &mut image.layers[0].1[0]
}

/// The error of an image is the same whether the chart rendered it, an import brought it, or `compare` reads it.
#[test]
fn an_imported_image_has_the_errors_of_the_charts_own() {
    let folder = Folder::with_box(SCENE);
    folder.render("fast.exr", &["--preset", "fast", "--aov", "direct"]);
    folder.render("printed.exr", &["--preset", "printed", "--aov", "direct"]);
    folder.render(
        "equal.exr",
        &["--preset", "printed", "--aov", "direct", "--set", "lights.shadows=rays", "--set", "lights.lamps=sampled"],
    );
    folder.foreign("fast.exr", "bare.exr", |image| image.layers.truncate(1));
    folder.foreign("fast.exr", "layers.exr", |_| ());
    let list = r#"
        [[import]]
        name = "By equal terms"
        image = "printed.exr"
        equal_terms_image = "equal.exr"
        milliseconds = 40
        [[import]]
        name = "Other, 2 \"bounces\""
        image = "layers.exr"
        milliseconds = 12.5
        bounces = 2
        by = "<b>Anna</b>"
        device = "A card"
        note = "Said, \"so\""
        direct = "exact"
    "#;
    fs::create_dir(folder.path("sub")).unwrap();
    for name in ["printed.exr", "equal.exr", "layers.exr"] {
        fs::copy(folder.path(name), folder.path(&format!("sub/{name}"))).unwrap();
    }
    fs::write(folder.path("sub/list.toml"), list).unwrap();
    let given = [
        "--imports",
        "sub/list.toml",
        "--import",
        "Own=fast.exr,3e3",
        "--import",
        "Bare=bare.exr,7",
        "--import",
        "Approximate=printed.exr,9",
        "--import",
        "Less the reference's=bare.exr,8,exact-direct",
    ];
    let args = [&["--presets", "fast,printed", "--paths", "none"][..], &given].concat();
    let rows = folder.rows_of_chart("out", &args);
    assert_eq!(rows.len(), 2 + 6);
    let measured = |name: &str| Folder::row(&rows, name)["measured"].clone();
    let (fast, printed) = (measured("fast"), measured("printed"));
    assert!(fast["same"]["diffuse"]["rel"].as_f64().unwrap() > 0.0, "{fast}");

    // The header of this program's images has all facts; for an image without one the list gives them.
    for name in ["Own", "Other, 2 \"bounces\""] {
        let import = measured(name);
        for truth in ["full", "same"] {
            assert_eq!(import[truth], fast[truth], "{name}, {truth}");
        }
    }
    // Its number of bounces is unknown, so it is compared with all light.
    let bare = measured("Bare");
    assert_eq!(bare["full"]["total"], fast["full"]["total"]);
    assert_eq!(bare["same"], bare["full"]);
    assert!(bare["full"]["indirect"].is_null() && bare["full"]["diffuse"].is_null(), "{bare}");
    // By the header of each of the two images.
    for truth in ["full", "same"] {
        assert_eq!(measured("By equal terms")[truth], printed[truth], "{truth}");
    }
    assert_eq!(measured("Approximate")["same"]["total"], printed["same"]["total"]);
    assert!(measured("Approximate")["same"]["diffuse"].is_null());
    let indirect = |name: &str| Folder::row(&rows, name)["source"]["indirect"].as_str().unwrap().to_owned();
    assert!(indirect("Bare").contains("not judged: nothing says"), "{}", indirect("Bare"));
    assert!(indirect("Approximate").contains("not judged: the image's header says"), "{}", indirect("Approximate"));

    // `compare` too subtracts the reference's direct light from an image without a direct layer. Both have exact
    // shadows, so they differ by the noise of the reference's shadows alone, which for a point light exists only along
    // edges.
    let reference =
        ["reference", SCENE, "--depth", "full", "--noise", "20", "--aov", "direct,diffuse", "--size", "32x24", "-q"];
    folder.done(&[&reference[..], &["-o", "truth.exr"]].concat());
    folder.done(&["compare", "layers.exr", "truth.exr", "--json", "compared.json"]);
    let compared = folder.json("compared.json");
    for (of_chart, of_compare) in [("total", "total"), ("indirect", "indirect"), ("diffuse", "indirect_diffuse")] {
        assert_eq!(measured("Own")["full"][of_chart], compared[of_compare], "{of_chart}");
    }
    let energy = |name: &str| measured(name)["full"]["diffuse"]["energy"].as_f64().unwrap();
    let apart = (energy("Less the reference's") - energy("Own")).abs();
    assert!(apart > 0.0 && apart < 0.05, "{apart} for the noise of shadows in the reference");

    // Given values appear in the files and on the page unchanged.
    let row = Folder::row(&rows, "Other, 2 \"bounces\"");
    assert_eq!(row["source"]["kind"], "import");
    assert_eq!(row["source"]["milliseconds"], 12.5);
    assert_eq!(row["source"]["by"], "<b>Anna</b>");
    assert!(
        row["origin"].is_null() && row["settings"].is_null() && row["measured"]["frame_wall_ms"].is_null(),
        "{row}"
    );
    let csv = fs::read_to_string(folder.path("out/rows.csv")).unwrap();
    assert!(csv.contains("\"Other, 2 \"\"bounces\"\"\",import,") && csv.contains("\"Said, \"\"so\"\"\""), "{csv}");
    let page = fs::read_to_string(folder.path("out/index.html")).unwrap();
    assert!(
        page.contains("other program") && !page.contains("<b>Anna"),
        "a note is markup, or the page has no imports"
    );
    let svg = fs::read_to_string(folder.path("out/chart.svg")).unwrap();
    assert!(svg.contains("other program: 12 ms as given"), "{svg}");
    assert!(svg.contains("ms a frame: GPU; other programs: as given"), "{svg}");
    // Two more panels show the imports of which only the whole image was measured.
    assert_eq!(svg.matches("class=\"title\"").count(), 4, "{svg}");
    assert!(svg.contains("Bare, other program: 7 ms as given"), "{svg}");

    // A repeated command keeps all rows; another image of the same name is measured again; without imports the other
    // rows stay.
    let said = folder.done(&[&["chart", SCENE, "-o", "out"][..], &SMALL, &args].concat());
    assert!(said.contains("rows kept from earlier calls: 8 of 8"), "{said}");
    folder.foreign("fast.exr", "bare.exr", |image| {
        image.layers.truncate(1);
        image.layers[0].1.iter_mut().flatten().for_each(|value| *value *= 2.0);
    });
    let rows = folder.rows_of_chart("out", &args);
    let energy = |measured: &Value| measured["full"]["total"]["energy"].as_f64().unwrap();
    let doubled = energy(&Folder::row(&rows, "Bare")["measured"]) / energy(&fast);
    assert!((doubled - 2.0).abs() < 1e-6, "twice the light has {doubled} of the energy");
    assert_eq!(folder.rows_of_chart("out", &args[..4]).len(), 2);
}

#[test]
fn imports_that_are_unfit_are_refused_in_a_sentence() {
    let folder = Folder::with_box(SCENE);
    folder.render("fit.exr", &["--preset", "fast", "--aov", "direct"]);
    folder.render("printed.exr", &["--preset", "printed", "--aov", "direct"]);
    folder.done(&["render", SCENE, "-q", "-o", "small.exr", "--size", "16x16", "--set", "voxels=16"]);
    folder.render("other-view.exr", &["--eye", "0,0,2", "--target", "0,0,0"]);
    folder.render("image.png", &[]);
    folder.foreign("fit.exr", "nan.exr", |image| *first_pixel(image) = [f32::NAN, 0.0, f32::INFINITY]);
    folder.foreign("fit.exr", "negative.exr", |image| first_pixel(image)[1] = -0.5);
    folder.foreign("fit.exr", "layer.exr", |image| image.layers[1].1[3][0] = -0.25);
    folder.foreign("fit.exr", "no-image.exr", |image| image.layers[0].0 = Aov::Albedo);
    fs::write(folder.path("short.exr"), &fs::read(folder.path("fit.exr")).unwrap()[..600]).unwrap();
    fs::write(folder.path("empty.exr"), "").unwrap();
    let list = |name: &str, more: &str| {
        let text = format!("[[import]]\nname = \"a\"\nimage = \"fit.exr\"\nmilliseconds = 1\n{more}\n");
        fs::write(folder.path(name), text).unwrap();
    };
    list("key.toml", "who = \"me\"");
    list("direct.toml", "direct = \"nearly\"");
    list("scene.toml", "scene = \"room\"");
    list("note.toml", "note = \"=HYPERLINK()\"");
    list("equal.toml", "equal_terms_image = \"printed.exr\"");
    list("control.toml", "by = \"a\\u001b[2J\"");
    fs::write(folder.path("time.toml"), "[[import]]\nname = \"a\"\nimage = \"fit.exr\"\nmilliseconds = nan\n").unwrap();
    fs::write(folder.path("no.toml"), "[[import]]\nname = \"a\"\nimage = \"fit.exr\"\n").unwrap();
    let before = names(&folder.path(""));
    let long = format!("{}=fit.exr,3", "o".repeat(65));
    fn one(text: &str) -> Vec<&str> {
        vec!["--import", text]
    }
    let listed = |path: &'static str| vec!["--imports", path];
    for (args, part) in [
        (one("fit.exr,3"), "is not NAME=IMAGE.exr,MILLISECONDS; write it so"),
        (one("a=fit.exr,fast"), "is not NAME=IMAGE.exr,MILLISECONDS; write it so"),
        (one("a=fit.exr,3,exact"), "is not NAME=IMAGE.exr,MILLISECONDS; write it so"),
        (one("a=,3"), "is not NAME=IMAGE.exr,MILLISECONDS; write it so"),
        (one("a=fit.exr"), "is not NAME=IMAGE.exr,MILLISECONDS; write it so"),
        (one("a=fit.exr,0"), "a takes 0 ms; write milliseconds, finite and above 0"),
        (one("a=fit.exr,inf"), "a takes inf ms"),
        (one("a\nb=fit.exr,3"), "the name \"a\\nb\" has control characters; leave them out"),
        (one("=fit.exr,3"), "the name \"\" is empty or long"),
        (one(&long), "is empty or long; write 1 to 64 characters"),
        (one("@a=fit.exr,3"), "which tables take for a formula"),
        (one("a =fit.exr,3"), "which tables take for a formula"),
        (one("a\u{202e}b=fit.exr,3"), "has control characters; leave them out"),
        (one("fast=fit.exr,3"), "a row of the chart has the name \"fast\" already"),
        (one("1 path a pixel=fit.exr,3"), "a row of the chart has the name \"1 path a pixel\" already"),
        (vec!["--import", "a=fit.exr,3", "--import", "a=nan.exr,3"], "two images have the name \"a\""),
        (one("a=none.exr,3"), "none.exr: cannot be read"),
        (one("a=.,3"), ".: is a folder, not an OpenEXR image"),
        (one("a=image.png,3"), "image.png: is no OpenEXR image; a chart judges linear radiance"),
        (one("a=empty.exr,3"), "empty.exr: is no OpenEXR image"),
        (one("a=short.exr,3"), "short.exr: is "),
        (
            one("a=no-image.exr,3"),
            "has no channels R, G and B, and no Y; write linear radiance into channels of these names",
        ),
        (
            one("a=small.exr,3"),
            "small.exr: is 16x16 pixels, the chart 32x24; render it at the chart's size, or chart with --size 16x16",
        ),
        (one("a=other-view.exr,3"), "other-view.exr: shows another camera ("),
        (one("a=nan.exr,3"), "nan.exr: has 1 NaN and 1 infinite values; "),
        (one("a=negative.exr,3"), "negative.exr: has 1 negative values, down to -0.5; "),
        (one("a=layer.exr,3"), "layer.exr: has 1 negative values in its layer direct, down to -0.25; "),
        (one("a=printed.exr,3,exact-direct"), "render it with --set lights.shadows=rays --set lights.lamps=sampled"),
        (listed("none.toml"), "none.toml: cannot be read"),
        (listed("key.toml"), "key.toml: line 5: unknown field `who`"),
        (listed("direct.toml"), "direct.toml: line 5: unknown variant `nearly`"),
        (listed("no.toml"), "no.toml: line 1: missing field `milliseconds`"),
        (listed("time.toml"), "time.toml: [[import]]: a takes NaN ms"),
        (listed("note.toml"), "note.toml: [[import]]: the note \"=HYPERLINK()\" begins with"),
        (listed("control.toml"), "control.toml: [[import]]: the by \"a\\u{1b}[2J\" has control characters"),
        (listed("equal.toml"), "printed.exr: has direct light that is not exact, as its header says"),
        (listed("scene.toml"), "a shows the scene \"room\", which the chart does not have; name one of box"),
        (vec!["--paths", "0"], "write numbers from 1 to 65536, such as 1,4,16,64, or none"),
        (vec!["--paths", "4,x"], "write numbers from 1 to 65536"),
    ] {
        let output = folder.run(&[&["chart", SCENE, "-o", "out", "--presets", "fast"][..], &SMALL, &args].concat());
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(part), "{args:?}: {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{args:?}: {said}");
        assert!(output.stdout.is_empty(), "{args:?}: {}", text(&output.stdout));
        assert_eq!(names(&folder.path("")), before, "{args:?} left something behind");
    }
    // With several scenes the command line cannot say which one an image shows; a list can.
    fs::copy(folder.path(SCENE), folder.path("room.glb")).unwrap();
    let two = [&["chart", SCENE, "room.glb", "-o", "out", "--presets", "fast", "--paths", "none"][..], &SMALL].concat();
    let output = folder.run(&[&two[..], &one("a=fit.exr,3")].concat());
    let said = text(&output.stderr);
    assert!(output.status.code() == Some(2) && said.contains("a does not say which scene it shows"), "{said}");
    // Both files are the same scene by their hash, so that the image fits either.
    folder.done(&[&two[..], &listed("scene.toml")].concat());
    let rows = folder.json("out/rows.json")["rows"].as_array().unwrap().clone();
    let scenes: Vec<&str> = rows.iter().map(|row| row["scene"].as_str().unwrap()).collect();
    assert_eq!(scenes, ["box", "room", "room"]);
}

/// More paths err less and take longer; equal numbers of paths give equal images; and their random numbers are not
/// those of the reference, so that the two noises are independent.
#[test]
fn the_path_tracer_stands_beside_the_settings() {
    let folder = Folder::with_box(SCENE);
    let args = ["--presets", "fast", "--reference-noise", "4"];
    let run = |output: &str, more: &[&str]| {
        let small = &SMALL[..4];
        folder.done(&[&["chart", SCENE, "-o", output][..], small, &args, more].concat());
        folder.json(&format!("{output}/rows.json"))["rows"].as_array().unwrap().clone()
    };
    let rows = run("out", &[]);
    let found: Vec<&str> = rows.iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(found, ["fast", "1 path a pixel", "4 paths a pixel", "16 paths a pixel", "64 paths a pixel"]);
    let traced = &rows[1..];
    for (row, paths) in traced.iter().zip([1, 4, 16, 64]) {
        assert_eq!(row["source"], serde_json::json!({ "kind": "path-tracer", "paths": paths }));
        let measured = &row["measured"];
        assert!(
            measured["frame_wall_ms"]["median"].as_f64().unwrap() > 0.0 && measured["frame_gpu_ms"].is_null(),
            "{row}"
        );
        assert!(measured["frames"].as_u64().unwrap() >= 1 && measured["full"] == measured["same"], "{row}");
        assert_eq!(row["origin"]["machine"], rows[0]["origin"]["machine"]);
    }
    for part in ["total", "diffuse"] {
        let rel: Vec<f64> = traced.iter().map(|row| row["measured"]["full"][part]["rel"].as_f64().unwrap()).collect();
        assert!(rel.windows(2).all(|pair| pair[1] < pair[0]), "{part}: {rel:?}");
        // Noise falls with the root of the number of paths: by 8 over all, and less where the reference's own noise
        // dominates.
        assert!(rel[3] < rel[0] / 3.0, "{part}: {rel:?}");
    }
    let svg = fs::read_to_string(folder.path("out/chart.svg")).unwrap();
    assert!(
        svg.contains("4 paths a pixel, path tracer") && svg.contains("ms a frame: GPU; path tracer: wall clock"),
        "{svg}"
    );
    let page = fs::read_to_string(folder.path("out/index.html")).unwrap();
    assert!(
        page.contains("\"method\":\"path tracer\"") && page.contains("\"paths_seed\":1"),
        "no mark of the path tracer"
    );

    // In another folder the rows have the same errors, and so has the image of the command that the page names.
    let again = run("again", &["--paths", "16,4,4"]);
    assert_eq!(again.len(), 1 + 2);
    for (row, old) in again[1..].iter().zip(&traced[1..3]) {
        assert_eq!((&row["name"], &row["measured"]["full"]), (&old["name"], &old["measured"]["full"]));
    }
    let size = ["--depth", "full", "--size", "32x24", "--aov", "direct,diffuse", "-q"];
    folder.done(&[&["reference", SCENE, "-o", "traced.exr", "--spp", "16", "--seed", "1"][..], &size].concat());
    folder.done(&[&["reference", SCENE, "-o", "truth.exr", "--noise", "4"][..], &size].concat());
    folder.done(&["compare", "traced.exr", "truth.exr", "--json", "compared.json"]);
    let compared = folder.json("compared.json");
    let own = &traced[2]["measured"]["full"];
    assert_eq!((&own["total"], &own["diffuse"]), (&compared["total"], &compared["indirect_diffuse"]));
    assert_eq!(run("none", &["--paths", "none"]).len(), 1);
}
