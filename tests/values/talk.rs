//! `docs/talk.md` is what its example writes: the text word by word, the pictures but for what drivers round; and what it names is there.

use crate::page;
use crate::pictures;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use twobounce::gi::cones::ledger::{OPEN, ROWS};
use twobounce::settings::Key;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_owned()
}

const AGAIN: &str = "run `cargo run --release --example talk`";

/// The page with the table of times that it has.
fn current() -> (String, String) {
    let page = fs::read_to_string(root().join("docs/talk.md")).expect("the page");
    let document = page::document(page::times_of(&page).expect("times"));
    (page, document)
}

#[test]
fn the_page_is_what_the_example_writes() {
    let (page, document) = current();
    assert!(page == document, "docs/talk.md is not current: {AGAIN}");
    let device = "a device";
    let table = page::times(
        device,
        &["printed", "corrected"],
        &[("image", vec![(0, 2.0), (1, 3.04)]), ("mips", vec![(1, 1.0)])],
    );
    assert!(table.ends_with("| image | 2.0 | 3.0 |\n| mips | – | 1.0 |\n| all | 2 | 4 |\n"), "{table}");
}

#[test]
fn what_the_page_names_is_there() {
    let (_, page) = current();
    let mut files = 0;
    for named in page.split('`').skip(1).step_by(2) {
        if named.contains('/') {
            files += 1;
            assert!(root().join(named).exists(), "the page names {named}, which is not there");
        } else if ["cones.", "lights.", "grid."].iter().any(|table| named.starts_with(table)) {
            let key = named.split(['=', ' ']).next().unwrap_or(named);
            assert!(Key::named(key).is_some(), "the page names {key}, which is no setting");
        }
    }
    assert!(files > 40, "{files}");
    let named: BTreeSet<_> =
        page::SLIDES.iter().flat_map(|slide| slide.statements).flat_map(|s| s.2).copied().collect();
    // S12 is what the slides do not hold.
    let open = OPEN.iter().map(|row| row.id).filter(|id| *id != "S12");
    let rows: BTreeSet<_> = ROWS.iter().map(|row| row.id).chain(open).collect();
    assert_eq!(named, rows, "each row of the ledger is about something on the slides");
}

/// Images are rendered with a quarter of the page's pixels a side, and compared with means over 4×4 of the page's.
#[test]
fn pictures_are_current() {
    const SHRINK: u32 = 4;
    let folder = root().join("docs/talk");
    let (pictures, _) = pictures::rendered(pictures::IMAGE_SIZE / SHRINK).expect("pictures");
    let shown: BTreeSet<_> = page::SLIDES.iter().flat_map(|slide| slide.pictures).map(|picture| picture.0).collect();
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
        // Drivers differ in filtering and in which pixels an edge covers. A mean over sixteen pixels that are clipped and encoded
        // differs from one pixel of four samples along every edge.
        let mean = apart as f64 / kept.len() as f64;
        assert!(mean < if is_image { 3.0 } else { 1.0 }, "{name} is {mean:.2} of 255 off in the mean: {AGAIN}");
    }
}
