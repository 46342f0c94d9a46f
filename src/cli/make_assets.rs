//! `twobounce make-assets`: writes the scenes in `assets/`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;

use crate::say;

#[derive(Args, Debug)]
pub struct MakeAssetsArgs {
    /// The folder to write, which is created if it is missing
    #[arg(value_name = "DIR", default_value = "assets")]
    pub dir: PathBuf,
}

pub fn run(args: &MakeAssetsArgs) -> anyhow::Result<ExitCode> {
    for name in twobounce::assets::write(&args.dir)? {
        say!("{}", args.dir.join(name).display());
    }
    Ok(ExitCode::SUCCESS)
}
