//! Refinement of a still image: passes are added until the estimated noise of their mean is low enough.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use crate::Result;
use crate::chart::measure::same_depth;
use crate::reference::film::Film;
use crate::reference::{self, Control, Depth, Options, Stop};
use crate::renderer::{FrameReport, Renderer};
use crate::scene::{Pose, Still, View};
use crate::settings::{GatherResolution, Settings};

/// The noise to which a still image is refined: root mean square of its pixels' relative errors.
const NOISE: f64 = 0.02;
/// The maximum number of passes.
const MOST_PASSES: u32 = 256;
/// The largest number of pixels at which light is gathered at every pixel during refinement: 200 MB for opaque
/// surfaces, and as much for blended ones.
const MOST_GATHERED: u64 = 1 << 21;
/// Remaining work that takes longer than this is compared with the path tracer's.
const LONG: Duration = Duration::from_secs(10);
/// Samples per pixel of the path tracer's two trials, whose image has an eighth of the pixels along each side.
const TRIAL: [u32; 2] = [2, 8];
const TRIAL_SCALE: u32 = 8;

/// Whether memory may not suffice for light at every pixel: for a large image, or with a limit set by the caller.
pub fn is_scarce((width, height): (u32, u32), memory_limit: Option<u64>) -> bool {
    u64::from(width) * u64::from(height) > MOST_GATHERED || memory_limit.is_some()
}

/// The noise to which an image is refined.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    /// The image has `image.passes` passes, without refinement.
    Off,
    /// The maximum root mean square of the pixels' relative errors, as a share.
    AtMost(f64),
}

/// The quality of an image, and the time that it may take.
#[derive(Clone, Copy, Debug, Default)]
pub struct Refine {
    /// By default 0.02 for a still image without `image.passes`, else [`Noise::Off`].
    pub noise: Option<Noise>,
    /// No further pass begins after this time.
    pub time_limit: Option<Duration>,
}

impl Refine {
    /// The noise to which an image is refined. `still` marks a single image that is made to be looked at. `None` if
    /// only `image.passes` counts.
    fn goal(&self, still: bool, settings: &Settings) -> Option<f64> {
        match self.noise {
            Some(Noise::Off) => None,
            Some(Noise::AtMost(noise)) => Some(noise),
            None => (self.time_limit.is_some() || still && settings.image.passes == 1).then_some(NOISE),
        }
    }

    /// The settings for an image that may be refined. Light is gathered at every pixel, unless the resolution was
    /// `chosen` or memory is `scarce` ([`is_scarce`]): gathering at fewer pixels blurs light, and no number of passes
    /// removes that.
    #[must_use]
    pub fn fitted(&self, settings: Settings, chosen: bool, still: bool, scarce: bool) -> Settings {
        let mut fitted = settings;
        if !scarce && !chosen && self.goal(still, &fitted).is_some() {
            fitted.image.gather_resolution = GatherResolution::Full;
        }
        fitted
    }
}

/// An event during refinement.
#[derive(Clone, Debug)]
pub enum Event {
    /// The next pass begins. `has` passes are finished, and about `needed` are needed in all, known after two passes.
    Pass { has: u32, needed: Option<u32> },
    /// A note that the path tracer would reach the goal sooner.
    Note(String),
}

/// The goal of an image, and the progress towards it.
pub struct Refinement {
    noise: f64,
    until: Option<Instant>,
    began: Instant,
    passes: u32,
    resolution: GatherResolution,
    reached: Option<f64>,
    /// The scene's file, for the path tracer's command.
    file: Option<String>,
}

impl Refinement {
    /// The refinement of work that began at `began`. `None` if only `image.passes` counts.
    pub fn new(args: &Refine, still: bool, settings: &Settings, began: Instant) -> Option<Self> {
        let noise = args.goal(still, settings)?;
        let until = args.time_limit.map(|limit| began + limit);
        let resolution = settings.image.gather_resolution;
        Some(Self { noise, until, began: Instant::now(), passes: 1, resolution, reached: None, file: None })
    }

    /// Sets the scene's file, so that a note can name the path tracer's command.
    #[must_use]
    pub fn of_file(self, file: String) -> Self {
        Self { file: Some(file), ..self }
    }

