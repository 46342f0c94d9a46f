//! The command that makes what is seen, and files of it.

use std::path::Path;

use anyhow::Context as _;
use twobounce::layers::Aov;
use twobounce::settings::Settings;

use super::App;
use super::eye::Eye;
use crate::cli::{out, words};
use crate::say;

/// Flags that what is seen replaces; each takes a value.
const REPLACED: [&str; 15] = [
    "--size",
    "--camera",
    "--eye",
    "--target",
    "--up",
    "--fov",
    "--time",
    "--preset",
    "--config",
    "--method",
    "--set",
    "--exposure",
    "--glsl",
    "--script",
    "--refine",
];

/// Flags without a value that only the window has.
const OF_WINDOW: [&str; 1] = ["--play"];

/// What is seen, as flags.
pub struct Seen<'a> {
    /// As typed after `twobounce view`.
    pub typed: &'a [String],
    /// `None` where the camera is still the one that was asked for.
    pub eye: Option<Eye>,
    pub time_s: f64,
    pub size: (u32, u32),
    pub preset: &'a str,
    pub settings: &'a Settings,
    pub exposure_ev: f32,
}

impl Seen<'_> {
    /// The `twobounce render` command that makes the same picture, for a shell.
    pub fn command(&self) -> String {
        let camera = ["--camera", "--eye", "--target", "--up", "--fov"];
        let keeps = |flag: &str| !REPLACED.contains(&flag) || self.eye.is_none() && camera.contains(&flag);
        let mut words = vec!["twobounce".to_owned(), "render".to_owned()];
        let mut typed = self.typed.iter();
        while let Some(word) = typed.next() {
            let flag = word.split('=').next().unwrap_or(word);
            if OF_WINDOW.contains(&flag) {
                continue;
            }
            if keeps(flag) {
                words.push(word.clone());
            } else if flag == word {
                typed.next(); // its value
            }
        }
        if let Some(Eye { eye, target, up, fov }) = self.eye {
            let point = |p: glam::DVec3| format!("{},{},{}", p.x, p.y, p.z);
            words.extend([
                format!("--eye={}", point(eye)),
                format!("--target={}", point(target)),
                format!("--up={}", point(up)),
                format!("--fov={fov}"),
            ]);
        }
        words.extend([
            format!("--time={}", self.time_s),
            format!("--size={}x{}", self.size.0, self.size.1),
            format!("--preset={}", self.preset),
        ]);
        words.extend(changed(self.preset, self.settings).into_iter().map(|set| format!("--set={set}")));
        words.extend([format!("--exposure={}", self.exposure_ev), "-o".into(), "image.png".into()]);
        words::line(&words)
    }
}

impl App {
    /// The settings that make what is shown: of a refined picture, with as many passes.
    pub(super) fn settings(&self) -> Settings {
        let mut settings = self.panel.settings.clone();
        if let Some((_, frame)) = self.frame.as_ref().filter(|_| self.rests()) {
            settings.image.passes = settings.image.passes.max(frame.refined.passes);
        }
        settings
    }

    pub(super) fn command(&self) -> String {
        let exposure = self.panel.exposure.or(self.frame.as_ref().map(|(_, frame)| frame.exposure_ev));
        let seen = Seen {
            typed: &self.subject.typed,
            eye: self.eye,
            time_s: self.subject.args.time + self.later_s,
            size: self.shown.as_ref().map_or(self.subject.args.size, |shown| shown.screen.size()),
            preset: &self.panel.preset,
            settings: &self.settings(),
            exposure_ev: exposure.unwrap_or(0.0),
        };
        seen.command()
    }

    /// Writes the image that is shown as a PNG, and beside it as an EXR with the settings.
    pub(super) fn save(&self, path: &Path) -> anyhow::Result<()> {
        let (_, frame) = self.frame.as_ref().context("there is no picture to save yet: wait for the first")?;
        let mut image = frame.image.clone();
        image.layers.retain(|(layer, _)| *layer != Aov::Alpha);
        image.write_png(path, frame.exposure_ev)?;
        let exr = path.with_extension("exr");
        let header = [("settings", self.settings().to_toml()), ("command", self.command())];
        let header = header.into_iter().map(|(name, value)| (name.to_owned(), value)).collect();
        image.write_exr(&exr, &header)?;
        say!("wrote {} and {}", out::name(path), out::name(&exr));
        Ok(())
    }
}

/// `key=value` of everything that differs from a preset.
fn changed(preset: &str, settings: &Settings) -> Vec<String> {
    let base = Settings::preset(preset).unwrap_or_default().entries();
    let pairs = settings.entries().into_iter().zip(base);
    pairs.filter(|((_, now), (_, was))| now != was).map(|((key, now), _)| format!("{}={now}", key.name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_keeps_what_was_typed_but_what_is_seen() {
        let typed =
            ["a b.glb", "--size", "64x64", "--play", "--sky=0.5", "--set", "voxels=32", "--strict"].map(str::to_owned);
        let mut settings = Settings::fast();
        settings.set("voxels=16").unwrap();
        let seen = Seen {
            typed: &typed,
            eye: None,
            time_s: 0.5,
            size: (32, 16),
            preset: "fast",
            settings: &settings,
            exposure_ev: -0.25,
        };
        let words = "twobounce render 'a b.glb' --sky=0.5 --strict --time=0.5 --size=32x16 --preset=fast \
                     --set=voxels=16 --exposure=-0.25 -o image.png";
        assert_eq!(seen.command(), words);
    }
}
