//! `twobounce make-assets`: the scenes in `assets/`, written anew.

use super::Outcome;
use super::args::MakeAssetsArgs;
use crate::say;

pub fn run(args: &MakeAssetsArgs) -> anyhow::Result<Outcome> {
    for name in twobounce::assets::write(&args.dir)? {
        say!("{}", args.dir.join(name).display());
    }
    Ok(Outcome::Done)
}
