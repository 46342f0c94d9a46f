//! A process that damages files and observes the readers. It ends before its time only by a fault.

use std::collections::{BTreeMap, HashSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::coverage::Coverage;
use crate::guard::{self, BECAUSE, Cost, FAULT};
use crate::random::Random;
use crate::targets::{self, Input, TARGETS};
use crate::{bytes, formats};

/// Inputs that are kept for each target because something new happened; beyond these, new ones replace old ones.
const MOST_KEPT: usize = 1500;
/// Largest number of characters of a refusal, with the file's name.
const MOST_SENTENCE: usize = 700;

const REPORT_EVERY: Duration = Duration::from_secs(60);

/// Task of a worker.
pub struct Task {
    /// The folder for its files, which stay after a fault.
    pub folder: PathBuf,
    pub seed: u64,
    pub seconds: u64,
    /// Names of targets, separated by commas; empty for all.
    pub only: String,
}

/// Sums over the inputs of one target.
#[derive(Default)]
struct Tally {
    inputs: u64,
    refused: u64,
    new: u64,
    most: Cost,
}

/// A valid file to damage.
struct Seed {
    ending: String,
    bytes: Vec<u8>,
}

/// Damages files until the time is over, and writes the tallies into the folder as `report`.
pub fn work(task: &Task) {
    guard::start();
    let mut random = Random(task.seed);
    let mut kept: Vec<Vec<Seed>> = TARGETS.iter().map(|_| Vec::new()).collect();
    for path in crate::corpus() {
        let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        let bytes = fs::read(&path).expect("the corpus can be read");
        kept[targets::index_of(&path).expect("a target reads it")].push(Seed { ending, bytes });
    }
    let given: Vec<usize> = kept.iter().map(Vec::len).collect();
    let chosen = |t: &usize| task.only.is_empty() || task.only.split(',').any(|name| name == TARGETS[*t].name);
    let shares: Vec<usize> = (0..TARGETS.len()).filter(chosen).flat_map(|t| vec![t; TARGETS[t].share]).collect();
    assert!(!shares.is_empty(), "there is no target {}", task.only);
    let mut tallies: Vec<Tally> = TARGETS.iter().map(|_| Tally::default()).collect();
    let (mut seen, mut coverage) = (HashSet::new(), Coverage::default());
    let (start, mut reported) = (Instant::now(), Instant::now());
    while start.elapsed() < Duration::from_secs(task.seconds) {
        let target = shares[random.below(shares.len())];
        let seeds = &kept[target];
        // Every other input starts from an undamaged file.
        let among = if random.below(2) == 0 { given[target] } else { seeds.len() };
        let [one, other] = [random.below(among), random.below(seeds.len())].map(|at| &seeds[at]);
        let (ending, damaged) =
            (one.ending.clone(), formats::change(&mut random, &one.ending, &one.bytes, &other.bytes));
        coverage.clear();
        let (shape, cost) = run(&task.folder, target, &ending, &damaged);
        let new = coverage.is_new() | seen.insert((target, plain(&shape)));
        let tally = &mut tallies[target];
        tally.inputs += 1;
        tally.refused += u64::from(shape.starts_with(REFUSED));
        tally.new += u64::from(new);
        tally.most.seconds = tally.most.seconds.max(cost.seconds);
        tally.most.bytes = tally.most.bytes.max(cost.bytes);
        if reported.elapsed() > REPORT_EVERY {
            // The caller may end a long run.
            write_report(&task.folder, &tallies);
            reported = Instant::now();
        }
        if new && damaged.len() <= bytes::MOST_BYTES {
            let (seed, seeds) = (Seed { ending, bytes: damaged }, &mut kept[target]);
            if seeds.len() < MOST_KEPT {
                seeds.push(seed);
            } else {
                let at = given[target] + random.below(MOST_KEPT - given[target]);
                seeds[at] = seed;
            }
        }
    }
    write_report(&task.folder, &tallies);
}

/// A line for each target.
fn write_report(folder: &Path, tallies: &[Tally]) {
    let line = |(target, tally): (&targets::FuzzTarget, &Tally)| {
        let (name, Tally { inputs, refused, new, most }) = (target.name, tally);
        let (milliseconds, mib) = (1e3 * most.seconds, most.bytes >> 20);
        format!("{name} {inputs} {refused} {new} {milliseconds:.0} {mib}\n")
    };
    let report: String = TARGETS.iter().zip(tallies).map(line).collect();
    fs::write(folder.join("report"), report).expect("the folder can be written");
}

/// Runs one file with the ending of its own name.
pub fn run_file(folder: &Path, path: &Path) {
    guard::start();
    let target = targets::index_of(path).unwrap_or_else(|| fault("has an ending that no target reads"));
    let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
    let bytes = fs::read(path).unwrap_or_else(|e| fault(&format!("cannot be read: {e}")));
    let (outcome, Cost { seconds, bytes }) = run(folder, target, &ending, &bytes);
    eprintln!("{}: {outcome} ({seconds:.3} s, {} KiB)", path.display(), bytes >> 10);
}

/// The start of the result of [`run`] for a refused file.
const REFUSED: &str = "refused: ";

/// Runs an input; a fault ends the process. Returns the outcome in words.
fn run(folder: &Path, target: usize, ending: &str, bytes: &[u8]) -> (String, Cost) {
    let (target, path) = (&TARGETS[target], folder.join(format!("input.{ending}")));
    if let Err(e) = fs::write(&path, bytes) {
        fault(&format!("{} cannot be written: {e}", path.display()));
    }
    let choice = blake3::hash(bytes).as_bytes()[..8].try_into().map_or(0, u64::from_le_bytes);
    let input = Input { folder, path: &path, bytes, choice };
    let (outcome, cost) = guard::watched(|| (target.run)(&input));
    let outcome = outcome.unwrap_or_else(|panic| fault(&panic));
    if let Err(sentence) = &outcome
        && let Some(wrong) = wrong_sentence(sentence, target.names_file.then_some(folder))
    {
        fault(&format!("was refused with {wrong}: {sentence:?}"));
    }
    // A fault leaves its input behind; otherwise the file is removed.
    let _ = fs::remove_file(&path);
    (outcome.unwrap_or_else(|sentence| format!("{REFUSED}{sentence}")), cost)
}

/// A fault in the wording of a refusal or a note.
pub fn wrong_sentence(sentence: &str, named: Option<&Path>) -> Option<&'static str> {
    // The format in which Rust prints values for programmers.
    let debug = ["Some(", "None,", "Ok(", "Err(", "Error {", "kind:", "Custom {", "panicked"];
    let starts = named.is_none_or(|folder| sentence.starts_with(&*folder.to_string_lossy()));
    [
        (sentence.chars().any(char::is_control), "control characters"),
        (sentence.trim() != sentence || sentence.is_empty(), "space around it"),
        (sentence.chars().count() > MOST_SENTENCE, "too many words"),
        (debug.iter().any(|word| sentence.contains(word)), "words for programmers"),
        (!starts, "no file's name"),
    ]
    .into_iter()
    .find_map(|(is, what)| is.then_some(what))
}

