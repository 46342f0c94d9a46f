//! `twobounce make-assets`: the scenes in `assets/`, written again.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::say;

#[derive(Args, Debug)]
pub struct MakeAssetsArgs {
    /// The folder to write into; made where it is missing
    #[arg(value_name = "DIR", default_value = "assets")]
    pub dir: PathBuf,
}

pub fn run(args: &MakeAssetsArgs) -> anyhow::Result<ExitCode> {
    for name in twobounce::assets::write(&args.dir)? {
        say!("{}", args.dir.join(name).display());
    }
    Ok(ExitCode::SUCCESS)
}
