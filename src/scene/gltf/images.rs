//! The textures and images that materials use. Images are decoded in parallel.

use std::collections::HashMap;
use std::path::Path;

use gltf::json::texture::{MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked::{self, Valid};
use image::{DynamicImage, ImageReader, Limits};
use rayon::prelude::*;

use super::accessor::{Data, Problem, missing};
use super::container::{resolve, shorten};
use super::document::{Document, image_of};
use super::hash_part;
use crate::scene::{Image, Mip, Texture, Wrap};

/// Limits of an image: its longest side in texels and its size in bytes. They bound what a damaged header can allocate.
const SIDE_MAX: u32 = 16384;
const BYTES_MAX: u64 = 1 << 30;

/// Textures and images in the order of their first use. The maps go from indices of the document to indices of the scene.
#[derive(Default)]
pub struct Used {
    textures: HashMap<usize, usize>,
    image_indices: HashMap<usize, usize>,
    /// Indices of the document.
    images: Vec<usize>,
    made: Vec<Texture>,
}

impl Used {
    /// The scene's index of texture `index` of the document; `None` if the texture has no image of a supported format.
    pub fn texture(&mut self, document: &Document, index: usize) -> Result<Option<usize>, Problem> {
        if let Some(&at) = self.textures.get(&index) {
            return Ok(Some(at));
        }
        let source = document.textures.get(index).ok_or_else(|| missing("texture", index))?;
        let Some(image) = image_of(source) else {
            document.warn(format!("texture {index} has no PNG or JPEG image and was left out"));
            return Ok(None);
        };
        document.images.get(image).ok_or_else(|| missing("image", image))?;
        let default = Sampler::default();
        let sampler = match source.sampler.map(|s| s.value()) {
            Some(sampler) => document.samplers.get(sampler).ok_or_else(|| missing("sampler", sampler))?,
            None => &default,
        };
        let at = *self.image_indices.entry(image).or_insert_with(|| {
            self.images.push(image);
            self.images.len() - 1
        });
        self.textures.insert(index, self.made.len());
        self.made.push(texture(at, sampler));
        Ok(Some(self.made.len() - 1))
    }
}

/// Absent and unknown values mean repeat and trilinear.
fn texture(image: usize, sampler: &Sampler) -> Texture {
    let wrap = |mode: Checked<WrappingMode>| match mode {
        Valid(WrappingMode::ClampToEdge) => Wrap::Clamp,
        Valid(WrappingMode::MirroredRepeat) => Wrap::Mirror,
        _ => Wrap::Repeat,
    };
    let (min_linear, mip) = match sampler.min_filter {
        Some(Valid(MinFilter::Nearest)) => (false, Mip::None),
        Some(Valid(MinFilter::Linear)) => (true, Mip::None),
        Some(Valid(MinFilter::NearestMipmapNearest)) => (false, Mip::Nearest),
        Some(Valid(MinFilter::LinearMipmapNearest)) => (true, Mip::Nearest),
        Some(Valid(MinFilter::NearestMipmapLinear)) => (false, Mip::Linear),
        _ => (true, Mip::Linear),
    };
    let wrap = [wrap(sampler.wrap_s), wrap(sampler.wrap_t)];
    let mag_linear = sampler.mag_filter != Some(Valid(MagFilter::Nearest));
    Texture { image, wrap, mag_linear, min_linear, mip }
}

/// Reads and decodes all used images and adds their bytes to `hash`.
pub fn load(
    data: &Data,
    folder: &Path,
    used: Used,
    hash: &mut blake3::Hasher,
) -> Result<(Vec<Texture>, Vec<Image>), Problem> {
    let loaded: Vec<_> = used.images.par_iter().map(|&index| load_image(data, folder, index)).collect();
    let mut images = Vec::new();
    for loaded in loaded {
        let (image, bytes_hash, warning) = loaded?;
        hash_part(hash, bytes_hash.as_bytes());
        warning.into_iter().for_each(|w| data.document.warn(w));
        images.push(image);
    }
    Ok((used.made, images))
}

fn load_image(data: &Data, folder: &Path, index: usize) -> Result<(Image, blake3::Hash, Option<String>), Problem> {
    let source = &data.document.images[index];
    let what = format!("image {index}");
    let external;
    let bytes = match (&source.uri, source.buffer_view) {
        (Some(uri), _) => {
            external = resolve(folder, &what, uri)?;
            &external[..]
        }
        (None, Some(view)) => data.view(view.value())?,
        (None, None) => return Err(format!("{what} has neither a URI nor a buffer view; export the file again")),
    };
    let mut name = source.name.clone().unwrap_or_default();
    if let Some(uri) = source.uri.as_ref().filter(|uri| name.is_empty() && !uri.starts_with("data:")) {
        name.clone_from(uri);
    }
    let decoded = decode(bytes).map_err(|e| {
        format!("{what} (\"{}\") cannot be decoded ({e}); save it as PNG or JPEG again", shorten(&name))
    })?;
    let color = decoded.color();
    let deep = color.bytes_per_pixel() == 2 * color.channel_count();
    let warning = deep.then(|| "images with 16 bits per channel are rounded to 8".to_string());
    let rgba = decoded.into_rgba8();
    let image = Image { name, width: rgba.width(), height: rgba.height(), rgba: rgba.into_raw() };
    Ok((image, blake3::hash(bytes), warning))
}

fn decode(bytes: &[u8]) -> image::ImageResult<DynamicImage> {
    let mut reader = ImageReader::new(std::io::Cursor::new(bytes)).with_guessed_format()?;
    let mut limits = Limits::default();
    limits.max_image_width = Some(SIDE_MAX);
    limits.max_image_height = Some(SIDE_MAX);
    limits.max_alloc = Some(BYTES_MAX);
    reader.limits(limits);
    reader.decode()
}
