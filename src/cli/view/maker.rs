//! How frames are made: coarse ones while something moves; at rest whole ones, which go on to get better. What there is
//! meanwhile is shown: the light of all bounces while it settles, and the mean over passes of the image.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::DVec3;
use rayon::prelude::*;
use twobounce::gi::rays::inspect::Inspect;
use twobounce::ground::boxes::FACTOR;
use twobounce::layers::{Aov, Layers};
use twobounce::output::display::{Display, srgb_code};
use twobounce::renderer::{FrameReport, RenderOptions, Renderer};
use twobounce::scene::Scene;
use twobounce::settings::Settings;
use twobounce::vk::{Context, ZoneTiming, ZoneTimings};
use twobounce::{Error, Result};
use winit::event_loop::EventLoopProxy;

use super::job::{Beside, Job, News, PanelChoice, ShownFrame};
use super::layer::{Grid, Layer};
use super::question::{self, Cost, Question, Reply};
use super::screen::Picture;
use super::worker::Shared;
use crate::cli::progress::course::IMAGE_PASSES;

/// Milliseconds of the image while something moves: with encoding and showing it, an answer within 100.
const MOVING_MS: f64 = 35.0;
/// By how much a side of the image is divided while something moves.
const DIVISORS: [u32; 4] = [1, 2, 4, 8];
/// At rest, what there is meanwhile is shown after so long,
const SHOW_AFTER: Duration = Duration::from_millis(250);
/// and after so many times as long as showing it takes: pictures in between take a quarter of the time at most.
const SHOW_SHARE: u32 = 3;

/// Renderers of what is shown and, second, of what is beside it.
pub struct Makers {
    context: Arc<Context>,
    scene: Arc<Scene>,
    pub options: RenderOptions,
    pub shared: Arc<Shared>,
    news: EventLoopProxy<News>,
    makers: Vec<Maker>,
    /// As in the job that they were made for.
    shaders: u32,
}

impl Makers {
    pub fn new(context: Arc<Context>, scene: Arc<Scene>, options: RenderOptions, news: EventLoopProxy<News>) -> Self {
        Self { context, scene, options, shared: Arc::default(), news, makers: vec![], shaders: 0 }
    }

    /// Tells the window something, which may be closed.
    pub fn tell(&self, news: News) {
        self.shared.lock().step = None;
        let _ = self.news.send_event(news);
    }

    /// Hands the window a job's frame, or says why there is none.
    pub fn tell_frame(&self, job: &Job, frame: std::result::Result<ShownFrame, String>) {
        self.shared.lock().frame = Some((job.revision, frame));
        self.tell(News::Frame);
    }

    /// Makes what a job asks for, and tells of it each time that it is better than before. At rest the light is brought
    /// as far as `render` brings it; then comes the image of one pass, and then the mean over passes: as many as the
    /// settings ask for, then as many as the job does.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Interrupted`] once another picture is wanted.
    pub fn make(&mut self, job: &Job) -> Result<()> {
        let began = Instant::now();
        let divisor = self.prepare(job)?;
        let mut first_ms = None;
        let mut show = |makers: &mut Self, whole| {
            let mut frame = makers.frame(job, divisor, began, whole)?;
            // Later pictures of the job are this one, refined.
            frame.ms = *first_ms.get_or_insert(frame.ms);
            makers.tell_frame(job, Ok(frame));
            Ok::<_, Error>(())
        };
        if job.moving {
            self.draw(job)?;
            return show(self, false);
        }
        // When what there is meanwhile is shown.
        let mut due = began + SHOW_AFTER;
        while !self.makers.iter().all(|maker| maker.renderer.light_is_whole()) {
            if Instant::now() > due {
                let begins = Instant::now();
                self.draw(job)?;
                show(self, false)?;
                due = next_due(begins);
            }
            self.shared.check(job)?;
            self.makers.iter_mut().try_for_each(|maker| maker.light_pass(job))?;
        }
        self.draw(job)?;
        show(self, !self.lacks_passes())?;
        due = Instant::now() + SHOW_AFTER;
        loop {
            let (lacks, least) = (self.lacks_passes(), if self.shared.lock().holds { 1 } else { job.choice.refine });
            let is_behind = |maker: &Maker| maker.renderer.passes() < maker.settings_passes().max(least);
            if !self.makers.iter().any(is_behind) {
                return Ok(());
            }
            self.shared.check(job)?;
            if !lacks && self.shared.lock().question.is_some() {
                self.answer(job);
                continue;
            }
            let mut behind = self.makers.iter_mut().filter(|maker| is_behind(maker));
            behind.try_for_each(|maker| maker.refine(job))?;
            let whole = !self.lacks_passes();
            if !self.makers.iter().any(is_behind) || whole && lacks || Instant::now() > due {
                let begins = Instant::now();
                show(self, whole)?;
                due = next_due(begins);
            }
        }
    }

