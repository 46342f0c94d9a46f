//! A still image is refined until it is good: passes over it are added until its own estimate of its noise is low enough.

use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use clap::Args;
use twobounce::Result;
use twobounce::chart::measure::same_depth;
use twobounce::reference::film::Film;
use twobounce::reference::{self, Control, Depth, Options, Stop};
use twobounce::renderer::FrameReport;
use twobounce::scene::Still;
use twobounce::settings::{GatherResolution, Settings};

use super::args::{SettingsArgs, budget, percent};
use super::progress::duration;

/// The noise that a still image is refined to, root mean square of its pixels' relative errors.
const NOISE: f64 = 0.02;
/// The most passes, where time does not end them before.
const MOST_PASSES: u32 = 256;
/// Pixels of the largest image of which every one gathers where it is refined: 200 MB for opaque surfaces, as much for blended ones.
pub const MOST_GATHERED: u64 = 1 << 21;
/// Work that takes longer is compared with the path tracer's.
const LONG: Duration = Duration::from_secs(10);
/// Samples a pixel of the path tracer's trial, whose image has an eighth of the pixels a side.
const TRIAL: [u32; 2] = [2, 8];
const TRIAL_SCALE: u32 = 8;

#[derive(Args, Clone, Debug, Default)]
pub struct RefineArgs {
    /// Add passes over the image until the root mean square of its pixels' relative error is at most this, by its own estimate, or
    /// take those of image.passes alone [default: 2 for a still image without --timings, --json, --trace and image.passes, else off]
    #[arg(long, value_name = "PERCENT|off", value_parser = Noise::read, allow_negative_numbers = true)]
    pub noise: Option<Noise>,
    /// Add no more passes once the command has taken this long, such as 90s or 5min
    #[arg(long, value_name = "TIME", value_parser = budget, allow_negative_numbers = true)]
    pub time_limit: Option<Duration>,
}

impl RefineArgs {
    /// The noise that an image is refined to. A `still` is a single image that is made to be looked at. None where `image.passes` alone
    /// counts.
    fn goal(&self, still: bool, settings: &Settings) -> Option<f64> {
        match self.noise {
            Some(Noise::Off) => None,
            Some(Noise::AtMost(noise)) => Some(noise),
            None => (self.time_limit.is_some() || still && settings.image.passes == 1).then_some(NOISE),
        }
    }

    /// The settings for an image that may be refined: then light is gathered at every pixel, unless flags or a file say otherwise or
    /// memory is `scarce`. What is gathered for several pixels blurs, and no pass takes that away. `given`: where the settings come from.
    ///
    /// # Errors
    /// An unknown preset.
    pub fn fitted(&self, settings: Settings, given: &SettingsArgs, still: bool, scarce: bool) -> Result<Settings> {
        const KEY: &str = "image.gather_resolution";
        let preset = Settings::preset(&given.preset)?.image.gather_resolution;
        let chosen = preset != settings.image.gather_resolution || given.sets.iter().any(|set| set.starts_with(KEY));
        let mut fitted = settings;
        if !scarce && !chosen && self.goal(still, &fitted).is_some() {
            fitted.image.gather_resolution = GatherResolution::Full;
        }
        Ok(fitted)
    }
}

/// The value of `--noise`: a share, or none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Noise {
    Off,
    AtMost(f64),
}

impl Noise {
    fn read(text: &str) -> std::result::Result<Self, &'static str> {
        match text {
            "off" => Ok(Self::Off),
            _ => percent(text).map(Self::AtMost).map_err(|_| "write a percentage above 0, or off"),
        }
    }
}

/// The goal of an image, and how far it is.
pub struct Refinement {
    noise: f64,
    until: Option<Instant>,
    began: Instant,
    passes: u32,
    resolution: GatherResolution,
    reached: Option<f64>,
}

impl Refinement {
    /// Of a command that began at `began`. None where `image.passes` alone counts: see [`RefineArgs::goal`].
    pub fn new(args: &RefineArgs, still: bool, settings: &Settings, began: Instant) -> Option<Self> {
        let noise = args.goal(still, settings)?;
        let until = args.time_limit.map(|limit| began + limit);
        let resolution = settings.image.gather_resolution;
        Some(Self { noise, until, began: Instant::now(), passes: 1, resolution, reached: None })
    }

