//! `twobounce reference`: a path-traced reference image.

use std::ops::Range;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Mutex;
use std::time::Instant;

use clap::Args;
use twobounce::layers::Aov;
use twobounce::output::file;
use twobounce::output::picture::ImageKind;
use twobounce::reference::cache::{self, Cache};
use twobounce::reference::film::Film;
use twobounce::reference::part::{About, Part};
use twobounce::reference::{Depth, Options, Progress, Stop};
use twobounce::scene::Still;
use twobounce::stage::{check_film, truth_header};
use twobounce::{Error, Result};

use super::args::{SceneArgs, aov, percent};
use super::display::DisplayArgs;
use super::progress::{Work, left};
use super::share::{self, Parts};
use super::{interrupt, out, outputs};
use crate::say;

#[derive(Args, Debug)]
pub struct ReferenceArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The image to write: linear radiance in an .exr, or a .png or .jpg for a display; - is an .exr on standard
    /// output. With --samples a .film for `twobounce merge`
    #[arg(short, long, value_name = "REF.exr|REF.png|PART.film")]
    pub output: PathBuf,
    /// Samples per pixel
    #[arg(long, value_name = "N", conflicts_with = "noise", value_parser = clap::value_parser!(u32).range(2..=1 << 24))]
    pub spp: Option<u32>,
    /// Add samples until the root mean square of the pixels' relative error is below this percentage
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = percent, allow_negative_numbers = true)]
    pub noise: f64,
    /// Only trace the samples with these numbers, from 0 on: a part for `twobounce merge`
    #[arg(long, value_name = "A-B", conflicts_with_all = ["spp", "noise"], value_parser = samples)]
    pub samples: Option<Range<u32>>,
    /// Print the N commands that share the samples of --samples, one per line, and trace nothing
    #[arg(long, value_name = "N", requires = "samples", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub list: Option<u32>,
    /// Number of indirect bounces, by default those of render; direct, or full for all light
    #[arg(long, value_name = "N|direct|full", default_value = "2", value_parser = depth, allow_hyphen_values = true)]
    pub depth: Depth,
    /// The seed of the random numbers
    #[arg(long, value_name = "S", default_value_t = 0)]
    pub seed: u64,
    /// Further layers of an .exr, separated by commas
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',', value_parser = aov())]
    pub aov: Vec<Aov>,
    /// Make pixels without a surface transparent; the sky still lights the scene
    #[arg(long)]
    pub transparent: bool,
    #[command(flatten)]
    pub display: DisplayArgs,
    /// Print only notes and errors
    #[arg(short, long)]
    pub quiet: bool,
}

/// Parses the numbers of the first and the last sample as a range.
fn samples(text: &str) -> std::result::Result<Range<u32>, &'static str> {
    let read = || {
        let (first, last) = text.split_once('-')?;
        let (first, last) = (first.parse::<u32>().ok()?, last.parse::<u32>().ok()?);
        (first <= last && last < 1 << 24).then_some(first..last + 1)
    };
    read().ok_or("write the numbers of the first and the last sample, from 0 on, such as 0-127")
}

fn depth(text: &str) -> std::result::Result<Depth, String> {
    match text {
        "full" => Ok(Depth::Full),
        "direct" => Ok(Depth::Bounces(0)),
        _ => text.parse().map(Depth::Bounces).map_err(|_| "write a number of indirect bounces, direct or full".into()),
    }
}

/// Renders the image, or takes it from the cache, and writes it; or writes the sums of a part of its samples.
pub fn run(args: &ReferenceArgs) -> anyhow::Result<ExitCode> {
    out::be_quiet(args.quiet);
    args.scene.check()?;
    let shown = shown(args)?;
    if let (Some(samples), Some(count)) = (&args.samples, args.list) {
        let parts: Vec<String> = share::chunks(samples.len() as u32, count)
            .map(|part| format!("{}-{}", samples.start + part.start, samples.start + part.end - 1))
            .collect();
        let shared = Parts { flag: "--samples", outputs: &["-o", "--output"], ending: "film" };
        shared.list(&parts, Some(&args.output));
        return Ok(ExitCode::SUCCESS);
    }
    outputs::check(&[Some(&args.scene.path), args.scene.sky_map()], &[Some(&args.output)])?;
    let (part, traced) = trace(args)?;
    let (film, name) = (&part.film, out::name(&args.output));
    if args.samples.is_some() {
        part.write(&args.output)?;
        say!("{name}: samples {}", part.samples());
        traced.say();
        return Ok(ExitCode::SUCCESS);
    }
    let (image, header) = part.image();
    if shown {
        image.write_shown(&args.output, args.display.display(&image))?;
    } else {
        image.write_exr(&args.output, &header)?;
    }
    let (width, height) = (film.width, film.rows.len());
    let (samples, noise) = (film.done(), 100.0 * film.noise());
    say!("{name}: {width}x{height}, {samples} samples per pixel, noise {noise:.2} % RMS");
    traced.say();
    if film.rejected() > 0 {
        say!("{} samples were not finite and count as black", film.rejected());
    }
    Ok(ExitCode::SUCCESS)
}

