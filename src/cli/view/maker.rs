//! Makes frames: coarse ones during motion, complete ones at rest, which are then refined. Intermediate results are
//! shown: the light of all bounces while it settles, and the mean over passes of the image.

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

/// Target time of the image during motion in milliseconds: with encoding and showing it, an answer within 100.
const MOVING_MS: f64 = 35.0;
/// Divisors of the image's sides during motion.
const DIVISORS: [u32; 4] = [1, 2, 4, 8];
/// The time after which an intermediate result is shown at rest.
const SHOW_AFTER: Duration = Duration::from_millis(250);
/// The minimum interval of intermediate results as a multiple of the time for showing one, so that they take at most a
/// quarter of the time.
const SHOW_SHARE: u32 = 3;

/// Renderers of the picture and of the second picture.
pub struct Makers {
    context: Arc<Context>,
    scene: Arc<Scene>,
    pub options: RenderOptions,
    pub shared: Arc<Shared>,
    news: EventLoopProxy<News>,
    makers: Vec<Maker>,
    /// The number of the job for which they were made.
    shaders: u32,
}

impl Makers {
    pub fn new(context: Arc<Context>, scene: Arc<Scene>, options: RenderOptions, news: EventLoopProxy<News>) -> Self {
        Self { context, scene, options, shared: Arc::default(), news, makers: vec![], shaders: 0 }
    }

    /// Sends a message to the window, which may be closed.
    pub fn tell(&self, news: News) {
        self.shared.lock().step = None;
        let _ = self.news.send_event(news);
    }

    /// Gives the window a job's frame, or the reason why there is none.
    pub fn tell_frame(&self, job: &Job, frame: std::result::Result<ShownFrame, String>) {
        self.shared.lock().frame = Some((job.revision, frame));
        self.tell(News::Frame);
    }

    /// Makes the frame of a job, and reports each improvement. At rest the light first makes the passes of `render`.
    /// Then the image is made with one pass, and then as the mean over passes: first as many as the settings request,
    /// then as many as the job does.
    ///
    /// # Errors
    /// As [`Renderer::render`]; [`Error::Interrupted`] if another picture is requested.
    pub fn make(&mut self, job: &Job) -> Result<()> {
        let began = Instant::now();
        let divisor = self.prepare(job)?;
        let mut first_ms = None;
        let mut show = |makers: &mut Self, whole| {
            let mut frame = makers.frame(job, divisor, began, whole)?;
            // Later pictures of the job are refinements of this one.
            frame.ms = *first_ms.get_or_insert(frame.ms);
            makers.tell_frame(job, Ok(frame));
            Ok::<_, Error>(())
        };
        if job.moving {
            self.draw(job)?;
            return show(self, false);
        }
        // The time of the next intermediate result.
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

    /// A new renderer for a job.
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

    /// Prepares for a job. Returns the divisor of the image's sides.
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

    /// Answers a question, if there is one.
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

    /// Costs of a frame with other values of a key, each on its own renderer.
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
        maker.draw(job)?; // warm-up
        maker.renderer.make_anew();
        maker.draw(job)?;
        Ok((maker.report().timings.gpu_ms, maker.renderer.plan().total()))
    }

    /// The boxes of the last frame's grids.
    fn boxes(&self) -> Vec<[DVec3; 2]> {
        let ground = &self.makers[0].renderer.frame().ground;
        let (base, places) = (&ground.desc.grid, ground.lists.iter().map(|lists| lists.place));
        let corners = places.map(|place| {
            let least = base.corner + DVec3::from(place.corner.map(f64::from)) * base.voxel_m;
            [least, least + DVec3::splat(f64::from(place.edge) * f64::from(place.voxel) * base.voxel_m)]
        });
        // The boxes of finer voxels in the base grid are included.
        let edge = f64::from(base.edge) * base.voxel_m;
        let finer = ground.base().boxes.iter().take(base.boxes as usize).zip(1..).map(|(corner, number)| {
            let least = base.corner + DVec3::from(corner.map(f64::from)) * base.voxel_m;
            [least, least + DVec3::splat(edge / FACTOR.powi(number))]
        });
        corners.chain(finer).collect()
    }

    /// Whether the settings request more passes over the image.
    fn lacks_passes(&self) -> bool {
        self.makers.iter().any(|maker| maker.renderer.passes() < maker.settings_passes())
    }

    /// An image of one pass.
    fn draw(&mut self, job: &Job) -> Result<()> {
        self.makers.iter_mut().try_for_each(|maker| maker.draw(job))
    }

    /// The last drawn frame, for showing.
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

/// The time of the next picture after one whose rendering began then.
fn next_due(began: Instant) -> Instant {
    Instant::now() + SHOW_AFTER + SHOW_SHARE * began.elapsed()
}

/// The smallest divisor with which an image is fast enough.
fn divisor(size: (u32, u32), ms_per_pixel: f64) -> u32 {
    let pixels = f64::from(size.0) * f64::from(size.1);
    let soon = |d: &&u32| pixels / f64::from(**d * **d) * ms_per_pixel <= MOVING_MS;
    DIVISORS.iter().find(soon).or(DIVISORS.last()).copied().unwrap_or(1)
}

/// Zones of a frame except those of its image.
fn light_zones(timings: &ZoneTimings) -> Vec<ZoneTiming> {
    timings.zones.iter().filter(|zone| !IMAGE_PASSES.contains(&zone.name)).cloned().collect()
}

/// A renderer and its inputs.
struct Maker {
    renderer: Renderer,
    made_for: (Settings, (u32, u32), Layer),
    /// The time of its light in seconds after `--time`; `None` during motion, when older light is included.
    lit_at: Option<f64>,
    /// Time of the last image with one pass.
    ms_per_pixel: f64,
    report: Option<FrameReport>,
    /// Times of the passes before the image, when they last ran.
    light: Vec<ZoneTiming>,
    /// Debug views, which are created on the first request.
    inspect: Option<Inspect>,
}

impl Maker {
    /// Adopts the settings of a job. At rest, light of another time is discarded, so that the picture equals that of
    /// `render`.
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

    /// Times stay those of the first pass, which are those of a frame.
    fn refine(&mut self, job: &Job) -> Result<()> {
        let noise = self.renderer.refine(&job.pose, &job.view)?.noise;
        self.report.iter_mut().for_each(|report| report.noise = noise);
        Ok(())
    }

    /// The number of passes over the image in the settings.
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

    /// The last drawn picture, its image, and its display: `display`, or the job's choice.
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

/// A layer in display codes; the image as in a PNG.
pub fn encode(image: &Layers, layer: Aov, display: Display) -> Vec<u8> {
    let code = |p: &[f32; 3]| match layer {
        Aov::Beauty | Aov::Direct | Aov::Indirect => display.codes(*p),
        Aov::Normal => p.map(|c| (255.0 * (0.5 * c + 0.5)).round() as u8),
        // The picture is half as bright for each metre of depth.
        Aov::Depth => p.map(|c| srgb_code(1.0 / (1.0 + c))),
        Aov::Alpha | Aov::Ao | Aov::Albedo | Aov::Diffuse => p.map(srgb_code),
    };
    let pixels = image.get(layer).unwrap_or(image.beauty());
    pixels.par_iter().flat_map_iter(|p| code(p).into_iter().chain([255])).collect()
}
