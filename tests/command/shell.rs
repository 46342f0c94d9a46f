//! Completions of shells and manual pages name exactly the program's options.

use std::collections::BTreeSet;
use std::fs;
use std::process::{Command, Output, Stdio};

const SHELLS: [&str; 5] = ["bash", "zsh", "fish", "elvish", "powershell"];

fn twobounce(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_twobounce")).args(args).output().expect("twobounce")
}

fn said(args: &[&str]) -> String {
    let output = twobounce(args);
    assert!(output.status.success() && output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

/// The commands that `twobounce help` lists.
fn commands() -> Vec<String> {
    let help = said(&["help"]);
    let list = help.split("Commands:\n").nth(1).and_then(|rest| rest.split("\n\n").next()).expect("a list");
    let names: Vec<String> =
        list.lines().filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect();
    assert!(names.len() > 8 && names.contains(&"render".into()), "{names:?}");
    names.into_iter().filter(|name| name != "help").collect()
}

/// The flags that `twobounce help COMMAND` lists, each at the start of its line.
fn flags(command: &str) -> BTreeSet<String> {
    let help = said(&["help", command]);
    let lines = help.lines().map(str::trim_start).filter(|line| line.starts_with('-'));
    let words = lines.flat_map(|line| line.split([' ', ',']).take(4).map(str::to_owned).collect::<Vec<_>>());
    words.filter(|word| word.len() > 3 && word.starts_with("--")).map(|w| w.trim_end_matches('=').to_owned()).collect()
}

#[test]
fn every_shell_knows_every_command_and_flag() {
    let commands = commands();
    for shell in SHELLS {
        let script = said(&["completions", shell]);
        for command in &commands {
            assert!(script.contains(command.as_str()), "{shell} does not know {command}");
            for flag in flags(command) {
                let word = if shell == "fish" { format!("-l {}", &flag[2..]) } else { flag };
                assert!(script.contains(&word), "{shell} does not know {word} of {command}");
            }
        }
    }
    assert!(flags("render").contains("--exposure") && flags("render").len() > 25, "{:?}", flags("render"));
    let refused = twobounce(&["completions", "tcsh"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(refused.status.code() == Some(2) && message.contains("'tcsh'") && message.contains("bash"), "{message}");
}

/// The words that bash offers to complete the last of `words`.
fn offered(words: &str) -> Vec<String> {
    let script = said(&["completions", "bash"]);
    let asked = format!(
        "{script}\nCOMP_WORDS=({words})\nCOMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))\n\
         _twobounce twobounce \"${{COMP_WORDS[COMP_CWORD]}}\" \"${{COMP_WORDS[COMP_CWORD-1]}}\"\n\
         printf '%s\\n' \"${{COMPREPLY[@]}}\"\n"
    );
    let output = Command::new("bash").args(["--norc", "-c", &asked]).stdin(Stdio::null()).output().expect("bash");
    assert!(output.stderr.is_empty(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text").lines().map(str::to_owned).collect()
}

#[test]
fn bash_completes() {
    assert_eq!(offered("twobounce ren"), ["render"]);
    assert_eq!(offered("twobounce render a.glb --expo"), ["--exposure"]);
    assert_eq!(offered("twobounce render a.glb --method ph"), ["photons"]);
    assert_eq!(offered("twobounce completions z"), ["zsh"]);
}

#[test]
fn manual_pages_name_every_command_and_flag() {
    let folder = tempfile::tempdir().expect("a folder");
    let pages = folder.path().join("man1");
    assert!(said(&["man", pages.to_str().unwrap()]).starts_with("wrote "));
    let page = |name: &str| fs::read_to_string(pages.join(name)).expect("a page").replace("\\-", "-");
    let first = page("twobounce.1");
    assert_eq!(first, said(&["man"]).replace("\\-", "-"), "the same page");
    assert!(first.contains("\n.TH twobounce 1 ") && first.contains("make-assets"), "{first}");
    let commands = commands();
    for command in &commands {
        assert!(first.contains(&format!("twobounce-{command}(1)")), "twobounce.1 does not name {command}");
        let page = page(&format!("twobounce-{command}.1"));
        assert!(page.is_ascii());
        for flag in flags(command) {
            assert!(page.contains(&flag), "the page of {command} does not name {flag}");
        }
    }
    assert_eq!(fs::read_dir(&pages).expect("a folder").count(), commands.len() + 1);
    // A file exists where the folder should be.
    let refused = twobounce(&["man", pages.join("twobounce.1").to_str().unwrap()]);
    assert_eq!(refused.status.code(), Some(2));
}
