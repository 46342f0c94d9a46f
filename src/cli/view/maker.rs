//! How frames are made: coarse ones while something moves; at rest whole ones, which go on to get better. What there is meanwhile is
//! shown: the light of all bounces while it settles, and the mean over passes of the image.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;
use twobounce::gi::rays::inspect::Inspect;
use twobounce::ground::boxes::FACTOR;
use twobounce::layers::{Aov, Layers};
use twobounce::output::png::{automatic_exposure, srgb_code, tone_curve};
use twobounce::renderer::{FrameReport, RenderOptions, Renderer};
use twobounce::settings::Settings;
use twobounce::vk::{Context, Watch, ZoneTiming, ZoneTimings};
use twobounce::{Error, Result};

use super::job::{Beside, Frame, Job, Refined, Stage, Wanted};
use super::layer::{Grid, Layer};
use super::question::{self, Cost, Found, Question};
use super::screen::Picture;
use crate::cli::blank::sky_shown;
use crate::cli::progress::course::IMAGE_PASSES;
/// Milliseconds of the image while something moves: with encoding and showing it, an answer within 100.
const MOVING_MS: f64 = 35.0;
/// By how much a side of the image is divided while something moves.
const DIVISORS: [u32; 4] = [1, 2, 4, 8];
/// At rest, what there is meanwhile is shown after so long,
const SHOW_AFTER: Duration = Duration::from_millis(250);
/// and after so many times as long as showing it takes: pictures in between take a quarter of the time at most.
const SHOW_SHARE: u32 = 3;

/// Renderers of what is shown and of what is beside it.
pub struct Makers {
    stage: Stage,
    own: Option<Maker>,
    beside: Option<Maker>,
}

impl Makers {
    /// Frames go on as long as `watch` says.
    pub fn new(mut stage: Stage, watch: Watch) -> Self {
        stage.options.watch = Some(watch);
        Self { stage, own: None, beside: None }
    }

    /// The next job's renderers are made anew: their shaders are others.
    pub fn renew(&mut self) {
        (self.own, self.beside) = (None, None);
    }

    /// Makes what a job asks for, and shows it each time that it is better than before.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Interrupted`] once another picture is wanted.
    pub fn make(&mut self, job: &Job, wanted: &Wanted, show: &dyn Fn(Frame)) -> Result<()> {
        let began = Instant::now();
        let mut making = self.making(job, began)?;
        if job.moving {
            return making.draw().and_then(|()| making.frame(false)).map(show);
        }
        making.light(wanted, show)?;
        while !self.making(job, began)?.refine(wanted, show)? {
            self.answer(job, wanted);
        }
        Ok(())
    }

    /// Prepares for a job.
    fn making<'a>(&'a mut self, job: &'a Job, began: Instant) -> Result<Making<'a>> {
        let Self { stage, own, beside } = self;
        let own = Maker::of(own, stage, &job.settings, job)?;
        let mut beside = match &job.beside {
            Some(settings) => Some(Maker::of(beside, stage, settings, job)?),
            None => {
                *beside = None;
                None
            }
        };
        let ms_per_pixel = own.ms_per_pixel + beside.as_ref().map_or(0.0, |maker| maker.ms_per_pixel);
        let divisor = if job.moving { divisor(job.size, ms_per_pixel) } else { 1 };
        own.prepare(job, &job.settings, divisor)?;
        if let (Some(maker), Some(settings)) = (&mut beside, &job.beside) {
            maker.prepare(job, settings, divisor)?;
        }
        Ok(Making { job, stage, began, divisor, own, beside })
    }

    /// Answers what else is asked, if anything is.
    pub fn answer(&mut self, job: &Job, wanted: &Wanted) {
        let Some(question) = wanted.question() else { return };
        let found = match (question, &mut self.own) {
            (Question::Rays(pixel), Some(own)) => own.rays(&self.stage.context, pixel).map(Found::Rays),
            (Question::Rays(_), None) => return,
            (Question::Cost(key, settings), _) => {
                self.costs(key, &settings, job, wanted).map(|costs| Found::Cost(key, costs))
            }
        };
        match found {
            Err(Error::Interrupted) => {}
            found => wanted.found(found.unwrap_or_else(|error| Found::Nothing(error.to_string()))),
        }
    }

