//! Opens what the flags describe: the scene (file, moment, camera, light) and the device.

use std::ffi::OsStr;
use std::path::Path;
use std::sync::{Arc, OnceLock};

use clap::{Args, Command, FromArgMatches};
use glam::DVec3;
use twobounce::ground::clearance::fitted_to_camera;
use twobounce::output::exr::Metadata;
use twobounce::reference::lights_itself;
use twobounce::renderer::{RenderOptions, largest_image, memory_limit, most_triangles};
use twobounce::scene::{Bounds, DEFAULT_FOV_DEGREES, LoadOptions, Playback, Pose, Projection, Scene, Still, View};
use twobounce::settings::Settings;
use twobounce::vk::{Context, ContextOptions};
use twobounce::{Error, Result};

use super::args::{DefaultLight, DeviceArgs, Ground, Loop, RunArgs, SceneArgs};
use super::out;
use super::progress::watch;
use crate::say;

/// The scene of `twobounce demo`, wherever a scene is named.
pub const DEMO: &str = "demo:";

/// A scene ready to render.
pub struct Opened {
    pub scene: Scene,
    /// Pixels of the image.
    pub size: (u32, u32),
    /// The camera in words, for headers and reports.
    pub camera: String,
    /// The sky in words.
    pub sky: String,
    pub shot: Shot,
    /// The pose at --time, and the camera in it.
    pub still: (Pose, View),
    /// Of the scene over all that plays, once something asked for them.
    bounds: OnceLock<Bounds>,
}

/// Which moment of a scene is seen, and from where.
#[derive(Clone)]
pub struct Shot {
    playback: Playback,
    time_s: f64,
    camera: Camera,
}

/// A camera of the file moves with its node; the others stand still.
#[derive(Clone, Copy)]
enum Camera {
    OfFile {
        index: usize,
        /// Radians; its own where absent.
        fov: Option<f32>,
    },
    Fixed(View),
}

impl SceneArgs {
    /// The defaults for this scene and size.
    pub fn plain(path: &Path, size: (u32, u32)) -> Self {
        let typed = [OsStr::new(""), OsStr::new("--"), path.as_os_str()];
        let matches = Self::augment_args(Command::new("")).get_matches_from(typed);
        Self { size, ..Self::from_arg_matches(&matches).expect("every flag has a default") }
    }

    /// Finds mistakes that can be found without opening the file.
    pub fn check(&self) -> Result<()> {
        let usage = |sentence: &str| Err(Error::Usage(sentence.to_owned()));
        if self.default_light == DefaultLight::On && self.sky.given() {
            return usage("--default-light on and --sky both give a sky; leave one of them out");
        }
        self.sky.check()?;
        let (Some(eye), Some(target)) = (self.eye, self.target) else { return Ok(()) };
        let Some(forward) = (target - eye).try_normalize() else {
            return usage("--eye and --target are the same point; move one of them");
        };
        // Within 1e-6 radians the image's roll would be rounding noise.
        if self.up.try_normalize().is_none_or(|up| up.cross(forward).length() < 1e-6) {
            return usage("--up is zero or points along the view; choose another direction");
        }
        Ok(())
    }

    /// Loads the scene, chooses animation and camera, adds the sky and, without any light, a light. Prints what was ignored,
    /// simplified or added.
    pub fn open(&self) -> Result<Opened> {
        self.open_within(LoadOptions::default())
    }

    /// As [`Self::open`], within the limits that a device sets.
    fn open_within(&self, device: LoadOptions) -> Result<Opened> {
        self.check()?;
        let options = LoadOptions {
            scene: self.scene.clone(),
            assets: self.assets.clone(),
            strict: self.strict,
            max_texture: self.max_texture,
            memory: None,
            ..device
        };
        let mut scene = if self.path == Path::new(DEMO) {
            Scene::load_glb("demo", twobounce::assets::demo()?, &options)?
        } else {
            Scene::load(&self.path, &options)?
        };
        let of_sky = self.sky.add_to(&mut scene, self.max_texture)?;
        let animations = match &self.animation {
            Some(name) => scene.animations_named(name)?,
            None => (0..scene.animations.len().min(1)).collect(),
        };
        let playback = Playback { animations, repeats: self.repeats == Loop::On };
        let bounds = OnceLock::new();
        let about = || *bounds.get_or_init(|| scene.bounds_of(&playback));
        let (camera, words) = self.choose_camera(&scene, about)?;
        let shot = Shot { playback, time_s: self.time, camera };
        let mut notes = std::mem::take(&mut scene.warnings);
        notes.extend(of_sky);
        if let Some(note) = self.light(&mut scene, &shot, &bounds)? {
            notes.push(note);
        }
        notes.iter().for_each(|note| out::warn(&format!("note: {}: {note}", scene.name)));
        let sky = self.sky.words(&scene);
        let still = shot.at(&scene, 0.0);
        Ok(Opened { scene, size: self.size, camera: words, sky, shot, still, bounds })
    }

