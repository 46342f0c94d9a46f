//! A rendered picture.

use std::path::Path;

use crate::layers::{Aov, Layers};
use crate::measure::metrics::{Comparison, compare_files};
use crate::output::display::Display;
use crate::output::exr::Metadata;
use crate::output::picture::ImageKind;
use crate::settings::Settings;
use crate::{Error, Result};

/// A rendered picture: linear radiance, further layers, and how a display shows it.
#[derive(Clone, Debug)]
pub struct Image {
    /// Radiance and further layers, rows from the top.
    pub layers: Layers,
    /// Tone curve and exposure with which [`Image::save`] writes a .png or .jpg.
    pub display: Display,
    /// Sentences about parts that were ignored, simplified or added, and about possible problems of the picture.
    pub notes: Vec<String>,
    /// The estimated root mean square of the pixels' relative error; unknown for a single pass.
    pub noise: Option<f64>,
    /// The settings of the picture, with `image.passes` as the number of passes that were made. A path-traced picture
    /// has none.
    pub settings: Option<Settings>,
    /// Metadata of an .exr.
    pub(super) header: Metadata,
}

impl Image {
    /// Width and height in pixels.
    pub fn size(&self) -> (u32, u32) {
        (self.layers.width, self.layers.height)
    }

    /// Linear radiance (Rec. 709) of `width · height` pixels, rows from the top.
    pub fn radiance(&self) -> &[[f32; 3]] {
        self.layers.beauty()
    }

    /// The pixels of a further layer; `None` if it was not asked for.
    pub fn layer(&self, layer: Aov) -> Option<&[[f32; 3]]> {
        self.layers.get(layer)
    }

    /// 8-bit sRGB of every pixel, exposed and tone-mapped by [`Image::display`].
    pub fn shown(&self) -> Vec<[u8; 3]> {
        self.radiance().iter().map(|radiance| self.display.codes(*radiance)).collect()
    }

    /// Compares the picture with its reference: energy and errors, and those of the indirect light if both have the
    /// layer `direct`. `docs/accuracy.md` has the formulas.
    ///
    /// # Errors
    /// The sizes differ, a picture has no finite pixel, or the reference is black.
    pub fn compare(&self, reference: &Self) -> Result<Comparison> {
        Ok(compare_files(&self.layers, &reference.layers, [&self.header, &reference.header])?.0)
    }

    /// Writes the picture by the path's ending: a .png or .jpg, exposed and tone-mapped by [`Image::display`], or an
    /// .exr of linear radiance with all layers. The bytes are those of the command `render`.
    ///
    /// # Errors
    /// The path has another ending or cannot be written, or a .jpg is requested for a picture with transparent pixels.
    pub fn save(&self, path: impl AsRef<Path>) -> Result<()> {
        let path = path.as_ref();
        let kind = ImageKind::of_path(path);
        if kind == Some(ImageKind::Jpeg) && self.layers.get(Aov::Alpha).is_some() {
            return Err(Error::file(path, "has no transparent pixels, as a .jpg; name a .png or an .exr"));
        }
        match kind {
            Some(ImageKind::Exr) => self.layers.write_exr(path, &self.header),
            Some(_) => self.layers.write_shown(path, self.display),
            None => Err(Error::file(path, "has an unknown ending; end it in .png, .jpg or .exr")),
        }
    }
}
