//! `docs/notes/talk.md` names existing code, and its pictures equal those of its example within the rounding of
//! drivers.

use crate::ledger_pages::ids;
use crate::pictures;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use twobounce::lab::ledger::LEDGERS;
use twobounce::lab::table::{cells, coded, tables};
use twobounce::settings::Key;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

const AGAIN: &str = "run `cargo run --release --example pages -- talk`";

fn page() -> String {
    fs::read_to_string(root().join("docs/notes/talk.md")).expect("the page")
}

#[test]
fn the_table_of_times_has_every_preset() {
    let (name, times) = tables(&page()).expect("marks").remove(0);
    let head = times.lines().find_map(cells).expect(AGAIN);
    assert_eq!((name.as_str(), &head[1..]), ("times", &pictures::presets().map(|preset| preset.0)[..]), "{AGAIN}");
    assert!(times.lines().any(|line| line.starts_with("| all |")), "{AGAIN}");
}

#[test]
fn what_the_page_names_is_there() {
    let page = page();
    let mut files = 0;
    for named in coded(&page) {
        if named.contains('/') {
            files += 1;
            assert!(root().join(named).exists(), "the page names {named}, which is not there");
        } else if ["cones.", "lights.", "grid."].iter().any(|table| named.starts_with(table)) {
            let key = named.split(['=', ' ']).next().unwrap_or(named);
            assert!(Key::named(key).is_some(), "the page names {key}, which is no setting");
        }
    }
    assert!(files > 40, "{files}");
    // The third column of the slides has rows of the ledger; S12 is absent from the slides.
    let slides = page.lines().filter_map(cells).filter(|cells| cells.len() == 3);
    let named: BTreeSet<&str> = slides.flat_map(|cells| cells[2].split(' ')).filter(|id| *id != "ledger").collect();
    let named: BTreeSet<&str> = named.into_iter().filter(|id| !id.is_empty()).collect();
    let rows: BTreeSet<&str> = ids(LEDGERS[0].text).into_iter().filter(|id| *id != "S12").collect();
    assert_eq!(named, rows, "each row of the ledger is about something on the slides");
}

/// Images are rendered with a quarter of the page's pixels a side, and compared with means over 4×4 of the page's.
#[test]
fn pictures_are_current() {
    const SHRINK: u32 = 4;
    let (page, folder) = (page(), root().join("docs/notes/talk"));
    let (pictures, _) = pictures::rendered(pictures::IMAGE_SIZE / SHRINK).expect("pictures");
    let shown: BTreeSet<_> = page.split("](talk/").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    let written: BTreeSet<_> = pictures.iter().map(|picture| picture.0).chain(["path-traced.png"]).collect();
    let there = fs::read_dir(&folder).expect("pictures").map(|file| file.expect("a file").file_name());
    let there: BTreeSet<_> = there.map(|name| name.into_string().expect("a name")).collect();
    assert_eq!(shown, written);
    assert_eq!(there, written.iter().map(|name| (*name).to_owned()).collect());
    let bytes: u64 = written.iter().map(|name| fs::metadata(folder.join(name)).expect(name).len()).sum();
    assert!(bytes < 4_000_000, "{bytes} bytes");
    for (name, now) in pictures {
        let file = fs::read(folder.join(name)).expect(name);
        let [mut kept, now] = [file, now].map(|png| image::load_from_memory(&png).expect(name).into_rgb8());
        let is_image = kept.dimensions() == (pictures::IMAGE_SIZE, pictures::IMAGE_SIZE);
        if is_image {
            kept = image::imageops::thumbnail(&kept, now.width(), now.height());
        }
        assert_eq!(kept.dimensions(), now.dimensions(), "{name}: {AGAIN}");
        let apart: u64 = kept.iter().zip(now.iter()).map(|(a, b)| u64::from(a.abs_diff(*b))).sum();
        // Drivers differ in filtering and in which pixels an edge covers. A mean over sixteen pixels that are clipped
        // and encoded differs from one pixel of four samples along every edge.
        let mean = apart as f64 / kept.len() as f64;
        assert!(mean < if is_image { 3.0 } else { 1.0 }, "{name} is {mean:.2} of 255 off in the mean: {AGAIN}");
    }
}
