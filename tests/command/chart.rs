//! `twobounce chart`: rows, pages, continuing after an interruption, and refusals.

use std::collections::BTreeSet;
use std::fs;
use std::process::{Child, Command, Output};

use crate::cli_common::{Folder, after_first_row, finished, interrupted, names, root, text};
use crate::more;
use serde_json::Value;

/// A comma in the scene's name must be quoted in rows.csv.
const SCENE: &str = "box,1.glb";

const SMALL: [&str; 6] = ["--size", "24x24", "--set", "voxels=16", "--reference-noise", "20"];

impl Folder {
    fn charting(&self, args: &[&str]) -> Command {
        let mut command = self.command(&["chart"]);
        command.args(args).args(SMALL);
        if !args.contains(&"--paths") {
            command.args(["--paths", "none"]);
        }
        command
    }

    fn chart(&self, args: &[&str]) -> Output {
        self.charting(args).output().unwrap()
    }

    /// Standard output of a chart; fails if the command fails.
    fn charted(&self, args: &[&str]) -> String {
        let output = self.chart(args);
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}", text(&output.stderr));
        text(&output.stdout)
    }

    /// Starts a chart and waits for its first row.
    fn started(&self, output: &str, args: &[&str]) -> Child {
        let mut command = self.charting(args);
        after_first_row(command.args(["-o", output]), &self.path(output))
    }
}

/// A row's names and errors, without its times.
fn lasting(chart: &Value) -> Vec<String> {
    let errors = |row: &Value| format!("{} {} {}", row["name"], row["measured"]["full"], row["measured"]["same"]);
    chart["rows"].as_array().unwrap().iter().map(errors).collect()
}

/// Every path to a value, `[]` for an element of a list; spreads, metrics and settings count as values.
fn paths(json: &Value, path: &str, found: &mut BTreeSet<String>) {
    let value =
        |map: &serde_json::Map<String, Value>| ["median", "rel", "voxels"].iter().any(|key| map.contains_key(*key));
    match json {
        Value::Object(map) if !value(map) => map.iter().for_each(|(key, inner)| {
            paths(inner, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, found);
        }),
        Value::Array(list) => list.iter().for_each(|inner| paths(inner, &format!("{path}[]"), found)),
        _ => {
            found.insert(path.to_owned());
        }
    }
}

/// The cells of a CSV line, by RFC 4180.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut quoted) = (vec![String::new()], false);
    for letter in line.chars() {
        match letter {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(String::new()),
            _ => cells.last_mut().unwrap().push(letter),
        }
    }
    cells
}

