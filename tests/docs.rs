//! The pages say what is there: paths exist, commands and flags are known, links lead somewhere, licences are whole.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// What stands between single backticks, fenced blocks left out.
fn quoted(page: &str) -> Vec<String> {
    let prose: String = page.split("```").step_by(2).collect();
    prose.split('`').skip(1).step_by(2).map(str::to_owned).collect()
}

/// The lines of the fenced blocks, without comments and with continued lines joined.
fn commands(page: &str) -> Vec<String> {
    let blocks = page.split("```").skip(1).step_by(2).map(|block| block.split_once('\n').unwrap().1);
    let text = blocks.collect::<String>().replace("\\\n", " ");
    text.lines()
        .map(|line| line.split(" #").next().unwrap().trim().to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// Every file of the project, without what is built or fetched.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if path.is_dir() && !["target", ".git", ".cache", "out"].contains(&name) {
            files(&path, found);
        } else if path.is_file() {
            found.push(path);
        }
    }
}

#[test]
fn the_architecture_names_paths_that_exist() {
    let page = read("ARCHITECTURE.md");
    let is_path = |s: &&String| s.contains('/') && !s.contains(' ');
    let named = quoted(&page);
    let paths: Vec<_> = named.iter().filter(is_path).collect();
    assert!(paths.len() > 20, "{paths:?}");
    for path in paths {
        assert!(root().join(path).exists(), "ARCHITECTURE.md names {path}, which is not there");
    }
    for entry in fs::read_dir(root().join("src")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap().to_owned();
        let room = format!("src/{name}{}", if path.is_dir() { "/" } else { "" });
        assert!(named.contains(&room), "ARCHITECTURE.md does not say what {room} is for");
    }
    assert!(page.lines().count() <= 80, "ARCHITECTURE.md is to be one page");
}

#[test]
fn commands_and_flags_in_the_readme_exist() {
    let makefile = read("Makefile");
    let mut seen = vec![];
    for line in commands(&read("README.md")) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["make", target, ..] => {
                assert!(makefile.contains(&format!("\n{target}:")), "the Makefile has no target {target}");
            }
            ["twobounce", command, ..] => {
                let help = Command::new(env!("CARGO_BIN_EXE_twobounce")).args([command, "--help"]).output().unwrap();
                assert!(help.status.success(), "there is no `twobounce {command}`");
                let help = String::from_utf8(help.stdout).unwrap();
                for flag in words.iter().filter(|word| word.starts_with('-')) {
                    let known = help.split(|c: char| c.is_whitespace() || c == ',').any(|word| word == *flag);
                    assert!(known, "`twobounce {command}` has no {flag}");
                }
                seen.push(command.to_owned());
            }
            _ => {}
        }
    }
    assert!(seen.iter().any(|command| command == "render"), "{seen:?}");
}

#[test]
fn links_and_pictures_lead_somewhere() {
    for page in ["README.md", "ARCHITECTURE.md", "assets/README.md", "docs/README.md", "docs/talk.md"] {
        let folder = root().join(page).parent().unwrap().to_owned();
        for link in read(page).split("](").skip(1).map(|rest| rest.split([')', '#']).next().unwrap()) {
            let outside = link.starts_with("https://") || link.is_empty();
            assert!(outside || folder.join(link).exists(), "{page} links to {link}, which is not there");
        }
    }
}

#[test]
fn every_page_is_in_the_index() {
    let index = read("docs/README.md");
    for entry in fs::read_dir(root().join("docs")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        if name.ends_with(".md") && name != "README.md" {
            assert!(index.contains(&format!("]({name})")), "docs/README.md does not list {name}");
        }
    }
}

#[test]
fn licences_are_whole() {
    assert!(read("LICENSE-MIT").contains("The above copyright notice and this permission notice shall be included"));
    assert!(read("LICENSE-APACHE").contains("END OF TERMS AND CONDITIONS"));
    assert!(read("Cargo.toml").contains("license = \"MIT OR Apache-2.0\""));
    let scenes = read("assets/README.md");
    for entry in fs::read_dir(root().join("assets")).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        if name != "README.md" {
            let line = scenes.lines().find(|line| line.contains(&format!("`{name}`")));
            assert!(line.is_some_and(|line| line.contains("CC0 1.0")), "assets/README.md gives no licence for {name}");
        }
    }
}

#[test]
fn no_file_is_larger_than_five_megabytes() {
    let mut found = vec![];
    files(root(), &mut found);
    assert!(found.len() > 50, "{}", found.len());
    for file in found {
        let bytes = file.metadata().unwrap().len();
        assert!(bytes <= 5_000_000, "{} has {bytes} bytes", file.display());
    }
}

/// What hosts rely on is little: every other module is hidden from the pages that say what stays.
#[test]
fn the_documentation_shows_four_modules() {
    let page = read("src/lib.rs");
    let hidden = "#[cfg_attr(not(internals), doc(hidden))]";
    let lines: Vec<&str> = page.lines().collect();
    let modules = lines.iter().enumerate().filter_map(|(i, line)| Some((i, line.strip_prefix("pub mod ")?)));
    let shown: Vec<_> = modules.filter(|(i, _)| lines[i - 1] != hidden).map(|(_, name)| name).collect();
    assert_eq!(shown, ["host;", "renderer;", "scene;", "settings;"]);
    for name in shown {
        let link = format!("[`{}`]", name.trim_end_matches(';'));
        assert!(page.contains(&link), "the first page does not name {link}");
    }
}
