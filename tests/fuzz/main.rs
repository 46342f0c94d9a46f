//! Files with random damage: no reader may panic, hang, take much memory or print anything but one sentence.
//! `docs/notes/fuzzing.md` says how to run this for longer and how to repeat a fault.
#![cfg(target_os = "linux")]

mod bytes;
mod coverage;
mod follow;
mod formats;
mod guard;
mod json;
mod random;
mod shrink;
mod targets;
#[path = "../common/valid.rs"]
mod valid;
mod worker;

use std::env;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use guard::BECAUSE;

/// Number of workers, and seconds of each: two minutes of processor time.
const WORKERS: u64 = 2;
const SECONDS: u64 = 60;

/// Environment variables with a worker's task; a person may set them too.
const FOLDER: &str = "TWOBOUNCE_FUZZ_FOLDER";
const FILE: &str = "TWOBOUNCE_FUZZ_FILE";
const SEED_VARIABLE: &str = "TWOBOUNCE_FUZZ_SEED";
const SECONDS_VARIABLE: &str = "TWOBOUNCE_FUZZ_SECONDS";
const TARGETS_VARIABLE: &str = "TWOBOUNCE_FUZZ_TARGETS";
const WORKERS_VARIABLE: &str = "TWOBOUNCE_FUZZ_WORKERS";

fn number(variable: &str, default: u64) -> u64 {
    env::var(variable)
        .map_or(default, |text| text.parse().unwrap_or_else(|_| panic!("{variable} takes a whole number")))
}

/// Valid files, and damaged ones that were faults once.
pub fn corpus() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folders = ["tests/fuzz/corpus", "tests/fuzz/found", "tests/values/gltf/compressed", "tests/values/maps"];
    let entries = folders.iter().flat_map(|folder| fs::read_dir(root.join(folder)).expect("the folder is there"));
    let paths = entries.map(|entry| entry.expect("the folder can be read").path());
    // Larger ones take longer and find no more.
    let small = |path: &PathBuf| path.metadata().is_ok_and(|about| about.len() < 20_000);
    let no_list = |path: &PathBuf| !path.ends_with("streams.json");
    let mut paths: Vec<PathBuf> = paths.filter(|p| targets::index_of(p).is_some() && small(p) && no_list(p)).collect();
    paths.sort();
    paths
}

/// A folder in memory where there is one, because files are written thousands of times a second.
fn folder() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir()).expect("a folder can be made")
}

/// A process of this program that works in `folder`.
fn worker_in(folder: &Path) -> Command {
    let mut command = Command::new(env::current_exe().expect("the program has a file"));
    command.args(["--exact", "worker", "--ignored", "--nocapture", "--test-threads", "1"]);
    // One thread, so that its time and its memory are those of its input.
    command.env(FOLDER, folder).env("RAYON_NUM_THREADS", "1").env_remove(FILE);
    command.stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Waits for a worker: `None` when it ended well, else its fault.
fn fault_of(child: Child) -> Option<String> {
    let output = child.wait_with_output().expect("a worker can be waited for");
    if output.status.success() {
        return None;
    }
    let said = String::from_utf8_lossy(&output.stderr);
    let because = said.lines().find_map(|line| Some(line.split_once(BECAUSE)?.1.to_owned()));
    Some(
        because.unwrap_or_else(|| format!("ended with {}: {}", output.status, said.lines().next().unwrap_or_default())),
    )
}

/// Runs one file in a separate process and returns its fault.
fn fault_of_file(folder: &Path, file: &Path) -> Option<String> {
    fault_of(worker_in(folder).env(FILE, file).spawn().expect("a worker can be started"))
}

/// Not a test: the entry point of the processes that the tests start.
#[test]
#[ignore = "the tests below start it"]
fn worker() {
    let Ok(folder) = env::var(FOLDER).map(PathBuf::from) else { return };
    match env::var(FILE) {
        Ok(file) => worker::run_file(&folder, Path::new(&file)),
        Err(_) => {
            let (seed, seconds) = (number(SEED_VARIABLE, 1), number(SECONDS_VARIABLE, 1));
            let only = env::var(TARGETS_VARIABLE).unwrap_or_default();
            worker::work(&worker::Task { folder, seed, seconds, only });
        }
    }
}

/// Every undamaged file, or the one that `TWOBOUNCE_FUZZ_FILE` names.
#[test]
fn files_of_the_corpus_are_survived() {
    let folder = folder();
    let files = env::var(FILE).map_or_else(|_| corpus(), |file| vec![file.into()]);
    let fault = |file: &PathBuf| Some(format!("{} {}", file.display(), fault_of_file(folder.path(), file)?));
    let faults: Vec<String> = files.iter().filter_map(fault).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// A minute on two processors, or the time in `TWOBOUNCE_FUZZ_SECONDS`.
#[test]
fn damaged_files_are_survived() {
    let folder = folder();
    let (first, seconds) = (number(SEED_VARIABLE, 1), number(SECONDS_VARIABLE, SECONDS));
    if env::var(FILE).is_ok() {
        return; // one file is repeated
    }
    let workers = (0..number(WORKERS_VARIABLE, WORKERS)).map(|i| {
        let own = folder.path().join(i.to_string());
        fs::create_dir(&own).unwrap();
        let mut command = worker_in(&own);
        command.env(SEED_VARIABLE, (first + i).to_string()).env(SECONDS_VARIABLE, seconds.to_string());
        (first + i, own, command.spawn().expect("a worker can be started"))
    });
    let workers: Vec<_> = workers.collect();
    let (mut reports, mut faults) = (Vec::new(), Vec::new());
    for (seed, own, child) in workers {
        match fault_of(child) {
            None => reports.push(fs::read_to_string(own.join("report")).expect("a worker's report")),
            Some(fault) => faults.push(shrink::kept(&own, seed, &fault)),
        }
    }
    print!("{}", worker::summary(&reports));
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
