//! What `chart` and `study` share: scenes are opened, references made, missing rows measured and kept, and a folder written.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use twobounce::chart::export::Chart;
use twobounce::chart::measure::{Subject, Truth, same_depth};
use twobounce::chart::plan::Trial;
use twobounce::chart::row::Row;
use twobounce::chart::store::{Keys, Store, Stored};
use twobounce::layers::Aov;
use twobounce::output::file;
use twobounce::reference::cache::Cache;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, SceneArgs, memory_size};
use super::counter::Counter;
use super::reference::{Bar, check_memory};
use super::{interrupt, out};
use crate::say;

/// How rows are made, whichever they are.
#[derive(clap::Args, Debug)]
pub struct BenchArgs {
    /// Stop after so many minutes of measuring, references not counted; the same command goes on later
    #[arg(long, value_name = "M", value_parser = minutes)]
    pub budget_minutes: Option<Duration>,
    /// Root mean square of the references' relative error; `reference --noise` makes the same ones
    #[arg(long, value_name = "PERCENT", default_value = "1", value_parser = percent)]
    pub reference_noise: f64,
    /// Refuse to take more device memory than this: such a setting becomes a row that says so
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    /// Keep rows that another build of the program measured; without this they are measured anew
    #[arg(long)]
    pub any_build: bool,
    #[command(flatten)]
    pub device: DeviceArgs,
}

fn minutes(text: &str) -> std::result::Result<Duration, String> {
    let duration = text.parse().ok().and_then(|minutes: f64| Duration::try_from_secs_f64(60.0 * minutes).ok());
    duration.filter(|d| !d.is_zero()).ok_or_else(|| "write a number of minutes above 0".into())
}

/// As a share.
fn percent(text: &str) -> std::result::Result<f64, String> {
    let percent = text.parse().ok().filter(|p: &f64| p.is_finite() && *p > 0.0);
    percent.map(|p| p / 100.0).ok_or_else(|| "write a percentage above 0".into())
}

/// Which settings on which scenes, and the folder that keeps them.
pub struct Bench<'a> {
    /// How the scenes are looked at.
    pub scene: &'a SceneArgs,
    pub paths: Vec<&'a PathBuf>,
    pub trials: &'a [Trial],
    pub folder: &'a Path,
    pub args: &'a BenchArgs,
}

/// Why no further rows were made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Done,
    OutOfTime,
    Interrupted,
}

