//! References of a chart: rough ones first, which are refined in rounds.

use twobounce::chart::measure::ReferenceImage;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::Still;
use twobounce::{Error, Result};

use super::Filling;
use crate::cli::reference::traced;
use crate::say;

/// A round makes references this much less noisy, in about ten times the time.
const STEP: f64 = 3.0;

/// Noise that is so little above what was asked for is not worth a round of its own.
const CLOSE: f64 = 1.5;

impl Filling<'_> {
    /// The noise of a scene's reference of this depth.
    pub(super) fn noise(&self, scene: usize, depth: Depth) -> Option<f64> {
        let references = &self.scenes[scene].scene.references;
        references.iter().find(|reference| reference.depth == depth).map(|reference| reference.noise)
    }

    /// Makes a reference as good as the next round asks for, or takes it from the cache: of the first samples, then of less and
    /// less noise, in the end the one that `reference --noise` makes.
    pub(super) fn next_reference(&mut self, scene: usize, depth: Depth) -> Result<()> {
        let last = self.bench.args.reference_noise;
        let noise = self.noise(scene, depth).map_or(f64::INFINITY, |now| now / STEP);
        let noise = if noise < CLOSE * last { last } else { noise };
        let of_round = |stop| self.scenes[scene].scene.reference_options(depth, stop);
        let seen = &self.scenes[scene].scene;
        let name = &seen.name;
        let light = match depth {
            Depth::Full => "all light".to_owned(),
            Depth::Bounces(n) => format!("light of {n} indirect bounces"),
        };
        let options: Options = of_round(Stop::Rough { noise, last });
        let (film, traced) = traced(&self.cache, Still::new(&seen.scene, &seen.pose, &seen.view), &options)?;
        let noise = film.noise();
        let how = if traced.paths == 0 { "from the cache".into() } else { format!("{:.1} s", traced.seconds) };
        say!("{name}: reference of {light}, noise {:.2} %, {how}", 100.0 * noise);
        let reference = ReferenceImage::of_film(depth, &film)
            .map_err(|error| Error::Usage(format!("{name}: {error}; light the scene")))?;
        self.scenes[scene].scene.set_reference(reference);
        Ok(())
    }
}
