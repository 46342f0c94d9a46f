//! Checks of output files before any work.

use std::path::{Path, PathBuf};

use twobounce::output::file;
use twobounce::output::picture::ImageKind;
use twobounce::{Error, Result};

/// The image files of a render.
#[derive(Clone, Debug, PartialEq)]
pub struct ImageFiles {
    pub kind: ImageKind,
    path: PathBuf,
    /// The frame's number in the name: the text before it, the number of digits, and the text after it.
    number: Option<(String, usize, String)>,
}

/// Checks for every output file that it can be written, is not an input, and is written once; `-` is standard output.
pub fn check(inputs: &[Option<&PathBuf>], outputs: &[Option<&PathBuf>]) -> Result<()> {
    for (i, output) in outputs.iter().enumerate().filter_map(|(i, output)| Some((i, (*output)?))) {
        let standard = file::is_standard(output);
        let is_among = |files: &[Option<&PathBuf>]| files.iter().flatten().any(|file| file::is_same(output, file));
        if !standard && is_among(inputs) {
            return Err(Error::file(output, "is read and written by the same command; name another output"));
        }
        if standard {
            super::out::check_open()?;
        }
        // A pipe or a device can take several.
        if is_among(&outputs[..i]) && (output.is_file() || !output.exists()) {
            return Err(Error::file(output, "is named as two outputs; name them apart"));
        }
        file::check_writable(output)?;
    }
    super::out::leave_to(outputs);
    Ok(())
}

/// Refuses an input that is an image for a display if linear radiance is needed.
pub fn refuse_display_image(path: &Path) -> Result<()> {
    let ending = path.extension().and_then(|ending| ending.to_str()).unwrap_or_default().to_lowercase();
    if ["png", "jpg", "jpeg"].contains(&ending.as_str()) {
        return Err(Error::file(
            path,
            "is an image for a display; write linear radiance with -o NAME.exr and name that",
        ));
    }
    Ok(())
}

impl ImageFiles {
    /// Standard output.
    pub fn standard(kind: ImageKind) -> Self {
        Self { kind, path: "-".into(), number: None }
    }

    /// Reads the extension and, for a sequence, the place of the frame's number.
    pub fn named(path: &Path, sequence: bool) -> Result<Self> {
        let unknown = || Error::file(path, "has an unknown ending; end the output in .png, .jpg or .exr");
        let kind = ImageKind::of_path(path).ok_or_else(unknown)?;
        let number = path.to_str().and_then(number_in);
        match (&number, sequence) {
            (None, true) => Err(Error::file(path, "has no place for the frame's number; name it like out_%04d.png")),
            (Some(_), false) => {
                Err(Error::file(path, "has a place for a frame's number; add --frames N or take it out"))
            }
            _ => Ok(Self { kind, path: path.to_owned(), number }),
        }
    }

    /// The file for a frame, counted from 0.
    pub fn path(&self, frame: u32) -> PathBuf {
        match &self.number {
            None => self.path.clone(),
            Some((before, digits, after)) => format!("{before}{frame:0digits$}{after}").into(),
        }
    }
}

/// The text with exactly one `%d` or `%04d`, split.
fn number_in(text: &str) -> Option<(String, usize, String)> {
    let (before, rest) = text.split_once('%')?;
    let (width, after) = rest.split_once('d')?;
    // 20 digits can hold any number; more would be a typing error.
    let digits = if width.is_empty() { 1 } else { width.parse().ok().filter(|n| (1..=20).contains(n))? };
    (!after.contains('%')).then(|| (before.into(), digits, after.into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn path_of(name: &str, frame: u32) -> Option<String> {
        ImageFiles::named(Path::new(name), true).ok().map(|o| o.path(frame).to_string_lossy().into_owned())
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
