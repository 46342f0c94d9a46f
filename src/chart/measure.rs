//! One row: renders a setting, times it, and holds its image against the references.
//!
//! The error is that of the first frame after a cold start (with `bounces = all`, of the settled one), so that it does not depend
//! on how many frames were timed. Times are of later frames without further layers, which would take time of their own; each
//! makes lists and light anew, as if something had moved.
//!
//! Light that a method sends through the method alone (emissive surfaces with `emitters = cones`, the sky) is in no direct layer
//! of its own, but in the reference's. There the indirect part is image − the reference's direct light: whatever is wrong
//! with that light counts too. And where nothing but such light shines, the first of the method's gathers is its direct
//! light, so that "as many bounces" means one fewer than the setting says.

use std::sync::Arc;

use super::export::SceneLine;
use super::picture;
use super::row::{Errors, Measured, Pass};
use crate::layers::{Aov, Layers};
use crate::measure::metrics::{self, NonFinite};
use crate::measure::picture::signed_difference;
use crate::measure::timing::{Spread, Timings};
use crate::profile::WARM_UP;
use crate::reference::Depth;
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::{Bounds, Pose, Scene, View};
use crate::settings::{Bounces, LampLight, Settings};
use crate::vk::{Context, process_cpu_ms};
use crate::{Error, Result};

/// Frames to time, after those that warm up: so many at least,
const LEAST_FRAMES: usize = 2;
/// and at most.
const MOST_FRAMES: usize = 5;

/// In between, no further frame is timed once those before took so long together: long frames vary little.
const LONG_ENOUGH_MS: f64 = 2000.0;

/// A scene, how it is looked at, and what is true of it.
pub struct Subject {
    /// Its name in the chart.
    pub name: String,
    pub scene: Scene,
    pub pose: Pose,
    pub view: View,
    /// Of the scene over the whole animation.
    pub bounds: Bounds,
    /// Pixels.
    pub size: (u32, u32),
    /// Bytes; the device's own budget where absent.
    pub memory_limit: Option<u64>,
    /// The camera in words.
    pub camera: String,
    pub truths: Vec<Truth>,
}

/// A reference image.
pub struct Truth {
    pub depth: Depth,
    /// Root mean square of its pixels' relative error.
    pub noise: f64,
    /// The image and its direct and diffuse layers.
    pub layers: Layers,
}

/// A setting's pictures as JPEG files, small enough for a page.
pub struct Pictures {
    pub image: Vec<u8>,
    /// Signed difference from the full light, and from that of as many bounces; red is too bright, blue too dark.
    pub full: Vec<u8>,
    pub same: Vec<u8>,
}

impl Truth {
    /// # Errors
    /// [`Error::Usage`] for a black image: nothing can be held against it.
    pub fn new(depth: Depth, noise: f64, layers: Layers) -> Result<Self> {
        metrics::metrics(layers.beauty(), layers.beauty(), "reference")?;
        Ok(Self { depth, noise, layers })
    }
}

/// The indirect bounces that an image with these settings can be asked for.
pub fn same_depth(scene: &Scene, settings: &Settings) -> Depth {
    let first_is_direct = scene.lights.is_empty() && by_method_alone(scene, settings);
    match settings.bounces {
        Bounces::All => Depth::Full,
        finite => Depth::Bounces(finite.volumes() - u32::from(first_is_direct)),
    }
}

/// Whether some light reaches the image through the method alone, so that its direct layer lacks it.
fn by_method_alone(scene: &Scene, settings: &Settings) -> bool {
    (settings.lights.lamps == LampLight::Gathered && scene.emits()) || scene.sky != glam::Vec3::ZERO
}

