//! One row: renders a setting, times it, and compares its image with the references.
//!
//! The error is that of the first frame (with `bounces = all`, after it settled), so that it does not depend on how many frames
//! were timed. Times are of later frames without further layers, which would take time of their own; each
//! makes lists and light again, as if something had moved.
//!
//! The whole image is that of the settings. The indirect light is measured on equal terms ([`terms`]): where the settings shadow
//! lights by cones or gather lamps, on a second image.

use std::sync::Arc;

use super::export::SceneLine;
use super::import::Import;
use super::picture;
use super::plan::Trial;
use super::row::{Errors, Measured, Pass, Pictures};
use super::subject::Subject;
use crate::ground::clearance::for_camera;
use crate::layers::{Aov, Layers};
use crate::measure::metrics::{self, NoiseInRel, NonFinite};
use crate::measure::picture::signed_difference;
use crate::measure::terms::{self, Subtract};
use crate::measure::timing::{PassTiming, Spread, Timings};
use crate::profile::WARM_UP;
use crate::reference::film::Film;
use crate::reference::{Depth, Options, Stop};
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::{Pose, Scene, Still, View};
use crate::settings::{Bounces, Settings};
use crate::vk::{Context, process_cpu_ms};
use crate::{Result, measure};

/// Frames to time, after those that warm up: so many at least,
const LEAST_FRAMES: usize = 2;
/// and at most.
pub(super) const MOST_FRAMES: usize = 5;

/// In between, no further frame is timed once those before took so long together: long frames vary little.
pub(super) const LONG_ENOUGH_MS: f64 = 2000.0;

/// A scene of a chart: how it is looked at, and its references.
pub struct ChartScene {
    /// Its name in the chart.
    pub name: String,
    pub scene: Scene,
    pub pose: Pose,
    pub view: View,
    /// The camera in words.
    pub camera: String,
    /// Of every image.
    pub options: RenderOptions,
    pub references: Vec<ReferenceImage>,
}

/// A path-traced image.
pub struct ReferenceImage {
    pub depth: Depth,
    /// Root mean square of its pixels' relative error.
    pub noise: f64,
    /// The image and its direct and diffuse layers.
    pub layers: Layers,
    /// What the noise may add to `rel`; nothing where it is not known.
    pub noise_in_rel: NoiseInRel,
}

impl ReferenceImage {
    /// # Errors
    /// [`crate::Error::Usage`] for a black image: nothing can be compared with it.
    pub fn new(depth: Depth, noise: f64, layers: Layers) -> Result<Self> {
        metrics::metrics(layers.beauty(), layers.beauty(), "reference")?;
        Ok(Self { depth, noise, layers, noise_in_rel: NoiseInRel::default() })
    }

    /// The same of a film.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for a black image.
    pub fn of_film(depth: Depth, film: &Film) -> Result<Self> {
        let reference = Self::new(depth, film.noise(), film.layers(&[Aov::Direct, Aov::Diffuse]))?;
        Ok(Self { noise_in_rel: NoiseInRel::of(&reference.layers, &film.error()), ..reference })
    }

    /// Its indirect bounces; `None`: all.
    pub fn bounces(&self) -> Option<u32> {
        match self.depth {
            Depth::Full => None,
            Depth::Bounces(n) => Some(n),
        }
    }
}

/// Light of as many indirect bounces as the settings ask for, whatever the method. Where the sky is all of a scene's light, the
/// first gather finds its direct light, so that the image shows one indirect bounce fewer.
pub fn same_depth(scene: &Scene, settings: &Settings) -> Depth {
    let sky_alone = scene.sky != glam::Vec3::ZERO && scene.lights.is_empty() && !scene.emits();
    match settings.bounces {
        Bounces::All => Depth::Full,
        finite => Depth::Bounces(finite.volumes() - u32::from(sky_alone)),
    }
}

/// The images that a row's errors are measured on, each with its direct layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Images {
    /// The image of the settings.
    pub whole: Layers,
    /// The image on equal terms; `None` where that is the first one.
    pub equal: Option<Layers>,
}

impl Images {
    /// Both in one, the second one below the first.
    pub fn stacked(&self) -> Layers {
        let Some(equal) = &self.equal else { return self.whole.clone() };
        let both = self.whole.layers.iter().zip(&equal.layers);
        let layers = both.map(|((aov, above), (_, below))| (*aov, [&above[..], below].concat())).collect();
        Layers { height: 2 * self.whole.height, layers, ..self.whole }
    }

