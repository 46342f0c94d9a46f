//! `twobounce make-assets`: the scenes in `assets/`, written again.

use std::process::ExitCode;

use super::args::MakeAssetsArgs;
use crate::say;

pub fn run(args: &MakeAssetsArgs) -> anyhow::Result<ExitCode> {
    for name in twobounce::assets::write(&args.dir)? {
        say!("{}", args.dir.join(name).display());
    }
    Ok(ExitCode::SUCCESS)
}