    /// Renders an image, and adds passes until its noise is low enough. `tell` is called before each further pass; its
    /// error ends the work.
    ///
    /// # Errors
    /// As for [`Renderer::render`], and errors of `tell`.
    pub fn run(
        &mut self,
        renderer: &mut Renderer,
        pose: &Pose,
        view: &View,
        tell: &mut dyn FnMut(&Renderer, Event) -> Result<()>,
    ) -> Result<FrameReport> {
        let mut report = renderer.render(pose, view)?;
        (self.began, self.passes, self.reached) = (Instant::now(), 1, None);
        while self.lacks(renderer.passes(), &report) {
            let still = Still::new(renderer.scene(), pose, view);
            if let Some(words) = self.compare(still, renderer.size(), renderer.settings())? {
                tell(renderer, Event::Note(words))?;
            }
            tell(renderer, Event::Pass { has: self.passes, needed: self.needed() })?;
            report = report.then(renderer.refine(pose, view)?);
        }
        Ok(report)
    }

    /// Reports the number of `passes` in the image's mean. Returns whether another one is needed.
    fn lacks(&mut self, passes: u32, report: &FrameReport) -> bool {
        (self.passes, self.reached) = (passes, report.noise);
        let good = self.reached.is_some_and(|noise| noise <= self.noise);
        !good && passes < MOST_PASSES && !self.is_over()
    }

    fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }

    /// About the number of passes that the goal takes in all, known after two of them: noise is proportional to the
    /// inverse square root of their number.
    fn needed(&self) -> Option<u32> {
        let noise = self.reached?;
        let passes = f64::from(self.passes) * (noise / self.noise).powi(2);
        Some((passes.ceil() as u32).max(self.passes))
    }

    /// The time of the remaining passes.
    fn left(&self) -> Option<Duration> {
        let missing = f64::from(self.needed()? - self.passes);
        Some(self.began.elapsed().mul_f64(missing / f64::from(self.passes)))
    }

    /// A sentence if the path tracer would reach the goal sooner. It is requested once, when the noise is known and
    /// much work remains.
    fn compare(&self, still: Still, size: (u32, u32), settings: &Settings) -> Result<Option<String>> {
        let left = self.left().filter(|left| self.passes == 2 && *left > LONG);
        let Some((left, file)) = left.zip(self.file.as_ref()) else { return Ok(None) };
        let depth = same_depth(still.scene, settings);
        let flag = match depth {
            Depth::Full => " --depth full".to_owned(),
            Depth::Bounces(bounces) => format!(" --depth {bounces}"),
        };
        let paths = paths_time(still, size, depth, self.noise)?;
        let percent = 100.0 * self.noise;
        Ok((paths < left).then(|| {
            format!(
                "the path tracer reaches {percent} % of noise in about {}, these passes in {}: twobounce reference {file} -o image.exr \
                 --noise {percent}{flag}",
                duration(paths),
                duration(left)
            )
        }))
    }

    /// The noise that was reached and the remaining work if it is above the goal; and whether it is.
    pub fn result(&self) -> (String, bool) {
        let (passes, goal) = (self.passes, 100.0 * self.noise);
        let resolution = self.resolution;
        let same = format!(
            "--set image.passes={passes} --set image.gather_resolution={resolution} --noise off gives the same image"
        );
        let Some(noise) = self.reached else {
            return (format!("one pass, whose noise is not known, until --time-limit was over ({same})"), true);
        };
        let reached = format!("noise {:.2} %, mean of {passes} passes ({same})", 100.0 * noise);
        if noise <= self.noise {
            return (reached, false);
        }
        let why = if self.passes < MOST_PASSES { "--time-limit was over; " } else { "" };
        let left = match self.needed().zip(self.left()) {
            Some((needed, time)) if needed <= MOST_PASSES => {
                format!("{goal} % takes about {needed} passes, {} more", duration(time))
            }
            Some((needed, _)) => {
                format!(
                    "{goal} % takes about {needed} passes, more than the {MOST_PASSES} that an image gets: allow more with --noise"
                )
            }
            None => "the time of further passes is not known".into(),
        };
        (format!("{reached}: {why}{left}"), true)
    }
}

