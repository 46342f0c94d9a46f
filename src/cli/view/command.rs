//! The command that makes what is seen.

use twobounce::settings::Settings;

use super::eye::Eye;
use crate::cli::shell::quoted;

/// Flags that what is seen replaces; each takes a value.
const REPLACED: [&str; 14] = [
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
        words.iter().map(|word| quoted(word)).collect::<Vec<_>>().join(" ")
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
