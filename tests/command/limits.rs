//! Limits of the operating system: each ends the command with a sentence and exit code 2, or the work goes on with
//! less; there is no crash, hang or partial file.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::CommandExt;
use std::process::{Command, Output};

use crate::cli_common::{Folder, names, root, text};

/// A user without other processes: a limit on threads counts all of a user's, and does not apply to root.
const USER: u32 = 64_321;

const RENDER: [&str; 9] = [
    "render",
    "box.glb",
    "-q",
    "--size=24x16",
    "--preset=fast",
    "--set=voxels=16",
    "--default-light=off",
    "-o",
    "a.exr",
];
const REFERENCE: [&str; 8] =
    ["reference", "box.glb", "-q", "--size=24x16", "--spp=2", "--default-light=off", "-o", "a.exr"];

/// Runs the program after a line of the shell, for two minutes at most.
fn after(line: &str, folder: &Folder, args: &[&str]) -> Output {
    command_after(line, folder, args).output().unwrap()
}

fn command_after(line: &str, folder: &Folder, args: &[&str]) -> Command {
    let mut command = Command::new("timeout");
    let line = format!("{line}; exec \"$@\"");
    command.args(["-k", "1", "120", "bash", "-c", &line, "bash", env!("CARGO_BIN_EXE_twobounce")]).args(args);
    let cache = folder.path("cache");
    command.current_dir(folder.path("")).env("TWOBOUNCE_CACHE", &cache).env("XDG_CACHE_HOME", cache);
    command
}

/// The message of a refused run, `None` where it worked. Fails for everything else.
fn refusal(output: &Output, what: &str) -> Option<String> {
    let said = text(&output.stderr);
    match output.status.code() {
        Some(0) => None,
        Some(2) if said.trim_end().lines().count() == 1 && said.starts_with("twobounce: ") => Some(said),
        code => panic!("{what}: exit code {code:?}: {said}"),
    }
}

#[test]
fn few_threads_make_the_same_image_and_none_are_refused() {
    let folder = Folder::with_box("box.glb");
    // The other user may not be able to reach the folder or the program.
    let program = folder.path("twobounce");
    fs::copy(env!("CARGO_BIN_EXE_twobounce"), &program).unwrap();
    fs::create_dir(folder.path("cache")).unwrap();
    for path in ["", "cache"] {
        fs::set_permissions(folder.path(path), fs::Permissions::from_mode(0o777)).unwrap();
    }
    // SAFETY: the function has no preconditions.
    let is_root = unsafe { libc::geteuid() } == 0;
    for args in [&RENDER[..], &REFERENCE, &["compare", "whole.exr", "whole.exr"]] {
        let mut whole = None;
        let mut refused = vec![];
        for processes in [4096, 1, 2, 3, 4, 5, 6, 8, 12] {
            let mut command =
                command_after(&format!("ulimit -u {processes}; shift; set -- ./twobounce \"$@\""), &folder, args);
            if is_root {
                command.uid(USER);
            }
            let output = command.output().unwrap();
            // The shell itself may not find enough memory.
            if output.status.code().is_some_and(|code| code > 2) && text(&output.stderr).contains("fork") {
                continue;
            }
            match refusal(&output, &format!("{args:?} with {processes} processes")) {
                Some(said) => {
                    assert!(said.contains("ulimit -u"), "{said}");
                    refused.push(processes);
                }
                None if args[0] == "compare" => {}
                None => {
                    let image = fs::read(folder.path("a.exr")).unwrap();
                    fs::rename(folder.path("a.exr"), folder.path("whole.exr")).unwrap();
                    assert!(
                        *whole.get_or_insert_with(|| image.clone()) == image,
                        "{args:?} with {processes} processes"
                    );
                }
            }
            assert!(!folder.path("a.exr").exists());
        }
        assert!(refused.contains(&2) && (!is_root || !refused.contains(&4096)), "{args:?}: {refused:?} were refused");
        assert!(!is_root || args[0] == "render" || !refused.contains(&6), "{args:?} goes on with fewer: {refused:?}");
    }
}

#[test]
fn too_little_address_space_is_said_before_a_driver_ends_the_process() {
    let folder = Folder::with_box("box.glb");
    let chart = [
        "chart",
        "box.glb",
        "-o",
        "chart",
        "--presets=fast",
        "--size=16x16",
        "--set=voxels=16",
        "--reference-noise=50",
    ];
    for args in [&RENDER[..], &["info"], &chart, &REFERENCE] {
        for limit in ["-v 100000", "-v 300000", "-v 450000", "-v 800000", "-v 1500000", "-d 400000"] {
            let refused = refusal(&after(&format!("ulimit {limit}"), &folder, args), &format!("{args:?} with {limit}"));
            let takes_a_driver = args[0] != "reference";
            assert_eq!(refused.is_some(), takes_a_driver, "{args:?} with {limit}: {refused:?}");
            assert!(refused.is_none_or(|said| said.contains("ulimit -v")), "{args:?} with {limit}");
        }
        let enough = after("ulimit -v 2500000", &folder, args);
        assert_eq!(refusal(&enough, &format!("{args:?} with enough")), None);
    }
}