/// About the time that the path tracer takes for an image of this noise, measured by a small trial.
fn paths_time(still: Still, size: (u32, u32), depth: Depth, noise: f64) -> Result<Duration> {
    let [width, height] = [size.0, size.1].map(|side| side.div_ceil(TRIAL_SCALE));
    let mut film = Film::new(width, height);
    let mut times = [Duration::ZERO; 2];
    for (time, samples) in times.iter_mut().zip(TRIAL) {
        let options = Options { width, height, depth, stop: Stop::Samples(samples), seed: 0, occlusion: false };
        let control = Control { progress: &|_| (), save: &mut |_| Ok(()), cancel: &AtomicBool::new(false) };
        let begins = Instant::now();
        reference::render(still, &options, &mut film, control)?;
        *time = begins.elapsed();
    }
    // Both trials prepare the scene; the second one only adds its further samples.
    let (samples, trial_pixels) = (f64::from(TRIAL[1] - TRIAL[0]), f64::from(width * height));
    let sample = times[1].saturating_sub(times[0]).div_f64(samples * trial_pixels);
    let needed = f64::from(TRIAL[1]) * (film.noise() / noise).powi(2);
    Ok(times[0] + sample.mul_f64(needed * f64::from(size.0) * f64::from(size.1)))
}

/// A duration such as `40 s`, `3 min 20 s` or `2 h 5 min`.
pub fn duration(time: Duration) -> String {
    match time.as_secs_f64().round() as u64 {
        seconds @ 0..60 => format!("{seconds} s"),
        seconds @ 60..3600 => format!("{} min {} s", seconds / 60, seconds % 60),
        seconds => format!("{} h {} min", seconds / 3600, seconds / 60 % 60),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn report(noise: Option<f64>) -> FrameReport {
        FrameReport { noise, ..FrameReport::default() }
    }

    fn args(noise: Option<Noise>, limit_s: Option<u64>) -> Refine {
        Refine { noise, time_limit: limit_s.map(Duration::from_secs) }
    }

    #[test]
    fn stills_are_refined_and_others_where_it_is_asked_for() {
        let (one, now) = (Settings::default(), Instant::now());
        let mut two = one.clone();
        two.set("image.passes=2").unwrap();
        let goal = |noise, limit, still, settings| {
            Refinement::new(&args(noise, limit), still, settings, now).map(|refinement| refinement.noise)
        };
        assert_eq!(goal(None, None, true, &one), Some(NOISE));
        assert_eq!(goal(None, None, false, &one), None);
        assert_eq!(goal(None, None, true, &two), None);
        assert_eq!(goal(None, Some(5), false, &two), Some(NOISE));
        assert_eq!(goal(Some(Noise::AtMost(0.1)), None, false, &two), Some(0.1));
        assert_eq!(goal(Some(Noise::Off), Some(5), true, &one), None);
    }

    #[test]
    fn a_refined_image_gathers_at_every_pixel_unless_told() {
        let resolution = |passes: u32, chosen, still, scarce| {
            let mut settings = Settings::fast();
            settings.image.passes = passes;
            args(None, None).fitted(settings, chosen, still, scarce).image.gather_resolution
        };
        assert_eq!(resolution(1, false, true, false), GatherResolution::Full);
        assert_eq!(resolution(1, false, true, true), GatherResolution::Quarter);
        assert_eq!(resolution(1, false, false, false), GatherResolution::Quarter);
        assert_eq!(resolution(4, false, true, false), GatherResolution::Quarter);
        assert_eq!(resolution(1, true, true, false), GatherResolution::Quarter);
    }

    #[test]
    fn durations_are_read_at_a_glance() {
        let words = [0.2, 59.4, 60.0, 3599.0, 7500.0].map(|s| duration(Duration::from_secs_f64(s)));
        assert_eq!(words, ["0 s", "59 s", "1 min 0 s", "59 min 59 s", "2 h 5 min"]);
    }

    #[test]
    fn passes_are_added_until_the_image_is_good_or_time_is_over() {
        let settings = Settings::default();
        let new = |limit_s, began| Refinement::new(&args(None, limit_s), true, &settings, began).unwrap();
        let mut open = new(None, Instant::now());
        assert!(open.lacks(1, &report(None)) && open.needed().is_none());
        assert!(open.lacks(2, &report(Some(0.06))));
        assert_eq!(open.needed(), Some(18), "a third of the noise takes nine times as many passes");
        assert!(open.result().1);
        assert!(!open.lacks(20, &report(Some(0.019))));
        let (words, is_short) = open.result();
        assert!(words.starts_with("noise 1.90 %, mean of 20 passes (--set image.passes=20"), "{words}");
        assert!(!is_short);
        assert!(!open.lacks(MOST_PASSES, &report(Some(0.5))));
        assert!(
            open.result().0.contains("): 2 % takes about 160000 passes, more than the 256 that"),
            "{}",
            open.result().0
        );
        let mut over = new(Some(1), Instant::now() - Duration::from_secs(2));
        assert!(!over.lacks(1, &report(None)));
        assert!(over.result().0.contains("--time-limit was over") && over.result().1);
    }
}
