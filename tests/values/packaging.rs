//! Packages: that of crates.io builds from its own files, and the Debian package has its parts and depends on all
//! libraries that the program opens.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn read(name: &str) -> String {
    fs::read_to_string(root().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

/// The files of the package of crates.io.
fn packaged() -> BTreeSet<String> {
    let list = ["package", "--list", "--allow-dirty", "--locked", "--offline"];
    let listed = Command::new(env!("CARGO")).current_dir(root()).args(list).output().expect("cargo");
    assert!(listed.status.success(), "{}", String::from_utf8_lossy(&listed.stderr));
    let text = String::from_utf8(listed.stdout).expect("text");
    text.lines().map(|line| line.replace('\\', "/")).collect()
}

/// A path without `..` in it.
fn plain(path: &Path) -> String {
    let mut parts: Vec<&str> = vec![];
    for part in path.components() {
        match part {
            Component::ParentDir => drop(parts.pop()),
            Component::Normal(name) => parts.push(name.to_str().expect("UTF-8")),
            _ => {}
        }
    }
    parts.join("/")
}

/// The files that a source reads at compile time, without those of its unit tests.
fn included(source: &str) -> Vec<String> {
    let text = read(source);
    let text = text.split("#[cfg(test)]").next().expect("a part");
    let folder = Path::new(source).parent().expect("a folder");
    let starts = ["include_str!(\"", "include_bytes!(\"", "#[path = \""];
    let names = starts.iter().flat_map(|start| text.split(start).skip(1).map(|rest| rest.split('"').next().unwrap()));
    names.map(|name| plain(&folder.join(name))).collect()
}

#[test]
fn the_package_holds_what_its_sources_read_and_is_small() {
    let packaged = packaged();
    let sources = packaged.iter().filter(|name| name.ends_with(".rs") && !name.starts_with("examples/"));
    let included: Vec<String> = sources.flat_map(|source| included(source)).collect();
    assert!(included.len() > 20 && included.contains(&"docs/notes/ledger.md".into()), "{included:?}");
    let tests: Vec<&String> = included.iter().filter(|name| name.starts_with("tests/")).collect();
    assert!(tests.len() <= 1, "only unit tests may read {tests:?}");
    for name in included.iter().filter(|name| !tests.contains(name)) {
        assert!(packaged.contains(name), "a source reads {name}, which `include` in Cargo.toml leaves out");
    }
    let made = [".cargo_vcs_info.json", "Cargo.toml.orig"];
    let files = packaged.iter().filter(|name| !made.contains(&name.as_str()));
    let bytes: u64 = files.map(|name| fs::metadata(root().join(name)).expect(name).len()).sum();
    assert!(bytes < 4 << 20, "the package has {bytes} bytes before it is compressed");
    let of_no_use = |name: &&String| ["tests/", "scripts/", "python/"].iter().any(|folder| name.starts_with(folder));
    assert_eq!(packaged.iter().find(of_no_use), None);
}

/// The table `package.metadata.deb`.
fn deb() -> toml::Table {
    let manifest: toml::Table = read("Cargo.toml").parse().expect("TOML");
    manifest["package"]["metadata"]["deb"].as_table().expect("a table").clone()
}

/// Whether `path`, whose last part may contain one `*`, names a file.
fn names_a_file(path: &str) -> bool {
    let path = PathBuf::from(path);
    let name = path.file_name().and_then(|name| name.to_str()).expect("a name");
    let Some((start, end)) = name.split_once('*') else { return root().join(&path).is_file() };
    let folder = fs::read_dir(root().join(path.parent().expect("a folder"))).expect("a folder");
    let mut names = folder.map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"));
    names.any(|name| name.starts_with(start) && name.ends_with(end))
}

#[test]
fn the_debian_package_has_every_part() {
    let (deb, script) = (deb(), read("scripts/deb.sh"));
    let assets = deb["assets"].as_array().expect("a list");
    let from: Vec<&str> = assets.iter().map(|asset| asset[0].as_str().expect("a path")).collect();
    for part in ["target/release/twobounce", "out/deb/man/*.1", "assets/*.glb", "LICENSE-APACHE"] {
        assert!(from.contains(&part), "{part} is not in the package");
    }
    for path in from {
        let made = path.starts_with("target/") || path.starts_with("out/deb/");
        assert!(made || names_a_file(path), "there is no {path}");
        // The script creates the files of its folder.
        if let Some(name) = path.strip_prefix("out/deb/twobounce.") {
            let shells = script.lines().find_map(|line| line.strip_prefix("for shell in ")).expect("a loop");
            assert!(shells.contains(name), "scripts/deb.sh does not make {path}");
        }
    }
}

/// The libraries that the window opens by name are recommended packages, because no linker knows of them.
#[test]
fn the_debian_package_names_what_is_opened() {
    let deb = deb();
    let words = |key: &str| deb[key].as_str().expect("text").to_owned();
    assert!(words("depends").contains("$auto") && words("depends").contains("libvulkan1"));
    let recommended = words("recommends");
    assert!(recommended.contains("mesa-vulkan-drivers | vulkan-icd"), "{recommended}");
    let setup = read("scripts/setup.sh");
    let packages = setup.lines().filter_map(|line| line.trim().strip_prefix('"')?.split_once(": "));
    let window: Vec<&str> = packages
        .filter(|(_, why)| ["opens windows\"", "hears keys and mouse\"", "knows keys\""].contains(why))
        .map(|p| p.0)
        .collect();
    assert_eq!(window.len(), 4, "{window:?}");
    for package in window.into_iter().chain(["libx11-6", "libxkbcommon0", "libwayland-client0"]) {
        assert!(recommended.split(", ").any(|name| name == package), "{package} is not recommended: {recommended}");
    }
}

/// No workflow continues after a test that failed or could not run, and the one of Linux runs the commands of the
/// continuous integration.
#[test]
fn workflows_let_no_failure_pass() {
    let mut seen = 0;
    for entry in fs::read_dir(root().join(".github/workflows")).expect("a folder") {
        let name = entry.expect("an entry").file_name().into_string().expect("UTF-8");
        let text = read(&format!(".github/workflows/{name}"));
        for way_out in ["continue-on-error", "|| true", "--skip", "if: failure", "--no-fail-fast"] {
            assert!(!text.contains(way_out), "{name} has {way_out}");
        }
        let tests = if name == "ci.yml" {
            "- run: .ci/run"
        } else {
            "- run: cargo test --release --locked --lib --test values"
        };
        assert!(text.contains(tests) && text.contains("if-no-files-found: error"), "{name}");
        seen += 1;
    }
    assert_eq!(seen, 3, "workflows for Linux, Windows and macOS");
}
