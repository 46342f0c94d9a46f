//! `suite/` is complete and small: scenes, cameras in numbers, references that fit each other, rows, pages and tables.

use std::fs;
use std::path::{Path, PathBuf};

use glam::DVec3;
use twobounce::chart::import::Named;
use twobounce::chart::suite::{Rows, Suite};
use twobounce::lab::table::{CsvRow, from_csv, tables};
use twobounce::layers::Aov;
use twobounce::output::exr::Metadata;
use twobounce::scene::{LoadOptions, Playback, Projection, Scene, View};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("suite")
}

fn suite() -> Suite {
    Suite::read(&folder()).unwrap()
}

fn csv() -> (String, Vec<CsvRow>) {
    let text = fs::read_to_string(folder().join("rows.csv")).unwrap();
    let rows = from_csv(&text).unwrap().1;
    (text, rows)
}

#[test]
fn cameras_in_numbers_are_those_of_the_files() {
    let suite = suite();
    assert_eq!(suite.scenes.len(), 8);
    for entry in &suite.scenes {
        let scene = Scene::load(&suite.path(entry), &LoadOptions::default()).unwrap();
        let animations = (0..scene.animations.len().min(1)).collect();
        let pose = scene.pose_of(&Playback { animations, repeats: false }, entry.time_s);
        let of_file = scene.view(&pose, 0);
        let [eye, target, up] = [entry.eye, entry.target, entry.up].map(DVec3::from);
        let stated = View::look_at(eye, target, up, entry.fov_degrees.to_radians() as f32);
        let ends = [(stated.eye, of_file.eye), (stated.forward, of_file.forward), (stated.up, of_file.up)];
        for (stated, of_file) in ends {
            assert!((stated - of_file).length() < 2e-6, "{}: {stated} stated, {of_file} of the file", entry.name);
        }
        let fov = |view: &View| match view.projection {
            Projection::Perspective { fov, .. } => fov.to_degrees(),
            Projection::Orthographic { .. } => panic!("{} has another projection", entry.name),
        };
        assert!((fov(&stated) - fov(&of_file)).abs() < 1e-3, "{}: {} degrees", entry.name, fov(&of_file));
    }
}

/// The small reference is the mean of the large one up to the rounding of the files' values, and each states its trace
/// settings.
#[test]
fn references_of_both_sides_are_one_image() {
    let suite = suite();
    let [large, small] = suite.sides[..] else { panic!("{:?}", suite.sides) };
    for entry in &suite.scenes {
        let [fine, coarse] = [large, small].map(|side| suite.reference(entry, side).unwrap());
        assert!(coarse.noise < fine.noise && fine.noise < 0.06, "{}: {} of noise", entry.name, fine.noise);
        assert!(coarse.noise_in_rel.total < fine.noise_in_rel.total && fine.noise_in_rel.total > 0.0);
        let step = large / small;
        for (aov, pixels) in &coarse.layers.layers {
            let whole = fine.layers.get(*aov).unwrap();
            for (at, pixel) in pixels.iter().enumerate() {
                let (x, y) = (at as u32 % small * step, at as u32 / small * step);
                let block = (0..step * step).map(|i| whole[((y + i / step) * large + x + i % step) as usize]);
                let mean = block.fold(0.0, |sum, pixel| sum + pixel[1]) / (step * step) as f32;
                let apart = (mean - pixel[1]).abs();
                assert!(apart <= 1e-3 * mean.abs(), "{} {aov} {at}: {mean} and {}", entry.name, pixel[1]);
            }
        }
        assert!(fine.layers.get(Aov::Direct).is_some() && fine.layers.get(Aov::Diffuse).is_some());
        for file in suite.files(entry, large).iter().chain(&suite.files(entry, small)) {
            let header: Metadata = twobounce::layers::Layers::read_exr(file).unwrap().1;
            let seeds = suite.seeds.iter().map(u64::to_string).collect::<Vec<_>>().join(" ");
            assert_eq!(header["seeds"], seeds, "{}: trace it again", file.display());
            assert_eq!(header["samplesOfSeed"], entry.samples.to_string(), "{}: trace it again", file.display());
            let hash = Scene::load(&suite.path(entry), &LoadOptions::default()).unwrap().hash;
            assert_eq!(header["sceneHash"], hash, "{}: trace it again", file.display());
        }
    }
}

#[test]
fn tables_are_those_of_the_rows() {
    let (suite, rows) = (suite(), Rows::read(&folder()).unwrap());
    let pages = suite.scenes.iter().map(|scene| format!("{}.md", scene.name));
    for page in pages.chain(["README.md".to_owned()]) {
        let text = fs::read_to_string(folder().join(&page)).unwrap_or_else(|e| panic!("suite/{page}: {e}"));
        assert!(!tables(&text).unwrap().is_empty(), "suite/{page} has no table");
        assert!(rows.fill(&suite, &text).unwrap() == text, "suite/{page} is old: run `twobounce suite -o suite`");
    }
    assert!(csv().0 == rows.csv(&suite), "suite/rows.csv is in another order: run `twobounce suite -o suite`");
}

#[test]
fn every_scene_has_rows_of_this_program_and_others_say_how_they_were_made() {
    let (suite, rows) = (suite(), csv().1);
    let others = Named::read(&folder().join("others.toml")).unwrap();
    for entry in &suite.scenes {
        for side in &suite.sides {
            let of = |row: &&CsvRow| row.cell("scene") == entry.name && row.cell("side_pixels") == side.to_string();
            for preset in ["fast", "balanced", "accurate"] {
                let row = rows.iter().filter(of).find(|row| row.cell("name") == preset);
                let row = row.unwrap_or_else(|| panic!("{preset} is not measured on {} at {side}", entry.name));
                assert!(row.number("total_rel").is_some() && row.number("milliseconds").is_some());
                assert!(row.cell("device").contains("llvmpipe") || !row.cell("device").is_empty());
            }
        }
    }
    let foreign: Vec<&CsvRow> = rows.iter().filter(|row| row.cell("source") == "other program").collect();
    let names: std::collections::BTreeSet<&str> =
        foreign.iter().map(|row| row.cell("name").split(',').next().unwrap()).collect();
    assert!(names.len() >= 2, "rows of two other programs: {names:?}");
    for row in foreign {
        let made = others
            .iter()
            .find(|other| other.name == row.cell("name") && other.scene.as_deref() == Some(row.cell("scene")));
        let made = made.unwrap_or_else(|| panic!("suite/others.toml does not say how {} was made", row.cell("name")));
        assert_eq!(made.note.as_deref(), Some(row.cell("note")), "{}", made.name);
        assert!(!row.cell("device").is_empty() && !row.cell("note").is_empty(), "{}", made.name);
    }
}

#[test]
fn the_folder_is_small() {
    fn files(folder: &Path, found: &mut Vec<(PathBuf, u64)>) {
        for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
            match entry.file_type().unwrap().is_dir() {
                true => files(&entry.path(), found),
                false => found.push((entry.path(), entry.metadata().unwrap().len())),
            }
        }
    }
    let mut found = Vec::new();
    files(&folder(), &mut found);
    let sum: u64 = found.iter().map(|(_, bytes)| bytes).sum();
    assert!(sum < 9_000_000, "suite/ has {sum} bytes; at most 25 MB may be here, and 9 were enough");
    assert!(found.iter().all(|(_, bytes)| *bytes < 1_500_000), "{found:?}");
}
