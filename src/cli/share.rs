//! Work that is shared by many machines: the part of this one, its name, and the commands of all parts.

use std::ops::Range;
use std::path::Path;

use clap::Args;
use twobounce::Result;

use super::args::memory_size;
use super::{interrupt, out, words};
use crate::say;

/// A part of the work: the rows whose address has this remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// The number of the part, from 0.
    index: u64,
    count: u64,
}

/// The rows of a folder that this call measures, and the rows that are valid.
#[derive(Args, Clone, Debug, Default)]
pub struct RowArgs {
    /// The maximum device memory; rows that need more are marked as such
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    /// Accept rows that another build of the program measured; by default they are measured again
    #[arg(long)]
    pub any_build: bool,
    /// Only measure part I of N of the rows, selected by a hash; `twobounce merge` joins the folders
    #[arg(long, value_name = "I/N", value_parser = shard)]
    pub shard: Option<Shard>,
    /// The name of this machine in rows; only times of one machine are compared [default: the host's name]
    #[arg(long, value_name = "NAME", value_parser = machine)]
    pub machine: Option<String>,
}

impl RowArgs {
    /// Whether the row with this address belongs to this part.
    pub fn has(&self, address: &str) -> bool {
        self.shard.is_none_or(|shard| shard.has(address))
    }

    /// The part as text; empty for the whole.
    pub fn in_words(&self) -> String {
        self.shard.map_or(String::new(), |shard| format!("part {} of {}", shard.index + 1, shard.count))
    }

    /// Prints how a run ended with `there` of `planned` rows. `spent` says whether its budget ended it.
    ///
    /// # Errors
    /// [`Error::Interrupted`](twobounce::Error::Interrupted) if Ctrl-C ended it.
    pub fn say_end(&self, there: usize, planned: usize, spent: bool) -> Result<()> {
        if planned == 0 {
            say!("no row is in {}", self.in_words());
        }
        if spent {
            say!("the budget is spent after {there} of {planned} rows; the same command continues from there");
        }
        interrupt::check().inspect_err(|_| {
            out::warn(&format!("{there} of {planned} rows are kept; the same command continues from there"));
        })
    }

    pub fn machine(&self) -> String {
        self.machine.clone().unwrap_or_else(|| gethostname::gethostname().to_string_lossy().into_owned())
    }
}

impl Shard {
    fn has(self, address: &str) -> bool {
        let start = address.get(..16).and_then(|digits| u64::from_str_radix(digits, 16).ok());
        start.unwrap_or_default() % self.count == self.index
    }
}

fn shard(text: &str) -> std::result::Result<Shard, &'static str> {
    let read = || {
        let (index, count) = text.split_once('/')?;
        let (index, count) = (index.parse::<u64>().ok()?, count.parse::<u64>().ok()?);
        (1..=count).contains(&index).then_some(Shard { index: index - 1, count })
    };
    read().ok_or("write which part of how many, from 1 on, such as 1/4")
}

fn machine(text: &str) -> std::result::Result<String, &'static str> {
    let is_name = !text.trim().is_empty() && text.len() <= 64 && !text.chars().any(char::is_control);
    is_name.then(|| text.to_owned()).ok_or("write a name of at most 64 characters")
}

/// Prints the commands of the shards of a folder of rows. `outputs` are the flags that name the folder.
pub fn list_shards(count: u32, outputs: &[&str], folder: &Path) {
    let shards: Vec<String> = (1..=count).map(|i| format!("{i}/{count}")).collect();
    Parts { flag: "--shard", outputs, ending: "" }.list(&shards, Some(folder));
}

/// `count` items in `parts` successive ranges, none of them empty.
pub fn chunks(count: u32, parts: u32) -> impl Iterator<Item = Range<u32>> {
    let (count, parts) = (u64::from(count), u64::from(parts.min(count)));
    let cut = move |i: u64| (i * count / parts) as u32;
    (0..parts).map(move |i| cut(i)..cut(i + 1))
}

/// The differences between the parts of some work.
pub struct Parts<'a> {
    /// The flag that selects the part.
    pub flag: &'a str,
    /// The flags of outputs, for which every part gets its own name.
    pub outputs: &'a [&'a str],
    /// The ending of an output file; empty for a folder.
    pub ending: &'a str,
}

impl Parts<'_> {
    /// Prints the commands that share this work, one per line, and on standard error how to join the results. `values`
    /// are those of the flag. `result` is the output; `None` if there is nothing to join.
    pub fn list(&self, values: &[String], result: Option<&Path>) {
        let typed: Vec<String> = std::env::args().skip(1).collect();
        for (i, value) in values.iter().enumerate() {
            say!("{}", words::line(&self.command(&typed, i + 1, value)));
        }
        let Some(result) = result else { return };
        let mut merge = vec!["twobounce".to_owned(), "merge".to_owned()];
        merge.extend((1..=values.len()).map(|i| self.beside(result, i)));
        merge.extend(["-o".to_owned(), result.display().to_string()]);
        out::warn(&format!("note: when all are done: {}", words::line(&merge)));
    }

    /// The command of part `i`.
    fn command(&self, typed: &[String], i: usize, value: &str) -> Vec<String> {
        // A flag without a value here stands alone, or takes the next word, which stays in its place.
        let takes_value = |word: &str| word == "--list" || word == self.flag || self.outputs.contains(&word);
        let mut words = vec!["twobounce".to_owned()];
        for mut group in words::grouped(typed, takes_value) {
            let name = words::flag(&group).to_owned();
            if name == "--list" || name == self.flag {
                continue;
            }
            if self.outputs.contains(&name.as_str()) {
                let output = group.pop().unwrap_or_default();
                let output = output.strip_prefix(&format!("{name}=")).unwrap_or(&output);
                group = vec![name, self.beside(Path::new(output), i)];
            }
            words.extend(group);
        }
        words.extend([self.flag.to_owned(), value.to_owned()]);
        words
    }

    /// The name of part `i` of a result: `out.3`, or `out.3.film` with an ending.
    fn beside(&self, path: &Path, i: usize) -> String {
        match self.ending {
            "" => format!("{}.{i}", path.display()),
            ending => format!("{}.{i}.{ending}", path.with_extension("").display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_is_in_one_part() {
        let parts = ["1/3", "2/3", "3/3"].map(|text| shard(text).unwrap());
        for i in 0..100u64 {
            let address = blake3::hash(&i.to_le_bytes()).to_hex().to_string();
            assert_eq!(parts.iter().filter(|part| part.has(&address)).count(), 1);
        }
        assert!(["", "1", "0/2", "3/2", "1/0", "a/b", "-1/2"].iter().all(|text| shard(text).is_err()));
    }

    #[test]
    fn parts_are_the_same_command_with_their_own_folder() {
        let shards = Parts { flag: "--shard", outputs: &["-o"], ending: "" };
        let films = Parts { flag: "--samples", ending: "film", ..shards };
        let typed = ["chart", "a b.glb", "--list", "2", "-o", "out", "--set", "voxels=32"].map(str::to_owned);
        let words = words::line(&shards.command(&typed, 2, "2/2"));
        assert_eq!(words, "twobounce chart 'a b.glb' -o out.2 --set voxels=32 --shard 2/2");
        let typed = ["reference", "--samples=0-63", "--list=2", "-o", "a.film", "b.glb"].map(str::to_owned);
        let words = words::line(&films.command(&typed, 1, "0-31"));
        assert_eq!(words, "twobounce reference -o a.1.film b.glb --samples 0-31");
    }
}
