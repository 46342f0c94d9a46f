//! The picture of a scene in one call.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::{Event, Image, Noise, Refine, Refinement, Stage, Staged, is_scarce, why_blank};
use crate::ground::finish::approximated;
use crate::layers::Aov;
use crate::measure::{refuse_invalid, terms};
use crate::output::display::{Display, ToneMap};
use crate::output::exr::Metadata;
use crate::renderer::{Context, ContextOptions, RenderOptions, Renderer};
use crate::scene::{Scene, Still};
use crate::settings::Settings;
use crate::stability::warnings::known_failures;
use crate::{Error, Result};

/// The maximum side of an image in pixels.
pub const MAX_SIDE: u32 = 16384;

/// The progress of a picture, reported when a pass begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// The number of finished passes.
    pub has: u32,
    /// About the number of passes in all, known after two of them.
    pub needed: Option<u32>,
}

/// Options of a picture. [`Options::default`] has the defaults of `twobounce render`.
#[derive(Clone)]
pub struct Options {
    /// Width and height in pixels; 1280 × 720 by default.
    pub size: (u32, u32),
    /// Camera, time, sky and default light.
    pub stage: Stage,
    /// Layers in addition to radiance.
    pub layers: Vec<Aov>,
    /// Whether pixels without a surface are transparent. The sky lights the scene in both cases.
    pub transparent: bool,
    /// The noise to which the picture is refined; 2 % by default.
    pub noise: Option<Noise>,
    /// No further pass begins after this time.
    pub time_limit: Option<Duration>,
    /// Tone curve of a .png or .jpg.
    pub tone: ToneMap,
    /// Exposure of a .png or .jpg in stops, -60 to 60; automatic where absent.
    pub exposure_ev: Option<f32>,
    /// An open device; by default a device is opened for this picture.
    pub context: Option<Arc<Context>>,
    /// The device to open: see [`ContextOptions::device`].
    pub device: Option<String>,
    /// Whether the device is opened with Vulkan's validation layers, whose messages are then errors.
    pub validation: bool,
    /// Bytes of device memory that may be used; by default the budget that the device reports.
    pub memory_limit: Option<u64>,
    /// Called before each pass over the picture.
    pub progress: Option<Arc<dyn Fn(Progress) + Send + Sync>>,
    /// A flag that ends the work with [`Error::Interrupted`] within about a second once it is true.
    pub cancel: Option<Arc<AtomicBool>>,
    /// The settings; by default those of the preset `balanced`. [`Options::set`] changes a key by its name.
    pub settings: Settings,
    /// Whether light is gathered at the pixels of `image.gather_resolution` even if the picture is refined. By default
    /// a refined picture gathers at every pixel.
    pub keeps_resolution: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            size: (1280, 720),
            stage: Stage::default(),
            layers: vec![],
            transparent: false,
            noise: None,
            time_limit: None,
            tone: ToneMap::default(),
            exposure_ev: None,
            context: None,
            device: None,
            validation: false,
            memory_limit: None,
            progress: None,
            cancel: None,
            settings: Settings::default(),
            keeps_resolution: false,
        }
    }
}

impl fmt::Debug for Options {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { size, stage, layers, settings, .. } = self;
        let mut debug = f.debug_struct("Options");
        debug.field("size", size).field("stage", stage).field("layers", layers).field("settings", settings);
        debug.finish_non_exhaustive()
    }
}

impl Options {
    /// Options with the settings of a preset: `fast`, `balanced` or another of [`PRESETS`](crate::settings::PRESETS).
    ///
    /// # Errors
    /// No preset has that name.
    pub fn preset(name: &str) -> Result<Self> {
        Ok(Self { settings: Settings::preset(name)?, ..Self::default() })
    }

    /// Options with these settings, which are used unchanged.
    pub fn with_settings(settings: Settings) -> Self {
        Self { settings, keeps_resolution: true, ..Self::default() }
    }

    /// Sets a key of the settings, `key=value`, as `--set` does.
    ///
    /// # Errors
    /// There is no such key, or it does not take the value.
    pub fn set(&mut self, key_value: &str) -> Result<&mut Self> {
        self.settings.set(key_value)?;
        self.keeps_resolution |= key_value.trim_start().starts_with("image.gather_resolution");
        Ok(self)
    }

    pub(super) fn check(&self) -> Result<()> {
        let usage = |sentence: String| Err(Error::Usage(sentence));
        let (width, height) = self.size;
        if [width, height].iter().any(|side| !(1..=MAX_SIDE).contains(side)) {
            return usage(format!("a picture of {width}x{height} pixels: each side may have 1 to {MAX_SIDE}"));
        }
        if self.exposure_ev.is_some_and(|ev| !(-60.0..=60.0).contains(&ev)) {
            return usage("the exposure is not between -60 and 60 stops; choose one that is".into());
        }
        if matches!(self.noise, Some(Noise::AtMost(noise)) if noise.is_nan() || noise <= 0.0) {
            return usage("the noise of a picture must be above 0; choose Noise::Off for no goal".into());
        }
        Ok(())
    }
}

