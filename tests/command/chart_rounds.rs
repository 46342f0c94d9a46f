//! A chart's rounds: rough references and a page soon, then errors as exact as requested, while times stay as measured.

use std::fs;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::cli_common::{Folder, finished, root, text};
use serde_json::Value;

const ROWS: usize = 2;

impl Folder {
    fn charting_twice(&self, cache: &str, output: &str, noise: &str) -> Command {
        let mut command = self.command(&["chart"]);
        command.env("TWOBOUNCE_CACHE", self.path(cache)).arg(root().join("assets/cornell-point.glb"));
        command.args(["-o", output, "--size", "32x32", "--set", "voxels=16", "--presets", "fast,printed"]);
        command.args(["--reference-noise", noise, "--paths", "none"]);
        command
    }

    fn images(&self, output: &str) -> usize {
        let entries = fs::read_dir(self.path(output).join("rows")).unwrap();
        entries.filter(|entry| entry.as_ref().unwrap().path().extension().is_some_and(|e| e == "exr")).count()
    }
}

fn number(row: &Value, path: &str) -> f64 {
    row.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path} of {row}"))
}

#[test]
fn errors_are_refined_and_times_are_kept() {
    let folder = Folder::empty();
    let mut command = folder.charting_twice("cache", "chart", "1.5");
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let page = folder.path("chart/index.html");
    let end = Instant::now() + Duration::from_secs(120);
    while finished(&folder.path("chart")).len() < ROWS || !page.exists() {
        assert!(Instant::now() < end && child.try_wait().unwrap().is_none(), "no rough rows while it runs");
        std::thread::sleep(Duration::from_millis(5));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let shown = fs::read_to_string(&page).unwrap();
    assert!(
        shown.contains("\"running\":true") && shown.contains("Errors are rough"),
        "the page does not say what it is"
    );
    // Through JSON's reading of numbers, like the rows below.
    let as_json = |bytes: &[u8]| {
        let kept: twobounce::lab::store::Stored<twobounce::chart::row::Row> = toml::from_str(&text(bytes)).unwrap();
        serde_json::from_str::<Value>(&serde_json::to_string(&kept.row).unwrap()).unwrap()
    };
    let rough: Vec<Value> = finished(&folder.path("chart")).iter().map(|(_, bytes)| as_json(bytes)).collect();
    assert!(rough.iter().all(|row| number(row, "/measured/full/noise") > 0.015), "killed too late: {rough:?}");
    assert!(folder.images("chart") > 0, "no image is kept for the rounds");
    let svg = fs::read_to_string(folder.path("chart/chart.svg")).unwrap();
    assert!(svg.contains("class=\"bar"), "no error bars: {svg}");

    let output = folder.charting_twice("cache", "chart", "1.5").output().unwrap();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(said.contains(&format!("rows kept from earlier calls: {ROWS} of {ROWS}")), "{said}");
    let fine = folder.rows("chart");
    assert_eq!((fine.len(), folder.images("chart")), (ROWS, 0), "an image is left over");
    for old in &rough {
        let new = fine.iter().find(|row| row["key"] == old["key"]).unwrap();
        for time in ["frame_gpu_ms", "frame_wall_ms", "passes"] {
            assert_eq!(old["measured"][time], new["measured"][time], "{time} was measured again");
        }
        assert_eq!(old["origin"], new["origin"]);
        for truth in ["full", "same"] {
            assert!(number(new, &format!("/measured/{truth}/noise")) <= 0.015, "{new}");
            // Noise of the reference makes an error larger, at most by the bar's length, or by chance a little smaller.
            let rel = |row: &Value| number(row, &format!("/measured/{truth}/total/rel"));
            let bar = number(old, &format!("/measured/{truth}/noise_in_rel/total"));
            let added = rel(old) - rel(new);
            assert!(bar > 0.01 && added <= bar && added > -0.2 * bar, "{truth}: {added} of {bar}");
        }
    }
    let text = fs::read_to_string(&page).unwrap();
    assert!(
        text.contains("\"running\":false") && !text.contains("Errors are rough"),
        "the page does not say that it is done"
    );

    // A chart that finds its references in the cache skips the rounds, and has the same errors.
    let output = folder.charting_twice("cache", "again", "1.5").output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(said.matches("reference of all light").count(), 1, "{said}");
    for (old, new) in fine.iter().zip(&folder.rows("again")) {
        assert_eq!(old["measured"]["full"], new["measured"]["full"]);
        assert_eq!(old["measured"]["same"], new["measured"]["same"]);
    }
}
