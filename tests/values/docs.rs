//! The pages are right about the project: paths exist, commands and flags are known, links work, licences are complete.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::{frontier_tables, tables};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// Texts between single backticks, fenced blocks left out.
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

/// Every file of the project, except built and fetched ones.
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

/// The help of a command, or of the program if there is none.
fn help(command: &[&str]) -> String {
    let help = Command::new(env!("CARGO_BIN_EXE_twobounce")).args(command).arg("--help").output().unwrap();
    assert!(help.status.success(), "there is no `twobounce {}`", command.join(" "));
    String::from_utf8(help.stdout).unwrap()
}

#[test]
fn commands_and_flags_on_the_first_pages_exist() {
    let makefile = read("Makefile");
    let mut seen = vec![];
    let pages = ["README.md", "docs/usage.md", "docs/accuracy.md"];
    for line in pages.iter().flat_map(|page| commands(&read(page))) {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words[..] {
            ["make", target, ..] => {
                assert!(makefile.contains(&format!("\n{target}:")), "the Makefile has no target {target}");
            }
            ["twobounce", command, ..] => {
                let help = help(&[command]);
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
fn the_page_of_usage_names_every_command_and_flag() {
    let page = read("docs/usage.md");
    let names = |word: &str| page.contains(&format!("`{word}`")) || page.contains(&format!("`{word} "));
    let listed = help(&[]);
    let listed = listed.split_once("Commands:\n").unwrap().1.split("\n\n").next().unwrap();
    let listed = listed.lines().filter_map(|line| line.split_whitespace().next()).filter(|command| *command != "help");
    let commands: Vec<&str> = listed.chain(["study", "ledger", "make-assets"]).collect();
    assert!(commands.len() > 10, "{commands:?}");
    for command in commands {
        assert!(names(command), "docs/usage.md does not name `{command}`");
        let help = help(&[command]);
        // Two spaces or a line's end precede an option's description.
        let options = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
        let options = options.flat_map(|line| line.split("  ").next().unwrap().split([' ', ',']));
        for flag in options.filter(|word| word.starts_with("--")) {
            assert!(flag == "--help" || names(flag), "docs/usage.md does not name {flag} of `twobounce {command}`");
        }
    }
}

/// The pages of this project's documentation, from its root.
fn pages() -> Vec<String> {
    let mut found = vec![];
    files(&root().join("docs"), &mut found);
    files(&root().join("suite"), &mut found);
    let pages = found.iter().filter(|path| path.extension().is_some_and(|extension| extension == "md"));
    let pages = pages.map(|path| path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned());
    pages
        .chain(
            ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "CHANGELOG.md", "assets/README.md"].map(str::to_owned),
        )
        .collect()
}

/// The anchors of a page's headings: lower case, without punctuation, with dashes for spaces.
fn anchors(page: &str) -> Vec<String> {
    let headings =
        page.lines().filter_map(|line| line.strip_prefix('#').map(|rest| rest.trim_start_matches('#').trim()));
    let kept = |c: &char| c.is_alphanumeric() || [' ', '-', '_'].contains(c);
    headings.map(|heading| heading.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-")).collect()
}

#[test]
fn links_and_pictures_lead_somewhere() {
    for page in pages() {
        let (folder, text) = (root().join(&page).parent().unwrap().to_owned(), read(&page));
        for link in text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
            if link.starts_with("https://") {
                continue;
            }
            let (path, anchor) = link.split_once('#').unwrap_or((link, ""));
            assert!(path.is_empty() || folder.join(path).exists(), "{page} links to {path}, which is not there");
            if !anchor.is_empty() {
                let target =
                    if path.is_empty() { text.clone() } else { fs::read_to_string(folder.join(path)).unwrap() };
                assert!(
                    anchors(&target).iter().any(|known| known == anchor),
                    "{page} links to {link}: no such heading"
                );
            }
        }
    }
}

/// The first page is for strangers, who have little time.
#[test]
fn the_readme_is_short() {
    let words = read("README.md").split_whitespace().count();
    assert!(words <= 1100, "README.md has {words} words: move some to a page in docs/");
}

#[test]
fn tables_of_measurements_are_those_of_the_study() {
    let again = "run `cargo run --release --example pages -- strengths none`";
    let rows = tables::rows(root()).unwrap();
    for name in tables::PAGES {
        let text = read(name);
        let filled = twobounce::lab::table::fill(&text, |name, old| tables::table(name, &rows, old)).unwrap();
        assert!(text.contains("<!-- table: "), "{name} has no table");
        assert!(text == filled, "the tables of {name} differ from the rows of the study: {again}");
        assert!(!text.contains("| – |"), "{name} has an error that was not measured: run `twobounce study`");
    }
    for preset in twobounce::settings::PRESETS {
        assert!(tables::ORDER.contains(&preset.name), "examples/pages/tables.rs has no place for {}", preset.name);
    }
}

#[test]
fn the_frontier_is_that_of_its_rows() {
    let rows = frontier_tables::Rows::read(root()).unwrap();
    let page = read(frontier_tables::PAGE);
    let filled = twobounce::lab::table::fill(&page, |name, _| rows.table(name)).unwrap();
    assert!(page.contains("<!-- table: errors gallery -->"), "tables are missing");
    assert!(page == filled, "the tables are stale: run `cargo run --release --example pages -- frontier`");
    for (method, tried) in frontier_tables::METHODS {
        for tried in tried {
            let mut words = tried.split(' ');
            let mut settings = twobounce::settings::Settings::preset(words.next().unwrap()).unwrap();
            frontier_tables::COMMON.into_iter().chain(words).for_each(|change| settings.set(change).unwrap());
            assert_eq!(settings.method.name(), *method, "{tried}");
        }
    }
}

#[test]
fn the_page_of_stability_has_the_committed_rows() {
    let (page, rows) = (read("docs/stability.md"), read("docs/stability-rows.csv"));
    let filled = twobounce::stability::markdown::summary(&rows, &page).unwrap();
    assert!(page.lines().filter(|line| line.starts_with('|')).count() > 40, "tables are missing");
    assert!(page == filled, "docs/stability.md is stale: run `cargo run --release --example pages -- stability`");
}

#[test]
fn tables_say_how_the_indirect_light_was_measured() {
    let head = "scene,name,method,frame_gpu_ms,same_total_rel,same_total_energy,same_diffuse_rel,same_diffuse_energy";
    let (numbers, terms) = ("0.25,0.5,0.125,0.75", "lights.shadows=rays lights.lamps=sampled");
    let rows = format!(
        "{head},equal_terms\ngallery,printed,cones,9,{numbers},\"{terms}\"\ngallery,fast,rays,7,{numbers},\n\
         gallery,corrected,cones,9,{numbers},{terms}\ngallery,lpv-printed,lpv,9,{numbers},lights.lamps=sampled\n\
         gallery,fast bounces=1,rays,1,{numbers},\nroom,accurate,rays,1,{numbers},\n"
    );
    let (_, rows) = twobounce::lab::table::from_csv(&rows).unwrap();
    let today = ["presets", "errors gallery"].map(|name| tables::table(name, &rows, "").unwrap()).concat();
    let of = |start: &str| -> Vec<&str> { today.lines().filter(|line| line.starts_with(start)).collect() };
    let (fast, printed) = (of("| `fast` |"), of("| `printed` |"));
    assert!(today.find(fast[0]) < today.find(printed[0]), "another order than that of the tables");
    assert!(fast[0].starts_with("| `fast` | `rays` | 7 | 0.250 | 0.125 | 9 shared rays"), "{fast:?}");
    assert!(printed[0].starts_with("| `printed` | `cones` | 9 | 0.250 | 0.125 † |"), "{printed:?}");
    assert!(of("| `corrected` |")[0].contains(" † |") && of("| `lpv-printed` |")[0].contains(" ‡ |"), "{today}");
    assert!(today.contains("†: measured with `lights.shadows=rays` and `lights.lamps=sampled`; "), "{today}");
    assert!(today.contains("‡: measured with `lights.lamps=sampled`.*"), "{today}");
    assert_eq!(fast[1], "| `fast` | 0.250 | 0.50 | 0.125 | 0.75 |");
    assert_eq!(printed[1], "| `printed` | 0.250 | 0.50 | 0.125 † | 0.75 |");
    assert!(!today.contains("– |") && !today.contains("accurate"), "{today}");
    assert!(tables::table("weather", &rows, "").is_err());
}

#[test]
fn every_page_is_in_the_index() {
    for folder in ["docs", "docs/notes"] {
        let index = read(&format!("{folder}/README.md"));
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap();
            if name.ends_with(".md") && name != "README.md" {
                assert!(index.contains(&format!("]({name})")), "{folder}/README.md does not list {name}");
            }
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

/// Hosts rely on few modules: the rustdoc hides every module that may change.
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

/// Paths from the project's root in a text: known folders, and files with the ending of a source.
fn paths(text: &str) -> impl Iterator<Item = &str> {
    const FOLDERS: [&str; 8] = ["src/", "glsl/", "tests/", "docs/", "examples/", "scripts/", "assets/", "python/"];
    const ENDINGS: [&str; 16] = [
        "rs", "glsl", "comp", "frag", "vert", "geom", "md", "toml", "sh", "py", "csv", "png", "glb", "svg", "html",
        "js",
    ];
    let words = text.split(|c: char| !c.is_ascii_alphanumeric() && !"/._-".contains(c));
    let words = words.map(|word| word.trim_end_matches(['.', '-']).trim_start_matches("../"));
    let is_file = |word: &str| word.rsplit_once('.').is_some_and(|(_, ending)| ENDINGS.contains(&ending));
    words.filter(move |word| FOLDERS.iter().any(|folder| word.starts_with(folder)) && is_file(word))
}

/// The comments of a source, or all of a page.
fn prose(name: &str, text: &str) -> String {
    let ending = name.rsplit('.').next().unwrap();
    let mark = match ending {
        "md" => return text.to_owned(),
        "rs" | "glsl" | "comp" | "frag" | "vert" | "geom" => "//",
        _ => "#",
    };
    text.lines().filter_map(|line| line.split_once(mark)).map(|(_, comment)| format!("{comment}\n")).collect()
}

#[test]
fn paths_in_comments_and_pages_exist() {
    let text = "See `src/gone.rs`, docs/README.md and assets/*.glb.";
    assert_eq!(paths(text).collect::<Vec<_>>(), ["src/gone.rs", "docs/README.md"]);
    assert_eq!(prose("a.rs", "f(\"src/a.rs\"); // as src/lib.rs\n"), " as src/lib.rs\n");
    let mut found = vec![];
    for folder in ["src", "glsl", "tests", "examples", "scripts"] {
        files(&root().join(folder), &mut found);
    }
    let names = found.iter().map(|path| path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned());
    let sources = [".rs", ".glsl", ".comp", ".frag", ".vert", ".geom", ".toml", ".sh", ".py"];
    let names = names.filter(|name| sources.iter().any(|ending| name.ends_with(ending)));
    let mut seen = 0;
    let mut gone = vec![];
    for name in names.chain(pages()).chain(["Makefile", "Cargo.toml", "build.rs"].map(str::to_owned)) {
        let text = prose(&name, &read(&name));
        for path in paths(&text) {
            seen += 1;
            if !root().join(path).exists() && !root().join(&name).parent().unwrap().join(path).exists() {
                gone.push(format!("{name} names {path}, which is not there"));
            }
        }
    }
    assert!(seen > 300, "{seen} paths");
    assert!(gone.is_empty(), "{}", gone.join("\n"));
}
