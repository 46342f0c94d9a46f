//! The suite: scenes with cameras, references with known errors, and rows for images of any program.
//!
//! `suite/suite.toml` lists the scenes. A reference is the mean of traces with different seeds, whose spread gives its
//! standard error. Every row is compared with all light by the definition of all charts.

mod rows;

use std::path::{Path, PathBuf};

use glam::DVec3;
use serde::Deserialize;

use super::measure::ReferenceImage;
use super::row::Row;
use crate::error::said;
use crate::layers::{Layers, relative_noise};
use crate::measure::metrics::noise_in_rel;
use crate::output::exr::Metadata;
use crate::output::{file, read};
use crate::reference::Depth;
use crate::settings::{Bounces, Settings};
use crate::{Error, Result};

pub use rows::{COLUMNS, Judged, Rows};

/// The content of `suite.toml`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Suite {
    /// Sides of the square images in pixels. The first one is traced, and the others are averages of it.
    pub sides: Vec<u32>,
    /// Seeds of the traces.
    pub seeds: Vec<u64>,
    /// Settings for every rendered preset.
    pub settings: Vec<String>,
    #[serde(rename = "scene")]
    pub scenes: Vec<Entry>,
    #[serde(skip)]
    folder: PathBuf,
}

/// A scene of the suite. The camera is that of its file, in numbers that every program can use.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    pub name: String,
    /// The path relative to the suite's folder.
    pub file: PathBuf,
    /// The time within the file's animation in seconds.
    pub time_s: f64,
    pub eye: [f64; 3],
    pub target: [f64; 3],
    pub up: [f64; 3],
    /// Vertical field of view.
    pub fov_degrees: f64,
    /// Samples per pixel of each trace.
    pub samples: u32,
}

impl Suite {
    /// Reads `suite.toml` of a folder.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read or has another format.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join("suite.toml");
        let wrong =
            |why: &str| Error::file(&path, format!("{why}; write it as this project's suite/suite.toml is written"));
        let suite: Self =
            toml::from_str(&read::text(&path, "list of scenes")?).map_err(|e| wrong(&said(&e.message())))?;
        let divides = |side: &u32| *side > 0 && suite.sides[0].is_multiple_of(*side);
        match suite.seeds.len() > 1 && !suite.sides.is_empty() && suite.sides.iter().all(divides) {
            true => Ok(Self { folder: folder.to_owned(), ..suite }),
            false => Err(wrong("has fewer than two seeds, no sides, or a side that does not divide the first one")),
        }
    }

    /// The scenes with these names; all without names.
    ///
    /// # Errors
    /// [`Error::Usage`] for a name without a scene.
    pub fn named(&self, names: &[String]) -> Result<Vec<&Entry>> {
        let all: Vec<&str> = self.scenes.iter().map(|scene| scene.name.as_str()).collect();
        let find = |name: &String| {
            let wrong = || Error::Usage(format!("the suite has no scene {name:?}; name one of {}", all.join(", ")));
            self.scenes.iter().find(|scene| scene.name == *name).ok_or_else(wrong)
        };
        if names.is_empty() { Ok(self.scenes.iter().collect()) } else { names.iter().map(find).collect() }
    }

    /// The file of a scene.
    pub fn path(&self, scene: &Entry) -> PathBuf {
        self.folder.join(&scene.file)
    }

    /// The files of a reference: the image, and the standard error of its values.
    pub fn files(&self, scene: &Entry, side: u32) -> [PathBuf; 2] {
        ["", "-error"].map(|end| self.folder.join(format!("references/{}-{side}{end}.exr", scene.name)))
    }

    /// A stored reference of all light.
    ///
    /// # Errors
    /// [`Error::File`] if it is missing or has another size.
    pub fn reference(&self, scene: &Entry, side: u32) -> Result<ReferenceImage> {
        let read = |path: PathBuf| match Layers::read_exr(&path) {
            Ok((layers, _)) if (layers.width, layers.height) == (side, side) => Ok(layers),
            _ => {
                let text = format!("is missing or damaged; make it with `twobounce suite {} --references`", scene.name);
                Err(Error::file(path, text))
            }
        };
        let [image, error] = self.files(scene, side).map(read);
        let (layers, error) = (image?, error?);
        let (noise, noise_in_rel) = (noise(&layers, &error), noise_in_rel(&layers, error.beauty()));
        Ok(ReferenceImage { depth: Depth::Full, noise, layers, noise_in_rel })
    }

    /// Writes the references of all sides from traces of the first one. `header` is that of the images.
    ///
    /// # Errors
    /// [`Error::File`] if a file cannot be written.
    pub fn write_references(&self, scene: &Entry, traces: &[Layers], header: &Metadata) -> Result<()> {
        file::create_folder(&self.folder.join("references"))?;
        for &side in &self.sides {
            let [image, error] = &mean(traces, side);
            let mut header = header.clone();
            header.insert("noise".into(), format!("{:.6}", noise(image, error)));
            let [image_file, error_file] = self.files(scene, side);
            error.write_exr(&error_file, &header)?;
            image.write_exr(&image_file, &header)?;
        }
        Ok(())
    }

    /// The settings of a row: a preset, then those of the suite, then `sets`.
    ///
    /// # Errors
    /// [`Error::Usage`] if a preset or setting does not exist, or the bounces are limited.
    pub fn row(&self, preset: &str, sets: &[String]) -> Result<Row> {
        let mut settings = Settings::preset(preset)?;
        self.settings.iter().chain(sets).try_for_each(|set| settings.set(set))?;
        match settings.bounces {
            Bounces::All => Ok(Row::of_settings(preset, sets, settings)),
            _ => Err(Error::Usage("--set bounces: the references hold all light; leave it out".into())),
        }
    }
}

