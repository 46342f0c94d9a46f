//! Modules import only from lower ones: the rooms of `src/` and the folders of `src/vk/`, in the order that
//! ARCHITECTURE.md states; the files of `src/cli/` have no cyclic imports.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// The names between backticks in the line of ARCHITECTURE.md that starts with `start`, the lowest first.
fn order(start: &str) -> Vec<String> {
    let page = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let line = page.lines().find(|line| line.starts_with(start)).unwrap_or_else(|| panic!("no line {start:?}"));
    line[start.len()..].split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// Every Rust file below `folder`.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<PathBuf> =
        entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect();
    found.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    found
}

/// The code without comments, white space around `::`, and line breaks.
fn code(text: &str) -> String {
    let lines = text.lines().map(|line| line.split("//").next().unwrap().trim());
    lines.collect::<Vec<_>>().join(" ")
}

/// The text that follows each `prefix` in the code: the path's next name, or the next names of a list in braces.
fn names_after(code: &str, prefix: &str) -> Vec<String> {
    let first = |path: &str| path.trim().split(|c: char| !c.is_alphanumeric() && c != '_').next().unwrap().to_owned();
    let is_inside = |at: usize| code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
    let mut names = Vec::new();
    for (at, _) in code.match_indices(prefix).filter(|(at, _)| !is_inside(*at)) {
        let rest = &code[at + prefix.len()..];
        let Some(list) = rest.strip_prefix('{') else {
            names.push(first(rest));
            continue;
        };
        let (mut depth, mut start) = (0, 0);
        for (i, c) in list.char_indices() {
            if depth == 0 && matches!(c, ',' | '}') {
                names.push(first(&list[start..i]));
                start = i + 1;
            }
            match c {
                '}' if depth == 0 => break,
                '{' => depth += 1,
                '}' => depth -= 1,
                _ => {}
            }
        }
    }
    names
}

/// The names of `order` above `own` that `code` imports.
fn upward(code: &str, prefixes: &[&str], order: &[String], own: &str) -> Vec<String> {
    let floor = |name: &str| order.iter().position(|room| room == name);
    let own = floor(own).unwrap_or_else(|| panic!("{own} has no place in ARCHITECTURE.md"));
    let mut names: Vec<String> = prefixes.iter().flat_map(|prefix| names_after(code, prefix)).collect();
    names.retain(|name| floor(name).is_some_and(|floor| floor > own));
    names
}

/// The first part of a path below `folder`, without the extension.
fn room(path: &Path, folder: &Path) -> String {
    let part = path.strip_prefix(folder).unwrap().components().next().unwrap().as_os_str().to_str().unwrap();
    part.trim_end_matches(".rs").to_owned()
}

#[test]
fn rooms_import_downwards() {
    let order = order("Rooms from the lowest to the highest: ");
    let src = root().join("src");
    let mut rooms = Vec::new();
    for path in sources(&src) {
        let own = room(&path, &src);
        if ["lib", "main"].contains(&own.as_str()) {
            continue;
        }
        let text = code(&fs::read_to_string(&path).unwrap());
        let found = upward(&text, &["crate::", "twobounce::"], &order, &own);
        assert_eq!(found, [""; 0], "{} imports from above", path.display());
        rooms.push(own);
    }
    let missing: Vec<_> = order.iter().filter(|room| !rooms.contains(room)).collect();
    assert!(missing.is_empty(), "ARCHITECTURE.md orders rooms that are not there: {missing:?}");
}

#[test]
fn folders_of_vk_import_downwards() {
    let order = order("Folders of `src/vk/` from the lowest to the highest: ");
    let vk = root().join("src/vk");
    for path in sources(&vk) {
        let own = room(&path, &vk);
        if own == "mod" {
            continue;
        }
        let text = code(&fs::read_to_string(&path).unwrap());
        assert_eq!(upward(&text, &["crate::vk::"], &order, &own), [""; 0], "{} imports from above", path.display());
        // By a public name of `crate::vk` a file could import from any folder.
        let mut others = names_after(&text, "crate::vk::");
        others.extend(names_after(&text, "super::super::"));
        others.retain(|name| !order.contains(name));
        assert_eq!(others, [""; 0], "{} does not say from which folder it imports", path.display());
    }
}

/// The cycles of `rooms`, each given with its imports, and the rooms that import them: rooms without imports among the
/// rest are removed one by one.
fn circles(mut rooms: BTreeMap<String, BTreeSet<String>>) -> BTreeSet<String> {
    loop {
        let known: BTreeSet<String> = rooms.keys().cloned().collect();
        rooms.retain(|_, imports| imports.iter().any(|name| known.contains(name)));
        if rooms.len() == known.len() {
            return known;
        }
    }
}

#[test]
fn commands_import_in_no_circle() {
    let cli = root().join("src/cli");
    let mut rooms: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for path in sources(&cli) {
        let own = room(&path, &cli);
        if own == "mod" {
            continue; // It lists the commands, and none of them imports it.
        }
        let is_file =
            path.parent() == Some(&cli) || path.ends_with("mod.rs") && path.parent().unwrap().parent() == Some(&cli);
        let prefixes = if is_file { ["super::", "crate::cli::"] } else { ["super::super::", "crate::cli::"] };
        let text = code(&fs::read_to_string(&path).unwrap());
        let mut names: BTreeSet<String> = prefixes.iter().flat_map(|prefix| names_after(&text, prefix)).collect();
        if text.contains("say!(") {
            names.insert("out".to_owned());
        }
        names.remove(&own);
        rooms.entry(own).or_default().extend(names);
    }
    assert!(rooms["render"].contains("args"), "{rooms:?}");
    assert_eq!(circles(rooms), BTreeSet::new());
}

#[test]
fn a_circle_is_found() {
    let rooms = |pairs: &[(&str, &str)]| {
        let mut rooms: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for (from, to) in pairs {
            rooms.entry((*from).to_owned()).or_default().insert((*to).to_owned());
            rooms.entry((*to).to_owned()).or_default();
        }
        rooms
    };
    assert_eq!(circles(rooms(&[("a", "b"), ("b", "c"), ("a", "c")])), BTreeSet::new());
    let found = circles(rooms(&[("a", "b"), ("b", "c"), ("c", "b"), ("c", "d")]));
    assert_eq!(found.into_iter().collect::<Vec<_>>(), ["a", "b", "c"]);
}

#[test]
fn an_import_from_above_is_found() {
    let order = ["low", "middle", "high"].map(str::to_owned);
    let above = |text: &str| upward(&code(text), &["crate::"], &order, "middle");
    assert_eq!(above("use crate::low::Thing;\nuse crate::middle::Other;"), [""; 0]);
    assert_eq!(above("// crate::high is only named here"), [""; 0]);
    assert_eq!(above("fn f() -> crate::high::Thing {}"), ["high"]);
    assert_eq!(above("use crate::{\n    low::{a, b},\n    high::{c, d}, Error,\n};"), ["high"]);
    assert_eq!(above("use crate::{low, high};"), ["high"]);
}