    /// An image begins.
    pub fn begin(&mut self) {
        (self.began, self.passes, self.reached) = (Instant::now(), 1, None);
    }

    /// The image is the mean of so many passes. Whether it needs another one.
    pub fn lacks(&mut self, passes: u32, report: &FrameReport) -> bool {
        (self.passes, self.reached) = (passes, report.noise);
        let good = self.reached.is_some_and(|noise| noise <= self.noise);
        !good && passes < MOST_PASSES && !self.is_over()
    }

    fn is_over(&self) -> bool {
        self.until.is_some_and(|until| Instant::now() >= until)
    }

    /// About how many passes the goal takes in all, where two have shown it: noise falls with the root of their number.
    pub fn needed(&self) -> Option<u32> {
        let noise = self.reached?;
        let passes = f64::from(self.passes) * (noise / self.noise).powi(2);
        Some((passes.ceil() as u32).max(self.passes))
    }

    /// The time that the passes that are missing take.
    fn left(&self) -> Option<Duration> {
        let missing = f64::from(self.needed()? - self.passes);
        Some(self.began.elapsed().mul_f64(missing / f64::from(self.passes)))
    }

    /// A sentence where the path tracer is nearer to the goal; asked once, when noise is known and much is left to do.
    pub fn compare(&self, still: Still, size: (u32, u32), settings: &Settings, file: &str) -> Result<Option<String>> {
        let Some(left) = self.left().filter(|left| self.passes == 2 && *left > LONG) else { return Ok(None) };
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

    /// The noise that was reached, and where it is above the goal what is left; and whether it is above.
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

/// About how long the path tracer takes for an image of so little noise, by a small trial.
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
    // Both trials prepare the scene; the second one adds its further samples alone.
    let (samples, trial_pixels) = (f64::from(TRIAL[1] - TRIAL[0]), f64::from(width * height));
    let sample = times[1].saturating_sub(times[0]).div_f64(samples * trial_pixels);
    let needed = f64::from(TRIAL[1]) * (film.noise() / noise).powi(2);
    Ok(times[0] + sample.mul_f64(needed * f64::from(size.0) * f64::from(size.1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use twobounce::frame::Counters;
    use twobounce::vk::ZoneTimings;

    fn report(noise: Option<f64>) -> FrameReport {
        let timings = ZoneTimings::default();
        let counters = Counters { triangles: 1, degenerate: 0, list_items: 1, occupied_voxels: 1 };
        FrameReport { timings, counters, repeats: 0, settling: 0, noise, cpu_ms: None }
    }

    fn args(noise: Option<Noise>, limit_s: Option<u64>) -> RefineArgs {
        RefineArgs { noise, time_limit: limit_s.map(Duration::from_secs) }
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
        assert_eq!(Noise::read("off"), Ok(Noise::Off));
        assert_eq!(Noise::read("5"), Ok(Noise::AtMost(0.05)));
        assert!(["0", "-1", "on", "nan", ""].iter().all(|text| Noise::read(text).is_err()));
    }

    #[test]
    fn a_refined_image_gathers_at_every_pixel_unless_told() {
        let of = |sets: &[&str]| SettingsArgs {
            preset: "fast".into(),
            config: None,
            method: None,
            sets: sets.iter().map(|set| (*set).to_owned()).collect(),
        };
        let resolution = |sets: &[&str], still, scarce| {
            let (given, refine) = (of(sets), args(None, None));
            let fitted = refine.fitted(given.effective().unwrap(), &given, still, scarce).unwrap();
            fitted.image.gather_resolution
        };
        assert_eq!(resolution(&[], true, false), GatherResolution::Full);
        assert_eq!(resolution(&[], true, true), GatherResolution::Quarter);
        assert_eq!(resolution(&[], false, false), GatherResolution::Quarter);
        assert_eq!(resolution(&["image.passes=4"], true, false), GatherResolution::Quarter);
        assert_eq!(resolution(&["image.gather_resolution=quarter"], true, false), GatherResolution::Quarter);
        assert_eq!(resolution(&["image.gather_resolution=half"], true, false), GatherResolution::Half);
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
