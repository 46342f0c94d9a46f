//! A still image gets passes until its noise is low enough, and its noise is printed.

use crate::cli_common::{Folder, root, text};
use twobounce::layers::Layers;
use twobounce::settings::Settings;

const STILL: [&str; 6] = ["render", "box.glb", "--preset=fast", "--size=48x32", "--set=voxels=16", "-o"];

fn folder() -> Folder {
    let folder = Folder::empty();
    std::fs::copy(root().join("assets/cornell-area.glb"), folder.path("box.glb")).unwrap();
    folder
}

fn still(folder: &Folder, name: &str, more: &[&str]) -> (String, Layers) {
    let said = folder.done(&[&STILL[..], &[name], more].concat());
    (said, Layers::read_exr(&folder.path(name)).unwrap().0)
}

/// Root mean square of the difference of radiance.
fn difference(a: &Layers, b: &Layers) -> f64 {
    let squares = a.beauty().iter().flatten().zip(b.beauty().iter().flatten()).map(|(a, b)| f64::from(a - b).powi(2));
    (squares.sum::<f64>() / a.beauty().len() as f64).sqrt()
}

#[test]
fn a_still_gets_passes_until_its_noise_is_low() {
    let folder = folder();
    let (said, refined) = still(&folder, "refined.exr", &[]);
    let line = said.lines().find(|line| line.contains("mean of")).unwrap_or_else(|| panic!("{said}"));
    let noise: f64 = line.split_whitespace().nth(1).unwrap().parse().unwrap();
    let passes: u32 = line.split("image.passes=").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(noise <= 2.0 && passes > 2, "{line}");
    // The printed settings, and those in the file, make the same image.
    let (_, header) = Layers::read_exr(&folder.path("refined.exr")).unwrap();
    let mut settings = Settings::default();
    settings.merge_toml(&header["settings"]).unwrap();
    assert_eq!(settings.image.passes, passes);
    let full = "--set=image.gather_resolution=full";
    assert!(line.contains("image.gather_resolution=full"), "{line}");
    let (_, again) = still(&folder, "again.exr", &[&format!("--set=image.passes={passes}"), full]);
    assert!(again == refined);
    // With one pass fewer, the same estimate is above the goal.
    let (fewer, _) = still(&folder, "fewer.exr", &[&format!("--set=image.passes={}", passes - 1), full]);
    let fewer: f64 = fewer.split("by its passes: ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(fewer > 2.0, "{fewer} with {} passes", passes - 1);
    // Its distance from the mean of many passes is the printed noise within a half, since noise is an estimate.
    let (_, one) = still(&folder, "one.exr", &["--noise=off", full]);
    let (_, many) = still(&folder, "many.exr", &["--set=image.passes=1024", full]);
    let (of_one, of_mean) = (difference(&one, &many), difference(&refined, &many));
    let expected = of_one / f64::from(passes).sqrt();
    assert!(of_mean < 1.5 * expected, "{of_mean}, of one pass {of_one}, {passes} passes");
    // Benchmarks and sequences have one pass, and the preset's gathered pixels.
    let (_, one) = still(&folder, "one.exr", &["--noise=off"]);
    for more in [&["--timings"][..], &["--repeat=2"], &["--json=a.json"]] {
        assert!(still(&folder, "timed.exr", more).1 == one, "{more:?}");
    }
    // They have more where a flag asks for it.
    let (said, refined_twice) = still(&folder, "timed.exr", &["--repeat=2", "--noise=2"]);
    assert!(said.contains(line) && refined_twice == refined, "{said}");
}

#[test]
fn time_ends_refinement_in_a_note() {
    let folder = folder();
    let output = folder.run(&[&STILL[..], &["late.exr", "--time-limit=1s", "--noise=0.001"]].concat());
    let said = text(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("note: box: ") && said.contains("--time-limit was over"), "{said}");
    assert!(folder.path("late.exr").exists());
    for (flag, remedy) in [("--noise=0", "or off"), ("--noise=-2", "or off"), ("--time-limit=0", "such as 60s")] {
        let said = folder.refused(&[&STILL[..], &["a.exr", flag]].concat());
        assert!(said.contains(remedy), "{said}");
    }
}
