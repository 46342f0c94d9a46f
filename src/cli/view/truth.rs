//! The error of the shown picture: the path tracer renders the same view, and both are compared again as samples are
//! added.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{Comparison, compare};
use twobounce::measure::terms::Subtract;
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::scene::{Scene, Still};
use winit::event_loop::EventLoopProxy;

use super::job::{News, ShownFrame};
use super::maker::encode;
use super::screen::Picture;
use crate::cli::threads;

/// Samples per pixel after which both are compared.
const ROUNDS: [u32; 7] = [1, 4, 16, 64, 256, 1024, 4096];

/// The path-traced light of all bounces so far, and the error of the image.
pub struct Compared {
    pub samples: u32,
    /// Relative noise of the reference.
    pub noise: f64,
    pub comparison: Comparison,
    reference: Layers,
}

/// A running path tracer for one frame; dropping it ends it.
pub struct Truth {
    /// The revision of the frame.
    pub revision: u64,
    cancel: Arc<AtomicBool>,
}

impl Truth {
    /// Starts it for a frame; it reports each round.
    ///
    /// # Errors
    /// One sentence if the system allows no thread.
    pub fn begin(scene: Arc<Scene>, frame: &ShownFrame, news: EventLoopProxy<News>) -> twobounce::Result<Self> {
        let cancel = Arc::<AtomicBool>::default();
        let ShownFrame { job, image, .. } = frame;
        let truth = Self { revision: job.revision, cancel: cancel.clone() };
        let (pose, view, image) = (job.pose.clone(), job.view, image.clone());
        threads::spawn(move || {
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
                if news.send_event(News::Compared(cancel.clone(), compared)).is_err() {
                    return; // the window is closed
                }
            }
        })?;
        Ok(truth)
    }
}

impl Drop for Truth {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

impl Compared {
    /// The image at `fade` 0, the reference at 1, FLIP per pixel at 2 (white is 1), and blends between them.
    pub fn picture(&self, frame: &ShownFrame, fade: f32) -> Picture {
        let reference = encode(&self.reference, Aov::Beauty, frame.display);
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

    /// The numbers for the panel.
    pub fn in_words(&self) -> String {
        let total = &self.comparison.total;
        let noise = if self.noise.is_finite() { format!(", noise {:.1} %", 100.0 * self.noise) } else { String::new() };
        format!(
            "rel {:.4}, energy {:.3}, FLIP {:.4}\nagainst {} paths a pixel, all bounces{noise}",
            total.rel, total.energy, self.comparison.flip, self.samples
        )
    }
}
