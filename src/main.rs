//! Parses the command line, runs it, and turns the outcome into an exit code.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::out::init_log();
    let args = match cli::parse() {
        Ok(args) => args,
        Err(code) => return code,
    };
    cli::run(&args).and_then(|code| cli::out::finish().map(|()| code)).unwrap_or_else(|error| {
        cli::out::warn(&cli::sentence(&error));
        cli::exit_code(&error)
    })
}