/// With validation, any message would be a row's failure.
#[test]
fn rows_pages_and_failures() {
    let folder = Folder::with_box(SCENE);
    let args = [SCENE, "-o", "out", "--presets", "fast,printed", "--sweep", "voxels=16,64", "--validation"];
    let others = ["--paths", "1", "--import", "Other=other.exr,5"];
    let args = [&args[..], &others].concat();
    let mut render = folder.command(&["render", SCENE, "-q", "-o", "other.exr", "--preset", "fast", "--aov", "direct"]);
    assert!(render.args(&SMALL[..4]).status().unwrap().success());
    let said = folder.charted(&[&args[..], &["--memory-limit", "9.5MiB"]].concat());
    assert!(said.contains("settings that could not run: 2 of 6"), "{said}");
    assert_eq!(
        names(&folder.path("out")),
        ["chart.svg", "chart.txt", "index.html", "outline.toml", "rows", "rows.csv", "rows.json"]
    );

    let chart = folder.json("out/rows.json");
    let rows = chart["rows"].as_array().unwrap();
    let row_names: Vec<_> = rows.iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(row_names, ["fast", "printed", "fast voxels=64", "printed voxels=64", "1 path a pixel", "Other"]);
    for row in &rows[..2] {
        let measured = &row["measured"];
        assert!(row["failure"].is_null() && measured["frame_gpu_ms"]["median"].as_f64().unwrap() > 0.0, "{row}");
        let sum: f64 = measured["passes"].as_array().unwrap().iter().map(|p| p["gpu_ms"].as_f64().unwrap()).sum();
        let frame = measured["frame_gpu_ms"]["max"].as_f64().unwrap();
        // The passes' medians may come from different frames; each is at most the time of the slowest frame.
        assert!(sum > 0.0 && sum < 1.5 * frame, "passes take {sum} ms, the slowest frame {frame}");
        assert_eq!(measured["same"]["bounces"], 2);
        assert!(measured["full"]["bounces"].is_null());
        let changed = measured["equal_terms"].as_array().unwrap().len();
        assert_eq!(changed, if row["preset"] == "printed" { 2 } else { 0 }, "{row}");
        // The reference of all light is brighter than two bounces, so the share of indirect light in it is larger.
        let energy = |truth: &str| measured[truth]["indirect"]["energy"].as_f64().unwrap();
        assert!(energy("same") > energy("full"), "{row}");
    }
    // Rays are nearer to the truth than the talk's listings, even at 16³.
    let rel = |row: &Value| row["measured"]["same"]["indirect"]["rel"].as_f64().unwrap();
    assert!(rel(&rows[0]) < rel(&rows[1]), "{} and {}", rel(&rows[0]), rel(&rows[1]));
    for row in &rows[2..4] {
        let failure = row["failure"].as_str().unwrap();
        // One further digit, because the need lies within the same MiB.
        assert!(
            ["10 MiB", "9.5 MiB"].iter().any(|size| failure.contains(&format!("--memory-limit of {size}"))),
            "{row}"
        );
    }

    let csv = fs::read_to_string(folder.path("out/rows.csv")).unwrap();
    let lines: Vec<_> = csv.lines().map(cells).collect();
    assert!(lines.len() == 7 && lines.iter().all(|line| line.len() == lines[0].len()), "{csv}");
    assert_eq!(lines[1][0], "box,1");
    let column = |name: &str| lines[0].iter().position(|cell| cell == name).unwrap();
    let in_csv: f64 = lines[1][column("same_indirect_rel")].parse().unwrap();
    assert!((in_csv / rel(&rows[0]) - 1.0).abs() < 1e-5, "six digits of {}: {in_csv}", rel(&rows[0]));
    assert_eq!(lines[2][column("voxels")], "16");
    // The box is diffuse; its edges against the sky are left out.
    assert_eq!(chart["scenes"][0]["all_diffuse"], true);
    let diffuse = rows[0]["measured"]["same"]["diffuse"]["rel"].as_f64().unwrap();
    assert!(diffuse < rel(&rows[0]) && diffuse > 0.5 * rel(&rows[0]), "{diffuse} of {}", rel(&rows[0]));
    let in_csv: f64 = lines[1][column("same_diffuse_rel")].parse().unwrap();
    assert!((in_csv / diffuse - 1.0).abs() < 1e-5, "six digits of {diffuse}: {in_csv}");

    let page = fs::read_to_string(folder.path("out/index.html")).unwrap();
    // The image, two differences per row and two references.
    assert_eq!(page.matches("data:image/jpeg;base64,").count(), 4 * 3 + 2);
    assert!(!page.contains("{{"), "a place in the page was not filled in");
    let svg = fs::read_to_string(folder.path("out/chart.svg")).unwrap();
    let marks: Vec<&str> = svg.lines().filter(|line| line.contains(" scale(")).collect();
    assert!(marks.len() == 4 + 2 * 4 && svg.contains("polyline"), "{svg}");
    let shapes: BTreeSet<_> =
        marks.iter().filter_map(|line| line.split('"').find(|part| part.starts_with('M'))).collect();
    assert_eq!(shapes.len(), 4, "a shape for each method, for the path tracer and for other programs: {svg}");

    let mut written = BTreeSet::new();
    paths(&chart, "", &mut written);
    written.retain(|path| !path.starts_with("rows[].measured.same."));
    let all = fs::read_to_string(root().join("docs/json.md")).unwrap();
    let page = all.split("\n# ").find(|part| part.contains("twobounce chart")).unwrap();
    let cell = |line: &str| line.strip_prefix("- `").and_then(|rest| rest.split('`').next()).map(str::to_owned);
    let documented: BTreeSet<String> = page.lines().filter_map(cell).collect();
    written.extend(["rows[].measured.same".into(), "rows[].measured.full".into()]);
    assert_eq!(written, documented);

    // With enough memory the failed rows are measured, and the others are kept.
    let said = folder.charted(&args);
    assert!(said.contains("rows kept from earlier calls: 4 of 6") && !said.contains("could not run"), "{said}");
}

