//! `twobounce plan`: the answer, its files, the stored answer, continuing after Ctrl-C, and refusals.

use crate::cli_common;

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};

use cli_common::{Folder, text};
use serde_json::Value;

const SMALL: [&str; 10] = [
    "box.glb",
    "--size",
    "24x24",
    "--methods",
    "none,rays",
    "--set",
    "voxels=16",
    "--set",
    "bounces=2",
    "--validation",
];

impl Folder {
    fn plan(&self, args: &[&str]) -> Output {
        self.command(&[&["plan"], &SMALL[..], args].concat()).output().unwrap()
    }
}

/// Every path to a value, `[]` for an element of a list.
fn paths(json: &Value, path: &str, found: &mut BTreeSet<String>) {
    match json {
        Value::Object(map) if !map.contains_key("median") => map.iter().for_each(|(key, inner)| {
            paths(inner, &if path.is_empty() { key.clone() } else { format!("{path}.{key}") }, found);
        }),
        Value::Array(list) => list.iter().for_each(|inner| paths(inner, &format!("{path}[]"), found)),
        _ => {
            found.insert(path.to_owned());
        }
    }
}

#[test]
fn the_answer_holds_and_is_the_same_at_once() {
    let folder = Folder::with_box("box.glb");
    let asked =
        ["--max-error", "0.25", "--max-mib", "64", "--budget", "25s", "-o", "cheap.toml", "--json", "plan.json"];
    let first = folder.plan(&asked);
    assert_eq!(first.status.code(), Some(0), "{}{}", text(&first.stdout), text(&first.stderr));
    let answer: Value = serde_json::from_slice(&fs::read(folder.path("plan.json")).unwrap()).unwrap();
    assert_eq!(answer["holds"], true);
    let (error, noise) = (answer["choice"]["error"].as_f64().unwrap(), answer["confidence"]["noise"].as_f64().unwrap());
    assert!(
        error <= 0.25 && noise < 0.15 && answer["confidence"]["other_seed"].as_f64().unwrap() <= 0.25,
        "{answer:#}"
    );
    assert_eq!(answer["choice"]["settings"]["voxels"], 16);

    // Half a minute of searching is not repeated, and the answer has the same bytes.
    let began = Instant::now();
    let again = folder.plan(&asked);
    assert!(began.elapsed() < Duration::from_secs(5), "{:?}", began.elapsed());
    assert_eq!(text(&first.stdout), text(&again.stdout));
    assert!(text(&again.stderr).contains("asked before"));

    // The printed command runs, and so does --config with the file; both give the image whose error was reported.
    let command = text(&first.stdout).lines().find(|line| line.starts_with("  twobounce render")).unwrap().to_owned();
    let words: Vec<&str> = command.split_whitespace().skip(1).collect();
    assert!(folder.command(&words).output().unwrap().status.success(), "{command}");
    let by_file = ["render", "box.glb", "--size", "24x24", "--config", "cheap.toml", "--noise=off", "-o", "other.png"];
    assert!(folder.command(&by_file).output().unwrap().status.success());
    assert_eq!(fs::read(folder.path("image.png")).unwrap(), fs::read(folder.path("other.png")).unwrap());

    // With limits that nothing keeps: the nearest settings, and exit code 1.
    let nothing = folder.plan(&["--max-error", "0.25", "--max-ms", "0.001", "--budget", "10s"]);
    assert_eq!(nothing.status.code(), Some(1), "{}", text(&nothing.stderr));
    assert!(text(&nothing.stdout).contains("the nearest:"), "{}", text(&nothing.stdout));

    // The documentation has every key.
    let mut written = BTreeSet::new();
    paths(&answer, "", &mut written);
    let settings = |path: &String| path.contains(".settings.");
    let mut written: BTreeSet<String> = written.into_iter().filter(|path| !settings(path)).collect();
    written.extend(["choice.settings".to_owned(), "finalists[].settings".to_owned()]);
    let page = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/json.md")).unwrap();
    let part = page.split("\n# ").find(|part| part.contains("twobounce plan --json")).expect("a part about plan");
    let cell = |line: &str| line.strip_prefix("- `").and_then(|rest| rest.split('`').next()).map(str::to_owned);
    let documented: BTreeSet<String> = part.lines().filter_map(cell).collect();
    let choices = |path: &String| !path.starts_with("finalists[].");
    written.retain(choices);
    written.insert("finalists[]".into());
    // Keys that are absent here are documented too.
    let unknown: Vec<_> = written.difference(&documented).collect();
    assert!(unknown.is_empty(), "docs/json.md lacks {unknown:?}");
    let unwritten: Vec<_> = documented.difference(&written).collect();
    assert!(unwritten.iter().all(|key| key.contains("ladders[]") || key.contains("held_out[]")), "{unwritten:?}");
}

/// With two cameras or moments the error is the larger one, and each has a command.
#[test]
fn several_moments_have_a_command_each() {
    let folder = Folder::with_box("box.glb");
    let output = folder.plan(&["--max-ms", "100000", "--time", "0,1", "--budget", "8s", "--json", "-"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let answer: Value = serde_json::from_slice(&output.stdout).unwrap();
    let commands: Vec<&str> = answer["commands"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
    assert!(commands.len() == 2 && !commands[0].contains("--time") && commands[1].contains("--time=1"), "{commands:?}");
}

#[cfg(unix)]
#[test]
fn interrupted_it_goes_on() {
    let folder = Folder::with_box("box.glb");
    let args = [&["plan"], &SMALL[..], &["--max-error", "0.2", "--budget", "20s"]].concat();
    let kept = || fs::read_dir(folder.path("cache/plan")).into_iter().flatten().count();
    let mut child = folder.command(&args).stdout(Stdio::null()).stderr(Stdio::piped()).spawn().unwrap();
    let end = Instant::now() + Duration::from_secs(120);
    while kept() < 2 {
        assert!(Instant::now() < end && child.try_wait().unwrap().is_none(), "no row while the command runs");
        std::thread::sleep(Duration::from_millis(20));
    }
    let output = cli_common::interrupted(child);
    assert_eq!(output.status.code(), Some(130), "{}", text(&output.stderr));
    let rows: Vec<_> = fs::read_dir(folder.path("cache/plan")).unwrap().map(|e| e.unwrap()).collect();
    let before: Vec<_> = rows.iter().map(|row| (row.path(), row.metadata().unwrap().modified().unwrap())).collect();
    // The machine's speed decides whether any setting holds within the budget.
    assert!(matches!(folder.command(&args).output().unwrap().status.code(), Some(0 | 1)));
    assert!(kept() > before.len());
    for (path, written) in before {
        assert_eq!(fs::metadata(&path).unwrap().modified().unwrap(), written, "{} was measured twice", path.display());
    }
}

#[test]
fn what_makes_no_sense_is_one_sentence() {
    let folder = Folder::with_box("box.glb");
    let cases: [(&[&str], &str); 7] = [
        (&[], "plan needs a limit"),
        (&["--max-error", "0"], "above 0"),
        (&["--max-ms", "5", "--budget", "soon"], "such as 60s"),
        (&["--max-ms", "5", "--set", "voxel=16"], "did you mean"),
        (&["--max-ms", "5", "--camera", "0,nave"], "nave"),
        (&["--max-ms", "5", "--set", "method=lpv"], "leave no method"),
        (&["--max-error", "0.0001", "--budget", "3s"], "reference's own noise"),
    ];
    for (args, words) in cases {
        let output = folder.plan(args);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        let last = said.lines().last().unwrap_or_default();
        assert!(last.contains(words) && output.stdout.is_empty(), "{args:?}: {said}");
    }
}