/// Renders a scene as `twobounce render` does. It is seen through its first camera or framed, lit by a default light if
/// it has none, and refined until its noise is low. A device is opened unless [`Options::context`] has one. The same
/// scene and options give the same bits on the same device, unless a time limit ends the work.
///
/// # Errors
/// [`Error::Usage`] for invalid options or scenes, [`Error::Memory`] if the device has too little memory,
/// [`Error::Device`] if no device is found or it fails, [`Error::Interrupted`] by [`Options::cancel`].
pub fn render(scene: &Scene, options: &Options) -> Result<Image> {
    let began = Instant::now();
    options.check()?;
    options.settings.check()?;
    options.stage.check()?;
    scene.check()?;
    let context = match &options.context {
        Some(context) => context.clone(),
        None => Context::new(&ContextOptions { device: options.device.clone(), validation: options.validation })?,
    };
    check_size(&context, options.size)?;
    let mut staged = Staged::new(scene.clone(), &options.stage, options.size)?;
    staged.scene.sky_unseen = options.transparent;
    let scarce = is_scarce(options.size, options.memory_limit);
    let refine = Refine { noise: options.noise, time_limit: options.time_limit };
    let settings = refine.fitted(options.settings.clone(), options.keeps_resolution, true, scarce);
    let (settings, fitted) = staged.fitted(settings);
    let mut notes = std::mem::take(&mut staged.notes);
    notes.extend(fitted);
    notes.extend(known_limits(&staged, &settings));
    let mut header = image_header(&staged, &settings, &context);
    let cancel = options.cancel.clone();
    let check = move || match &cancel {
        Some(cancel) if cancel.load(Ordering::Relaxed) => Err(Error::Interrupted),
        _ => Ok(()),
    };
    check()?;
    let render_options = RenderOptions {
        aovs: with_alpha(&options.layers),
        memory_limit: options.memory_limit,
        watch: Some(Arc::new({
            let check = check.clone();
            move |_| check()
        })),
        ..RenderOptions::new(options.size, staged.bounds())
    };
    let (pose, view) = &staged.still.clone();
    let mut refinement = Refinement::new(&refine, true, &settings, began);
    let mut renderer = Renderer::new(&context, staged.scene, pose, settings, render_options)?;
    let tell = |has, needed| options.progress.iter().for_each(|progress| progress(Progress { has, needed }));
    tell(0, None);
    let report = match &mut refinement {
        Some(refinement) => refinement.run(&mut renderer, pose, view, &mut |_, event| {
            match event {
                Event::Pass { has, needed } => tell(has, needed),
                Event::Note(_) => {}
            }
            check()
        })?,
        None => renderer.render(pose, view)?,
    };
    if let Some(refinement) = &refinement {
        let (words, is_short) = refinement.result();
        notes.extend(is_short.then_some(words));
    }
    refuse_invalid(&context)?;
    let mut layers = renderer.read();
    let ev = options.exposure_ev.unwrap_or_else(|| options.tone.automatic_exposure(layers.beauty()));
    let display = Display { tone: options.tone, exposure_ev: ev };
    let still = Still::new(renderer.scene(), pose, view);
    notes.extend(why_blank(&layers, still, Some((display, options.exposure_ev.is_none()))));
    if !options.transparent {
        layers.layers.retain(|(layer, _)| *layer != Aov::Alpha);
    }
    let mut settings = renderer.settings().clone();
    settings.image.passes = renderer.passes();
    header.insert("settings".into(), settings.to_toml());
    Ok(Image { layers, display, notes, noise: report.noise, settings: Some(settings), header })
}

/// These layers in the order of files, with alpha, which marks pixels that show the sky.
pub fn with_alpha(layers: &[Aov]) -> Vec<Aov> {
    Aov::ALL.iter().copied().filter(|layer| *layer == Aov::Alpha || layers.contains(layer)).collect()
}

/// Refuses an image that exceeds the device's limits.
pub fn check_size(context: &Context, (width, height): (u32, u32)) -> Result<()> {
    let limits = &context.limits;
    let most = limits.max_image_dimension2_d.min(limits.max_framebuffer_width).min(limits.max_framebuffer_height);
    if width.max(height) > most {
        let device = &context.name;
        let text = format!("--size {width}x{height}: {device} makes images of up to {most} pixels a side");
        return Err(Error::Usage(text));
    }
    Ok(())
}

/// Sentences about known weaknesses of the method and settings in this scene, and about approximated materials.
pub fn known_limits(staged: &Staged, settings: &Settings) -> Vec<String> {
    let (scene, (pose, _)) = (&staged.scene, &staged.still);
    let failures = known_failures(scene, pose, staged.bounds(), settings);
    let mut notes: Vec<String> = Vec::new();
    if !failures.is_empty() {
        notes.push(format!("{} (docs/notes/stability.md)", failures.join("; ")));
    }
    notes.extend(approximated(scene).into_iter().map(|note| format!("{note} (docs/materials.md)")));
    notes
}

/// Metadata of a rendered .exr.
pub fn image_header(staged: &Staged, settings: &Settings, context: &Context) -> Metadata {
    staged.header([
        ("writer", format!("twobounce {} render", env!("CARGO_PKG_VERSION"))),
        ("method", settings.method.name().to_owned()),
        (terms::HEADER, terms::changes(settings).join(" ")),
        ("device", context.name.clone()),
        ("driver", context.driver.clone()),
    ])
}
