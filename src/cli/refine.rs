//! Flags for the refinement of a still image.

use std::time::Duration;

use clap::Args;
use twobounce::Result;
use twobounce::settings::Settings;
use twobounce::stage::{Noise, Refine};

use super::args::{SettingsArgs, budget, percent};

#[derive(Args, Clone, Debug, Default)]
pub struct RefineArgs {
    /// Add passes over the image until the estimated root mean square of its pixels' relative error is at most this
    /// percentage; off: only take image.passes passes [default: 2 for a still image without --timings, --json, --trace
    /// and image.passes, else off]
    #[arg(long, value_name = "PERCENT|off", value_parser = noise, allow_negative_numbers = true)]
    pub noise: Option<Noise>,
    /// Add no more passes after this time, such as 90s or 5min
    #[arg(long, value_name = "TIME", value_parser = budget, allow_negative_numbers = true)]
    pub time_limit: Option<Duration>,
}

impl RefineArgs {
    pub fn refine(&self) -> Refine {
        Refine { noise: self.noise, time_limit: self.time_limit }
    }
}

fn noise(text: &str) -> std::result::Result<Noise, &'static str> {
    match text {
        "off" => Ok(Noise::Off),
        _ => percent(text).map(Noise::AtMost).map_err(|_| "write a percentage above 0, or off"),
    }
}

impl SettingsArgs {
    /// Whether flags or a file set the resolution of gathering.
    ///
    /// # Errors
    /// The preset is unknown.
    pub fn choose_resolution(&self, settings: &Settings) -> Result<bool> {
        let preset = Settings::preset(&self.preset)?.image.gather_resolution;
        let set = self.sets.iter().any(|set| set.starts_with("image.gather_resolution"));
        Ok(set || preset != settings.image.gather_resolution)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_a_percentage_or_off() {
        assert_eq!(noise("off"), Ok(Noise::Off));
        assert_eq!(noise("5"), Ok(Noise::AtMost(0.05)));
        assert!(["0", "-1", "on", "nan", ""].iter().all(|text| noise(text).is_err()));
    }

    #[test]
    fn a_resolution_that_flags_name_is_chosen() {
        let chosen = |sets: &[&str]| {
            let sets = sets.iter().map(|set| (*set).to_owned()).collect();
            let given = SettingsArgs { preset: "fast".into(), config: None, method: None, sets };
            given.choose_resolution(&given.effective().unwrap()).unwrap()
        };
        assert!(!chosen(&[]) && !chosen(&["image.passes=4"]));
        assert!(chosen(&["image.gather_resolution=quarter"]) && chosen(&["image.gather_resolution=half"]));
    }
}
