//! Images of other programs: their descriptions, the checks, and the errors that can be measured.
//!
//! An image is linear radiance in an OpenEXR file with the chart's size and camera. Its time is stated by the user. The
//! error of the whole image is measured like that of any other row. The indirect light needs an image with exact direct
//! light ([`crate::measure::terms`]). For this program's own images the header states whether it is exact, for others
//! the user does.

use std::fs;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::measure::{ChartScene, Images, same_depth};
use super::row::{Row, Source};
use crate::error::said;
use crate::layers::{Aov, Layers};
use crate::measure::metrics::NonFinite;
use crate::measure::terms::{self, Subtract};
use crate::output::exr::Metadata;
use crate::output::read;
use crate::reference::Depth;
use crate::settings::Settings;
use crate::{Error, Result};

/// The description of an image before it is read.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Named {
    /// Its name in the chart.
    pub name: String,
    /// The file, from the folder of the file that names it.
    pub image: PathBuf,
    pub milliseconds: f64,
    /// The person or group who provided it.
    pub by: Option<String>,
    /// The device on which the time was measured.
    pub device: Option<String>,
    pub note: Option<String>,
    /// The scene's name in the chart, if it has several scenes.
    pub scene: Option<String>,
    /// Indirect bounces of its light; by default all.
    pub bounces: Option<u32>,
    /// Whether its direct light is exact.
    pub direct: Option<Exact>,
    /// Another image of the same program, whose direct light is exact.
    pub equal_terms_image: Option<PathBuf>,
}

/// The only possible statement about direct light.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Exact {
    Exact,
}

/// The word that ends `--import` for [`Exact`].
const EXACT_DIRECT: &str = "exact-direct";

/// The description in an import's row; nothing in it was measured here.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Claim {
    /// The stated time of a frame.
    pub milliseconds: f64,
    pub by: Option<String>,
    pub device: Option<String>,
    pub note: Option<String>,
    /// The name of the image's file.
    pub image: String,
    /// The name of the file on which the indirect light was measured, if it is another one.
    pub equal_terms_image: Option<String>,
    /// A sentence about how the indirect light was measured, or why it was not.
    pub indirect: String,
    #[serde(skip)]
    pub files: Files,
}

/// The files of an import when they were opened; empty in stored rows.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Files {
    /// The image, and the one on equal terms if it is another file, with their headers.
    images: Vec<(PathBuf, Metadata)>,
    /// Hash of their bytes.
    pub hash: String,
    size: (u32, u32),
    /// Indirect bounces, if they were stated.
    pub bounces: Option<u32>,
    direct: Direct,
}

/// The measurement of an import's indirect light.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Direct {
    /// With the direct layer of the image on equal terms.
    Layer,
    /// With the reference's direct light, which the image's own is stated to equal.
    OfReference,
    /// It is unknown whether its direct light is exact.
    #[default]
    Unknown,
    /// Its header says that its direct light is not exact.
    Approximate,
}

impl Direct {
    fn sentence(self) -> &'static str {
        match self {
            Self::Layer => {
                "The indirect light is the image less its own direct layer; in a scene with a sky, less the reference's."
            }
            Self::OfReference => {
                "The indirect light is the image less the reference's direct light: the image's own is said to be exact."
            }
            Self::Unknown => "The indirect light is not judged: nothing says that the image's direct light is exact.",
            Self::Approximate => {
                "The indirect light is not judged: the image's header says that its direct light is not the exact one."
            }
        }
    }
}

impl Named {
    /// Parses `NAME=IMAGE.exr,MILLISECONDS` or `NAME=IMAGE.exr,MILLISECONDS,exact-direct`.
    ///
    /// # Errors
    /// [`Error::Usage`] if the text has another form.
    pub fn parse(text: &str) -> Result<Self> {
        let form = || Error::Usage(format!("--import: {text:?} is not NAME=IMAGE.exr,MILLISECONDS; write it so"));
        let (name, rest) = text.split_once('=').ok_or_else(form)?;
        let (rest, direct) = match rest.rsplit_once(',') {
            Some((rest, EXACT_DIRECT)) => (rest, Some(Exact::Exact)),
            _ => (rest, None),
        };
        let (image, milliseconds) = rest.rsplit_once(',').filter(|(image, _)| !image.is_empty()).ok_or_else(form)?;
        let milliseconds = milliseconds.trim().parse().map_err(|_| form())?;
        let (name, image) = (name.to_owned(), PathBuf::from(image));
        Self { name, image, milliseconds, direct, ..Self::default() }.checked("--import").map_err(Error::Usage)
    }

