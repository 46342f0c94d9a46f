//! `twobounce study`: its page has the current axes, keeps text that was written by hand, and replaces no other page.

use std::fs;
use std::path::Path;
use std::process::Command;

use crate::cli_common::{after_first_row, interrupted};
use twobounce::chart::study::{PATHS_AXIS, lines};

/// Axis and setting of every line of the page's table except the path tracer's, which come last; an axis is named once.
/// A star marks lines with a second image.
fn table(page: &str) -> Vec<String> {
    let rows = page.lines().filter(|line| line.starts_with("| ") && line.contains("| `"));
    let rows = rows.take_while(|line| !line.starts_with(&format!("| {PATHS_AXIS} |")));
    rows.map(|line| {
        line.split('|').skip(1).take(2).map(|cell| cell.trim().trim_end_matches('*')).collect::<Vec<_>>().join(" ")
    })
    .collect()
}

/// The lines of the current table of axes, in the same form.
fn today(sets: &[String]) -> Vec<String> {
    let mut last = "";
    let lines = lines(sets).unwrap();
    let line = |(axis, row): &(&'static str, twobounce::chart::row::Row)| {
        let shown = if *axis == last { "" } else { axis };
        last = axis;
        format!("{shown} `{}`", row.name)
    };
    lines.iter().map(line).collect()
}

#[cfg(unix)]
#[test]
fn the_page_has_every_axis_and_keeps_what_stands_by_hand() {
    let folder = tempfile::tempdir().unwrap();
    let scene = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/cornell-point.glb");
    let study = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_twobounce"));
        command.current_dir(folder.path()).env("TWOBOUNCE_CACHE", folder.path().join("cache"));
        command.arg("study").arg(&scene).args(["-o", "study", "--rows", "rows", "--size", "16x16"]);
        command.args(["--set", "voxels=16", "--reference-noise", "20"]);
        command
    };
    let stopped = interrupted(after_first_row(&mut study(), &folder.path().join("rows")));
    assert_eq!(stopped.status.code(), Some(130), "{}", String::from_utf8_lossy(&stopped.stdout));

    let page_path = folder.path().join("study/README.md");
    let page = fs::read_to_string(&page_path).unwrap();
    assert_eq!(table(&page), today(&["voxels=16".to_owned()]));
    assert!(page.lines().count() <= 160, "the page is to have at most 160 lines");
    for file in ["cornell-point.svg", "rows.csv"] {
        assert!(page.contains(&format!("]({file})")) && folder.path().join("study").join(file).is_file(), "{file}");
    }

    fs::write(&page_path, page.replace("Nothing is written here yet.", "It was dark.")).unwrap();
    let again = study().args(["--budget-minutes", "1e-9"]).output().unwrap();
    assert_eq!(again.status.code(), Some(0), "{}", String::from_utf8_lossy(&again.stderr));
    assert!(fs::read_to_string(&page_path).unwrap().contains("It was dark."), "what stood by hand is gone");

    fs::write(&page_path, "My own page.").unwrap();
    let refused = study().output().unwrap();
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(
        refused.status.code() == Some(2) && said.contains("README.md: was not written by `twobounce study`"),
        "{said}"
    );
    assert_eq!(fs::read_to_string(&page_path).unwrap(), "My own page.");
}

/// The page of presets alone lists the current presets.
#[test]
fn the_rooms_in_docs_are_of_todays_presets() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/notes/study/rooms/README.md");
    let page = fs::read_to_string(path).expect("the page of `twobounce study --presets-only`");
    let presets: Vec<String> = twobounce::settings::PRESETS.iter().map(|preset| format!("`{}`", preset.name)).collect();
    let shown: Vec<String> =
        table(&page).iter().map(|line| line.trim_start_matches("preset").trim().to_owned()).collect();
    assert_eq!(shown, presets, "docs/notes/study/rooms is stale: run `twobounce study --presets-only`");
}

/// Fails when an axis was added and the study was not run again. Before the first run there is no page to compare.
#[test]
fn the_study_in_docs_is_of_todays_axes() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/notes/study/README.md");
    if let Ok(page) = fs::read_to_string(path) {
        assert_eq!(table(&page), today(&[]), "docs/notes/study is stale: run `twobounce study`");
        assert!(page.lines().count() <= 170, "the page is to have at most 170 lines");
    }
}