/// Root mean square of the pixels' relative error.
fn noise(image: &Layers, error: &Layers) -> f64 {
    let wide = |pixel: &[f32; 3]| DVec3::from(pixel.map(f64::from));
    relative_noise(image.beauty().iter().zip(error.beauty()).map(|(value, error)| (wide(value), wide(error))))
}

/// The mean of traces of a square image, and the standard error of that mean, at this side.
fn mean(traces: &[Layers], side: u32) -> [Layers; 2] {
    // The bits of a mantissa are limited to keep files small: a half float has as many, and the standard error of a few
    // traces is less certain.
    const VALUE_BITS: u32 = 10;
    const ERROR_BITS: u32 = 3;
    let (n, first) = (traces.len() as f64, &traces[0]);
    let (mut image, mut error) = (Layers::new(side, side, vec![]), Layers::new(side, side, vec![]));
    image.layers.clear();
    for (at, (aov, _)) in first.layers.iter().enumerate() {
        let small: Vec<Vec<DVec3>> =
            traces.iter().map(|trace| shrunk(&trace.layers[at].1, trace.width, side)).collect();
        let of_all = |pixel: usize| small.iter().map(move |trace| trace[pixel]);
        let means: Vec<DVec3> = (0..small[0].len()).map(|pixel| of_all(pixel).sum::<DVec3>() / n).collect();
        if at == 0 {
            let square = |pixel: usize| of_all(pixel).map(|value| (value - means[pixel]).powf(2.0)).sum::<DVec3>();
            let errors = (0..means.len()).map(|pixel| (square(pixel) / (n * (n - 1.0))).powf(0.5));
            error.layers[0].1 = errors.map(|value| rounded(value, ERROR_BITS)).collect();
        }
        image.layers.push((*aov, means.iter().map(|value| rounded(*value, VALUE_BITS)).collect()));
    }
    [image, error]
}

/// A square image whose pixels are averages over blocks of another one.
fn shrunk(pixels: &[[f32; 3]], from: u32, side: u32) -> Vec<DVec3> {
    let (step, mut sums) = (from / side, vec![DVec3::ZERO; (side * side) as usize]);
    for (at, pixel) in pixels.iter().enumerate() {
        let (x, y) = (at as u32 % from / step, at as u32 / from / step);
        sums[(y * side + x) as usize] += DVec3::from(pixel.map(f64::from)) / f64::from(step * step);
    }
    sums
}

/// The nearest values with `bits` bits after the first one of the mantissa.
fn rounded(value: DVec3, bits: u32) -> [f32; 3] {
    let unit = 1 << (f32::MANTISSA_DIGITS - 1 - bits);
    value.as_vec3().to_array().map(|value| f32::from_bits((value.to_bits() + unit / 2) & !(unit - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::layers::Aov;

    #[test]
    fn a_reference_is_a_mean_and_its_standard_error() {
        let trace = |values: [f32; 4]| {
            let pixels = values.map(|value| [value; 3]).to_vec();
            Layers { width: 2, height: 2, layers: vec![(Aov::Beauty, pixels.clone()), (Aov::Direct, pixels)] }
        };
        let traces = [trace([1.0, 1.0, 1.0, 1.0]), trace([3.0, 1.0, 1.0, 3.0])];
        let [image, error] = mean(&traces, 2);
        assert_eq!(image.beauty().iter().map(|p| p[0]).collect::<Vec<_>>(), [2.0, 1.0, 1.0, 2.0]);
        assert_eq!(image.get(Aov::Direct), Some(image.beauty()));
        // Two values differ by 2, so their variance is 2, and that of their mean is 1.
        assert_eq!(error.beauty().iter().map(|p| p[0]).collect::<Vec<_>>(), [1.0, 0.0, 0.0, 1.0]);
        let [image, error] = mean(&traces, 1);
        // The pixel's two values are 1 and 2.
        assert_eq!((image.beauty()[0][0], error.beauty()[0][0]), (1.5, 0.5));
        let step = 1.0 / 1024.0; // between 1 and 2, with 10 bits
        let values = DVec3::new(1.0 + 0.4 * step, 1.0 + 0.6 * step, -1.01);
        assert_eq!(rounded(values, 10), [1.0, 1.0 + step as f32, -1.0097656]);
    }
}
