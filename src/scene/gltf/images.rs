//! The textures and images that materials use. Images are decoded in parallel.

use std::borrow::Cow;
use std::collections::{BTreeSet, HashMap};
use std::io::Cursor;

use gltf::json::texture::{MagFilter, MinFilter, Sampler, WrappingMode};
use gltf::json::validation::Checked::{self, Valid};
use image::{DynamicImage, ImageError, ImageFormat, ImageReader, ImageResult, Limits};
use rayon::prelude::*;

use super::LoadOptions;
use super::accessor::{Data, Problem, missing};
use super::container::{ByteSource, Folders, find, inline, shorten};
use super::document::{Document, image_of};
use super::hash_part;
use super::ktx2;
use super::need::{Kind, Need};
use super::webp;
use crate::error::said;
use crate::memory::apart;
use crate::scene::texture::{ColorSpace, MipChain};
use crate::scene::{Material, Mip, Scene, Texture, TextureImage, TextureRef, Wrap};

/// Limits of an image: its longest side in texels, and the memory of a decoder: 8 bytes for every texel and some
/// megabytes for the rest of a file, such as colour profiles.
const SIDE_MAX: u32 = 16384;
const BYTES_MAX: u64 = TEXEL_MAX * (SIDE_MAX as u64) * (SIDE_MAX as u64);
const TEXEL_MAX: u64 = 8;
const OTHER_MAX: u64 = 16 << 20;
/// The maximum number of texels per byte of a file. PNG has 8 in a byte, of which deflate can produce 1032 from one
/// byte. JPEG has 64 in a block, which takes at least one bit per component and scan.
const PNG_TEXELS: u64 = 8 * 1032;
const JPEG_TEXELS: u64 = 64 * 8;
/// The size reported for an image that a decoder refuses by itself, because of its size or its other content.
const REFUSED: (u32, u32) = (u32::MAX, u32::MAX);

/// How a material reads an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Reading {
    Plain,
    /// Alpha times a factor with these bits is a glossiness. One minus it becomes the roughness, in the green channel.
    Glossiness(u32),
}

impl Reading {
    fn apply(self, rgba: &mut [u8]) {
        let Self::Glossiness(factor) = self else { return };
        for texel in rgba.chunks_exact_mut(4) {
            let glossiness = f32::from_bits(factor) * f32::from(texel[3]) / 255.0;
            texel.copy_from_slice(&[0, ((1.0 - glossiness) * 255.0).round() as u8, 0, 255]);
        }
    }
}

/// Textures and images in the order of their first use. The maps lead from indices of the document to indices of the
/// scene. An image that is read in two ways becomes two images.
#[derive(Default)]
pub struct Used {
    textures: HashMap<(usize, Reading), usize>,
    image_indices: HashMap<(usize, Reading), usize>,
    /// Indices of the document and how each image is read.
    images: Vec<(usize, Reading)>,
    made: Vec<Texture>,
    /// Whether a texture or extension that would be left out is an error.
    strict: bool,
    /// The maximum side in texels.
    most: Option<u32>,
}

impl Used {
    /// Images larger than `most` texels a side are halved until they fit.
    pub fn new(strict: bool, most: Option<u32>) -> Self {
        Self { strict, most, ..Self::default() }
    }

    /// The scene's index of texture `index` of the document; `None` if the texture has no image of a supported format.
    pub fn texture(&mut self, document: &Document, index: usize, reading: Reading) -> Result<Option<usize>, Problem> {
        if let Some(&at) = self.textures.get(&(index, reading)) {
            return Ok(Some(at));
        }
        let source = document.textures.get(index).ok_or_else(|| missing("texture", index))?;
        let Some(image) = image_of(source) else {
            let problem = format!("texture {index} has no image in a format that can be read");
            if self.strict {
                return Err(format!("{problem}; add one or leave out --strict"));
            }
            document.warn(format!("{problem} and was left out"));
            return Ok(None);
        };
        document.images.get(image).ok_or_else(|| missing("image", image))?;
        let default = Sampler::default();
        let sampler = match source.sampler.map(|s| s.value()) {
            Some(sampler) => document.samplers.get(sampler).ok_or_else(|| missing("sampler", sampler))?,
            None => &default,
        };
        let at = *self.image_indices.entry((image, reading)).or_insert_with(|| {
            self.images.push((image, reading));
            self.images.len() - 1
        });
        self.textures.insert((index, reading), self.made.len());
        self.made.push(texture(at, sampler));
        Ok(Some(self.made.len() - 1))
    }
}

