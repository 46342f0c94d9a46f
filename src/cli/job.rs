//! What the arguments of `render` mean: everything checked that needs neither the scene nor a device. `profile` checks its
//! outputs here too.

use std::path::{Path, PathBuf};

use twobounce::layers::Aov;
use twobounce::output::file;
use twobounce::profile::WARM_UP;
use twobounce::settings::Settings;
use twobounce::{Error, Result};

use super::args::{RenderArgs, SceneArgs, SettingsArgs};

/// A render that can begin.
#[derive(Debug)]
pub struct RenderJob {
    pub settings: Settings,
    pub output: Output,
    /// The image first, then the layers asked for, each once.
    pub aovs: Vec<Aov>,
    pub frames: Frames,
    /// Frames rendered before timing starts, so that shader compilation is not timed.
    pub warm_up: u32,
    /// Whether frames keep what stands still; else each is made anew, to be timed.
    pub still: bool,
}

/// Which frames to render.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Frames {
    /// The same frame this many times; the last is written.
    Repeat(u32),
    /// So many frames, each later than the one before by this many seconds, all written.
    Sequence { count: u32, step_s: f64 },
}

/// Where images go.
#[derive(Clone, Debug, PartialEq)]
pub struct Output {
    pub format: Format,
    name: Name,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Png,
    Exr,
}

#[derive(Clone, Debug, PartialEq)]
enum Name {
    One(PathBuf),
    /// `before%0<digits>dafter`.
    Numbered {
        before: String,
        digits: usize,
        after: String,
    },
}

impl RenderJob {
    /// Checks the arguments against each other and that every output can be written.
    pub fn new(args: &RenderArgs) -> Result<Self> {
        let settings = args.settings.effective()?;
        args.scene.check()?;
        let output = Output::new(&args.output, args.frames.is_some())?;
        if output.format == Format::Png && !args.aov.is_empty() {
            return usage("--aov adds layers to an .exr; name one with -o");
        }
        if output.format == Format::Exr && args.exposure.is_some() {
            return usage("--exposure is for a .png; an .exr holds the radiance itself");
        }
        if args.exposure.is_some_and(|ev| !(-60.0..=60.0).contains(&ev)) {
            return usage("--exposure takes stops between -60 and 60");
        }
        let frames = match args.frames {
            None => Frames::Repeat(args.repeat),
            Some(count) if args.fps.is_finite() && args.fps > 0.0 => Frames::Sequence { count, step_s: 1.0 / args.fps },
            Some(_) => return usage("--fps takes frames per second, finite and above 0"),
        };
        let image = output.path(0);
        let targets = [Some(&image), args.json.as_ref(), args.trace.as_ref()];
        check_targets(targets.into_iter().flatten(), &args.scene, &args.settings)?;
        let mut aovs = vec![Aov::Beauty];
        aovs.extend(Aov::ALL.iter().filter(|a| args.aov.contains(a)));
        let timed = args.timings || args.json.is_some() || args.trace.is_some() || args.repeat > 1;
        let still = args.still || args.frames.is_some();
        Ok(Self { settings, output, aovs, frames, warm_up: if timed { WARM_UP } else { 0 }, still })
    }
}

/// Every file to be written can be, is no input, and is written once.
pub fn check_targets<'a>(
    targets: impl IntoIterator<Item = &'a PathBuf>,
    scene: &SceneArgs,
    settings: &SettingsArgs,
) -> Result<()> {
    let mut others: Vec<&Path> = Vec::new();
    for target in targets {
        let mut inputs = [Some(&scene.path), settings.config.as_ref()].into_iter().flatten();
        if inputs.any(|input| file::is_same(target, input)) {
            return Err(Error::file(target, "is read and written by the same command; name another output"));
        }
        // A pipe or a device takes several.
        if others.iter().any(|other| file::is_same(target, other)) && (target.is_file() || !target.exists()) {
            return Err(Error::file(target, "is named as two outputs; name them apart"));
        }
        file::check_writable(target)?;
        others.push(target);
    }
    Ok(())
}

fn usage<T>(sentence: &str) -> Result<T> {
    Err(Error::Usage(sentence.to_owned()))
}

impl Output {
    /// Reads the extension and, for a sequence, the place of the frame's number.
    fn new(path: &Path, sequence: bool) -> Result<Self> {
        let format = match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("png") => Format::Png,
            Some("exr") => Format::Exr,
            _ => return Err(Error::file(path, "has an unknown ending; end the output in .png or .exr")),
        };
        let numbered = path.to_str().and_then(Name::numbered);
        let name = match (numbered, sequence) {
            (Some(name), true) => name,
            (None, false) => Name::One(path.to_owned()),
            (None, true) => {
                return Err(Error::file(path, "has no place for the frame's number; name it like out_%04d.png"));
            }
            (Some(_), false) => {
                return Err(Error::file(path, "has a place for a frame's number; add --frames N or take it out"));
            }
        };
        Ok(Self { format, name })
    }

    /// The file for a frame, counted from 0.
    pub fn path(&self, frame: u32) -> PathBuf {
        match &self.name {
            Name::One(path) => path.clone(),
            Name::Numbered { before, digits, after } => format!("{before}{frame:0digits$}{after}").into(),
        }
    }
}

impl Name {
    /// A name with exactly one `%d` or `%04d`.
    fn numbered(text: &str) -> Option<Self> {
        let (before, rest) = text.split_once('%')?;
        let (width, after) = rest.split_once('d')?;
        // 20 digits hold any count; more would be a slip of the hand.
        let digits = if width.is_empty() { 1 } else { width.parse().ok().filter(|n| (1..=20).contains(n))? };
        (!after.contains('%')).then(|| Self::Numbered { before: before.into(), digits, after: after.into() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path_of(name: &str, frame: u32) -> Option<String> {
        Output::new(Path::new(name), true).ok().map(|o| o.path(frame).to_string_lossy().into_owned())
    }

    #[test]
    fn numbers_stand_where_the_pattern_says() {
        assert_eq!(path_of("a/out_%04d.png", 7).as_deref(), Some("a/out_0007.png"));
        assert_eq!(path_of("%d.exr", 12345).as_deref(), Some("12345.exr"));
        assert_eq!(path_of("out_%2d_dawn.png", 7).as_deref(), Some("out_07_dawn.png"));
        for wrong in ["out.png", "out_%.png", "out_%s.png", "%04d_%04d.png", "out_%99d.png", "out_%04d.gif"] {
            assert_eq!(path_of(wrong, 0), None, "{wrong}");
        }
    }
}
