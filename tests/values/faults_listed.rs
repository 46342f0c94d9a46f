//! The planted faults (`tests/faults/faults.toml`, `make faults`): each can be planted, and the page names the test
//! that caught it.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use toml::Value;

fn read(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
    fs::read_to_string(path).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn text<'a>(fault: &'a Value, key: &str) -> &'a str {
    fault.get(key).and_then(Value::as_str).unwrap_or_else(|| panic!("a fault without {key}: {fault}"))
}

fn faults() -> Vec<Value> {
    let list: toml::Table = read("tests/faults/faults.toml").parse().expect("TOML");
    list["fault"].as_array().expect("a list").clone()
}

/// Whether `test` names a test binary, a file of one as `binary::file`, or a test as `binary::file::test`.
fn exists(test: &str) -> bool {
    let mut words = test.split("::");
    let (binary, file, function) = (words.next().expect("a word"), words.next(), words.last());
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(binary);
    // The library's tests are in its source files and are not searched.
    let Some(file) = file.filter(|_| binary != "lib") else {
        return binary == "lib" || folder.join("main.rs").exists();
    };
    let single = folder.join(format!("{file}.rs"));
    // Tests of a folder within a binary are not searched either.
    let text = |path| fs::read_to_string(path).expect("a test file");
    match function {
        Some(function) if single.exists() => text(single).contains(&format!("fn {function}")),
        _ => single.exists() || folder.join(file).join("mod.rs").exists(),
    }
}

#[test]
fn every_fault_can_be_planted() {
    let mut names = BTreeSet::new();
    for fault in faults() {
        let (name, file, find) = (text(&fault, "name"), text(&fault, "file"), text(&fault, "find"));
        assert!(names.insert(name.to_owned()), "two faults are called {name}");
        assert_eq!(read(file).matches(find).count(), 1, "{name}: how often its text stands in {file}");
        assert_ne!(find, text(&fault, "replace"), "{name} changes nothing");
        let wrong = text(&fault, "wrong");
        assert!(wrong.ends_with('.') && !wrong.contains('|'), "{name}: one sentence that fits a table");
        for test in fault["first"].as_array().expect("a list of tests") {
            let test = test.as_str().expect("a test's name");
            assert!(exists(test), "{name}: there is no test {test}");
        }
    }
    assert!(names.len() >= 12, "{names:?}");
}

#[test]
fn the_page_says_which_test_caught_each_fault() {
    let page = read("docs/notes/faults.md");
    let faults = faults();
    let rows: Vec<&str> = page.lines().filter(|line| line.starts_with("| `")).collect();
    for row in &rows {
        let caught = faults.iter().find_map(|fault| {
            let (name, wrong, file) = (text(fault, "name"), text(fault, "wrong"), text(fault, "file"));
            row.strip_prefix(&format!("| `{name}` | {wrong} | `{file}` | `"))
        });
        let caught = caught.unwrap_or_else(|| panic!("no fault has the row {row}: run `make faults`"));
        let test = caught.trim_end_matches("` |");
        assert!(exists(test.split(' ').next().expect("a word")), "{row}: {test} is no test");
    }
    assert_eq!(rows.len(), faults.len(), "each fault has a row: run `make faults`");
}
