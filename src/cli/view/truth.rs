//! The error of what is shown: the path tracer runs beside it, on what is seen, and both are compared again as samples come in.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{Comparison, compare};
use twobounce::measure::terms::Subtract;
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::scene::{Pose, Scene, Still, View};
use winit::event_loop::EventLoopProxy;

use super::maker::encode;
use super::screen::Picture;
use super::worker::Frame;

/// Samples per pixel after which both are compared.
const ROUNDS: [u32; 7] = [1, 4, 16, 64, 256, 1024, 4096];

/// The path-traced light of all bounces so far, and how far the image is from it.
pub struct Compared {
    pub samples: u32,
    /// Of the reference, relative.
    pub noise: f64,
    pub comparison: Comparison,
    reference: Layers,
}

/// A frame that is compared with the truth.
pub struct TruthOf {
    pub revision: u64,
    pub scene: Arc<Scene>,
    pub pose: Pose,
    pub view: View,
    pub image: Layers,
}

/// A path tracer under way for one frame; it ends when this is dropped.
pub struct Truth {
    /// The frame's.
    pub revision: u64,
    cancel: Arc<AtomicBool>,
    found: Arc<Mutex<Option<Compared>>>,
}

impl Truth {
    /// Starts it; `wake` is told of each round.
    pub fn begin(of: TruthOf, wake: EventLoopProxy<()>) -> Self {
        let TruthOf { revision, scene, pose, view, image } = of;
        let (cancel, found) = (Arc::<AtomicBool>::default(), Arc::<Mutex<Option<Compared>>>::default());
        let truth = Self { revision, cancel: cancel.clone(), found: found.clone() };
        std::thread::spawn(move || {
            let (width, height) = (image.width, image.height);
            let mut film = Film::new(width, height);
            for samples in ROUNDS {
                let stop = Stop::Samples(samples);
                let options = Options { width, height, depth: Depth::Full, stop, seed: 1, occlusion: false };
                let control = Control { progress: &|_| (), save: &mut |_| Ok(()), cancel: &cancel };
                if render(Still::new(&scene, &pose, &view), &options, &mut film, control).is_err() {
                    return; // no longer wanted
                }
                let reference = film.layers(&[Aov::Direct, Aov::Diffuse]);
                let Ok(comparison) = compare(&image, &reference, Subtract::in_scene(&scene)) else { return };
                let compared = Compared { samples, noise: film.noise(), comparison, reference };
                *found.lock().unwrap_or_else(PoisonError::into_inner) = Some(compared);
                if wake.send_event(()).is_err() {
                    return; // the window is closed
                }
            }
        });
        truth
    }

    /// The newest round, once.
    pub fn take(&self) -> Option<Compared> {
        self.found.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

impl Drop for Truth {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Compared {
    /// The image at `fade` 0, the reference at 1, FLIP per pixel at 2 (white is 1), and between them in between.
    pub fn picture(&self, frame: &Frame, fade: f32) -> Picture {
        let reference = encode(&self.reference, Aov::Beauty, frame.exposure_ev);
        let flip = &self.comparison.flip_map;
        let mixed = frame.picture.rgba.iter().zip(&reference).enumerate().map(|(at, (&image, &reference))| {
            let error = if at % 4 == 3 { 255.0 } else { 255.0 * flip[at / 4] };
            let (image, reference) = (f32::from(image), f32::from(reference));
            let mixed = if fade <= 1.0 {
                image + fade * (reference - image)
            } else {
                reference + (fade - 1.0) * (error - reference)
            };
            mixed.round() as u8
        });
        Picture { size: frame.picture.size, rgba: mixed.collect() }
    }

    /// The numbers, for the panel.
    pub fn words(&self) -> String {
        let total = &self.comparison.total;
        let noise = if self.noise.is_finite() { format!(", noise {:.1} %", 100.0 * self.noise) } else { String::new() };
        format!(
            "rel {:.4}, energy {:.3}, FLIP {:.4}\nagainst {} paths a pixel, all bounces{noise}",
            total.rel, total.energy, self.comparison.flip, self.samples
        )
    }
}