#[test]
fn a_file_that_may_not_grow_is_said_and_leaves_nothing() {
    let folder = Folder::with_box("box.glb");
    folder.done(&RENDER);
    let image = fs::read(folder.path("a.exr")).unwrap();
    let before = names(&folder.path(""));
    let standard = [&RENDER[..RENDER.len() - 1], &["-", "--aov=depth"]].concat();
    let json = [&RENDER[..], &["--json", "report.json"]].concat();
    let cases: [(&[&str], &str); 5] = [
        (&RENDER, "a.exr"),
        (&REFERENCE, "a.exr"),
        (&json, "a.exr"),
        (&standard, "standard output"),
        (&["make-assets", "."], "glb"),
    ];
    for (args, name) in cases {
        for kib in [0, 1] {
            let output = after(&format!("ulimit -f {kib}; exec >out"), &folder, args);
            let said = text(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
            let last = said.trim_end().lines().last().unwrap();
            assert!(last.contains(name) && last.contains("ulimit -f"), "{args:?}: {said}");
            fs::remove_file(folder.path("out")).unwrap();
        }
        let kept: Vec<String> = names(&folder.path("")).into_iter().filter(|name| name != "cache").collect();
        assert_eq!(kept, before.iter().filter(|name| *name != "cache").cloned().collect::<Vec<_>>(), "{args:?}");
        assert!(fs::read(folder.path("a.exr")).unwrap() == image, "{args:?} changed what was there");
    }
}

#[test]
fn too_small_a_stack_is_said() {
    let folder = Folder::with_box("box.glb");
    for args in [&RENDER[..], &REFERENCE, &["--help"]] {
        for kib in [64, 512] {
            let said = refusal(&after(&format!("ulimit -s {kib}"), &folder, args), &format!("{args:?} with {kib}"));
            assert!(said.is_some_and(|said| said.contains("ulimit -s")), "{args:?} with {kib}");
        }
    }
    assert_eq!(refusal(&after("ulimit -s 1024", &folder, &RENDER), "1024 KiB"), None);
}

#[test]
fn nothing_is_made_for_a_standard_output_that_is_closed() {
    let folder = Folder::with_box("box.glb");
    folder.done(&RENDER);
    let to = |args: &[&'static str]| [&args[..args.len() - 1], &["-"]].concat();
    let with = |args: &[&'static str], flag| [args, &[flag, "-"]].concat();
    let compare = ["compare", "a.exr", "a.exr", "--json", "-"].to_vec();
    for args in [to(&RENDER), to(&REFERENCE), with(&RENDER, "--json"), with(&RENDER, "--trace"), compare] {
        for line in ["exec >&-", "exec 1</dev/null"] {
            let said = refusal(&after(line, &folder, &args), &format!("{args:?} after {line}"));
            assert!(said.is_some_and(|said| said.contains("standard output is closed")), "{args:?} after {line}");
        }
        assert_eq!(refusal(&after("exec >/dev/null", &folder, &args), &format!("{args:?}")), None);
    }
    for args in [&["settings"][..], &["info"], &["compare", "a.exr", "a.exr"], &["completions", "bash"], &["man"]] {
        let said = refusal(&after("exec >&-", &folder, args), &format!("{args:?}"));
        assert!(said.is_some_and(|said| said.contains("standard output is closed")), "{args:?}");
    }
    // Other messages on standard output may be lost.
    assert_eq!(refusal(&after("exec >&-", &folder, &RENDER), "an image in a file"), None);
}

/// A limit on time acts like a signal, and leaves no partial image.
#[test]
fn a_process_whose_time_is_over_ends_tidily() {
    let folder = Folder::empty();
    let scene = root().join("assets/gallery.glb").display().to_string();
    let args = ["reference", &scene, "-o", "a.exr", "--size", "2048x2048", "--spp", "10000"];
    let output = after("ulimit -St 2", &folder, &args);
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(128 + libc::SIGXCPU), "{said}");
    assert!(said.ends_with("twobounce: interrupted\n"), "{said}");
    assert_eq!(names(&folder.path("")), ["cache"]);
}