    /// Adds light, and a ground that takes it, where the scene needs some. Returns what is to be said about that.
    fn light(&self, scene: &mut Scene, shot: &Shot, bounds: &OnceLock<Bounds>) -> Result<Option<String>> {
        let lit = |scene: &Scene| {
            let (pose, view) = shot.at(scene, 0.0);
            lights_itself(scene, &pose, &view)
        };
        let why = match (scene.has_light(), scene.has_light_beside_emission()) {
            (false, _) => "the scene has no light, emission or sky",
            (_, true) => "",
            _ if lit(scene)? => "",
            _ => "the scene has no light or sky, and what it emits hardly lights anything that is seen",
        };
        // Those of the scene itself, before anything is added.
        let about = |scene: &Scene| *bounds.get_or_init(|| scene.bounds_of(&shot.playback));
        let add = |scene: &mut Scene| {
            let (view, bounds) = (shot.first_view(scene), about(scene));
            // From below, a ground would hide what is seen.
            let ground = self.ground == Ground::On || self.ground == Ground::Auto && view.eye.y > bounds.min.y;
            scene.add_studio(&view, bounds, ground)
        };
        let needs = !why.is_empty();
        if self.default_light == DefaultLight::On || self.default_light == DefaultLight::Auto && needs {
            let added = add(scene);
            return Ok(Some(if needs { format!("{why}: {added}") } else { added }));
        }
        if self.ground == Ground::On {
            let bounds = about(scene);
            scene.add_ground(bounds);
        }
        Ok(needs.then(|| format!("{why}: the image will be black or nearly so")))
    }

    /// Opens the scene and the device, and prints what they are.
    pub fn open_on(&self, run: &RunArgs) -> Result<(Opened, Arc<Context>)> {
        self.open_with(run.device.open(self.size), run)
    }

    /// As [`Self::open_on`], on a device whose driver describes the pipelines where it can.
    pub fn open_on_describing(&self, run: &RunArgs) -> Result<(Opened, Arc<Context>)> {
        self.open_with(run.device.open_by(Context::describing, self.size), run)
    }

    /// The device comes first, for its limits; what is wrong with the scene is said first.
    fn open_with(&self, context: Result<Arc<Context>>, run: &RunArgs) -> Result<(Opened, Arc<Context>)> {
        let limits = context.as_ref().map_or_else(|_| LoadOptions::default(), |context| limits(context, run));
        let opened = self.open_within(limits)?;
        let context = context?;
        opened.say(&context);
        Ok((opened, context))
    }

    /// Opens the scene for a device that is open, and prints what both are.
    #[cfg(feature = "window")]
    pub fn open_for(&self, context: &Context, run: &RunArgs) -> Result<Opened> {
        let opened = self.open_within(limits(context, run))?;
        opened.say(context);
        Ok(opened)
    }

    /// The camera, and its words. `bounds`: of the scene.
    fn choose_camera(&self, scene: &Scene, bounds: impl FnOnce() -> Bounds) -> Result<(Camera, String)> {
        if let (Some(eye), Some(target)) = (self.eye, self.target) {
            let fov = self.fov.unwrap_or(f64::from(DEFAULT_FOV_DEGREES));
            let view = View::look_at(eye, target, self.up, fov.to_radians() as f32);
            let point = |p: DVec3| format!("{},{},{}", p.x, p.y, p.z);
            let words = format!("eye {} target {} up {} fov {}", point(eye), point(target), point(self.up), fov);
            return Ok((Camera::Fixed(view), words));
        }
        let fov = self.fov.map(|fov| fov.to_radians() as f32);
        let fov_words = self.fov.map_or(String::new(), |fov| format!(" fov {fov}"));
        let index = match &self.camera {
            Some(name) => Some(scene.camera_named(name)?),
            None => (!scene.cameras.is_empty()).then_some(0),
        };
        Ok(match index {
            Some(index) => {
                let camera = &scene.cameras[index];
                if self.fov.is_some() && !matches!(camera.projection, Projection::Perspective { .. }) {
                    let text =
                        format!("--fov: camera {index} is orthographic; leave it out or look with --eye and --target");
                    return Err(Error::Usage(text));
                }
                (Camera::OfFile { index, fov }, format!("{index} {:?}{fov_words}", camera.name))
            }
            None => {
                let fov = fov.unwrap_or(DEFAULT_FOV_DEGREES.to_radians());
                let aspect = f64::from(self.size.0) / f64::from(self.size.1);
                let bounds = bounds();
                let view = View::filling(&scene.outline(bounds), fov, aspect);
                let view = view.unwrap_or_else(|| View::framing_within(bounds, fov));
                (Camera::Fixed(view), format!("framing the scene{fov_words}"))
            }
        })
    }
}

/// Limits that a device sets to a scene.
fn limits(context: &Context, run: &RunArgs) -> LoadOptions {
    LoadOptions {
        texture_memory: Some(memory_limit(context, run.memory_limit)),
        texture_side: Some(largest_image(context)),
        triangles: Some(most_triangles(context)),
        ..LoadOptions::default()
    }
}

impl Opened {
    fn say(&self, context: &Context) {
        let (Self { scene, camera, .. }, (width, height)) = (self, self.size);
        say!("{}: triangles {}, camera {camera}, {width}x{height}", scene.name, scene.triangle_count());
        say!("{}: {}", context.name, context.driver);
    }