/// The texture of a sampler. Absent and unknown values mean repeat and trilinear.
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

/// The used images, which are read and not yet decoded.
pub struct Images<'a> {
    textures: Vec<Texture>,
    /// Opened images, or the reason why one cannot be read.
    opened: Vec<Result<Opened<'a>, Problem>>,
    readings: Vec<Reading>,
    strict: bool,
    most: Option<u32>,
}

/// An image as encoded bytes, with its size in texels.
struct Opened<'a> {
    /// "image 3 ("wood.png")", for messages.
    what: String,
    name: String,
    bytes: Cow<'a, [u8]>,
    size: (u32, u32),
}

/// Reads all used images as far as their headers; `need` gets the bytes of their files.
pub fn open<'a>(data: &Data<'a>, folders: Folders, used: Used, need: &mut Need) -> Result<Images<'a>, Problem> {
    let found: Vec<_> = used.images.iter().map(|&(index, _)| LocatedImage::new(data, folders, index)).collect();
    for found in found.iter().flatten() {
        // A buffer view refers to the bytes of a buffer.
        if let Encoded::Uri(source) = &found.source {
            need.add(Kind::Bytes, source.bytes(), 1);
        }
    }
    need.check()?;
    let opened: Vec<_> = found.into_par_iter().map(|found| found.and_then(LocatedImage::open)).collect();
    match opened.iter().find_map(|opened| opened.as_ref().err()).filter(|_| used.strict) {
        Some(problem) => Err(problem.clone()),
        None => {
            let readings = used.images.iter().map(|(_, reading)| *reading).collect();
            Ok(Images { textures: used.made, opened, readings, strict: used.strict, most: used.most })
        }
    }
}

/// An image whose bytes were located.
struct LocatedImage<'a> {
    what: String,
    name: String,
    source: Encoded<'a>,
}

enum Encoded<'a> {
    View(&'a [u8]),
    Uri(ByteSource),
}

impl<'a> LocatedImage<'a> {
    fn new(data: &Data<'a>, folders: Folders, index: usize) -> Result<Self, Problem> {
        let source = &data.document.images[index];
        let mut name = source.name.clone().unwrap_or_default();
        if let Some(uri) = source.uri.as_ref().filter(|uri| name.is_empty() && inline(uri).is_none()) {
            name.clone_from(uri);
        }
        let what = format!("image {index}");
        let encoded = match (&source.uri, source.buffer_view) {
            (Some(uri), _) => Encoded::Uri(find(folders, &what, uri)?),
            (None, Some(view)) => {
                Encoded::View(data.view(view.value()).map_err(|problem| format!("{what}: {problem}"))?)
            }
            (None, None) => return Err(format!("{what} has neither a URI nor a buffer view; export the file again")),
        };
        Ok(Self { what: format!("{what} (\"{}\")", shorten(&name)), name, source: encoded })
    }