/// The chart and `compare` use one definition of errors: every number of a row equals that of the images, rendered one
/// by one. A lamp lights the box, so presets that gather lamps need a second image for their indirect light.
#[test]
fn a_row_and_a_comparison_of_its_images_say_the_same() {
    let folder = Folder::empty();
    fs::copy(root().join("assets/cornell-area.glb"), folder.path(SCENE)).unwrap();
    let presets: Vec<&str> = more::every(3, twobounce::settings::PRESETS.iter().map(|preset| preset.name)).collect();
    folder.charted(&[SCENE, "-o", "out", "--set", "cones.passes=cells", "--presets", &presets.join(",")]);
    let chart = folder.json("out/rows.json");
    let ran = |args: &[&str]| {
        let output = folder.command(args).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{args:?}: {}", text(&output.stderr));
    };
    let reference =
        ["--depth", "2", "--noise", "20", "--aov", "direct,diffuse", "--size", "24x24", "-o", "truth.exr", "-q"];
    ran(&[&["reference", SCENE][..], &reference].concat());
    let rows = chart["rows"].as_array().unwrap();
    assert_eq!(rows.len(), presets.len());
    for row in rows {
        let changes: Vec<&str> =
            row["measured"]["equal_terms"].as_array().unwrap().iter().map(|change| change.as_str().unwrap()).collect();
        let render = |output: &str, changes: &[&str]| {
            let sets = ["voxels=16", "cones.passes=cells"].iter().chain(changes).flat_map(|change| ["--set", change]);
            let fixed = ["render", SCENE, "--size", "24x24", "--aov", "direct", "--noise", "off", "-q", "-o", output];
            let args: Vec<&str> =
                fixed.into_iter().chain(["--preset", row["preset"].as_str().unwrap()]).chain(sets).collect();
            ran(&args);
            let json = format!("{output}.json");
            ran(&["compare", output, "truth.exr", "--json", &json]);
            folder.json(&json)
        };
        let whole = render("whole.exr", &[]);
        let equal = render("equal.exr", &changes);
        assert_eq!(whole["indirect"].is_null(), !changes.is_empty(), "{}: {whole}", row["name"]);
        let same = &row["measured"]["same"];
        for (measured, compared) in [
            (&same["total"], &whole["total"]),
            (&same["indirect"], &equal["indirect"]),
            (&same["diffuse"], &equal["indirect_diffuse"]),
        ] {
            assert!(measured["rel"].as_f64().unwrap() > 0.0, "{row}");
            assert_eq!(measured, compared, "{}", row["name"]);
        }
    }
}

