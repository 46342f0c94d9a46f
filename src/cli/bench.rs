//! Runs settings over scenes for `chart` and `study`: references first, then rows, each kept as soon as it is finished.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use twobounce::chart::measure::{Subject, Truth, same_depth};
use twobounce::chart::plan::Trial;
use twobounce::chart::row::{Metric, Part, Row, Truth as Against};
use twobounce::chart::store::{Keys, Store, Stored};
use twobounce::layers::Aov;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs};
use super::reference::Bar;
use super::scene::Opened;
use super::{interrupt, out};
use crate::say;

/// Which settings on which scenes, and how.
pub struct Bench<'a> {
    pub store: &'a Store,
    pub trials: &'a [Trial],
    pub device: &'a DeviceArgs,
    /// The references' noise, as a share.
    pub noise: f64,
    /// For the rows, not for the references.
    pub budget: Option<Duration>,
}

/// Why no further rows were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    Done,
    OutOfTime,
    Interrupted,
}

/// Opens scenes, each looked at as `args` say, without references yet.
pub fn open(args: &SceneArgs, more: &[PathBuf], memory_limit: Option<u64>) -> Result<Vec<Subject>> {
    let mut subjects: Vec<Subject> = Vec::new();
    for (i, path) in std::iter::once(&args.path).chain(more).enumerate() {
        if std::iter::once(&args.path).chain(more).take(i).any(|other| other == path) {
            return Err(Error::file(path, "is named twice; name each scene once"));
        }
        let opened = SceneArgs { path: path.clone(), ..args.clone() }.open()?;
        opened.notes.iter().for_each(|note| out::complain(&format!("note: {}: {note}", opened.scene.name)));
        let mut subject = subject(opened, memory_limit);
        if subjects.iter().any(|other| other.name == subject.name) {
            subject.name = path.display().to_string();
        }
        subjects.push(subject);
    }
    Ok(subjects)
}

fn subject(opened: Opened, memory_limit: Option<u64>) -> Subject {
    let pose = opened.pose(0.0);
    Subject {
        name: opened.scene.name.clone(),
        view: opened.view(&pose),
        pose,
        bounds: opened.shot.bounds(&opened.scene),
        size: (opened.width, opened.height),
        memory_limit,
        camera: opened.camera,
        truths: Vec::new(),
        scene: opened.scene,
    }
}

impl Bench<'_> {
    /// Makes every reference that the rows will be held against, or takes it from the cache.
    pub fn references(&self, subjects: &mut [Subject]) -> Result<()> {
        let cache = Cache::of_user()?;
        for subject in subjects {
            let mut depths = vec![Depth::Full];
            for trial in self.trials {
                let depth = same_depth(&subject.scene, &trial.settings);
                if !depths.contains(&depth) {
                    depths.push(depth);
                }
            }
            for depth in depths {
                let truth = self.reference(&cache, subject, depth)?;
                subject.truths.push(truth);
            }
        }
        Ok(())
    }

    fn reference(&self, cache: &Cache, subject: &Subject, depth: Depth) -> Result<Truth> {
        let light = match depth {
            Depth::Full => "all light".to_owned(),
            Depth::Bounces(n) => format!("light of {n} indirect bounces"),
        };
        let (width, height) = subject.size;
        let stop = Stop::Noise(self.noise);
        let options = Options { width, height, depth, stop, seed: 0, occlusion: false };
        let bar = Bar::new();
        let of = (&subject.scene, &subject.pose, &subject.view);
        let film = cache.render(of, &options, &|progress| bar.show(&progress), interrupt::flag());
        let traced = bar.finish();
        let film = film?;
        let noise = film.noise();
        let how = if traced.paths == 0 { "from the cache".into() } else { format!("{:.1} s", traced.seconds) };
        say!("{}: reference of {light}, noise {:.2} %, {how}", subject.name, 100.0 * noise);
        Truth::new(depth, noise, film.layers(&[Aov::Direct]))
            .map_err(|error| Error::Usage(format!("{}: {error}; light the scene", subject.name)))
    }

    /// Makes the rows that are not kept yet, the bases of every scene first. Gives the rows that are there in the end, in the
    /// order of scenes, then of settings.
    pub fn rows(&self, subjects: &[Subject], context: Arc<Context>) -> Result<(Vec<Stored>, End)> {
        let keys = Keys::new(&context, self.device.validation, self.noise)?;
        let pairs = self.trials.iter().flat_map(|trial| subjects.iter().map(move |subject| (subject, trial)));
        let mut jobs: Vec<Job> = pairs.map(|(subject, trial)| Job::new(self.store, &keys, subject, trial)).collect();
        let end = self.make(&mut jobs, context)?;
        let mut rows: Vec<Stored> = jobs.into_iter().filter_map(|job| job.stored).collect();
        rows.sort_by_key(|stored| subjects.iter().position(|s| s.name == stored.row.scene));
        Ok((rows, end))
    }

    fn make(&self, jobs: &mut [Job], context: Arc<Context>) -> Result<End> {
        let bar = Counter::new(jobs);
        let start = Instant::now();
        let in_time = || self.budget.is_none_or(|budget| start.elapsed() < budget);
        let go_on = || in_time() && interrupt::check().is_ok();
        let mut device = Some(context);
        for job in jobs.iter_mut().filter(|job| !job.is_measured()) {
            if !go_on() {
                break;
            }
            bar.begin(job);
            let context = match device.take() {
                Some(context) => context,
                None => self.device.open(job.subject.size.0, job.subject.size.1)?,
            };
            let stored = match job.subject.measure(&context, &job.trial.settings, &go_on) {
                Ok(None) => break,
                Ok(Some((measured, pictures))) => {
                    device = Some(context);
                    Stored::new(Row { measured: Some(measured), ..job.row.clone() }, Some(&pictures))
                }
                Err(error) => {
                    // A device that failed may be lost; the next row opens it anew.
                    device = (!matches!(error, Error::Device(_))).then_some(context);
                    Stored::new(Row { failure: Some(error.to_string()), ..job.row.clone() }, None)
                }
            };
            self.store.save(&stored)?;
            bar.finish(&stored.row);
            job.stored = Some(stored);
        }
        bar.bar.finish_and_clear();
        Ok(match (interrupt::check(), in_time()) {
            (Err(_), _) => End::Interrupted,
            (_, false) if jobs.iter().any(|job| job.stored.is_none()) => End::OutOfTime,
            _ => End::Done,
        })
    }
}