    /// What a frame takes with other values of a key, each on a renderer of its own.
    fn costs(&self, name: &str, settings: &Settings, job: &Job, wanted: &Wanted) -> Result<Vec<Cost>> {
        let entries = settings.entries();
        let Some((key, now)) = entries.iter().find(|(key, _)| key.name == name) else { return Ok(vec![]) };
        let mut costs = vec![];
        for value in question::neighbours(key, now) {
            wanted.check()?;
            let taken = match self.cost(&format!("{name}={value}"), settings, job) {
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                taken => taken.map_err(|error| error.to_string()),
            };
            costs.push(Cost { is_now: value == *now, value, taken });
        }
        Ok(costs)
    }

    fn cost(&self, assignment: &str, settings: &Settings, job: &Job) -> Result<(f64, u64)> {
        let mut settings = settings.clone();
        settings.set(assignment)?;
        let mut maker = None;
        let maker = Maker::of(&mut maker, &self.stage, &settings, job)?;
        maker.prepare(job, &settings, 1)?;
        maker.draw(job, &self.stage)?; // warms up
        maker.renderer.make_anew();
        maker.draw(job, &self.stage)?;
        Ok((maker.report().timings.gpu_ms, maker.renderer.plan().total()))
    }
}

/// A job under way.
struct Making<'a> {
    job: &'a Job,
    stage: &'a Stage,
    began: Instant,
    divisor: u32,
    own: &'a mut Maker,
    beside: Option<&'a mut Maker>,
}

impl Making<'_> {
    /// Where the grids of the last frame stand.
    fn boxes(&self) -> Vec<[DVec3; 2]> {
        let ground = &self.own.renderer.frame().ground;
        let (base, places) = (&ground.desc.grid, ground.lists.iter().map(|lists| lists.place));
        let corners = places.map(|place| {
            let least = base.corner + DVec3::from(place.corner.map(f64::from)) * base.voxel_m;
            [least, least + DVec3::splat(f64::from(place.edge) * f64::from(place.voxel) * base.voxel_m)]
        });
        // And the boxes of finer voxels in the base grid.
        let edge = f64::from(base.edge) * base.voxel_m;
        let finer = ground.base().boxes.iter().take(base.boxes as usize).zip(1..).map(|(corner, number)| {
            let least = base.corner + DVec3::from(corner.map(f64::from)) * base.voxel_m;
            [least, least + DVec3::splat(edge / FACTOR.powi(number))]
        });
        corners.chain(finer).collect()
    }

    /// Brings the light as far as `render` does, and ends with the image of one pass.
    fn light(&mut self, wanted: &Wanted, show: &dyn Fn(Frame)) -> Result<()> {
        let (mut shown, mut took) = (Instant::now(), Duration::ZERO);
        loop {
            let whole = self.makers().all(|maker| maker.renderer.light_is_whole());
            if whole || shown.elapsed() > SHOW_AFTER + SHOW_SHARE * took {
                let begins = Instant::now();
                self.draw()?;
                let done = whole && !self.lacks_passes();
                show(self.frame(done)?);
                (shown, took) = (Instant::now(), begins.elapsed());
            }
            if whole {
                return Ok(());
            }
            wanted.check()?;
            let (job, stage) = (self.job, self.stage);
            self.makers().try_for_each(|maker| maker.light_pass(job, stage))?;
        }
    }

    /// Takes the mean over passes of the image: as many as the settings ask for, then as many as the job does. Returns whether that
    /// is done, or something is asked meanwhile.
    fn refine(&mut self, wanted: &Wanted, show: &dyn Fn(Frame)) -> Result<bool> {
        let (mut shown, mut took) = (Instant::now(), Duration::ZERO);
        let (job, stage) = (self.job, self.stage);
        loop {
            let (lacks, refines) = (self.lacks_passes(), wanted.refines());
            let goal = |maker: &Maker| maker.made_for.0.image.passes.max(if refines { job.refine } else { 1 });
            if !self.makers().any(|maker| maker.renderer.passes() < goal(maker)) {
                return Ok(true);
            }
            wanted.check()?;
            if wanted.asks() && !lacks {
                return Ok(false);
            }
            let is_behind = |maker: &&mut Maker| maker.renderer.passes() < goal(maker);
            self.makers().filter(is_behind).try_for_each(|maker| maker.refine(job, stage))?;
            let last = !self.makers().any(|maker| maker.renderer.passes() < goal(maker));
            let whole = !self.lacks_passes();
            if last || whole && lacks || shown.elapsed() > SHOW_AFTER + SHOW_SHARE * took {
                let begins = Instant::now();
                show(self.frame(whole)?);
                (shown, took) = (Instant::now(), begins.elapsed());
            }
        }
    }

    fn makers(&mut self) -> impl Iterator<Item = &mut Maker> {
        std::iter::once(&mut *self.own).chain(self.beside.as_deref_mut())
    }

    /// Whether the settings ask for more passes over the image.
    fn lacks_passes(&mut self) -> bool {
        self.makers().any(|maker| maker.renderer.passes() < maker.made_for.0.image.passes)
    }

    /// An image of one pass.
    fn draw(&mut self) -> Result<()> {
        let (job, stage) = (self.job, self.stage);
        self.makers().try_for_each(|maker| maker.draw(job, stage))
    }

    /// What was drawn last, to be shown.
    fn frame(&mut self, whole: bool) -> Result<Frame> {
        let Self { job, stage, divisor, .. } = *self;
        let (picture, image, exposure_ev) = self.own.picture(job, job.exposure, stage)?;
        let beside = self.beside.as_deref_mut().map(|maker| {
            let (picture, image, _) = maker.picture(job, Some(exposure_ev), stage)?;
            Ok(Beside { picture, image, gpu_ms: maker.report().timings.gpu_ms })
        });
        let renderer = &self.own.renderer;
        let (light_passes, passes) = (renderer.frame().light.awaited_passes(), renderer.passes());
        Ok(Frame {
            picture,
            image,
            exposure_ev,
            divisor,
            ms: 1e3 * self.began.elapsed().as_secs_f64(),
            report: self.own.report().clone(),
            allocated_bytes: stage.context.allocated_bytes(),
            beside: beside.transpose()?,
            light: self.own.light.clone(),
            refined: Refined { whole, light_passes, passes },
            boxes: self.boxes(),
            view: job.view,
        })
    }
}

