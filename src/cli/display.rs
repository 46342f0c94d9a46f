//! Flags for the display of images.

use clap::Args;
use twobounce::layers::Layers;
use twobounce::output::display::{Display, ToneMap};
use twobounce::output::picture::ImageKind;
use twobounce::{Error, Result};

use super::args::{named, number};
use crate::say;

#[derive(Args, Clone, Debug, Default)]
pub struct DisplayArgs {
    /// Tone curve of a .png or .jpg, which maps radiance to the range of a display [default: neutral]
    #[arg(long, value_name = "CURVE", value_parser = named(ToneMap::ALL, ToneMap::name))]
    pub tonemap: Option<ToneMap>,
    /// Exposure of a .png or .jpg in stops: radiance is multiplied by 2^EV [default: automatic, and printed]
    #[arg(long, value_name = "EV", allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n.abs() <= 60.0, "write stops between -60 and 60"))]
    pub exposure: Option<f64>,
}

impl DisplayArgs {
    /// Refuses flags that do not apply to a kind of file.
    pub fn check(&self, kind: ImageKind, transparent: bool) -> Result<()> {
        let usage = |sentence: &str| Err(Error::Usage(sentence.to_owned()));
        match kind {
            ImageKind::Exr if self.exposure.is_some() => {
                usage("--exposure is for a .png or .jpg; an .exr holds the radiance itself")
            }
            ImageKind::Exr if self.tonemap.is_some() => {
                usage("--tonemap is for a .png or .jpg; an .exr holds the radiance itself")
            }
            ImageKind::Jpeg if transparent => usage("a .jpg has no transparent pixels; name a .png or an .exr"),
            _ => Ok(()),
        }
    }

    pub fn tone(&self) -> ToneMap {
        self.tonemap.unwrap_or_default()
    }

    /// The requested exposure in stops.
    pub fn exposure_ev(&self) -> Option<f32> {
        self.exposure.map(|ev| ev as f32)
    }

    /// The display of an image; an automatic exposure is printed.
    pub fn display(&self, image: &Layers) -> Display {
        let tone = self.tone();
        let exposure_ev = self.exposure_ev().unwrap_or_else(|| {
            let ev = tone.automatic_exposure(image.beauty());
            say!("exposure: {ev} EV, automatic (--exposure {ev} gives the same image)");
            ev
        });
        Display { tone, exposure_ev }
    }
}
