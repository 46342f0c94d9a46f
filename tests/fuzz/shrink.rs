//! Shrinks a file with a fault while it keeps the fault.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::fault_of_file;

/// The largest number of attempts; each is a process.
const MOST_TIME: Duration = Duration::from_secs(60);

/// Stores the input that ended a worker under `target/fuzz`, shrunk, and prints how to repeat it.
pub fn kept(folder: &Path, seed: u64, fault: &str) -> String {
    let Some(input) = last_input(folder) else { return format!("seed {seed} without an input {fault}") };
    let bytes = fs::read(&input).expect("the input is there");
    let ending = input.extension().unwrap_or_default().to_string_lossy();
    let out = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/fuzz");
    fs::create_dir_all(&out).expect("target can be written");
    let name = &blake3::hash(&bytes).to_hex()[..12];
    let path = out.join(format!("{name}.{ending}"));
    fs::write(out.join(format!("{name}-whole.{ending}")), &bytes).expect("target can be written");
    fs::write(&path, shrunk(folder, &input, bytes, fault)).expect("target can be written");
    let path = path.display();
    format!(
        "seed {seed}: {path} {fault}\n  once more: TWOBOUNCE_FUZZ_FILE={path} cargo test --release --locked --test fuzz"
    )
}

/// A worker removes an input without a fault.
fn last_input(folder: &Path) -> Option<PathBuf> {
    let files = fs::read_dir(folder).ok()?.flatten().map(|entry| entry.path());
    files.into_iter().find(|path| path.file_stem().is_some_and(|stem| stem == "input"))
}

/// Removes ever smaller parts.
fn shrunk(folder: &Path, input: &Path, mut bytes: Vec<u8>, fault: &str) -> Vec<u8> {
    let candidate = folder.join("candidate").with_extension(input.extension().unwrap_or_default());
    // The position of the panic without its message, which may contain numbers.
    let kind = |fault: &str| fault.split_once(": ").map_or(fault, |(place, _)| place).to_owned();
    let same = |bytes: &[u8]| {
        fs::write(&candidate, bytes).expect("the folder can be written");
        fault_of_file(folder, &candidate).is_some_and(|other| kind(&other) == kind(fault))
    };
    let start = Instant::now();
    let mut size = bytes.len().next_power_of_two() / 2;
    while size > 0 {
        let mut at = 0;
        while at < bytes.len() && start.elapsed() < MOST_TIME {
            let mut less = bytes.clone();
            less.drain(at..(at + size).min(bytes.len()));
            if same(&less) {
                bytes = less;
            } else {
                at += size;
            }
        }
        size /= 2;
    }
    bytes
}
