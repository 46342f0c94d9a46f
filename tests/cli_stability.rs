//! `twobounce stability` as a user meets it, and its quick table held against the committed one.

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use twobounce::stability::cases;
use twobounce::stability::export::{Kept, read_csv};
use twobounce::stability::markdown::page;

/// Of another driver's rounding: as a share of the distance, and of the case's limit (or of a thousandth, where that is nothing).
const SHARE: f64 = 0.1;
const OF_LIMIT: f64 = 0.2;

const QUICK: &str = "tests/stability/quick.csv";
const ROWS: &str = "docs/stability-rows.csv";

fn root(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn stability(folder: &Path, args: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
    command.current_dir(folder).env("TWOBOUNCE_CACHE", folder.join("cache"));
    command.arg("stability").args(args).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_quick_table_is_no_worse_than_the_committed_one() {
    let folder = tempfile::tempdir().unwrap();
    let output = stability(folder.path(), &["--quick", "--validation", "-o", "table"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = fs::read_to_string(folder.path().join("table/rows.csv")).unwrap();
    let committed = fs::read_to_string(root(QUICK)).unwrap();
    let (now, before) = (read_csv(&table).unwrap(), read_csv(&committed).unwrap());
    assert_eq!(now.keys().collect::<Vec<_>>(), before.keys().collect::<Vec<_>>(), "other rows: {}", again());
    let (mut worse, mut better) = (Vec::new(), Vec::new());
    for (key @ (case, preset, grid), old) in &before {
        let limit = cases::named(case).expect("a case").limit;
        let (old, new) = (old.expect("the committed table has every number"), now[key]);
        let Some(new) = new else {
            worse.push(format!("{case} {preset} {grid}³ could not run"));
            continue;
        };
        let line = format!("{case} {preset} {grid}³: {} from the ideal, was {}", new.distance, old.distance);
        match compare(old, new, limit) {
            1.. => worse.push(line),
            0 => {}
            _ => better.push(line),
        }
    }
    if !better.is_empty() {
        // Past the test's captured output, so that it is seen.
        let _ = writeln!(std::io::stderr(), "\nbetter than the committed table; {}:\n{}", again(), better.join("\n"));
    }
    assert!(worse.is_empty(), "worse than the committed table:\n{}\nIf that is meant, {}", worse.join("\n"), again());
}

fn again() -> String {
    format!(
        "run `target/release/twobounce stability --quick -o out/quick`, copy out/quick/rows.csv to {QUICK} and commit it"
    )
}

/// 1: worse, −1: better, 0: the same up to rounding.
fn compare(old: Kept, new: Kept, limit: f64) -> i32 {
    let tolerance = SHARE * old.distance + OF_LIMIT * if limit > 0.0 { limit } else { 1e-3 };
    match new.distance - old.distance {
        d if d > tolerance => 1,
        d if d < -tolerance => -1,
        _ => 0,
    }
}

#[test]
fn worse_and_better_are_told_apart() {
    let kept = |distance| Kept { median: 0.0, min: 0.0, max: 0.0, distance };
    assert_eq!(compare(kept(0.0), kept(0.0001), 1e-3), 0);
    assert_eq!(compare(kept(0.0), kept(0.001), 1e-3), 1);
    assert_eq!(compare(kept(0.0), kept(0.001), 0.0), 1);
    assert_eq!(compare(kept(0.05), kept(0.04), 1e-3), -1);
    assert_eq!(compare(kept(0.05), kept(0.054), 1e-3), 0);
}

#[test]
fn the_page_is_that_of_the_committed_rows() {
    let rows = fs::read_to_string(root(ROWS)).unwrap();
    let again = format!("run `target/release/twobounce stability --markdown {ROWS} > docs/stability.md`");
    assert_eq!(fs::read_to_string(root("docs/stability.md")).unwrap(), page(&rows).unwrap(), "{again}");
}

#[test]
fn rows_are_kept_and_the_page_is_whole() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--case", "self-light-plane", "--preset", "fast", "--grid", "32", "--quick", "-o", "table"];
    let first = stability(folder.path(), &args);
    assert_eq!(first.status.code(), Some(0), "{}", text(&first.stderr));
    let page = fs::read_to_string(folder.path().join("table/index.html")).unwrap();
    assert!(page.contains("--case self-light-plane --preset fast --grid 32 --quick") && !page.contains("{{"));
    let again = text(&stability(folder.path(), &args).stdout);
    assert!(again.contains("rows kept from earlier calls: 1 of 1"), "{again}");
    let rows: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("table/rows.json")).unwrap()).unwrap();
    assert_eq!(rows["rows"][0]["measured"]["places"].as_array().unwrap().len(), 2);
}

/// The view through a thin-walled box does not meet the backs of its walls, which have no side.
#[test]
fn backs_without_a_side_dim_nothing_behind_glass() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--case", "refraction", "--preset", "fast", "--grid", "32", "--quick", "--validation", "-o", "table"];
    let output = stability(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let rows = fs::read_to_string(folder.path().join("table/rows.json")).unwrap();
    let rows: serde_json::Value = serde_json::from_str(&rows).unwrap();
    let places = rows["rows"][0]["measured"]["places"].as_array().unwrap();
    let of_box: Vec<&serde_json::Value> =
        places.iter().filter(|place| place[0].as_str().unwrap().starts_with("thin-walled")).collect();
    // 0.22: the noise of few samples, and edges that are smooth in the truth.
    assert!(of_box.len() == 2 && of_box.iter().all(|place| place[1].as_f64().unwrap() < 0.26), "{places:?}");
}

/// Scenes made by chance: nothing hangs, every pixel is finite, and most are as bright as the path tracer's. Seed 0 looks
/// through up to fifty panes of glass at what few rays light (0.67 of it), seed 6 has a light and seed 10 a lamp that almost
/// touch a surface, which few points find (0.86, 0.85).
#[test]
fn scenes_made_by_chance_are_finite() {
    let folder = tempfile::tempdir().unwrap();
    let args = ["--case", "random", "--preset", "balanced", "--grid", "32", "--quick", "--validation", "-o", "table"];
    let output = stability(folder.path(), &args);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let rows = fs::read_to_string(folder.path().join("table/rows.json")).unwrap();
    let rows: serde_json::Value = serde_json::from_str(&rows).unwrap();
    let places = rows["rows"][0]["measured"]["places"].as_array().unwrap();
    let ratios: Vec<f64> = places.iter().map(|place| place[1].as_f64().unwrap()).collect();
    assert!(ratios.len() >= 12 && ratios.iter().all(|ratio| (0.6..1.1).contains(ratio)), "{places:?}");
    assert!(ratios.iter().filter(|ratio| (*ratio - 1.0).abs() < 0.05).count() >= 9, "{places:?}");
}

#[test]
fn mistakes_are_told_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "x").unwrap();
    fs::create_dir(folder.path().join("mine")).unwrap();
    fs::write(folder.path().join("mine/letter.txt"), "x").unwrap();
    let cases: [(&[&str], &str); 6] = [
        (&["--case", "leek", "-o", "a"], "there is no \"leek\"; there are leak-sheet"),
        (&["--preset", "quick", "-o", "a"], "there is no preset \"quick\""),
        (&["--grid", "33", "-o", "a"], "--grid: setting \"voxels\" takes a power of two"),
        (&["--preset", "fast", "--method", "lpv", "-o", "a"], "--method: none of the presets"),
        (&["--case", "turn", "-o", "mine"], "holds something else than rows of stability"),
        (&["--markdown", "file"], "file: is no rows.csv"),
    ];
    for (args, sentence) in cases {
        let output = stability(folder.path(), args);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(sentence) && said.trim().lines().count() == 1, "{args:?}: {said}");
        assert!(!folder.path().join("a").exists(), "{args:?} leaves a folder");
    }
}