/// A chart continues after its process was killed, and becomes equal to one that was not interrupted.
#[cfg(unix)]
#[test]
fn killed_or_interrupted_it_goes_on() {
    let folder = Folder::with_box(SCENE);
    let args = [SCENE, "--presets", "fast,printed", "--sweep", "voxels=32,64"];
    let mut child = folder.started("killed", &args);
    // A second process does not write into the folder meanwhile.
    let second = folder.chart(&[&args[..], &["-o", "killed"]].concat());
    let said = text(&second.stderr);
    assert!(second.status.code() == Some(2) && said.contains("is being filled by another process"), "{said}");
    while !folder.path("killed/index.html").exists() {
        assert!(child.try_wait().unwrap().is_none(), "no page while it runs");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let before = finished(&folder.path("killed"));
    let page = fs::read_to_string(folder.path("killed/index.html")).unwrap();
    assert!(page.contains("settings are not measured yet"), "it was not killed at work, or the page does not say so");

    let child = folder.started("stopped", &args);
    let stopped = interrupted(child);
    assert_eq!(stopped.status.code(), Some(130), "{}", text(&stopped.stdout));
    let page = fs::read_to_string(folder.path("stopped/index.html")).unwrap();
    assert!(page.contains("settings are not measured yet"), "the page does not say that rows are missing");

    for output in ["killed", "stopped"] {
        let kept = finished(&folder.path(output)).len();
        let said = folder.charted(&[&args[..], &["-o", output]].concat());
        assert!(said.contains(&format!("rows kept from earlier calls: {kept} of ")), "{kept} kept: {said}");
    }
    let after = finished(&folder.path("killed"));
    assert!(before.iter().all(|row| after.contains(row)), "a finished row was measured anew");
    let charts = ["killed/rows.json", "stopped/rows.json"].map(|name| folder.json(name));
    assert_eq!(lasting(&charts[0]), lasting(&charts[1]));
    assert_eq!(charts[0]["rows"].as_array().unwrap().len(), charts[0]["planned"].as_u64().unwrap() as usize);
}

#[test]
fn a_budget_ends_it_between_rows() {
    let folder = Folder::with_box(SCENE);
    let args = [SCENE, "-o", "out", "--presets", "fast"];
    let output = folder.chart(&[&args[..], &["--budget-minutes", "1e-9"]].concat());
    let said = text(&output.stderr);
    assert!(output.status.code() == Some(2) && said.contains("too small for one run"), "{said}");
    assert!(!folder.path("out").exists(), "a folder was left behind");
    folder.charted(&args);
    let said = folder.charted(&[&args[..], &["--sweep", "rays.diffuse=2,3", "--budget-minutes", "1e-9"]].concat());
    assert!(said.contains("the budget is spent after 1 of 3 rows"), "{said}");
}

#[test]
fn what_makes_no_sense_is_one_sentence_and_changes_nothing() {
    let folder = Folder::with_box(SCENE);
    fs::create_dir(folder.path("mine")).unwrap();
    fs::write(folder.path("mine/index.html"), "my page").unwrap();
    fs::write(folder.path("file"), "my file").unwrap();
    let before = names(&folder.path(""));
    for (args, part) in [
        (&[SCENE, "-o", "mine"][..], "mine: holds something else than a chart"),
        (&[SCENE, "-o", "file"], "file: is a file; -o takes a folder"),
        (&[SCENE, "-o", "file/out"], "file/out: cannot be created"),
        (&[SCENE, "-o", "out", "--presets", "quick"], "--presets: there is no preset \"quick\""),
        (
            &[SCENE, "-o", "out", "--sweep", "voxel=32"],
            "--sweep: there is no setting \"voxel\"; did you mean \"voxels\"?",
        ),
        (&[SCENE, "-o", "out", "--sweep", "voxels=32,33"], "--sweep: setting \"voxels\" takes"),
        (&[SCENE, "-o", "out", "--sweep", "voxels"], "--sweep: \"voxels\" names no values: write key=value,value"),
        (&[SCENE, "-o", "out", "--sweep", "voxels="], "power of two"),
        (&[SCENE, "-o", "out", "--sweep", "grid.center=0,0,0"], "--sweep: grid.center is a point"),
        (&[SCENE, "-o", "out", "--budget-minutes", "0"], "write a number of minutes above 0"),
        (&[SCENE, "-o", "out", "--budget-minutes", "inf"], "write a number of minutes above 0"),
        (&[SCENE, "-o", "out", "--reference-noise", "0"], "write a percentage above 0"),
        (&[SCENE, SCENE, "-o", "out"], "is named twice"),
        (&[SCENE, "none.glb", "-o", "out"], "none.glb"),
        (&[SCENE, "-o", "out", "--device", "none"], "none"),
    ] {
        let output = folder.chart(args);
        let said = text(&output.stderr);
        assert!(output.status.code() == Some(2) && said.contains(part), "{args:?}: {said}");
        assert_eq!(said.trim_end().lines().count(), 1, "{args:?}: {said}");
        assert!(output.stdout.is_empty(), "{args:?}: {}", text(&output.stdout));
        assert_eq!(names(&folder.path("")), before, "{args:?} left something behind");
    }
    assert_eq!(fs::read(folder.path("mine/index.html")).unwrap(), b"my page");
    assert_eq!(names(&folder.path("mine")), ["index.html"]);
}