    /// The tables `[[import]]` of a TOML file; paths are relative to its folder.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read, has another format, or an entry is wrong.
    pub fn read(path: &Path) -> Result<Vec<Self>> {
        #[derive(Deserialize)]
        #[serde(deny_unknown_fields)]
        struct File {
            import: Vec<Named>,
        }
        let text = read::text(path, "list of imports")?;
        let file: File = toml::from_str(&text).map_err(|e| {
            let line = e.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let said = said(&e.message());
            Error::file(path, format!("line {line}: {said}; docs/usage.md shows a list of imports"))
        })?;
        let folder = path.parent().unwrap_or(Path::new(""));
        let placed = |named: Self| {
            let equal_terms_image = named.equal_terms_image.as_ref().map(|image| folder.join(image));
            let placed = Self { image: folder.join(&named.image), equal_terms_image, ..named };
            placed.checked("[[import]]").map_err(|problem| Error::file(path, problem))
        };
        file.import.into_iter().map(placed).collect()
    }

    /// The description itself, if its time and texts are valid; else a sentence that begins with `place`.
    fn checked(self, place: &str) -> std::result::Result<Self, String> {
        let texts = [("by", &self.by), ("device", &self.device), ("note", &self.note), ("scene", &self.scene)];
        let texts = texts.into_iter().map(|(key, text)| (key, text.as_ref()));
        for (key, text) in std::iter::once(("name", Some(&self.name))).chain(texts) {
            let Some(text) = text else { continue };
            let most = if key == "note" { 400 } else { 64 };
            if text.trim().is_empty() || text.chars().count() > most {
                return Err(format!("{place}: the {key} {text:?} is empty or long; write 1 to {most} characters"));
            }
            if text.chars().any(is_control) {
                return Err(format!("{place}: the {key} {text:?} has control characters; leave them out"));
            }
            // The scene's name is only compared.
            if key != "scene" && (text.starts_with(['=', '+', '-', '@']) || text.trim() != text) {
                return Err(format!(
                    "{place}: the {key} {text:?} begins with a space or one of = + - @, which tables take for a formula, or ends \
                     with a space; begin and end it with something else"
                ));
            }
        }
        if !(self.milliseconds.is_finite() && self.milliseconds > 0.0) {
            let (name, given) = (&self.name, self.milliseconds);
            return Err(format!("{place}: {name} takes {given} ms; write milliseconds, finite and above 0"));
        }
        Ok(self)
    }

    /// Reads and checks the image, and makes its row.
    ///
    /// # Errors
    /// [`Error::File`] unless it is a linear image of this size with finite radiance of at least 0.
    pub fn open(self, size: (u32, u32)) -> Result<Row> {
        let (mut images, mut has_layer) = (Vec::new(), false);
        for path in [Some(&self.image), self.equal_terms_image.as_ref()].into_iter().flatten() {
            let (image, header) = image_of(path, size)?;
            // The last image is the one on equal terms.
            has_layer = image.get(Aov::Direct).is_some();
            images.push((path.clone(), header));
        }
        let is_other = self.equal_terms_image.is_some();
        let (path, header) = images.last().expect("every import has an image");
        let changes = header.get(terms::HEADER);
        let is_said = self.direct.is_some() || is_other;
        let direct = match changes.map(String::as_str) {
            Some("") if has_layer => Direct::Layer,
            Some(changes) if !changes.is_empty() && is_said => {
                let sets: Vec<String> = changes.split(' ').map(|change| format!("--set {change}")).collect();
                let sets = sets.join(" ");
                let why = format!("has direct light that is not exact, as its header says; render it with {sets}");
                return Err(Error::file(path, why));
            }
            Some(changes) if !changes.is_empty() => Direct::Approximate,
            Some(_) => Direct::OfReference,
            _ if is_said && has_layer => Direct::Layer,
            _ if is_said => Direct::OfReference,
            _ => Direct::Unknown,
        };
        let file_name = |path: &PathBuf| path.file_name().map_or(String::new(), |n| n.to_string_lossy().into_owned());
        let claim = Claim {
            milliseconds: self.milliseconds,
            by: self.by,
            device: self.device,
            note: self.note,
            image: file_name(&self.image),
            equal_terms_image: self.equal_terms_image.as_ref().map(file_name),
            indirect: direct.sentence().to_owned(),
            files: Files { hash: hash(&images)?, images, size, bounces: self.bounces, direct },
        };
        let (name, scene) = (self.name, self.scene.unwrap_or_default());
        Ok(Row { name, scene, source: Source::Import(Box::new(claim)), ..Row::default() })
    }
}

impl Claim {
    /// Checks that the image can show the chart's scene: if its header names the scene, the camera or the time, these
    /// must be equal.
    ///
    /// # Errors
    /// [`Error::File`] that names both.
    pub fn check_view(&self, seen: &Metadata) -> Result<()> {
        for (path, header) in &self.files.images {
            for (key, words) in [("sceneHash", "scene"), ("camera", "camera"), ("time", "time"), ("sky", "sky")] {
                let (Some(own), Some(charts)) = (header.get(key), seen.get(key)) else { continue };
                if own != charts {
                    let [own, charts] = [header, seen].map(|of| of.get(words).map_or("", String::as_str));
                    return Err(Error::file(
                        path,
                        format!(
                            "shows another {words} ({own:?}) than the chart ({charts:?}); render it as the chart does"
                        ),
                    ));
                }
            }
        }
        Ok(())
    }

