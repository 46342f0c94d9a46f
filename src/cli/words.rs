//! Commands as text for a shell.

use std::path::Path;

use clap::{Args, Command};

use super::args::SceneArgs;

/// A command as one line that a shell reads back.
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

/// Typed words in turn: a word by itself, or a flag with its value, in one word or two. `takes_value`: of a flag.
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

/// The flag that a group of words begins with.
pub fn flag(group: &[String]) -> &str {
    group[0].split('=').next().unwrap_or_default()
}

/// The start of the command that renders a scene as it is looked at: without settings. `typed`: the words of this command.
pub fn render_command(typed: &[String], scene: &Path, (width, height): (u32, u32)) -> String {
    let flags = SceneArgs::augment_args(Command::new(""));
    let known = |flag: &str| {
        flags.get_arguments().find(|arg| arg.get_long().is_some_and(|long| flag.strip_prefix("--") == Some(long)))
    };
    let takes_value = |flag: &str| known(flag).is_none_or(|arg| arg.get_action().takes_values());
    let groups = grouped(typed, takes_value);
    let kept = groups.into_iter().filter(|group| known(flag(group)).is_some() && flag(group) != "--size");
    let start = ["twobounce", "render", &scene.display().to_string(), "-o", "image.png"].map(str::to_owned);
    let size = vec![format!("--size={width}x{height}")];
    line(&start.into_iter().chain(kept.flatten()).chain(size).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_rendered_as_it_is_looked_at() {
        let typed =
            ["a b.glb", "--size", "64x64", "--sky=0.5", "--strict", "--set", "voxels=32", "--time", "2", "-o", "x"];
        let command = render_command(&typed.map(str::to_owned), Path::new("a b.glb"), (64, 64));
        assert_eq!(command, "twobounce render 'a b.glb' -o image.png --sky=0.5 --strict --time 2 --size=64x64");
    }
}