    /// The reverse of [`Self::stacked`], for images of this height.
    pub fn unstacked(stacked: Layers, height: u32) -> Self {
        if stacked.height == height {
            return Self { whole: stacked, equal: None };
        }
        let half = |lower: usize| {
            let pixels = (stacked.width * height) as usize;
            let rows = |pixels_of: &[[f32; 3]]| pixels_of.iter().copied().skip(lower * pixels).take(pixels).collect();
            let layers = stacked.layers.iter().map(|(aov, all)| (*aov, rows(all))).collect();
            Layers { height, layers, ..stacked }
        };
        Self { whole: half(0), equal: Some(half(1)) }
    }
}

impl ChartScene {
    fn reference(&self, depth: Depth) -> &ReferenceImage {
        let found = self.references.iter().find(|reference| reference.depth == depth);
        found.unwrap_or_else(|| panic!("no reference of depth {depth:?} was made for {}", self.name))
    }

    /// How a reference of this scene is traced.
    pub fn reference_options(&self, depth: Depth, stop: Stop) -> Options {
        let (width, height) = self.options.size;
        Options { width, height, depth, stop, seed: 0, occlusion: false }
    }

    /// The scene in a line of `rows.json`.
    pub fn line(&self) -> SceneLine {
        let mut materials = self.scene.meshes.iter().map(|mesh| &self.scene.materials[mesh.material]);
        SceneLine {
            name: self.name.clone(),
            hash: self.scene.hash.clone(),
            triangles: self.scene.triangle_count(),
            camera: self.camera.clone(),
            all_diffuse: materials.all(|m| m.metallic == 0.0 && m.transmission == 0.0),
            command: String::new(),
        }
    }

    /// Puts a reference in the place of that of the same depth.
    pub fn set_reference(&mut self, reference: ReferenceImage) {
        self.references.retain(|other| other.depth != reference.depth);
        self.references.push(reference);
        // All light first, then from the most bounces down.
        self.references.sort_by_key(|reference| std::cmp::Reverse(reference.bounces().unwrap_or(u32::MAX)));
    }

    /// A picture of this scene's radiance. All have one exposure, that of the full light.
    pub fn picture(&self, radiance: &[[f32; 3]]) -> Result<String> {
        let exposure = metrics::exposure(self.reference(Depth::Full).layers.beauty());
        picture::uri(self.options.size, metrics::exposed(radiance, exposure))
    }

