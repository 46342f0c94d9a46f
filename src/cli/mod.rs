//! The command line: this file lists the commands, [`args`] has common arguments, [`scene`] opens a scene, [`outputs`]
//! checks output files, and each subcommand has a file.
//!
//! Exit codes: 0 for success, 1 for an exceeded limit, 2 for a fault of the user or the environment, 128 plus the
//! signal's number after an interruption.

mod args;
mod bench;
mod chart;
mod compare;
mod demo;
mod display;
mod driver_cache;
mod info;
mod interrupt;
mod lab;
mod ledger;
mod limits;
mod line;
mod make_assets;
mod merge;
pub mod out;
mod outputs;
mod plan;
mod profile;
mod progress;
mod reference;
mod refine;
mod render;
mod report;
mod scene;
mod settings;
mod share;
mod shell;
mod stability;
mod study;
mod suite;
mod threads;
mod tonemap;
#[cfg(feature = "window")]
mod view;
mod words;

use std::io::Write;
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

/// Renders glTF scenes with global illumination in Vulkan, and measures error and time against its own path tracer.
///
/// Six methods find the indirect light: exact rays to cached light (the default), voxel cones, photons in voxels, light
/// propagation volumes, irradiance probes, and paths. `twobounce render scene.glb -o image.png` renders a picture.
#[derive(Debug, Parser)]
#[command(version, subcommand_required = true, arg_required_else_help = true, after_help = OWN_DOCS)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

/// The commands that the list does not show.
const OWN_DOCS: &str = "For this project's own pages and scenes:
  study        Run the default study and write docs/notes/study again
  ledger       Measure what each error in the talk's listings changes, and write docs/notes/ledger.md again
  make-assets  Write the scenes in assets/ again";

#[derive(Debug, Subcommand)]
enum Command {
    /// Render a scene to an image
    Render(render::RenderArgs),
    /// Show a scene in a window
    #[cfg(feature = "window")]
    View(Box<view::ViewArgs>),
    /// Play a sequence in which everything moves: in a window, as images, or as a benchmark
    Demo(Box<demo::DemoArgs>),
    /// Path-trace a reference image on the CPU
    Reference(reference::ReferenceArgs),
    /// Compare an image with its reference
    Compare(compare::CompareArgs),
    /// Convert the radiance in an .exr to a .png or .jpg
    Tonemap(tonemap::TonemapArgs),
    /// Search for the cheapest settings within limits on error, time or memory, by measuring
    Plan(Box<plan::PlanArgs>),
    /// Chart error against time over many settings: a page, an SVG and rows
    Chart(chart::ChartArgs),
    /// Measure leaks, flicker, lost light and other failures, each as a number with an ideal
    Stability(stability::StabilityArgs),
    /// Compare an image of any renderer with the references of the suite, together with rows of other renderers
    Suite(suite::SuiteArgs),
    /// Join the results of several machines: charts, stability tables, samples of references
    Merge(merge::MergeArgs),
    /// Measure the time of each pass per voxel, pixel and step, and its growth
    Profile(profile::ProfileArgs),
    /// List every setting, or print the settings that flags select
    Settings(settings::SettingsCommandArgs),
    /// List the Vulkan devices, the features that twobounce needs, and the missing ones
    Info(info::InfoArgs),
    /// Print completions for bash, zsh, fish, elvish or powershell
    Completions(shell::CompletionsArgs),
    /// Print the manual page, or write a page per command
    Man(shell::ManArgs),
    /// Run the default study and write docs/notes/study
    #[command(hide = true)]
    Study(study::StudyArgs),
    /// Measure the effect of each error in a method's source, and fill docs/notes/ledger.md
    #[command(hide = true)]
    Ledger(ledger::LedgerArgs),
    /// Write the scenes in assets/
    #[command(hide = true)]
    MakeAssets(make_assets::MakeAssetsArgs),
}

/// Parses and runs the command line, prints an error, and returns the exit code.
pub fn main() -> ExitCode {
    if let Err(words) = limits::begin() {
        out::warn(words);
        return ExitCode::from(2);
    }
    driver_cache::separate_widths();
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

/// Prints help or the version, or one sentence about wrong arguments, without the usage.
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

/// A message on one line, with long values of a file or an argument shortened.
fn one_line(text: &str) -> String {
    let words: Vec<_> = text.split_whitespace().map(|word| ends(word, 200)).collect();
    ends(&words.join(" "), 1500)
}

/// The beginning and the end of a text of more than `most` characters.
fn ends(text: &str, most: usize) -> String {
    let characters: Vec<char> = text.chars().collect();
    if characters.len() <= most {
        return text.to_owned();
    }
    let part = |range: std::ops::Range<usize>| characters[range].iter().collect::<String>();
    format!("{}…{}", part(0..most * 2 / 3), part(characters.len() - most / 4..characters.len()))
}

/// Runs one subcommand; returns the exit code of a command that did not fail.
fn run(cli: &Cli) -> anyhow::Result<ExitCode> {
    use Command::{Compare, Completions, Info, Man, Settings};
    // These commands only print.
    if matches!(cli.command, Compare(_) | Completions(_) | Info(_) | Man(_) | Settings(_)) {
        out::check_open()?;
    }
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
        Command::Tonemap(args) => tonemap::run(args),
        Command::Plan(args) => plan::run(args, std::env::args().skip(2).collect()),
        Command::Chart(args) => chart::run(args),
        Command::Study(args) => study::run(args),
        Command::Stability(args) => stability::run(args),
        Command::Suite(args) => suite::run(args),
        Command::Settings(args) => settings::run(args),
        Command::Info(args) => info::run(args),
        Command::Completions(args) => shell::complete(args, Cli::command()),
        Command::Man(args) => shell::man(args, Cli::command()),
    }
}

#[cfg(test)]
mod tests {
    use super::one_line;

    #[test]
    fn long_values_are_shortened_in_messages() {
        assert_eq!(one_line("no  such\nfile a.glb"), "no such file a.glb");
        let said = one_line(&format!("--set {}é: no such key", "x".repeat(5000)));
        assert!(
            said.starts_with("--set xxx") && said.ends_with("xé: no such key") && said.chars().count() < 220,
            "{said}"
        );
        let words = one_line(&"x ".repeat(5000));
        assert!(words.contains('…') && words.chars().count() < 1500, "{words}");
    }
}
