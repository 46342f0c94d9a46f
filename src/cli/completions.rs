//! `twobounce completions`: what a shell completes, from the same flags that are parsed.

use std::process::ExitCode;

use clap::{Args, Command};
use clap_complete::Shell;
use twobounce::{Error, Result};

use super::out;

#[derive(Args, Debug)]
#[command(after_help = "For example:
  twobounce completions bash > ~/.local/share/bash-completion/completions/twobounce
  twobounce completions zsh > ~/.zfunc/_twobounce          # a folder of $fpath
  twobounce completions fish > ~/.config/fish/completions/twobounce.fish")]
pub struct CompletionsArgs {
    /// The shell to write for
    #[arg(value_name = "SHELL")]
    pub shell: Shell,
}

/// Prints the script. `command`: the whole program's.
pub fn run(args: &CompletionsArgs, mut command: Command) -> anyhow::Result<ExitCode> {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    out::write(&text(script)?);
    Ok(ExitCode::SUCCESS)
}

/// What was generated, as text.
pub fn text(bytes: Vec<u8>) -> Result<String> {
    String::from_utf8(bytes).map_err(|_| Error::Usage("what was generated is not UTF-8".into()))
}
