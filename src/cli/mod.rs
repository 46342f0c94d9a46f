//! The command line: [`args`] is what was typed, [`scene`] opens it, [`outputs`] checks where files go, then one file per
//! subcommand.
//!
//! Exit codes: 0 done, 1 a threshold was exceeded, 2 the user's or the environment's fault, 128 and the signal's number interrupted.

mod args;
mod bench;
mod blank;
mod chart;
mod compare;
mod completions;
mod demo;
mod info;
mod interrupt;
mod ledger;
mod make_assets;
mod man;
mod merge;
pub mod out;
mod outputs;
mod plan;
mod profile;
mod progress;
mod reference;
mod render;
mod report;
mod scene;
mod settings;
mod share;
mod sky;
mod stability;
mod study;
#[cfg(feature = "window")]
mod view;
mod words;

use std::io::Write;
use std::process::ExitCode;

use clap::Parser;
use clap::error::ErrorKind;

use args::{Cli, Command};

/// Parses and runs the command line, reports an error, and says how it ended.
pub fn main() -> ExitCode {
    out::init_log();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(error) => return refuse(&error),
    };
    run(&cli).and_then(|code| out::finish().map(|()| code)).unwrap_or_else(|error| {
        out::warn(&one_line(&format!("{error:#}")));
        let interrupted = matches!(error.downcast_ref(), Some(twobounce::Error::Interrupted));
        ExitCode::from(if interrupted { interrupt::exit_code() } else { 2 })
    })
}

/// Prints help or the version, or says in one sentence, without the usage, what is wrong with the arguments.
fn refuse(error: &clap::Error) -> ExitCode {
    let text = error.render().to_string();
    match error.kind() {
        ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => {
            out::write(&text);
            return ExitCode::SUCCESS;
        }
        ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
            let _ = write!(std::io::stderr(), "{text}");
        }
        _ => {
            let paragraphs = text.trim_start_matches("error: ").split("\n\n");
            let is_usage = |p: &&str| p.starts_with("Usage:") || p.starts_with("For more information");
            let problem: Vec<String> = paragraphs.take_while(|p| !is_usage(p)).map(one_line).collect();
            out::warn(&problem.join("; "));
        }
    }
    ExitCode::from(2)
}

fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Runs one subcommand; the exit code of a command that did not fail.
fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    match &cli.command {
        Command::Ledger(args) => ledger::run(args),
        Command::MakeAssets(args) => make_assets::run(args),
        Command::Render(args) => render::run(args),
        #[cfg(feature = "window")]
        Command::View(args) => view::run(args, std::env::args().skip(2).collect(), "twobounce render"),
        Command::Demo(args) => demo::run(args),
        Command::Merge(args) => merge::run(args),
        Command::Profile(args) => profile::run(args),
        Command::Reference(args) => reference::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Plan(args) => plan::run(args, std::env::args().skip(2).collect()),
        Command::Chart(args) => chart::run(args),
        Command::Study(args) => study::run(args),
        Command::Stability(args) => stability::run(args),
        Command::Settings(args) => settings::run(args),
        Command::Info(args) => info::run(args),
        Command::Completions(args) => completions::run(args),
        Command::Man(args) => man::run(args),
    }
}
