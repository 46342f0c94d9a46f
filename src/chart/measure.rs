//! One row: renders a setting, times it, and compares its image with the references.
//!
//! The error is that of the first frame (with `bounces = all`, after it has settled), so that it does not depend on the
//! number of timed frames. Times are of later frames without further layers, which would take additional time. Each
//! rebuilds lists and light as after motion.
//!
//! The whole image uses the row's settings. The indirect light is measured on equal terms ([`terms`]): on a second
//! image if the settings compute shadows by cones or gather lamps.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use super::outline::{SceneLine, Sketch, Truth};
use super::picture;
use super::row::{Errors, Measured, Pass, Pictures, Row, Source};
use crate::ground::grid_choice::for_camera;
use crate::layers::{Aov, Layers};
use crate::measure::metrics::{self, NonFinite, Parts};
use crate::measure::picture::signed_difference;
use crate::measure::terms::{self, Subtract};
use crate::measure::timing::{Count, PassTiming, Spread};
use crate::output::display::{Display, ToneMap};
use crate::output::exr::Metadata;
use crate::output::picture::codes;
use crate::profile::WARM_UP;
use crate::reference::film::Film;
use crate::reference::{self, Control, Depth, Options, Stop};
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::{Pose, Scene, Still, View};
use crate::settings::{Bounces, Settings};
use crate::vk::{Context, process_cpu_ms};
use crate::{Result, measure};

/// The number of timed frames.
const FRAMES: Count = Count { warm_up: WARM_UP as usize, least: 2, most: 5, enough_ms: 2000.0 };
/// The number of timed traces, which need no warm-up.
const TRACES: Count = Count { warm_up: 0, least: 1, ..FRAMES };

/// The maximum number of paths per pixel of a path tracer's row, because more would be a reference.
pub const MOST_PATHS: u32 = 1 << 16;

/// The seed of the path tracer's rows. With the seed of the references, a row would share their noise and appear more
/// accurate.
pub const SEED: u64 = 1;

/// A scene of a chart with its view and references.
pub struct ChartScene {
    /// Its name in the chart.
    pub name: String,
    pub scene: Scene,
    pub pose: Pose,
    pub view: View,
    /// The camera in words.
    pub camera: String,
    /// Options of every image.
    pub options: RenderOptions,
    pub references: Vec<ReferenceImage>,
    /// The beginning of the command that renders it, before `--preset`.
    pub command: String,
    /// Entries in the header of an image of the scene.
    pub header: Metadata,
}

/// A path-traced image.
pub struct ReferenceImage {
    pub depth: Depth,
    /// Root mean square of its pixels' relative error.
    pub noise: f64,
    /// The image and its direct and diffuse layers.
    pub layers: Layers,
    /// The most that the noise may add to `rel`.
    pub noise_in_rel: Parts<f64>,
}

impl ReferenceImage {
    /// # Errors
    /// [`crate::Error::Usage`] for a black image: nothing can be compared with it.
    pub fn of_film(depth: Depth, film: &Film) -> Result<Self> {
        let layers = film.layers(&[Aov::Direct, Aov::Diffuse]);
        metrics::metrics(layers.beauty(), layers.beauty(), "reference")?;
        let noise_in_rel = metrics::noise_in_rel(&layers, &film.error());
        Ok(Self { depth, noise: film.noise(), layers, noise_in_rel })
    }

    /// The number of indirect bounces; `None` for all.
    pub fn bounces(&self) -> Option<u32> {
        match self.depth {
            Depth::Full => None,
            Depth::Bounces(n) => Some(n),
        }
    }
}

/// The depth with as many indirect bounces as the settings, for every method. If the sky is the only light, the first
/// gather finds its direct light, so that the image shows one indirect bounce fewer.
pub fn same_depth(scene: &Scene, settings: &Settings) -> Depth {
    let sky_alone = scene.sky != glam::Vec3::ZERO && scene.lights.is_empty() && !scene.emits();
    match settings.bounces {
        Bounces::All => Depth::Full,
        finite => Depth::Bounces(finite.stored() - u32::from(sky_alone)),
    }
}

/// The images for a row's errors, each with its direct layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Images {
    /// The image of the settings.
    pub whole: Layers,
    /// The image on equal terms; `None` if it is the first one.
    pub equal: Option<Layers>,
}