    /// The depth of the reference with as many bounces.
    pub fn depth(&self, scene: &ChartScene) -> Depth {
        let own = || {
            let mut settings = Settings::default();
            settings.merge_toml(self.files.images.first()?.1.get("settings")?).ok()?;
            Some(same_depth(&scene.scene, &settings))
        };
        self.files.bounces.map(Depth::Bounces).or_else(own).unwrap_or(Depth::Full)
    }

    /// The direct light to subtract; `None` if the indirect light is not judged.
    pub fn subtract(&self, scene: &ChartScene) -> Option<Subtract> {
        match self.files.direct {
            Direct::Layer => Some(Subtract::in_scene(&scene.scene)),
            Direct::OfReference => Some(Subtract::OfReference),
            Direct::Unknown | Direct::Approximate => None,
        }
    }

    /// The images, read again.
    ///
    /// # Errors
    /// [`Error::File`] if a file changed since the chart began.
    pub fn images(&self) -> Result<Images> {
        let Files { images, hash: before, size, .. } = &self.files;
        let Some((first, _)) = images.first() else {
            return Err(Error::Usage("an import that was kept has no images of its own; name them again".into()));
        };
        let read = images.iter().map(|(path, _)| Ok(image_of(path, *size)?.0));
        let mut read = read.collect::<Result<Vec<_>>>()?.into_iter();
        if hash(images)? != *before {
            return Err(Error::file(first, "changed while the chart was made; start the same command again"));
        }
        Ok(Images { whole: read.next().expect("every import has an image"), equal: read.next() })
    }
}

/// Hash of the bytes of all files.
fn hash(images: &[(PathBuf, Metadata)]) -> Result<String> {
    let mut hasher = blake3::Hasher::new();
    for (path, _) in images {
        hasher.update(&fs::read(path).map_err(|e| read::unreadable(path, &e))?);
    }
    Ok(hasher.finalize().to_string())
}

/// Whether a character is a control character or changes the direction of text.
fn is_control(c: char) -> bool {
    c.is_control() || matches!(c, '\u{200e}'..='\u{200f}' | '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

/// The image in a file, if it has this size and holds radiance.
fn image_of(path: &Path, size: (u32, u32)) -> Result<(Layers, Metadata)> {
    const MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    read::about(path, "an OpenEXR image")?;
    let mut start = [0; 4];
    let read = fs::File::open(path).and_then(|mut file| std::io::Read::read_exact(&mut file, &mut start));
    if read.is_err() || start != MAGIC {
        let text = "is no OpenEXR image; a chart judges linear radiance, so have the other program write an .exr";
        return Err(Error::file(path, text));
    }
    let (mut image, header) = Layers::read_exr(path).map_err(|error| match error {
        Error::File { path, problem } if problem.contains("no channels R, G and B") => {
            Error::File { path, problem: format!("{problem}; write linear radiance into channels of these names") }
        }
        other => other,
    })?;
    image.layers.retain(|(aov, _)| matches!(aov, Aov::Beauty | Aov::Direct));
    let (width, height) = size;
    if (image.width, image.height) != size {
        let (w, h) = (image.width, image.height);
        let text = format!(
            "is {w}x{h} pixels, the chart {width}x{height}; render it at the chart's size, or chart with --size {w}x{h}"
        );
        return Err(Error::file(path, text));
    }
    for (aov, pixels) in &image.layers {
        let of = if *aov == Aov::Beauty { String::new() } else { format!(" in its layer {aov}") };
        let NonFinite { nan, inf } = NonFinite::of_pixels(pixels);
        if nan + inf > 0 {
            let text = format!(
                "has {nan} NaN and {inf} infinite values{of}; a chart judges finite radiance, so render it again"
            );
            return Err(Error::file(path, text));
        }
        let negative = pixels.iter().flatten().filter(|value| **value < 0.0);
        let (count, least) = negative.fold((0, 0.0f32), |(count, least), value| (count + 1, least.min(*value)));
        if count > 0 {
            let text = format!(
                "has {count} negative values{of}, down to {least}; radiance is at least 0, so render it with a pixel filter that has \
                 no negative weights"
            );
            return Err(Error::file(path, text));
        }
    }
    Ok((image, header))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_import_on_the_command_line_is_read_from_its_end() {
        let named = Named::parse("Other 1=a,b=c.exr,12.5").unwrap();
        assert_eq!(
            (named.name.as_str(), named.image.to_str(), named.milliseconds),
            ("Other 1", Some("a,b=c.exr"), 12.5)
        );
        assert_eq!(named.direct, None);
        assert_eq!(Named::parse("o=c.exr,1e3,exact-direct").unwrap().direct, Some(Exact::Exact));
    }
}