/// The least by which a side of the image is divided to be made soon.
fn divisor(size: (u32, u32), ms_per_pixel: f64) -> u32 {
    let pixels = f64::from(size.0) * f64::from(size.1);
    let soon = |d: &&u32| pixels / f64::from(**d * **d) * ms_per_pixel <= MOVING_MS;
    DIVISORS.iter().find(soon).or(DIVISORS.last()).copied().unwrap_or(1)
}

/// What a frame did before its image.
fn light_zones(timings: &ZoneTimings) -> Vec<ZoneTiming> {
    timings.zones.iter().filter(|zone| !IMAGE_PASSES.contains(&zone.name)).cloned().collect()
}

/// A renderer, and what it was made for.
struct Maker {
    renderer: Renderer,
    made_for: (Settings, (u32, u32), Layer),
    /// Seconds after `--time` that its light is of; `None` while the scene moves: light of before is in it.
    lit_at: Option<f64>,
    /// Of one pass over the image, as it was last.
    ms_per_pixel: f64,
    report: Option<FrameReport>,
    /// Times of what came before the image, when that was made last.
    light: Vec<ZoneTiming>,
    /// Made when it is first asked for.
    inspect: Option<Inspect>,
}

impl Maker {
    /// What is there, or a new one.
    fn of<'a>(there: &'a mut Option<Self>, stage: &Stage, settings: &Settings, job: &Job) -> Result<&'a mut Self> {
        if there.is_none() {
            let Stage { context, scene, shot, options } = stage;
            let options =
                RenderOptions { size: job.size, aovs: job.layer.needs(), responsive: true, ..options.clone() };
            let pose = shot.pose(scene, job.later_s);
            *there = Some(Self {
                renderer: Renderer::new(context, scene.as_ref().clone(), &pose, settings.clone(), options)?,
                made_for: (settings.clone(), job.size, job.layer),
                lit_at: None,
                ms_per_pixel: if context.is_cpu { 1.0 } else { 0.0 },
                report: None,
                light: vec![],
                inspect: None,
            });
        }
        Ok(there.as_mut().expect("just made"))
    }

    /// Changes to what a job asks for. At rest, light of another moment is forgotten: the picture is to be the one that `render` makes.
    fn prepare(&mut self, job: &Job, settings: &Settings, divisor: u32) -> Result<()> {
        let size = ((job.size.0 / divisor).max(1), (job.size.1 / divisor).max(1));
        let (made_settings, made_size, layer) = &self.made_for;
        if !made_settings.means_same(settings) || *made_size != size || *layer != job.layer {
            self.renderer.change_layers(settings.clone(), size, job.layer.needs())?;
            self.inspect = None;
        }
        self.made_for = (settings.clone(), size, job.layer);
        let now = Some(job.later_s);
        if self.renderer.frame().light.has_history() && self.lit_at != now && !job.moving {
            self.renderer.forget_light();
        }
        if !self.renderer.frame().light.has_history() {
            self.lit_at = now;
        } else if self.lit_at != now {
            self.lit_at = None;
        }
        Ok(())
    }

    fn light_pass(&mut self, job: &Job, stage: &Stage) -> Result<()> {
        let pose = stage.shot.pose(self.renderer.scene(), job.later_s);
        if let Some(report) = self.renderer.light_pass(&pose, &job.view)? {
            self.light = light_zones(&report.timings);
        }
        Ok(())
    }

    fn draw(&mut self, job: &Job, stage: &Stage) -> Result<()> {
        let pose = stage.shot.pose(self.renderer.scene(), job.later_s);
        let report = self.renderer.render_now(&pose, &job.view)?;
        let zones = report.timings.zones.iter().filter(|zone| IMAGE_PASSES.contains(&zone.name));
        let (width, height) = self.made_for.1;
        self.ms_per_pixel = zones.map(|zone| zone.gpu_ms).sum::<f64>() / (f64::from(width) * f64::from(height));
        let light = light_zones(&report.timings);
        if !light.is_empty() {
            self.light = light;
        }
        self.report = Some(report);
        Ok(())
    }

    /// Times stay those of the first pass, which are a frame's.
    fn refine(&mut self, job: &Job, stage: &Stage) -> Result<()> {
        let pose = stage.shot.pose(self.renderer.scene(), job.later_s);
        let noise = self.renderer.refine(&pose, &job.view)?.noise;
        self.report.iter_mut().for_each(|report| report.noise = noise);
        Ok(())
    }

    fn report(&self) -> &FrameReport {
        self.report.as_ref().expect("something was drawn")
    }

    /// The rays of a pixel of the last image.
    fn rays(&mut self, context: &Arc<Context>, pixel: (u32, u32)) -> Result<Vec<question::Ray>> {
        if self.inspect.is_none() {
            self.inspect = Some(question::inspect(context, &self.renderer, &self.made_for.0)?);
        }
        let inspect = self.inspect.as_ref().expect("just made");
        Ok(question::rays(&inspect.rays(context, question::inspected(&self.renderer), pixel)?, &self.renderer))
    }

    /// What was drawn last, the image itself and its exposure in stops.
    fn picture(
        &mut self,
        job: &Job,
        exposure: Option<f32>,
        Stage { context, .. }: &Stage,
    ) -> Result<(Picture, Layers, f32)> {
        let image = self.renderer.read();
        let scene = self.renderer.scene();
        let automatic = || automatic_exposure(image.beauty(), sky_shown(&image, scene, &job.view));
        let ev = exposure.unwrap_or_else(automatic);
        let rgba = match job.layer {
            Layer::Image(layer) => encode(&image, layer, ev),
            Layer::Grid(layer) => {
                let (renderer, inspect, settings) = (&self.renderer, &mut self.inspect, &self.made_for.0);
                Grid { context, renderer, inspect, settings }.picture(layer, &image, ev, &job.view)?
            }
        };
        Ok((Picture { size: self.made_for.1, rgba }, image, ev))
    }
}

/// A layer as a display takes it; the image as a PNG has it.
pub fn encode(image: &Layers, layer: Aov, exposure_ev: f32) -> Vec<u8> {
    let gain = exposure_ev.exp2();
    let code = |p: &[f32; 3]| match layer {
        Aov::Beauty | Aov::Direct | Aov::Indirect => tone_curve(p.map(|c| c * gain)).map(srgb_code),
        Aov::Normal => p.map(|c| (255.0 * (0.5 * c + 0.5)).round() as u8),
        // Half as bright a metre away.
        Aov::Depth => p.map(|c| srgb_code(1.0 / (1.0 + c))),
        Aov::Alpha | Aov::Ao | Aov::Albedo | Aov::Diffuse => p.map(srgb_code),
    };
    let pixels = image.get(layer).unwrap_or(image.beauty());
    pixels.par_iter().flat_map_iter(|p| code(p).into_iter().chain([255])).collect()
}