    fn open(self) -> Result<Opened<'a>, Problem> {
        let Self { what, name, source } = self;
        let bytes = match source {
            Encoded::View(bytes) => Cow::Borrowed(bytes),
            // No image has more bytes, so that a huge file is not read completely.
            Encoded::Uri(source) if source.bytes() > BYTES_MAX => {
                return Err(format!(
                    "{what} has {} bytes, more than any image that can be read; check the file",
                    source.bytes()
                ));
            }
            Encoded::Uri(source) => Cow::Owned(source.read(&what, u64::MAX)?),
        };
        if ktx2::is_ktx2(&bytes) {
            let size = ktx2::size(&bytes).map_err(|damage| undecodable_ktx2(&what, damage))?;
            return Ok(Opened { what, name, bytes, size });
        }
        webp::check(&bytes).map_err(|problem| format!("{what} {problem}"))?;
        let opened = reader(&bytes, 0).map_err(|e| undecodable(&what, &e))?;
        let each = match opened.format() {
            Some(ImageFormat::Png) => PNG_TEXELS,
            Some(ImageFormat::Jpeg) => JPEG_TEXELS,
            // An image of one colour takes no more bytes for more texels.
            _ => u64::MAX,
        };
        let size = match opened.into_dimensions() {
            Ok(size) => size,
            Err(ImageError::Limits(_)) => REFUSED,
            Err(e) => return Err(undecodable(&what, &e)),
        };
        let too_wide = size.0.max(size.1) > SIDE_MAX;
        if !too_wide && texels_of(size) > (bytes.len() as u64).saturating_mul(each) {
            return Err(format!(
                "{what} is too short for the {} × {} texels that it states; save it again",
                size.0, size.1
            ));
        }
        Ok(Opened { what, name, bytes, size })
    }
}

fn undecodable(what: &str, e: &ImageError) -> Problem {
    format!("{what} cannot be decoded ({}); save it as PNG or JPEG again", said(e))
}

fn undecodable_ktx2(what: &str, damage: &str) -> Problem {
    format!("{what} {damage}; save it as KTX 2 with ETC1S, UASTC or 8 bits a channel again")
}