    /// A new one for a job.
    fn maker(&self, settings: &Settings, job: &Job) -> Result<Maker> {
        let (size, aovs) = (job.size, job.choice.layer.needs());
        let options = RenderOptions { size, aovs, responsive: true, ..self.options.clone() };
        let scene = self.scene.as_ref().clone();
        Ok(Maker {
            renderer: Renderer::new(&self.context, scene, &job.pose, settings.clone(), options)?,
            made_for: (settings.clone(), size, job.choice.layer),
            lit_at: None,
            ms_per_pixel: if self.context.is_cpu { 1.0 } else { 0.0 },
            report: None,
            light: vec![],
            inspect: None,
        })
    }

    /// Prepares for a job. Returns by how much a side of the image is divided.
    fn prepare(&mut self, job: &Job) -> Result<u32> {
        if std::mem::replace(&mut self.shaders, job.shaders) != job.shaders {
            self.makers.clear();
        }
        let PanelChoice { settings, beside, .. } = &job.choice;
        let settings: Vec<Settings> = [settings.clone()].into_iter().chain(beside.settings(settings)).collect();
        self.makers.truncate(settings.len());
        for settings in &settings[self.makers.len()..] {
            let maker = self.maker(settings, job)?;
            self.makers.push(maker);
        }
        let ms_per_pixel = self.makers.iter().map(|maker| maker.ms_per_pixel).sum();
        let divisor = if job.moving { divisor(job.size, ms_per_pixel) } else { 1 };
        let mut pairs = self.makers.iter_mut().zip(&settings);
        pairs.try_for_each(|(maker, settings)| maker.prepare(job, settings, divisor))?;
        Ok(divisor)
    }

    /// Answers what else is asked, if anything is.
    pub fn answer(&mut self, job: &Job) {
        let Some(question) = self.shared.lock().question.take() else { return };
        let found = match (question, self.makers.first_mut()) {
            (Question::Rays(pixel), Some(own)) => own.rays(&self.context, pixel).map(Reply::Rays),
            (Question::Rays(_), None) => return,
            (Question::Cost(key), _) => self.costs(key, job).map(|costs| Reply::Cost(key, costs)),
        };
        match found {
            Err(Error::Interrupted) => {}
            found => self.tell(News::Found(job.revision, found.map_err(|error| error.to_string()))),
        }
    }

    /// Costs of a frame with other values of a key, each on a renderer of its own.
    fn costs(&self, name: &str, job: &Job) -> Result<Vec<Cost>> {
        let entries = job.choice.settings.entries();
        let Some((key, now)) = entries.iter().find(|(key, _)| key.name == name) else { return Ok(vec![]) };
        let mut costs = vec![];
        for value in question::neighbours(key, now) {
            self.shared.check(job)?;
            let taken = match self.cost(&format!("{name}={value}"), job) {
                Err(Error::Interrupted) => return Err(Error::Interrupted),
                taken => taken.map_err(|error| error.to_string()),
            };
            costs.push(Cost { is_now: value == *now, value, taken });
        }
        Ok(costs)
    }

    fn cost(&self, assignment: &str, job: &Job) -> Result<(f64, u64)> {
        let mut settings = job.choice.settings.clone();
        settings.set(assignment)?;
        let mut maker = self.maker(&settings, job)?;
        maker.prepare(job, &settings, 1)?;
        maker.draw(job)?; // warms up
        maker.renderer.make_anew();
        maker.draw(job)?;
        Ok((maker.report().timings.gpu_ms, maker.renderer.plan().total()))
    }