    /// Times the setting and compares its images, which [`Self::judge`] takes, with the references; `None` once `go_on`
    /// says no, which is asked between frames.
    ///
    /// # Errors
    /// Whatever keeps the setting from running: too little memory, a lost device, an image without a finite pixel.
    pub fn measure_settings(
        &self,
        context: &Arc<Context>,
        trial: &Trial,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<(Measured, Pictures, Images)>> {
        let settings = &trial.settings;
        let images = self.images(context, settings)?;
        let ([full, same], pictures) = self.judge(&Subject::Settings(trial.clone()), &images)?;
        let Some((timings, cpu_ms, memory_bytes)) = self.times(context, settings, go_on)? else { return Ok(None) };
        measure::refuse_invalid(context)?;
        let pass = |pass: PassTiming| Pass { name: pass.name.to_owned(), gpu_ms: pass.gpu_ms.median };
        let measured = Measured {
            frames: timings.frames().len(),
            frame_gpu_ms: Some(timings.frame_gpu_ms()),
            frame_cpu_ms: cpu_ms,
            frame_wall_ms: Some(timings.frame_wall_ms()),
            passes: timings.passes().into_iter().map(pass).collect(),
            memory_bytes: Some(memory_bytes),
            nonfinite: NonFinite::of(images.whole.beauty()).count(),
            equal_terms: terms::changes(settings),
            full,
            same,
        };
        Ok(Some((measured, pictures, images)))
    }

    /// Compares an image of another program with the references. Nothing is timed.
    ///
    /// # Errors
    /// [`crate::Error::File`]: the image is not what it was when the chart began.
    pub fn measure_import(&self, import: &Import) -> Result<(Measured, Pictures)> {
        let ([full, same], pictures) = self.judge(&Subject::Import(import.clone()), &import.images()?)?;
        let measured = Measured {
            frames: 0,
            frame_gpu_ms: None,
            frame_cpu_ms: None,
            frame_wall_ms: None,
            passes: Vec::new(),
            memory_bytes: None,
            nonfinite: 0,
            equal_terms: Vec::new(),
            full,
            same,
        };
        Ok((measured, pictures))
    }

    /// The errors of a row's images against the references of today: all light, and as many bounces; and its pictures.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for an image without a finite pixel.
    pub fn judge(&self, subject: &Subject, images: &Images) -> Result<([Errors; 2], Pictures)> {
        let references = subject.depths(self).map(|depth| self.reference(depth));
        let [full, same] = references.map(|reference| errors(images, subject.subtract(self), reference));
        let image = &images.whole;
        let difference = |reference: &ReferenceImage| {
            picture::uri(self.options.size, signed_difference(image.beauty(), reference.layers.beauty()))
        };
        let [full_picture, same_picture] = references.map(difference);
        let pictures = Pictures { image: self.picture(image.beauty())?, full: full_picture?, same: same_picture? };
        Ok(([full?, same?], pictures))
    }

    /// The first frames, each with its direct layer.
    fn images(&self, context: &Arc<Context>, settings: &Settings) -> Result<Images> {
        let first = |settings: &Settings| {
            let mut renderer = self.renderer(context, settings, vec![Aov::Direct])?;
            renderer.render(&self.pose, &self.view)?;
            Ok(renderer.read())
        };
        let differs = !terms::changes(settings).is_empty();
        let equal = differs.then(|| first(&terms::on_equal_terms(settings))).transpose()?;
        Ok(Images { whole: first(settings)?, equal })
    }

    /// Times of the image alone (further layers would be timed too), processor milliseconds of a frame where the system tells
    /// them, and bytes of device memory.
    fn times(
        &self,
        context: &Arc<Context>,
        settings: &Settings,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<(Timings, Option<Spread>, u64)>> {
        let mut renderer = self.renderer(context, settings, vec![])?;
        let (mut timings, mut cpu_ms) = (Timings::new(WARM_UP as usize), Vec::new());
        while another(timings.frames().map(|frame| frame.wall_ms)) {
            if !go_on() {
                return Ok(None);
            }
            renderer.make_anew();
            let before = process_cpu_ms();
            timings.push(renderer.render(&self.pose, &self.view)?);
            cpu_ms.push(process_cpu_ms().zip(before).map(|(after, before)| after - before));
        }
        // The first ones warmed up.
        let cpu_ms: Option<Vec<f64>> = cpu_ms.into_iter().skip(timings.warm_up()).collect();
        Ok(Some((timings, cpu_ms.map(Spread::of), renderer.plan().total())))
    }

    fn renderer(&self, context: &Arc<Context>, settings: &Settings, aovs: Vec<Aov>) -> Result<Renderer> {
        let options = RenderOptions { aovs, ..self.options.clone() };
        let settings = for_camera(settings, Still::new(&self.scene, &self.pose, &self.view), options.bounds);
        Renderer::new(context, self.scene.clone(), &self.pose, settings, options)
    }
}

/// Whether another frame is timed after those that took `wall_ms`.
fn another(wall_ms: impl ExactSizeIterator<Item = f64>) -> bool {
    let timed = wall_ms.len();
    timed < LEAST_FRAMES || (timed < MOST_FRAMES && wall_ms.sum::<f64>() < LONG_ENOUGH_MS)
}

/// `subtract`: `None` where the indirect light is not judged.
fn errors(images: &Images, subtract: Option<Subtract>, reference: &ReferenceImage) -> Result<Errors> {
    let compare = |image| metrics::compare(image, &reference.layers, subtract.unwrap_or(Subtract::Own));
    let whole = compare(&images.whole)?;
    let equal = images.equal.as_ref().map(compare).transpose()?;
    let equal = subtract.is_some().then_some(equal.as_ref().unwrap_or(&whole));
    Ok(Errors {
        bounces: reference.bounces(),
        noise: reference.noise,
        noise_in_rel: reference.noise_in_rel,
        total: whole.total,
        flip: whole.flip,
        indirect: equal.and_then(|equal| equal.indirect),
        diffuse: equal.and_then(|equal| equal.indirect_diffuse),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_kept_in_one() {
        let of = |value: f32| {
            let layer = |aov, value| (aov, vec![[value; 3], [value + 1.0; 3]]);
            let layers = vec![layer(Aov::Beauty, value), layer(Aov::Direct, 0.5 * value)];
            Layers { width: 1, height: 2, layers }
        };
        for equal in [None, Some(of(7.0))] {
            let images = Images { whole: of(3.0), equal };
            assert_eq!(Images::unstacked(images.stacked(), 2), images);
        }
    }

    #[test]
    fn slow_settings_are_timed_over_fewer_frames() {
        let timed = |ms: f64| (0..).find(|&n| !another(std::iter::repeat_n(ms, n))).unwrap();
        assert_eq!([1.0, 450.0, 550.0, 700.0, 1900.0, 60e3].map(timed), [5, 5, 4, 3, 2, 2]);
    }
}
