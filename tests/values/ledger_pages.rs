//! The pages of the ledgers: each has every row in its present wording, measured, and each row with a formula has a test.

use twobounce::gi::cones::ledger;
use twobounce::gi::ledger::{Effect, SHEETS};

#[test]
fn the_page_has_every_row_in_its_present_wording() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/ledger.md")).expect("docs/ledger.md");
    let measured = ledger::page::parse(&page).expect("a page that `twobounce ledger` wrote");
    assert!(ledger::page::document(&measured) == page, "docs/ledger.md is stale: run `twobounce ledger`");
    let rows = ledger::ROWS.iter().chain(ledger::OPEN);
    for row in rows.filter(|row| matches!(row.effect, Effect::Measured { .. })) {
        assert!(measured.changes.contains_key(row.id), "{} was not measured", row.id);
    }
    assert!(ledger::CHOICES.iter().all(|choice| measured.changes.contains_key(*choice)));
    assert_eq!(measured.furnaces.len(), ledger::FURNACE_FILLS.len() * ledger::FURNACE_ROOMS.len());
    // What the talk does twice gives the same bits when it is done once.
    assert_eq!(measured.changes["D29"].rel_percent, 0.0);
}

#[test]
fn the_rivals_pages_have_every_row_in_its_present_wording() {
    for sheet in SHEETS {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(sheet.page);
        let page = std::fs::read_to_string(path).expect(sheet.page);
        let command = format!("run `twobounce ledger --method {}`", sheet.method);
        let measured = sheet.parse(&page).unwrap_or_else(|| panic!("{} is stale: {command}", sheet.page));
        assert!(sheet.document(&measured) == page, "{} is stale: {command}", sheet.page);
        for row in sheet.rows.iter().filter(|row| matches!(row.effect, Effect::Measured { .. })) {
            assert!(measured.changes.contains_key(row.id), "{} was not measured: {command}", row.id);
        }
    }
}

#[test]
fn every_row_with_a_formula_has_its_test_here() {
    // Rows about syntax, or about doing the same work twice, have no formula; the lists are held in passes_voxelise.rs.
    let without = ["D4", "D5", "D9", "D29", "D30"];
    let tests = include_str!("ledger_formulas.rs");
    for row in ledger::ROWS.iter().filter(|row| !without.contains(&row.id)) {
        assert!(tests.contains(&format!("\nfn {}_", row.id.to_lowercase())), "{} has no test", row.id);
    }
}
