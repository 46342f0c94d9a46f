//! Opens the scene (file, time, camera, light) and the device of the flags.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::Arc;

use clap::{Args, Command, FromArgMatches};
use twobounce::Result;
use twobounce::renderer::{RenderOptions, largest_image, memory_limit, most_triangles};
use twobounce::scene::{LoadOptions, Scene};
use twobounce::settings::Settings;
use twobounce::stage::{Staged, check_size};
use twobounce::vk::{Context, ContextOptions};

use super::args::{DeviceArgs, RunArgs, SceneArgs};
use super::out;
use super::progress::watch;
use crate::say;

/// The name of the scene of `twobounce demo`, for any command.
pub const DEMO: &str = "demo:";

impl SceneArgs {
    /// The defaults for this scene and size.
    pub fn plain(path: &Path, size: (u32, u32)) -> Self {
        let typed = [OsStr::new(""), OsStr::new("--"), path.as_os_str()];
        let matches = Self::augment_args(Command::new("")).get_matches_from(typed);
        Self { size, ..Self::from_arg_matches(&matches).expect("every flag has a default") }
    }

    /// Finds mistakes that can be found without opening the file.
    pub fn check(&self) -> Result<()> {
        self.stage().check()
    }

    /// Loads the scene, chooses animation and camera, adds the sky and, if needed, a light. Prints notes about parts
    /// that were ignored, simplified or added.
    pub fn open(&self) -> Result<Staged> {
        self.open_within(LoadOptions::default())
    }

    /// As [`Self::open`], within limits of a device.
    fn open_within(&self, device: LoadOptions) -> Result<Staged> {
        self.check()?;
        let options = LoadOptions {
            scene: self.scene.clone(),
            assets: self.assets.clone(),
            strict: self.strict,
            max_texture: self.max_texture,
            memory: None,
            ..device
        };
        let scene = if self.path == Path::new(DEMO) {
            Scene::load_glb("demo", twobounce::assets::demo()?, &options)?
        } else {
            Scene::load(&self.path, &options)?
        };
        let staged = Staged::new(scene, &self.stage(), self.size)?;
        staged.notes.iter().for_each(|note| warn(&staged, note));
        Ok(staged)
    }

    /// Opens the scene and the device, and prints both.
    pub fn open_on(&self, run: &RunArgs) -> Result<(Staged, Arc<Context>)> {
        self.open_with(run.device.open(self.size), run)
    }

    /// As [`Self::open_on`], on a device whose driver describes pipelines if it can.
    pub fn open_on_describing(&self, run: &RunArgs) -> Result<(Staged, Arc<Context>)> {
        self.open_with(run.device.open_by(Context::describing, self.size), run)
    }

    /// The device is opened first for its limits, but errors of the scene are reported first.
    fn open_with(&self, context: Result<Arc<Context>>, run: &RunArgs) -> Result<(Staged, Arc<Context>)> {
        let limits = context.as_ref().map_or_else(|_| LoadOptions::default(), |context| limits(context, run));
        let staged = self.open_within(limits)?;
        let context = context?;
        introduce(&staged, &context);
        Ok((staged, context))
    }

    /// Opens the scene for an open device, and prints both.
    #[cfg(feature = "window")]
    pub fn open_for(&self, context: &Context, run: &RunArgs) -> Result<Staged> {
        let staged = self.open_within(limits(context, run))?;
        introduce(&staged, context);
        Ok(staged)
    }
}

/// Limits that a device sets for a scene.
fn limits(context: &Context, run: &RunArgs) -> LoadOptions {
    LoadOptions {
        texture_memory: Some(memory_limit(context, run.memory_limit)),
        texture_side: Some(largest_image(context)),
        triangles: Some(most_triangles(context)),
        ..LoadOptions::default()
    }
}

/// Prints a note about a scene.
pub fn warn(staged: &Staged, note: &str) {
    out::warn(&format!("note: {}: {note}", staged.scene.name));
}

fn introduce(staged: &Staged, context: &Context) {
    let (Staged { scene, camera, .. }, (width, height)) = (staged, staged.size);
    say!("{}: triangles {}, camera {camera}, {width}x{height}", scene.name, scene.triangle_count());
    say!("{}: {}", context.name, context.driver);
}

/// The settings with smaller voxels around the camera if the scene needs them, with a note.
pub fn fitted(staged: &Staged, settings: Settings) -> Settings {
    let (settings, note) = staged.fitted(settings);
    note.iter().for_each(|note| warn(staged, note));
    settings
}

/// Options of radiance alone, within a limit on device memory.
pub fn options(staged: &Staged, memory_limit: Option<u64>) -> RenderOptions {
    RenderOptions { memory_limit, watch: Some(watch()), ..RenderOptions::new(staged.size, staged.bounds()) }
}

/// Options of radiance alone, from the flags.
pub fn run_options(staged: &Staged, run: &RunArgs) -> RenderOptions {
    RenderOptions { submit: run.submit, steps: run.steps, ..options(staged, run.memory_limit) }
}

impl DeviceArgs {
    /// Opens the device for images of this size.
    pub fn open(&self, size: (u32, u32)) -> Result<Arc<Context>> {
        self.open_by(Context::new, size)
    }

    /// As [`Self::open`], with shaders that count their reads.
    pub fn open_counting(&self, size: (u32, u32)) -> Result<Arc<Context>> {
        self.open_by(Context::counting, size)
    }

    fn open_by(
        &self,
        open: impl Fn(&ContextOptions) -> Result<Arc<Context>>,
        size: (u32, u32),
    ) -> Result<Arc<Context>> {
        let context = open(&ContextOptions { device: self.device.clone(), validation: self.validation })?;
        check_size(&context, size)?;
        Ok(context)
    }
}
