//! `twobounce completions` and `twobounce man`: completions of shells and manual pages, from the parsed flags.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::Shell;
use clap_mangen::Man;
use twobounce::output::file;

use super::{out, outputs};
use crate::say;

#[derive(Args, Debug)]
#[command(after_help = "For example:
  twobounce completions bash > ~/.local/share/bash-completion/completions/twobounce
  twobounce completions zsh > ~/.zfunc/_twobounce          # a folder of $fpath
  twobounce completions fish > ~/.config/fish/completions/twobounce.fish")]
pub struct CompletionsArgs {
    /// The shell of the completions
    #[arg(value_name = "SHELL")]
    pub shell: Shell,
}

#[derive(Args, Debug)]
pub struct ManArgs {
    /// The folder for twobounce.1 and a page per command, which is created if it is missing; without it, twobounce.1 is
    /// printed
    #[arg(value_name = "DIR")]
    pub dir: Option<PathBuf>,
}

/// Prints the script. `command` is that of the whole program.
pub fn complete(args: &CompletionsArgs, mut command: Command) -> anyhow::Result<ExitCode> {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    out::write(&String::from_utf8(script)?);
    Ok(ExitCode::SUCCESS)
}

/// Prints one page, or writes all. `command` is that of the whole program.
pub fn man(args: &ManArgs, command: Command) -> anyhow::Result<ExitCode> {
    let mut command = command.disable_help_subcommand(true);
    command.build(); // sets the full name of every command
    let Some(folder) = &args.dir else {
        out::write(&page(&command)?);
        return Ok(ExitCode::SUCCESS);
    };
    file::create_folder(folder)?;
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
    let commands: Vec<_> = [&command].into_iter().chain(shown).collect();
    let name = |command: &Command| format!("{}.1", command.get_display_name().unwrap_or(command.get_name()));
    let paths: Vec<PathBuf> = commands.iter().map(|command| folder.join(name(command))).collect();
    outputs::check(&[], &paths.iter().map(Some).collect::<Vec<_>>())?;
    for (command, path) in commands.iter().zip(&paths) {
        file::write(path, page(command)?.as_bytes())?;
    }
    say!("wrote {} pages to {}", commands.len(), folder.display());
    Ok(ExitCode::SUCCESS)
}

/// One page, in roff and ASCII.
fn page(command: &Command) -> anyhow::Result<String> {
    let mut bytes = Vec::new();
    Man::new(command.clone()).render(&mut bytes)?;
    // Formatters that read bytes as Latin-1 can print these too.
    let escaped = |c: char| if c.is_ascii() { c.to_string() } else { format!("\\[u{:04X}]", u32::from(c)) };
    Ok(String::from_utf8(bytes)?.chars().map(escaped).collect())
}