impl Images<'_> {
    /// Adds the texels of all images and of the mip chains that `materials` need.
    pub fn check(&self, materials: &[Material], need: &mut Need) -> Result<(), Problem> {
        for image in self.opened.iter().flatten() {
            if image.size == REFUSED {
                let what = &image.what;
                return Err(format!(
                    "{what} has more than {SIDE_MAX} texels a side, or more beside them than is read; make it smaller"
                ));
            }
            if image.size.0.max(image.size.1) > SIDE_MAX {
                return Err(format!("{} has more than {SIDE_MAX} texels a side; make it smaller", image.what));
            }
        }
        let chains = self.chains(materials.iter().flat_map(Material::texture_slots));
        for index in 0..self.opened.len() {
            let spaces = chains.range((index, ColorSpace::Srgb)..=(index, ColorSpace::Linear)).count();
            need.add_image(self.size(index), spaces as u64);
        }
        let halved = self.opened.iter().flatten().filter(|image| self.halvings(image.size) > 0);
        let largest = halved.map(|image| texels_of(image.size)).max().unwrap_or(0);
        // Several images are decoded and halved at once.
        need.add_bytes(Kind::Texels, largest.saturating_mul(12).saturating_mul(rayon::current_num_threads() as u64));
        let largest = (0..self.opened.len()).map(|index| self.texels(index)).max().unwrap_or(0);
        // An upload to the device takes two more copies of the rectangle of a chain.
        need.add_bytes(Kind::Texels, largest.saturating_mul(2 * 6));
        need.check()
    }

    /// Refuses textures of the `drawn` materials that exceed the device's limits, each alone or all together.
    pub fn check_device(&self, drawn: &[&Material], options: &LoadOptions) -> Result<(), Problem> {
        let chains = self.chains(drawn.iter().flat_map(|material| material.drawn_slots()));
        let remedy = "use smaller textures or --max-texture TEXELS";
        if let Some((most, words)) = &options.texture_side {
            let too_large = |(width, height): &(u32, u32)| *width.max(&(height + height / 2)) > *most;
            if let Some((width, height)) = chains.iter().map(|&(image, _)| self.size(image)).find(too_large) {
                return Err(format!(
                    "has a texture of {width} × {height} texels, which needs more than {words} with its mips: {remedy}"
                ));
            }
        }
        let texels: u64 = chains.iter().map(|&(image, _)| self.texels(image)).sum();
        // A chain lies in a rectangle of one and a half times its largest level, 4 bytes per texel.
        let bytes = 6 * texels;
        let Some(limit) = options.texture_memory.as_ref().filter(|limit| bytes > limit.bytes) else { return Ok(()) };
        let ([needed, most], words) = (apart([bytes, limit.bytes]), &limit.words);
        let millions = texels as f64 / 1e6;
        Err(format!(
            "has textures of {millions:.1} million texels, which need {needed} on the device, more than {words} of {most}: {remedy}"
        ))
    }

    /// The images and colour spaces of these slots, each of which has a mip chain.
    fn chains(&self, slots: impl Iterator<Item = (TextureRef, ColorSpace)>) -> BTreeSet<(usize, ColorSpace)> {
        slots.map(|(slot, space)| (self.textures[slot.texture].image, space)).collect()
    }

    /// The size in texels after halving; zero for an image that cannot be read.
    fn size(&self, image: usize) -> (u32, u32) {
        let size = self.opened[image].as_ref().map_or((0, 0), |opened| opened.size);
        let halvings = self.halvings(size);
        if halvings == 0 { size } else { ((size.0 >> halvings).max(1), (size.1 >> halvings).max(1)) }
    }

    /// The number of halvings of an image of this size.
    fn halvings(&self, (width, height): (u32, u32)) -> u32 {
        let Some(most) = self.most else { return 0 };
        (0..32).find(|&times| width.max(height) >> times <= most).unwrap_or(0)
    }

    fn texels(&self, image: usize) -> u64 {
        texels_of(self.size(image))
    }

    /// Decodes all images into `scene` and hashes their bytes. Materials lose the slots of those that cannot be read.
    pub fn decode(self, document: &Document, scene: &mut Scene, hash: &mut blake3::Hasher) -> Result<(), Problem> {
        let of_colors = self.chains(scene.materials.iter().flat_map(Material::texture_slots));
        let halvings: Vec<u32> =
            self.opened.iter().map(|opened| opened.as_ref().map_or(0, |image| self.halvings(image.size))).collect();
        let halved = halvings.iter().filter(|times| **times > 0).count();
        let space = |index| {
            let color = of_colors.contains(&(index, ColorSpace::Srgb));
            if color { ColorSpace::Srgb } else { ColorSpace::Linear }
        };
        let readings = &self.readings;
        let decode = |(index, opened): (usize, Result<Opened, Problem>)| {
            opened.and_then(|image| image.decode(readings[index], halvings[index], space(index)))
        };
        let decoded: Vec<_> = self.opened.into_par_iter().enumerate().map(decode).collect();
        if let Some(most) = self.most.filter(|_| halved > 0) {
            document.warn(format!(
                "--max-texture: {halved} images were halved until they had at most {most} texels a side"
            ));
        }
        let mut place_of_image = Vec::new();
        for decoded in decoded {
            place_of_image.push(decoded.is_ok().then_some(scene.images.len()));
            match decoded {
                Ok((image, bytes_hash, deep)) => {
                    hash_part(hash, bytes_hash.as_bytes());
                    if deep {
                        document.warn("images with 16 bits per channel are rounded to 8");
                    }
                    scene.images.push(image);
                }
                Err(problem) if self.strict => return Err(problem),
                Err(problem) => {
                    hash_part(hash, &[]);
                    document.warn(format!("{problem}; until then its materials have their factors alone"));
                }
            }
        }
        let (mut place_of_texture, mut reading_of_texture) = (Vec::new(), Vec::new());
        for texture in self.textures {
            let image = place_of_image[texture.image];
            place_of_texture.push(image.map(|_| scene.textures.len()));
            reading_of_texture.push(readings[texture.image]);
            scene.textures.extend(image.map(|image| Texture { image, ..texture }));
        }
        for material in &mut scene.materials {
            let roughness = material.metallic_roughness_texture.map(|slot| reading_of_texture[slot.texture]);
            for slot in slots_mut(material) {
                *slot = slot.and_then(|s| Some(TextureRef { texture: place_of_texture[s.texture]?, ..s }));
            }
            if let (Some(Reading::Glossiness(factor)), None) = (roughness, material.metallic_roughness_texture) {
                material.roughness = 1.0 - f32::from_bits(factor);
            }
        }
        Ok(())
    }
}