    /// The box of the scene over all that plays.
    fn bounds(&self) -> Bounds {
        *self.bounds.get_or_init(|| self.scene.bounds_of(&self.shot.playback))
    }

    /// The settings, with smaller voxels about the camera where the scene asks for them; says so then.
    pub fn fitted(&self, settings: Settings) -> Settings {
        let (pose, view) = &self.still;
        match fitted_to_camera(&settings, Still::new(&self.scene, pose, view), self.bounds()) {
            Some((fitted, words)) => {
                out::warn(&format!("note: {}: {words}", self.scene.name));
                fitted
            }
            None => settings,
        }
    }

    /// The scene as other flags show it: another moment, another camera. And the camera in words.
    pub fn seen(&self, args: &SceneArgs) -> Result<(Pose, View, String)> {
        let frames = args.eye.is_none() && self.scene.cameras.is_empty();
        let (camera, words) = match &self.shot.camera {
            // A ground has been added since.
            Camera::Fixed(view) if frames => (Camera::Fixed(*view), self.camera.clone()),
            _ => args.choose_camera(&self.scene, || self.bounds())?,
        };
        let shot = Shot { time_s: args.time, camera, ..self.shot.clone() };
        let (pose, view) = shot.at(&self.scene, 0.0);
        Ok((pose, view, words))
    }

    /// Seconds that what plays takes; 0 where nothing moves.
    pub fn duration_s(&self) -> f64 {
        let playing = self.shot.playback.animations.iter().map(|&i| f64::from(self.scene.animations[i].duration));
        playing.fold(0.0, f64::max)
    }

    /// The image alone, within a limit on device memory.
    pub fn options(&self, memory_limit: Option<u64>) -> RenderOptions {
        RenderOptions { memory_limit, watch: Some(watch()), ..RenderOptions::new(self.size, self.bounds()) }
    }

    /// The image alone, as the flags say.
    pub fn run_options(&self, run: &RunArgs) -> RenderOptions {
        RenderOptions { submit: run.submit, steps: run.steps, ..self.options(run.memory_limit) }
    }

    /// Metadata of an .exr about its origin: how the scene is seen, and `more`. No dates: the same command gives the
    /// same bytes.
    pub fn header<const N: usize>(&self, more: [(&str, String); N]) -> Metadata {
        let Scene { name, hash, .. } = &self.scene;
        let (time, camera) = (self.shot.time_s.to_string(), self.camera.clone());
        let seen = [("scene", name.clone()), ("sceneHash", hash.clone()), ("camera", camera), ("time", time)];
        let entries = seen.into_iter().chain([("sky", self.sky.clone())]).chain(more);
        entries.map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

impl Shot {
    /// The scene `later_s` seconds after --time.
    pub fn pose(&self, scene: &Scene, later_s: f64) -> Pose {
        scene.pose_of(&self.playback, self.time_s + later_s)
    }

    /// The camera in a pose of the scene.
    pub fn view(&self, scene: &Scene, pose: &Pose) -> View {
        match self.camera {
            Camera::OfFile { index, fov: asked } => {
                let mut view = scene.view(pose, index);
                if let (Some(asked), Projection::Perspective { fov, .. }) = (asked, &mut view.projection) {
                    *fov = asked;
                }
                view
            }
            Camera::Fixed(view) => view,
        }
    }

    /// The camera at --time: one that stands still asks for no pose, which of millions of instances is large.
    fn first_view(&self, scene: &Scene) -> View {
        match self.camera {
            Camera::Fixed(view) => view,
            Camera::OfFile { .. } => self.at(scene, 0.0).1,
        }
    }

    /// The pose and the camera `later_s` seconds after --time.
    pub fn at(&self, scene: &Scene, later_s: f64) -> (Pose, View) {
        let pose = self.pose(scene, later_s);
        let view = self.view(scene, &pose);
        (pose, view)
    }

    /// Seconds within the animation, `later_s` after --time.
    pub fn time_s(&self, later_s: f64) -> f64 {
        self.time_s + later_s
    }
}

impl DeviceArgs {
    /// Opens the device for images of this size.
    pub fn open(&self, size: (u32, u32)) -> Result<Arc<Context>> {
        self.open_by(Context::new, size)
    }

    /// As [`Self::open`], with shaders that count what they read.
    pub fn open_counting(&self, size: (u32, u32)) -> Result<Arc<Context>> {
        self.open_by(Context::counting, size)
    }

    fn open_by(
        &self,
        open: impl Fn(&ContextOptions) -> Result<Arc<Context>>,
        (width, height): (u32, u32),
    ) -> Result<Arc<Context>> {
        let context = open(&ContextOptions { device: self.device.clone(), validation: self.validation })?;
        let limits = &context.limits;
        let most = limits.max_image_dimension2_d.min(limits.max_framebuffer_width).min(limits.max_framebuffer_height);
        if width.max(height) > most {
            let device = &context.name;
            let text = format!("--size {width}x{height}: {device} makes images of up to {most} pixels a side");
            return Err(Error::Usage(text));
        }
        Ok(context)
    }
}