    /// Where the grids of the last frame stand.
    fn boxes(&self) -> Vec<[DVec3; 2]> {
        let ground = &self.makers[0].renderer.frame().ground;
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

    /// Whether the settings ask for more passes over the image.
    fn lacks_passes(&self) -> bool {
        self.makers.iter().any(|maker| maker.renderer.passes() < maker.settings_passes())
    }

    /// An image of one pass.
    fn draw(&mut self, job: &Job) -> Result<()> {
        self.makers.iter_mut().try_for_each(|maker| maker.draw(job))
    }

    /// The frame that was drawn last, to be shown.
    fn frame(&mut self, job: &Job, divisor: u32, began: Instant, whole: bool) -> Result<ShownFrame> {
        let Self { context, makers, .. } = self;
        let (picture, image, display) = makers[0].picture(job, None, context)?;
        let beside = makers.get_mut(1).map(|maker| {
            let (picture, image, _) = maker.picture(job, Some(display), context)?;
            Ok::<_, Error>(Beside { picture, image, gpu_ms: maker.report().timings.gpu_ms })
        });
        let own = &makers[0];
        Ok(ShownFrame {
            job: job.clone(),
            picture,
            image,
            display,
            divisor,
            ms: 1e3 * began.elapsed().as_secs_f64(),
            report: own.report().clone(),
            allocated_bytes: context.allocated_bytes(),
            beside: beside.transpose()?,
            light: own.light.clone(),
            whole,
            light_passes: own.renderer.frame().light.awaited_passes(),
            passes: own.renderer.passes(),
            boxes: self.boxes(),
        })
    }
}

/// When a picture comes next after one whose making began then.
fn next_due(began: Instant) -> Instant {
    Instant::now() + SHOW_AFTER + SHOW_SHARE * began.elapsed()
}

/// The least by which a side of the image is divided to be made soon.
fn divisor(size: (u32, u32), ms_per_pixel: f64) -> u32 {
    let pixels = f64::from(size.0) * f64::from(size.1);
    let soon = |d: &&u32| pixels / f64::from(**d * **d) * ms_per_pixel <= MOVING_MS;
    DIVISORS.iter().find(soon).or(DIVISORS.last()).copied().unwrap_or(1)
}

/// Zones of a frame other than those of its image.
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
    /// Changes to what a job asks for. At rest, light of another moment is forgotten: the picture is to be the one that
    /// `render` makes.
    fn prepare(&mut self, job: &Job, settings: &Settings, divisor: u32) -> Result<()> {
        let size = ((job.size.0 / divisor).max(1), (job.size.1 / divisor).max(1));
        let (made_settings, made_size, layer) = &self.made_for;
        if !made_settings.means_same(settings) || *made_size != size || *layer != job.choice.layer {
            self.renderer.change_layers(settings.clone(), size, job.choice.layer.needs())?;
            self.inspect = None;
        }
        self.made_for = (settings.clone(), size, job.choice.layer);
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

    fn light_pass(&mut self, job: &Job) -> Result<()> {
        if let Some(report) = self.renderer.light_pass(&job.pose, &job.view)? {
            self.light = light_zones(&report.timings);
        }
        Ok(())
    }

    fn draw(&mut self, job: &Job) -> Result<()> {
        let report = self.renderer.render_now(&job.pose, &job.view)?;
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
    fn refine(&mut self, job: &Job) -> Result<()> {
        let noise = self.renderer.refine(&job.pose, &job.view)?.noise;
        self.report.iter_mut().for_each(|report| report.noise = noise);
        Ok(())
    }

    /// Passes over the image that the settings ask for.
    fn settings_passes(&self) -> u32 {
        self.made_for.0.image.passes
    }

    fn report(&self) -> &FrameReport {
        self.report.as_ref().expect("something was drawn")
    }

    /// The rays of a pixel of the last image.
    fn rays(&mut self, context: &Arc<Context>, pixel: (u32, u32)) -> Result<Vec<question::GatherRay>> {
        let inspect = question::inspect(&mut self.inspect, context, &self.renderer, &self.made_for.0)?;
        Ok(question::rays(&inspect.rays(context, question::inspected(&self.renderer), pixel)?, &self.renderer))
    }

    /// The picture that was drawn last, its image, and how it is shown: as `display` says, or by the job's choice.
    fn picture(
        &mut self,
        job: &Job,
        display: Option<Display>,
        context: &Arc<Context>,
    ) -> Result<(Picture, Layers, Display)> {
        let image = self.renderer.read();
        let display = display.unwrap_or_else(|| job.choice.display(&image));
        let rgba = match job.choice.layer {
            Layer::Image(layer) => encode(&image, layer, display),
            Layer::Grid(layer) => {
                let (renderer, inspect, settings) = (&self.renderer, &mut self.inspect, &self.made_for.0);
                Grid { context, renderer, inspect, settings }.picture(layer, &image, display, &job.view)?
            }
        };
        Ok((Picture { size: self.made_for.1, rgba }, image, display))
    }
}

/// A layer as a display takes it; the image as a PNG has it.
pub fn encode(image: &Layers, layer: Aov, display: Display) -> Vec<u8> {
    let code = |p: &[f32; 3]| match layer {
        Aov::Beauty | Aov::Direct | Aov::Indirect => display.codes(*p),
        Aov::Normal => p.map(|c| (255.0 * (0.5 * c + 0.5)).round() as u8),
        // Half as bright a metre away.
        Aov::Depth => p.map(|c| srgb_code(1.0 / (1.0 + c))),
        Aov::Alpha | Aov::Ao | Aov::Albedo | Aov::Diffuse => p.map(srgb_code),
    };
    let pixels = image.get(layer).unwrap_or(image.beauty());
    pixels.par_iter().flat_map_iter(|p| code(p).into_iter().chain([255])).collect()
}