/// One row to be made, or already there.
struct Job<'a> {
    subject: &'a Subject,
    trial: &'a Trial,
    /// As it is called in this chart, without a result.
    row: Row,
    stored: Option<Stored>,
}

impl<'a> Job<'a> {
    fn new(store: &Store, keys: &Keys, subject: &'a Subject, trial: &'a Trial) -> Self {
        let row = Row {
            key: keys.key(subject, &trial.settings),
            scene: subject.name.clone(),
            name: trial.name(),
            preset: trial.preset.clone(),
            swept: trial.swept.clone(),
            changes: trial.changes().into_iter().map(|(key, value)| format!("{}={value}", key.name)).collect(),
            settings: trial.settings.clone(),
            measured: None,
            failure: None,
        };
        // The same settings may have gone by another name.
        let renamed = |mut stored: Stored| {
            let Row { measured, failure, .. } = stored.row;
            stored.row = Row { measured, failure, ..row.clone() };
            stored
        };
        Self { subject, trial, stored: store.load(&row.key).map(renamed), row }
    }

    /// A failure is tried again: memory may be free by now.
    fn is_measured(&self) -> bool {
        self.stored.as_ref().is_some_and(|stored| stored.row.measured.is_some())
    }
}

/// The progress bar over the rows that are still to be made, and a line for each.
struct Counter {
    bar: ProgressBar,
}

impl Counter {
    fn new(jobs: &[Job]) -> Self {
        let missing = jobs.iter().filter(|job| !job.is_measured()).count();
        if missing < jobs.len() {
            say!("rows kept from earlier calls: {} of {}", jobs.len() - missing, jobs.len());
        }
        let bar = ProgressBar::new(missing as u64);
        if let Ok(style) = ProgressStyle::with_template("{wide_bar} {pos} of {len} rows, {eta} left: {msg}") {
            bar.set_style(style);
        }
        Self { bar }
    }

    fn begin(&self, job: &Job) {
        self.bar.set_message(format!("{} {}", job.row.scene, job.row.name));
        self.bar.tick();
    }

    fn finish(&self, row: &Row) {
        self.bar.inc(1);
        let told = match (&row.measured, &row.failure) {
            (Some(m), _) => {
                let error = |truth| row.error(truth, Part::Total, Metric::Rel).unwrap_or(f64::NAN);
                let (full, same) = (error(Against::Full), error(Against::Same));
                format!("{:.0} ms, rel {full:.3} of all light, {same:.3} of as many bounces", m.frame_gpu_ms.median)
            }
            (None, failure) => failure.clone().unwrap_or_default(),
        };
        self.bar.suspend(|| say!("{} {}: {told}", row.scene, row.name));
    }
}
