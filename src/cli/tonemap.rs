//! `twobounce tonemap`: converts radiance in an .exr to an image for a display.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Args;
use twobounce::Error;
use twobounce::layers::Layers;
use twobounce::output::picture::ImageKind;

use super::display::DisplayArgs;
use super::{out, outputs};
use crate::say;

#[derive(Args, Debug)]
pub struct TonemapArgs {
    /// An .exr of linear radiance, of this program or another
    #[arg(value_name = "IMAGE.exr")]
    pub image: PathBuf,
    /// The .png or .jpg to write; - is standard output, as a PNG
    #[arg(short, long, value_name = "OUT.png|OUT.jpg")]
    pub output: PathBuf,
    #[command(flatten)]
    pub display: DisplayArgs,
    /// Print only errors
    #[arg(short, long)]
    pub quiet: bool,
}

pub fn run(args: &TonemapArgs) -> anyhow::Result<ExitCode> {
    out::be_quiet(args.quiet);
    let kind = ImageKind::of_path(&args.output).filter(|kind| *kind != ImageKind::Exr);
    if kind.is_none() {
        return Err(Error::file(&args.output, "has another ending than .png or .jpg; name it so").into());
    }
    outputs::check(&[Some(&args.image)], &[Some(&args.output)])?;
    outputs::refuse_display_image(&args.image)?;
    let (image, _) = Layers::read_exr(&args.image)?;
    image.write_shown(&args.output, args.display.display(&image))?;
    say!("wrote {}", out::name(&args.output));
    Ok(ExitCode::SUCCESS)
}