pub fn slots_mut(m: &mut Material) -> impl Iterator<Item = &mut Option<TextureRef>> {
    let plain = [
        &mut m.base_color_texture,
        &mut m.metallic_roughness_texture,
        &mut m.normal_texture,
        &mut m.occlusion_texture,
        &mut m.emissive_texture,
        &mut m.specular_texture,
        &mut m.specular_color_texture,
        &mut m.transmission_texture,
        &mut m.thickness_texture,
    ];
    plain.into_iter().chain(m.finish.iter_mut().flat_map(|finish| finish.slots_mut()))
}

impl Opened<'_> {
    /// The image, interpreted as `reading` says and halved in that colour space, the hash of its bytes, and whether it
    /// has 16 bits per channel.
    fn decode(
        self,
        reading: Reading,
        halvings: u32,
        space: ColorSpace,
    ) -> Result<(TextureImage, blake3::Hash, bool), Problem> {
        let (mut image, deep) = self.texels()?;
        reading.apply(&mut image.rgba);
        if halvings > 0 {
            let level = MipChain::new(&image, space).levels.swap_remove(halvings as usize);
            (image.width, image.height, image.rgba) = (level.width, level.height, level.rgba);
        }
        Ok((image, blake3::hash(&self.bytes), deep))
    }

    /// The decoded image, and whether it has 16 bits per channel.
    fn texels(&self) -> Result<(TextureImage, bool), Problem> {
        let (name, (width, height)) = (self.name.clone(), self.size);
        if ktx2::is_ktx2(&self.bytes) {
            let (rgba, deep) = ktx2::decode(&self.bytes).map_err(|damage| undecodable_ktx2(&self.what, damage))?;
            return Ok((TextureImage { name, width, height, rgba }, deep));
        }
        let decoded = reader(&self.bytes, texels_of(self.size)).and_then(ImageReader::decode);
        let decoded = decoded.map_err(|e| undecodable(&self.what, &e))?;
        let color = decoded.color();
        let deep = color.bytes_per_pixel() == 2 * color.channel_count();
        let (width, height) = (decoded.width(), decoded.height());
        let rgba = match decoded {
            // Most files have this format, and the library's conversion would take as long as decoding a JPEG.
            DynamicImage::ImageRgb8(rgb) => opaque(rgb.as_raw()),
            other => other.into_rgba8().into_raw(),
        };
        Ok((TextureImage { name, width, height, rgba }, deep))
    }
}

fn opaque(rgb: &[u8]) -> Vec<u8> {
    let mut rgba = vec![255; rgb.len() / 3 * 4];
    for (to, from) in rgba.chunks_exact_mut(4).zip(rgb.chunks_exact(3)) {
        to[..3].copy_from_slice(from);
    }
    rgba
}

fn texels_of((width, height): (u32, u32)) -> u64 {
    u64::from(width) * u64::from(height)
}

/// A reader with limits for an image of `texels` texels: its size is checked once it is known, and this bounds the
/// decoder's other memory.
fn reader(bytes: &[u8], texels: u64) -> ImageResult<ImageReader<Cursor<&[u8]>>> {
    let mut reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format()?;
    let mut limits = Limits::default();
    limits.max_alloc = Some(TEXEL_MAX * texels + OTHER_MAX);
    reader.limits(limits);
    Ok(reader)
}