impl Images {
    /// Both images in one, the second one below the first.
    pub fn stacked(&self) -> Layers {
        let Some(equal) = &self.equal else { return self.whole.clone() };
        let both = self.whole.layers.iter().zip(&equal.layers);
        let layers = both.map(|((aov, above), (_, below))| (*aov, [&above[..], below].concat())).collect();
        Layers { height: 2 * self.whole.height, layers, ..self.whole }
    }

    /// The inverse of [`Self::stacked`], for images of this height.
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

    /// Options for tracing a reference of this scene.
    pub fn reference_options(&self, depth: Depth, stop: Stop) -> Options {
        let (width, height) = self.options.size;
        Options { width, height, depth, stop, seed: 0, occlusion: false }
    }

    pub fn still(&self) -> Still<'_> {
        Still::new(&self.scene, &self.pose, &self.view)
    }

    /// The scene for pages, with its references if one has all light.
    pub fn sketch(&self) -> Sketch {
        let mut materials = self.scene.meshes.iter().map(|mesh| &self.scene.materials[mesh.material]);
        let line = SceneLine {
            name: self.name.clone(),
            hash: self.scene.hash.clone(),
            triangles: self.scene.triangle_count(),
            camera: self.camera.clone(),
            all_diffuse: materials.all(|m| m.metallic == 0.0 && m.transmission == 0.0),
            command: self.command.clone(),
        };
        let truth = |reference: &ReferenceImage| {
            let picture = self.picture(reference.layers.beauty());
            Truth { bounces: reference.bounces(), noise: reference.noise, picture }
        };
        let has_truth = self.references.iter().any(|reference| reference.depth == Depth::Full);
        Sketch { line, truths: self.references.iter().filter(|_| has_truth).map(truth).collect() }
    }

    /// The noise of the reference with this depth, if there is one.
    pub fn noise(&self, depth: Depth) -> Option<f64> {
        self.references.iter().find(|reference| reference.depth == depth).map(|reference| reference.noise)
    }

    /// Replaces the reference with the same depth.
    pub fn set_reference(&mut self, reference: ReferenceImage) {
        self.references.retain(|other| other.depth != reference.depth);
        self.references.push(reference);
        // References are ordered with all light first, then by decreasing number of bounces.
        self.references.sort_by_key(|reference| std::cmp::Reverse(reference.bounces().unwrap_or(u32::MAX)));
    }

    /// A picture of this scene's radiance. All pictures have the exposure of the full light.
    pub fn picture(&self, radiance: &[[f32; 3]]) -> String {
        let display = Display::automatic(ToneMap::default(), self.reference(Depth::Full).layers.beauty());
        picture::uri(self.options.size, codes(radiance, display))
    }

    /// Measures the times of a row, and compares its images with the references; [`Self::judge`] needs these images. An
    /// image of another program is not timed. `go_on` is called between frames and between traces.
    ///
    /// # Errors
    /// Errors of `go_on`; [`crate::Error::Interrupted`] once `cancel` is set; too little memory, a lost device, an
    /// image without a finite pixel, or a file that changed since the chart began.
    pub fn measure(
        &self,
        context: &Arc<Context>,
        row: &Row,
        cancel: &AtomicBool,
        go_on: &dyn Fn() -> Result<()>,
    ) -> Result<(Measured, Pictures, Images)> {
        let (images, timed) = match (&row.source, &row.settings) {
            (Source::Import(claim), _) => (claim.images()?, Measured::default()),
            (Source::PathTracer { paths }, _) => self.trace(*paths, cancel, go_on)?,
            (Source::Settings, settings) => {
                let settings = settings.as_ref().expect("rows of the renderer have settings");
                (self.images(context, settings)?, self.times(context, settings, go_on)?)
            }
        };
        let ([full, same], pictures) = self.judge(row, &images)?;
        measure::refuse_invalid(context)?;
        let nonfinite = NonFinite::of_pixels(images.whole.beauty()).count();
        let equal_terms = row.settings.as_ref().map_or(Vec::new(), terms::changes);
        Ok((Measured { nonfinite, equal_terms, full, same, ..timed }, pictures, images))
    }

    /// The errors of a row's images against the current references (all light, and as many bounces), and its pictures.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] for an image without a finite pixel.
    pub fn judge(&self, row: &Row, images: &Images) -> Result<([Errors; 2], Pictures)> {
        let references = row.depths(self).map(|depth| self.reference(depth));
        let [full, same] = references.map(|reference| errors(images, row.subtract(self), reference));
        let image = &images.whole;
        let difference = |reference: &ReferenceImage| {
            picture::uri(self.options.size, signed_difference(image.beauty(), reference.layers.beauty()))
        };
        let [full_picture, same_picture] = references.map(difference);
        let pictures = Pictures { image: self.picture(image.beauty()), full: full_picture, same: same_picture };
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

    /// Times of the image alone, because further layers would take time.
    fn times(&self, context: &Arc<Context>, settings: &Settings, go_on: &dyn Fn() -> Result<()>) -> Result<Measured> {
        let mut renderer = self.renderer(context, settings, vec![])?;
        let timings = FRAMES.frames(&mut renderer, &self.pose, &self.view, go_on)?;
        let pass = |pass: PassTiming| Pass { name: pass.name.to_owned(), gpu_ms: pass.gpu_ms.median };
        Ok(Measured {
            frames: timings.frames().len(),
            frame_gpu_ms: Some(timings.frame_gpu_ms()),
            frame_cpu_ms: timings.frame_cpu_ms(),
            frame_wall_ms: Some(timings.frame_wall_ms()),
            passes: timings.passes().into_iter().map(pass).collect(),
            memory_bytes: Some(renderer.plan().total()),
            ..Measured::default()
        })
    }

    /// Path-traces the scene with `paths` paths per pixel, like an offline renderer. The time is the wall time of a
    /// trace on all threads including the construction of the tree, because the time of a frame includes voxelisation.
    fn trace(&self, paths: u32, cancel: &AtomicBool, go_on: &dyn Fn() -> Result<()>) -> Result<(Images, Measured)> {
        let options = Options { seed: SEED, ..self.reference_options(Depth::Full, Stop::Samples(paths)) };
        let (mut wall_ms, mut cpu_ms) = (Vec::new(), Vec::new());
        let film = loop {
            go_on()?;
            let mut film = Film::new(options.width, options.height);
            let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel };
            let (begin, before) = (Instant::now(), process_cpu_ms());
            reference::render(self.still(), &options, &mut film, control)?;
            wall_ms.push(begin.elapsed().as_secs_f64() * 1e3);
            cpu_ms.push(process_cpu_ms().zip(before).map(|(after, before)| after - before));
            if !TRACES.goes_on(wall_ms.iter().copied()) {
                break film;
            }
        };
        let images = Images { whole: film.layers(&[Aov::Direct]), equal: None };
        let measured = Measured {
            frames: wall_ms.len(),
            frame_cpu_ms: cpu_ms.into_iter().collect::<Option<Vec<f64>>>().map(Spread::of_values),
            frame_wall_ms: Some(Spread::of_values(wall_ms)),
            ..Measured::default()
        };
        Ok((images, measured))
    }

    fn renderer(&self, context: &Arc<Context>, settings: &Settings, aovs: Vec<Aov>) -> Result<Renderer> {
        let options = RenderOptions { aovs, ..self.options.clone() };
        let settings = for_camera(settings, self.still(), options.bounds);
        Renderer::new(context, self.scene.clone(), &self.pose, settings, options)
    }
}

/// The errors of a row's images. `subtract` is `None` if the indirect light is not judged.
///
/// # Errors
/// [`crate::Error::Usage`] for an image without a finite pixel.
pub fn errors(images: &Images, subtract: Option<Subtract>, reference: &ReferenceImage) -> Result<Errors> {
    let compare = |image| metrics::compare(image, &reference.layers, subtract.unwrap_or(Subtract::Own));
    let whole = compare(&images.whole)?;
    let equal = images.equal.as_ref().map(compare).transpose()?;
    let equal = subtract.is_some().then_some(equal.as_ref().unwrap_or(&whole));
    Ok(Errors {
        bounces: reference.bounces(),
        noise: reference.noise,
        noise_in_rel: reference.noise_in_rel,
        metrics: Parts {
            total: whole.total,
            indirect: equal.and_then(|equal| equal.indirect),
            diffuse: equal.and_then(|equal| equal.indirect_diffuse),
        },
        flip: whole.flip,
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
}
