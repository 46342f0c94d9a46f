//! The command line: [`args`] is what was typed, [`scene`] opens it, [`outputs`] checks where files go, then one file per
//! subcommand.
//!
//! Exit codes: 0 done, 1 a threshold was exceeded, 2 the user's or the environment's fault, 130 interrupted.

mod args;
mod bench;
mod chart;
mod compare;
mod info;
mod interrupt;
mod ledger;
mod make_assets;
pub mod out;
mod outputs;
mod profile;
mod progress;
mod reference;
mod render;
mod report;
mod scene;
mod settings;
mod study;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use args::{Cli, Command};

/// The typed arguments, or the exit code after help, version or a mistake was reported.
pub fn parse() -> Result<Cli, ExitCode> {
    Cli::try_parse().map_err(|error| match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            out::write(&error.render().to_string());
            ExitCode::SUCCESS
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = write!(std::io::stderr(), "{}", error.render());
            ExitCode::from(2)
        }
        _ => {
            out::warn(&usage_sentence(&error.render().to_string()));
            ExitCode::from(2)
        }
    })
}

/// Runs one subcommand; the exit code of a command that did not fail.
pub fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    match &cli.command {
        Command::Ledger(args) => ledger::run(args),
        Command::MakeAssets(args) => make_assets::run(args),
        Command::Render(args) => render::run(args),
        Command::Profile(args) => profile::run(args),
        Command::Reference(args) => reference::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Chart(args) => chart::run(args),
        Command::Study(args) => study::run(args),
        Command::Settings(args) => settings::run(args),
        Command::Info(args) => info::run(args),
    }
}

/// The whole chain of an error in one line.
pub fn sentence(error: &anyhow::Error) -> String {
    format!("{error:#}").split_whitespace().collect::<Vec<_>>().join(" ")
}

/// 130 for an interruption, 2 for everything else.
pub fn exit_code(error: &anyhow::Error) -> ExitCode {
    match error.downcast_ref() {
        Some(twobounce::Error::Interrupted) => ExitCode::from(130),
        _ => ExitCode::from(2),
    }
}

/// Clap's paragraphs (what is wrong, a tip, the usage) as one sentence without the usage.
fn usage_sentence(message: &str) -> String {
    let paragraphs = message.trim_start_matches("error: ").split("\n\n");
    let told: Vec<String> = paragraphs
        .take_while(|p| !p.starts_with("Usage:") && !p.starts_with("For more information"))
        .map(|p| p.split_whitespace().collect::<Vec<_>>().join(" "))
        .collect();
    told.join("; ")
}
