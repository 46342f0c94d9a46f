//! The command for the shown picture, and files of it.

use std::path::Path;

use anyhow::Context as _;
use clap::{Args as _, Command};
use twobounce::layers::Aov;
use twobounce::settings::Settings;

use super::eye::Eye;
use super::{App, ViewArgs};
use crate::cli::args::{RunArgs, SceneArgs};
use crate::cli::{out, words};
use crate::say;

impl App {
    /// The settings of the shown picture; if it is refined, with its number of passes.
    pub(super) fn settings(&self) -> Settings {
        let mut settings = self.panel.choice.settings.clone();
        if let Some(frame) = self.frame.as_ref().filter(|_| self.rests()) {
            settings.image.passes = settings.image.passes.max(frame.passes);
        }
        settings
    }

    /// The `twobounce render` command of the same picture for a shell.
    pub(super) fn command(&self) -> String {
        let replaced = ["--size", "--time", "--camera", "--eye", "--target", "--up", "--fov"];
        // Without an eye, the camera is still the requested one.
        let replaced = if self.eye.is_some() { &replaced[..] } else { &replaced[..2] };
        let own = ViewArgs::augment_args(Command::new(""));
        let of_both = RunArgs::augment_args(SceneArgs::augment_args(Command::new("")));
        let (args, settings) = (&self.subject.args, self.settings());
        let mut words = ["twobounce", "render", &args.path.display().to_string()].map(str::to_owned).to_vec();
        words.extend(words::kept(&self.subject.typed, &own, &of_both, replaced));
        if let Some(Eye { eye, target, up, fov }) = self.eye {
            let point = |p: glam::DVec3| format!("{},{},{}", p.x, p.y, p.z);
            words.extend([
                format!("--eye={}", point(eye)),
                format!("--target={}", point(target)),
                format!("--up={}", point(up)),
                format!("--fov={fov}"),
            ]);
        }
        let (width, height) = self.shown.as_ref().map_or(args.size, |shown| shown.screen.size());
        words.extend([
            format!("--time={}", args.time + self.later_s),
            format!("--size={width}x{height}"),
            format!("--preset={}", self.panel.preset),
        ]);
        words.extend(changed(&self.panel.preset, &settings).into_iter().map(|set| format!("--set={set}")));
        let choice = &self.panel.choice;
        let exposure = choice.exposure.or(self.frame.as_ref().map(|frame| frame.display.exposure_ev)).unwrap_or(0.0);
        words.extend(["--noise=off".into(), format!("--tonemap={}", choice.tone), format!("--exposure={exposure}")]);
        words.extend(["-o".into(), "image.png".into()]);
        words::line(&words)
    }

    /// Writes the shown image as a PNG, and next to it as an EXR with the settings.
    pub(super) fn save(&self, path: &Path) -> anyhow::Result<()> {
        let frame = self.frame.as_ref().context("there is no picture to save yet: wait for the first")?;
        let mut image = frame.image.clone();
        image.layers.retain(|(layer, _)| *layer != Aov::Alpha);
        image.write_shown(path, frame.display)?;
        let exr = path.with_extension("exr");
        let header = [("settings", self.settings().to_toml()), ("command", self.command())];
        let header = header.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        image.write_exr(&exr, &header)?;
        say!("wrote {} and {}", out::name(path), out::name(&exr));
        Ok(())
    }
}

/// `key=value` of every difference from a preset.
fn changed(preset: &str, settings: &Settings) -> Vec<String> {
    let base = Settings::preset(preset).unwrap_or_default().entries();
    let pairs = settings.entries().into_iter().zip(base);
    pairs.filter(|((_, now), (_, was))| now != was).map(|((key, now), _)| format!("{}={now}", key.name)).collect()
}
