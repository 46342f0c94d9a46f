//! Commands as text for a shell.

use std::path::Path;

use clap::{Arg, Args, Command};

use super::args::SceneArgs;

/// A command as one line for a shell.
pub fn line(words: &[String]) -> String {
    words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
}

fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+%@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// Groups typed words: a word alone, or a flag with its value, in one word or two. `takes_value` says whether a flag
/// has a value.
pub fn grouped(typed: &[String], takes_value: impl Fn(&str) -> bool) -> Vec<Vec<String>> {
    let mut groups = Vec::new();
    let mut words = typed.iter();
    while let Some(word) = words.next() {
        let mut group = vec![word.clone()];
        if word.starts_with('-') && !word.contains('=') && takes_value(word) {
            group.extend(words.next().cloned());
        }
        groups.push(group);
    }
    groups
}

/// The flag at the beginning of a group of words.
pub fn flag(group: &[String]) -> &str {
    group[0].split('=').next().unwrap_or_default()
}

/// The typed flags that another command has too, with their values and without those in `left_out`. `own` has the flags
/// of the typed command.
pub fn kept(typed: &[String], own: &Command, other: &Command, left_out: &[&str]) -> Vec<String> {
    let known = |command: &Command, flag: &str| {
        let is_it = |arg: &&Arg| {
            let short = arg.get_short().map(|short| format!("-{short}"));
            flag.strip_prefix("--").is_some_and(|long| arg.get_long() == Some(long)) || short.as_deref() == Some(flag)
        };
        command.get_arguments().find(is_it).cloned()
    };
    let takes_value = |flag: &str| known(own, flag).is_none_or(|arg| arg.get_action().takes_values());
    let stays = |group: &Vec<String>| known(other, flag(group)).is_some() && !left_out.contains(&flag(group));
    grouped(typed, takes_value).into_iter().filter(stays).flatten().collect()
}

/// The beginning of the command that renders a scene with this view, without settings. `typed` holds the words of this
/// command, which has the flags `Own` in addition to those of a scene.
pub fn render_command<Own: Args>(typed: &[String], scene: &Path, (width, height): (u32, u32)) -> String {
    let flags = SceneArgs::augment_args(Command::new(""));
    let start = ["twobounce", "render", &scene.display().to_string(), "-o", "image.png"].map(str::to_owned);
    let kept = kept(typed, &Own::augment_args(flags.clone()), &flags, &["--size"]);
    line(&start.into_iter().chain(kept).chain([format!("--size={width}x{height}")]).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Args)]
    struct Own {
        #[arg(short, long)]
        quiet: bool,
    }

    #[test]
    fn a_scene_is_rendered_as_it_is_looked_at() {
        let typed = "a b.glb|-q|--size|64x64|--sky|0.5|--strict|--set|voxels=32|--time|2|-o|x".split('|');
        let typed: Vec<String> = typed.map(str::to_owned).collect();
        let command = render_command::<Own>(&typed, Path::new("a b.glb"), (64, 64));
        assert_eq!(command, "twobounce render 'a b.glb' -o image.png --sky 0.5 --strict --time 2 --size=64x64");
    }
}
