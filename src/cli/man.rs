//! `twobounce man`: manual pages, from the same flags that are parsed.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Command};
use clap_mangen::Man;
use twobounce::output::file;

use super::{completions, out, outputs};
use crate::say;

#[derive(Args, Debug)]
pub struct ManArgs {
    /// The folder to write twobounce.1 and a page per command into, made where it is missing; without it, twobounce.1 is printed
    #[arg(value_name = "DIR")]
    pub dir: Option<PathBuf>,
}

/// Prints the page, or writes all. `command`: the whole program's.
pub fn run(args: &ManArgs, command: Command) -> anyhow::Result<ExitCode> {
    let mut command = command.disable_help_subcommand(true);
    command.build(); // gives every command its whole name
    let Some(folder) = &args.dir else {
        out::write(&page(&command)?);
        return Ok(ExitCode::SUCCESS);
    };
    let shown = command.get_subcommands().filter(|command| !command.is_hide_set());
    let pages: Vec<_> = [&command].into_iter().chain(shown).map(|command| (file_name(command), command)).collect();
    file::create_folder(folder)?;
    let paths: Vec<PathBuf> = pages.iter().map(|(name, _)| folder.join(name)).collect();
    outputs::check(&[], &paths.iter().map(Some).collect::<Vec<_>>())?;
    for ((_, command), path) in pages.iter().zip(&paths) {
        file::write(path, page(command)?.as_bytes())?;
    }
    say!("wrote {} pages to {}", pages.len(), folder.display());
    Ok(ExitCode::SUCCESS)
}

fn file_name(command: &Command) -> String {
    format!("{}.1", command.get_display_name().unwrap_or(command.get_name()))
}

/// One page, in roff and ASCII.
fn page(command: &Command) -> anyhow::Result<String> {
    let mut bytes = Vec::new();
    Man::new(command.clone()).render(&mut bytes)?;
    let text = completions::text(bytes)?;
    // Formatters that take bytes for Latin-1 print these too.
    let escaped = |c: char| if c.is_ascii() { c.to_string() } else { format!("\\[u{:04X}]", u32::from(c)) };
    Ok(text.chars().map(escaped).collect())
}