/// Whether the output is an image for a display.
fn shown(args: &ReferenceArgs) -> Result<bool> {
    let path = &args.output;
    if args.samples.is_some() {
        let is_film = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("film"));
        let text = "is no .film; samples are kept as sums, name it something.film and merge it with the others";
        args.display.check(ImageKind::Exr, false)?;
        return if is_film { Ok(false) } else { Err(Error::file(path, text)) };
    }
    let kind = match ImageKind::of_path(path) {
        _ if file::is_standard(path) => ImageKind::Exr,
        Some(kind) => kind,
        None => return Err(Error::file(path, "has an unknown ending; end the output in .exr, .png or .jpg")),
    };
    args.display.check(kind, args.transparent)?;
    if kind != ImageKind::Exr && !args.aov.is_empty() {
        return Err(Error::Usage("--aov adds layers to an .exr; name one with -o".into()));
    }
    Ok(kind != ImageKind::Exr)
}

/// The film for the arguments, and the work that was done.
fn trace(args: &ReferenceArgs) -> anyhow::Result<(Part, TracedWork)> {
    let stop = match &args.samples {
        Some(samples) => Stop::Range { first: samples.start, end: samples.end },
        None => args.spp.map_or(Stop::Noise(args.noise), Stop::Samples),
    };
    check_film(args.scene.size)?;
    interrupt::install()?;
    let mut opened = args.scene.open()?;
    opened.scene.sky_unseen = args.transparent;
    let (width, height) = opened.size;
    let occlusion = args.aov.contains(&Aov::Ao);
    let options = Options { width, height, depth: args.depth, stop, seed: args.seed, occlusion };
    let (pose, view) = &opened.still;
    let cache = cache();
    let of = Still::new(&opened.scene, pose, view);
    let (film, traced) = traced(&cache, of, &options).inspect_err(|error| {
        if matches!(error, Error::Interrupted) && cache.problem().is_none() {
            out::warn("finished samples are kept; the same command continues from there");
        }
    })?;
    let header = truth_header(&opened, args.depth, args.seed);
    let alpha = args.transparent.then_some(Aov::Alpha);
    let layers = args.aov.iter().copied().chain(alpha).map(|aov| aov.name().to_owned()).collect();
    Ok((Part { key: cache::key(of, &options), about: About { header, layers }, film }, traced))
}

/// The user's cache, with a note if it cannot store anything.
pub fn cache() -> Cache {
    let cache = Cache::of_user();
    if let Some(problem) = cache.problem() {
        out::warn(&format!("note: {problem}; references are not kept, unless TWOBOUNCE_CACHE names a folder for them"));
    }
    cache
}

/// Work of this call.
pub struct TracedWork {
    pub paths: u64,
    pub seconds: f64,
}

impl TracedWork {
    fn say(&self) {
        if self.paths == 0 {
            say!("taken from the cache");
        } else {
            let (paths, seconds) = (self.paths as f64 / 1e6, self.seconds);
            let (rate, threads) = (paths / seconds, rayon::current_num_threads());
            say!(
                "traced {paths:.2} million paths in {seconds:.1} s: {rate:.3} million per second on {threads} threads"
            );
        }
    }
}

/// The film of a scene and view. Samples that the cache lacks are traced, with a line of progress.
pub fn traced(cache: &Cache, of: Still, options: &Options) -> Result<(Film, TracedWork)> {
    let name = &of.scene.name;
    let work = Work::begin(&format!("{name}: reference"));
    // The time of the first path, and the number of paths since then.
    let seen: Mutex<Option<(Instant, u64)>> = Mutex::new(None);
    let show = |progress: Progress| {
        if let Ok(mut seen) = seen.lock() {
            let (start, latest) = seen.unwrap_or((Instant::now(), 0));
            let latest = latest.max(progress.paths - progress.before);
            *seen = Some((start, latest));
            let share = 100.0 * progress.paths as f64 / progress.expected as f64;
            let noise = progress.noise.map_or(String::new(), |noise| format!(", noise {:.2} %", 100.0 * noise));
            let left = left(start.elapsed(), latest, progress.expected.max(progress.paths) - progress.before);
            work.is_at(format!("{name}: reference {share:.0} %{noise}"), left);
        }
    };
    let film = cache.render(of, options, &show, &interrupt::PRESSED);
    drop(work);
    let seen = seen.lock().ok().and_then(|seen| *seen);
    let (seconds, paths) = seen.map_or((0.0, 0), |(start, paths)| (start.elapsed().as_secs_f64(), paths));
    Ok((film?, TracedWork { paths, seconds }))
}