impl Subject {
    fn truth(&self, depth: Depth) -> &Truth {
        let found = self.truths.iter().find(|truth| truth.depth == depth);
        found.unwrap_or_else(|| panic!("no reference of depth {depth:?} was made for {}", self.name))
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
        }
    }

    /// A picture of this scene's radiance. All have one exposure, that of the full light.
    pub fn picture(&self, radiance: &[[f32; 3]]) -> Result<Vec<u8>> {
        let exposure = metrics::exposure(self.truth(Depth::Full).layers.beauty());
        picture::jpeg(self.size, metrics::exposed(radiance, exposure))
    }

    /// Times the setting and holds its image against the references; `None` once `go_on` says no, which is asked between
    /// frames.
    ///
    /// # Errors
    /// Whatever keeps the setting from running: too little memory, a lost device, an image without a finite pixel.
    pub fn measure(
        &self,
        context: &Arc<Context>,
        settings: &Settings,
        go_on: &dyn Fn() -> bool,
    ) -> Result<Option<(Measured, Pictures)>> {
        let image = self.image(context, settings)?;
        let own_direct = !by_method_alone(&self.scene, settings);
        let (full, same) = (self.truth(Depth::Full), self.truth(same_depth(&self.scene, settings)));
        let (full_errors, same_errors) = (errors(&image, own_direct, full)?, errors(&image, own_direct, same)?);
        let Some(times) = self.times(context, settings, go_on)? else { return Ok(None) };
        if let Some(first) = context.validation_messages().first() {
            return Err(Error::Device(format!("the validation layer objects: {first}")));
        }
        let frames = times.timings.frames();
        let measured = Measured {
            frames: frames.len(),
            frame_gpu_ms: Spread::of(frames.iter().map(|frame| frame.gpu_ms)),
            frame_cpu_ms: times.cpu_ms.map(Spread::of),
            frame_wall_ms: Spread::of(frames.iter().map(|frame| frame.wall_ms)),
            passes: passes(&times.timings),
            memory_bytes: times.memory_bytes,
            nonfinite: NonFinite::of(image.beauty()).count(),
            own_direct,
            full: full_errors,
            same: same_errors,
        };
        let difference = |truth: &Truth| signed_difference(image.beauty(), truth.layers.beauty());
        let pictures = Pictures {
            image: self.picture(image.beauty())?,
            full: picture::jpeg(self.size, difference(full))?,
            same: picture::jpeg(self.size, difference(same))?,
        };
        Ok(Some((measured, pictures)))
    }

    /// The first frame and its direct layer.
    fn image(&self, context: &Arc<Context>, settings: &Settings) -> Result<Layers> {
        let mut renderer = self.renderer(context, settings, vec![Aov::Direct])?;
        renderer.render(&self.pose, &self.view)?;
        Ok(renderer.read())
    }

    /// Times of the image alone: further layers would be timed too.
    fn times(&self, context: &Arc<Context>, settings: &Settings, go_on: &dyn Fn() -> bool) -> Result<Option<Times>> {
        let mut renderer = self.renderer(context, settings, vec![])?;
        let (mut timings, mut cpu_ms) = (Timings::new(WARM_UP as usize), Vec::new());
        while another(timings.frames().iter().map(|frame| frame.wall_ms)) {
            if !go_on() {
                return Ok(None);
            }
            renderer.make_anew();
            let before = process_cpu_ms();
            timings.push(renderer.render(&self.pose, &self.view)?.timings);
            cpu_ms.push(process_cpu_ms().zip(before).map(|(after, before)| after - before));
        }
        let memory_bytes = renderer.plan().total();
        // The first ones warmed up.
        Ok(Some(Times { timings, cpu_ms: cpu_ms.into_iter().skip(WARM_UP as usize).collect(), memory_bytes }))
    }

    fn renderer(&self, context: &Arc<Context>, settings: &Settings, aovs: Vec<Aov>) -> Result<Renderer> {
        let options =
            RenderOptions { aovs, memory_limit: self.memory_limit, ..RenderOptions::new(self.size, self.bounds) };
        Renderer::new(context, self.scene.clone(), &self.pose, settings.clone(), options)
    }
}

/// What [`Subject::times`] measured.
struct Times {
    timings: Timings,
    /// Per frame that counts, where the system tells it.
    cpu_ms: Option<Vec<f64>>,
    memory_bytes: u64,
}

/// Whether another frame is timed after those that took `wall_ms`.
fn another(wall_ms: impl ExactSizeIterator<Item = f64>) -> bool {
    let timed = wall_ms.len();
    timed < LEAST_FRAMES || (timed < MOST_FRAMES && wall_ms.sum::<f64>() < LONG_ENOUGH_MS)
}

fn passes(timings: &Timings) -> Vec<Pass> {
    timings.passes().into_iter().map(|p| Pass { name: p.name.to_owned(), gpu_ms: p.gpu_ms.median }).collect()
}

fn errors(image: &Layers, own_direct: bool, truth: &Truth) -> Result<Errors> {
    let total = Layers::new(image.width, image.height, image.beauty().to_vec());
    let comparison = metrics::compare(&total, &truth.layers)?;
    let direct = if own_direct { image } else { &truth.layers }.get(Aov::Direct).unwrap_or_default().to_vec();
    let parts = Layers { layers: vec![total.layers[0].clone(), (Aov::Direct, direct)], ..total };
    let indirect = metrics::indirect(&parts).zip(metrics::indirect(&truth.layers));
    let diffuse = indirect.as_ref().zip(metrics::wholly_diffuse(&truth.layers));
    let bounces = match truth.depth {
        Depth::Full => None,
        Depth::Bounces(n) => Some(n),
    };
    Ok(Errors {
        bounces,
        noise: truth.noise,
        total: comparison.total,
        flip: comparison.flip,
        diffuse: diffuse.and_then(|((a, b), counts)| metrics::metrics_where(&counts, a, b)),
        // A reference without indirect light has no such part to be wrong about.
        indirect: indirect.and_then(|(a, b)| metrics::metrics(&a, &b, "reference's indirect part").ok()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_settings_are_timed_over_fewer_frames() {
        let timed = |ms: f64| (0..).find(|&n| !another(std::iter::repeat_n(ms, n))).unwrap();
        assert_eq!([1.0, 450.0, 550.0, 700.0, 1900.0, 60e3].map(timed), [5, 5, 4, 3, 2, 2]);
    }
}