impl Bench<'_> {
    /// Measures what is missing, writes the folder's files anew, has `write` do what else is to be done with a chart that
    /// has any row, and says what is missing.
    pub fn run(&self, write: impl FnOnce(&Chart) -> anyhow::Result<()>) -> anyhow::Result<()> {
        self.scene.check()?;
        check_memory(self.scene.size)?;
        let store = Store::open(self.folder, self.args.any_build)?;
        let mut subjects = self.open()?;
        let context = self.args.device.open(self.scene.size.0, self.scene.size.1)?;
        let (device, driver) = (context.name.clone(), context.driver.clone());
        interrupt::install()?;
        self.references(&mut subjects)?;
        let planned = self.trials.len() * subjects.len();
        let (stored, end) = self.rows(&store, &subjects, context)?;
        if stored.is_empty() && end == End::OutOfTime {
            let text = "--budget-minutes: too small for one run; the time is over and the first row is not finished";
            return Err(Error::Usage(text.to_owned()).into());
        }
        if !stored.is_empty() {
            let chart = Chart {
                device,
                driver,
                width: self.scene.size.0,
                height: self.scene.size.1,
                reference_noise: self.args.reference_noise,
                scenes: subjects.iter().map(Subject::line).collect(),
                planned,
                rows: stored.iter().map(|s| s.row.clone()).collect(),
                ..Chart::default()
            };
            chart.write(&store, &subjects, &stored)?;
            say!("wrote {}", store.path("index.html").display());
            write(&chart)?;
        }
        Ok(tell(end, &stored, planned)?)
    }

    /// Opens the scenes, without references yet.
    fn open(&self) -> Result<Vec<Subject>> {
        let mut subjects: Vec<Subject> = Vec::new();
        for (i, path) in self.paths.iter().enumerate() {
            if self.paths[..i].iter().any(|other| file::is_same(other, path)) {
                return Err(Error::file(*path, "is named twice; name each scene once"));
            }
            let opened = SceneArgs { path: path.to_path_buf(), ..self.scene.clone() }.open()?;
            opened.notes.iter().for_each(|note| out::complain(&format!("note: {}: {note}", opened.scene.name)));
            let name = &opened.scene.name;
            let mut numbered = (1..).map(|k| if k == 1 { name.clone() } else { format!("{name} {k}") });
            let free = |name: &String| subjects.iter().all(|other| other.name != *name);
            let name = numbered.find(free).expect("numbers do not end");
            let pose = opened.pose(0.0);
            subjects.push(Subject {
                name,
                view: opened.view(&pose),
                pose,
                bounds: opened.shot.bounds(&opened.scene),
                size: (opened.width, opened.height),
                memory_limit: self.args.memory_limit,
                camera: opened.camera,
                truths: Vec::new(),
                scene: opened.scene,
            });
        }
        Ok(subjects)
    }

    /// Makes every reference that the rows will be held against, or takes it from the cache.
    fn references(&self, subjects: &mut [Subject]) -> Result<()> {
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
        let stop = Stop::Noise(self.args.reference_noise);
        let options = Options { width, height, depth, stop, seed: 0, occlusion: false };
        let bar = Bar::new();
        let of = (&subject.scene, &subject.pose, &subject.view);
        let film = cache.render(of, &options, &|progress| bar.show(&progress), interrupt::flag());
        let traced = bar.finish();
        let film = film?;
        let noise = film.noise();
        let how = if traced.paths == 0 { "from the cache".into() } else { format!("{:.1} s", traced.seconds) };
        say!("{}: reference of {light}, noise {:.2} %, {how}", subject.name, 100.0 * noise);
        Truth::new(depth, noise, film.layers(&[Aov::Direct, Aov::Diffuse]))
            .map_err(|error| Error::Usage(format!("{}: {error}; light the scene", subject.name)))
    }

    /// Makes the rows that are not kept yet, the first settings of every scene first. Gives the rows that are there in the
    /// end, in the order of scenes, then of settings.
    fn rows(&self, store: &Store, subjects: &[Subject], context: Arc<Context>) -> Result<(Vec<Stored>, End)> {
        let keys = Keys::new(&context, self.args.device.validation, self.args.reference_noise);
        let pairs = self.trials.iter().flat_map(|trial| subjects.iter().map(move |subject| (subject, trial)));
        let mut jobs: Vec<Job> = pairs.map(|(subject, trial)| Job::new(store, &keys, subject, trial)).collect();
        let end = self.measure(store, &mut jobs, context)?;
        let mut rows: Vec<Stored> = jobs.into_iter().filter_map(|job| job.stored).collect();
        rows.sort_by_key(|stored| subjects.iter().position(|s| s.name == stored.row.scene));
        Ok((rows, end))
    }

    fn measure(&self, store: &Store, jobs: &mut [Job], context: Arc<Context>) -> Result<End> {
        let missing = jobs.iter().filter(|job| !job.is_measured()).count();
        let counter = Counter::new(missing, jobs.len());
        let start = Instant::now();
        let in_time = || self.args.budget_minutes.is_none_or(|budget| start.elapsed() < budget);
        let go_on = || in_time() && interrupt::check().is_ok();
        let mut device = Some(context);
        for job in jobs.iter_mut().filter(|job| !job.is_measured()) {
            if !go_on() {
                break;
            }
            counter.begin(&job.row);
            let context = match device.take() {
                Some(context) => context,
                None => self.args.device.open(job.subject.size.0, job.subject.size.1)?,
            };
            let stored = match job.subject.measure(&context, &job.trial.settings, &go_on) {
                Ok(None) => break,
                Ok(Some((measured, pictures))) => {
                    device = Some(context);
                    store.save(Row { measured: Some(measured), ..job.row.clone() }, Some(&pictures))?
                }
                Err(error) => {
                    // A device that failed may be lost; the next row opens it anew.
                    device = (!matches!(error, Error::Device(_))).then_some(context);
                    store.save(Row { failure: Some(error.to_string()), ..job.row.clone() }, None)?
                }
            };
            counter.finish(&stored.row);
            job.stored = Some(stored);
        }
        counter.clear();
        Ok(match (interrupt::check(), in_time()) {
            (Err(_), _) => End::Interrupted,
            (_, false) if jobs.iter().any(|job| job.stored.is_none()) => End::OutOfTime,
            _ => End::Done,
        })
    }
}

/// Says what is missing, and why.
fn tell(end: End, stored: &[Stored], planned: usize) -> Result<()> {
    let failed = stored.iter().filter(|s| s.row.measured.is_none()).count();
    if failed > 0 {
        say!("settings that could not run: {failed} of {planned}; their rows say why");
    }
    let there = stored.len();
    match end {
        End::Done => Ok(()),
        End::OutOfTime => {
            say!("the budget is spent after {there} of {planned} rows; the same command goes on from there");
            Ok(())
        }
        End::Interrupted => {
            out::complain(&format!("{there} of {planned} rows are kept; the same command goes on from there"));
            Err(Error::Interrupted)
        }
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
        let row = Row::new(keys.key(subject, &trial.settings), &subject.name, trial);
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
