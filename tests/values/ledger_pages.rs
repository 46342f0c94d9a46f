//! The pages of the ledgers: every row that names settings is measured, and each row with a formula has a test.

use twobounce::lab::ledger::{Comparison, LEDGERS, lines};
use twobounce::lab::table::cells;
use twobounce::settings::Settings;

/// The ids of a page's rows, measured or not: first cells such as D12.
pub fn ids(page: &str) -> Vec<&str> {
    let is_id = |id: &&str| {
        let mut letters = id.chars();
        letters.next().is_some_and(|first| first.is_ascii_uppercase())
            && !letters.as_str().is_empty()
            && letters.all(|c| c.is_ascii_digit())
    };
    page.lines().filter_map(|line| cells(line)?.first().copied()).filter(is_id).collect()
}

#[test]
fn every_row_that_names_settings_is_measured() {
    for ledger in LEDGERS {
        let lines = lines(ledger.text).expect(ledger.page);
        assert!(lines.len() >= 9, "{}: {} rows", ledger.page, lines.len());
        for line in lines {
            let name = format!("{}, {}", ledger.page, line.name);
            let settings = match &line.job {
                Comparison::Change { printed, right } => [&printed[..], right].concat(),
                Comparison::Fill { settings, .. } | Comparison::Furnace { settings, .. } => settings.clone(),
            };
            let mut set = Settings::preset(ledger.preset).expect("a preset");
            for assignment in settings.iter().filter(|assignment| !assignment.starts_with("sky=")) {
                set.set(assignment).unwrap_or_else(|error| panic!("{name}: {error}"));
            }
            let numbers = line.results.iter().flat_map(|cell| cell.split([' ', ',', '(', ')', '…', '%']));
            let numbers = numbers.filter(|word| !word.is_empty()).map(|word| word.parse::<f64>());
            assert!(
                numbers.clone().count() >= 2 && numbers.clone().all(|number| number.is_ok()),
                "{name} was not measured: run `twobounce ledger --method {}`",
                ledger.method
            );
            // Work that the talk does twice gives equal bits when it is done once.
            if line.name == "D29" {
                assert_eq!(line.results[0], "0.00 %");
            }
        }
    }
}

#[test]
fn every_switch_has_a_row() {
    let keys = twobounce::settings::keys();
    let switches = keys.iter().filter(|key| key.name.contains(".ledger.")).map(|key| format!("`{}=printed`", key.name));
    for switch in switches {
        assert!(LEDGERS.iter().any(|ledger| ledger.text.contains(&switch)), "no row of a ledger measures {switch}");
    }
}

#[test]
fn every_row_with_a_formula_has_its_test_here() {
    // Rows about syntax, or about doing the same work twice, have no formula; passes_voxelise.rs checks the lists.
    let without = ["D4", "D5", "D9", "D29", "D30"];
    let tests = include_str!("ledger_formulas.rs");
    assert_eq!(ids("| D1 | a |\n| text | D2 |\n"), ["D1"]);
    let ids = ids(LEDGERS[0].text);
    assert!(ids.len() > 40, "{ids:?}");
    for id in ids.into_iter().filter(|id| id.starts_with('D') && !without.contains(id)) {
        assert!(tests.contains(&format!("\nfn {}_", id.to_lowercase())), "{id} has no test");
    }
}