fn fault(why: &str) -> ! {
    eprintln!("{BECAUSE}{}", why.replace('\n', " "));
    std::process::exit(FAULT)
}

/// The text without its numbers and quoted names, so that an equal sentence about another part is not new.
fn plain(text: &str) -> String {
    let mut out = String::new();
    let mut quoted = false;
    for c in text.chars() {
        quoted ^= c == '"';
        if !quoted && !c.is_ascii_digit() {
            out.push(c);
        }
    }
    out
}

/// Sums the reports of workers, a line for each target.
pub fn summary(reports: &[String]) -> String {
    let mut sums: BTreeMap<&str, [u64; 5]> = BTreeMap::new();
    for line in reports.iter().flat_map(|report| report.lines()) {
        let Some((name, numbers)) = line.split_once(' ') else { continue };
        let sum = sums.entry(name).or_default();
        for (i, number) in numbers.split(' ').filter_map(|n| n.parse::<u64>().ok()).enumerate().take(5) {
            sum[i] = if i < 3 { sum[i] + number } else { sum[i].max(number) };
        }
    }
    let line = |(name, [inputs, refused, new, ms, mib]): (&&str, &[u64; 5])| {
        format!("{name:10} {inputs:>9} inputs, {refused:>9} refused, {new:>6} new, slowest {ms} ms, most {mib} MiB\n")
    };
    sums.iter().map(line).collect()
}
