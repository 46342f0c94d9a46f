//! A scene that is prepared for rendering: its camera is chosen, and its sky and light are added.

use std::sync::OnceLock;

use super::{Stage, Viewpoint, When};
use crate::ground::grid_choice::fitted_to_camera;
use crate::output::exr::Metadata;
use crate::reference::lights_itself;
use crate::scene::{Bounds, DEFAULT_FOV_DEGREES, Playback, Pose, Projection, Scene, Still, View};
use crate::settings::Settings;
use crate::{Error, Result};

/// A scene that is ready to render.
pub struct Staged {
    pub scene: Scene,
    /// Width and height of the image in pixels.
    pub size: (u32, u32),
    /// The camera in words, for headers and reports.
    pub camera: String,
    /// The sky in words.
    pub sky: String,
    pub shot: Shot,
    /// The pose at [`Stage::time_s`], and the camera in it.
    pub still: (Pose, View),
    /// Sentences about parts that were ignored, simplified or added.
    pub notes: Vec<String>,
    /// Bounds of the scene over all that is animated, computed on request.
    bounds: OnceLock<Bounds>,
}

/// The time and the camera of a picture.
#[derive(Clone)]
pub struct Shot {
    playback: Playback,
    time_s: f64,
    camera: StageCamera,
}

/// The camera: one of the file moves with its node, others are fixed.
#[derive(Clone, Copy)]
enum StageCamera {
    OfFile {
        index: usize,
        /// Vertical field of view in radians; by default that of the camera.
        fov: Option<f32>,
    },
    Fixed(View),
}

impl Staged {
    /// Chooses animation and camera, and adds the sky and, if needed, a light. `size` is that of the image in pixels.
    ///
    /// # Errors
    /// As for [`Stage::check`]; also a camera or an animation that the scene does not have, a sky that cannot be read,
    /// and [`Error::Usage`] for a scene that [`Scene::check`] refuses.
    pub fn new(mut scene: Scene, stage: &Stage, size: (u32, u32)) -> Result<Self> {
        stage.check()?;
        let of_sky = stage.add_sky(&mut scene)?;
        let animations = match &stage.animation {
            Some(name) => scene.animations_named(name)?,
            None => (0..scene.animations.len().min(1)).collect(),
        };
        let playback = Playback { animations, repeats: stage.repeats };
        let bounds = OnceLock::new();
        let about = || *bounds.get_or_init(|| scene.bounds_of(&playback));
        let (camera, words) = stage.choose_camera(&scene, size, about)?;
        let shot = Shot { playback, time_s: stage.time_s, camera };
        let mut notes = std::mem::take(&mut scene.warnings);
        notes.extend(of_sky);
        notes.extend(stage.light(&mut scene, &shot, &bounds)?);
        let sky = stage.sky_words(&scene);
        let still = shot.at(&scene, 0.0);
        Ok(Self { scene, size, camera: words, sky, shot, still, notes, bounds })
    }

    /// The bounds of the scene over all that is animated.
    pub fn bounds(&self) -> Bounds {
        *self.bounds.get_or_init(|| self.scene.bounds_of(&self.shot.playback))
    }

    /// The settings with smaller voxels around the camera if the scene needs them, and a note about this.
    pub fn fitted(&self, settings: Settings) -> (Settings, Option<String>) {
        let (pose, view) = &self.still;
        match fitted_to_camera(&settings, Still::new(&self.scene, pose, view), self.bounds()) {
            Some((fitted, words)) => (fitted, Some(words)),
            None => (settings, None),
        }
    }

    /// The pose, view and camera words of the scene on another stage: at another time or through another camera.
    ///
    /// # Errors
    /// The scene does not have the camera.
    pub fn seen(&self, stage: &Stage) -> Result<(Pose, View, String)> {
        let frames = stage.viewpoint == Viewpoint::Auto && self.scene.cameras.is_empty();
        let (camera, words) = match &self.shot.camera {
            // A ground was added after the scene was checked.
            StageCamera::Fixed(view) if frames => (StageCamera::Fixed(*view), self.camera.clone()),
            _ => stage.choose_camera(&self.scene, self.size, || self.bounds())?,
        };
        let shot = Shot { time_s: stage.time_s, camera, ..self.shot.clone() };
        let (pose, view) = shot.at(&self.scene, 0.0);
        Ok((pose, view, words))
    }

    /// Duration of the animations in seconds; 0 without motion.
    pub fn duration_s(&self) -> f64 {
        let playing = self.shot.playback.animations.iter().map(|&i| f64::from(self.scene.animations[i].duration));
        playing.fold(0.0, f64::max)
    }

    /// Metadata of an .exr about its origin: the view of the scene, and `more`. There are no dates, so that the same
    /// command gives the same bytes.
    pub fn header<const N: usize>(&self, more: [(&str, String); N]) -> Metadata {
        let Scene { name, hash, .. } = &self.scene;
        let (time, camera) = (self.shot.time_s.to_string(), self.camera.clone());
        let seen = [("scene", name.clone()), ("sceneHash", hash.clone()), ("camera", camera), ("time", time)];
        let entries = seen.into_iter().chain([("sky", self.sky.clone())]).chain(more);
        entries.map(|(name, value)| (name.to_owned(), value)).collect()
    }
}

impl Stage {
    /// Adds light, and a ground that receives it, if the scene needs them. Returns notes about them.
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
        // These are the bounds of the scene itself, before anything is added.
        let about = |scene: &Scene| *bounds.get_or_init(|| scene.bounds_of(&shot.playback));
        let add = |scene: &mut Scene| {
            let (view, bounds) = (shot.first_view(scene), about(scene));
            // Seen from below, a ground would hide the scene.
            let ground = self.ground == When::On || self.ground == When::Auto && view.eye.y > bounds.min.y;
            scene.add_studio(&view, bounds, ground)
        };
        let needs = !why.is_empty();
        if self.default_light == When::On || self.default_light == When::Auto && needs {
            let added = add(scene);
            return Ok(Some(if needs { format!("{why}: {added}") } else { added }));
        }
        if self.ground == When::On {
            let bounds = about(scene);
            scene.add_ground(bounds);
        }
        Ok(needs.then(|| format!("{why}: the image will be black or nearly so")))
    }

    /// The camera and its description. `bounds` are those of the scene.
    fn choose_camera(
        &self,
        scene: &Scene,
        (width, height): (u32, u32),
        bounds: impl FnOnce() -> Bounds,
    ) -> Result<(StageCamera, String)> {
        let fov = self.fov_degrees.map(|fov| fov.to_radians() as f32);
        let fov_words = self.fov_degrees.map_or(String::new(), |fov| format!(" fov {fov}"));
        let index = match &self.viewpoint {
            Viewpoint::LookAt { eye, target, up } => {
                let fov = self.fov_degrees.unwrap_or(f64::from(DEFAULT_FOV_DEGREES));
                let view = View::look_at(*eye, *target, *up, fov.to_radians() as f32);
                let point = |p: &glam::DVec3| format!("{},{},{}", p.x, p.y, p.z);
                let words = format!("eye {} target {} up {} fov {fov}", point(eye), point(target), point(up));
                return Ok((StageCamera::Fixed(view), words));
            }
            Viewpoint::OfFile(name) => Some(scene.camera_named(name)?),
            Viewpoint::Auto => (!scene.cameras.is_empty()).then_some(0),
        };
        Ok(match index {
            Some(index) => {
                let camera = &scene.cameras[index];
                if fov.is_some() && !matches!(camera.projection, Projection::Perspective { .. }) {
                    let text =
                        format!("--fov: camera {index} is orthographic; leave it out or look with --eye and --target");
                    return Err(Error::Usage(text));
                }
                (StageCamera::OfFile { index, fov }, format!("{index} {:?}{fov_words}", camera.name))
            }
            None => {
                let fov = fov.unwrap_or(DEFAULT_FOV_DEGREES.to_radians());
                let aspect = f64::from(width) / f64::from(height);
                let bounds = bounds();
                let view = View::filling(&scene.outline(bounds), fov, aspect);
                let view = view.unwrap_or_else(|| View::framing_within(bounds, fov));
                (StageCamera::Fixed(view), format!("framing the scene{fov_words}"))
            }
        })
    }
}

impl Shot {
    /// The pose `later_s` seconds after [`Stage::time_s`].
    pub fn pose(&self, scene: &Scene, later_s: f64) -> Pose {
        scene.pose_of(&self.playback, self.time_s + later_s)
    }

    /// The camera in a pose of the scene.
    pub fn view(&self, scene: &Scene, pose: &Pose) -> View {
        match self.camera {
            StageCamera::OfFile { index, fov: asked } => {
                let mut view = scene.view(pose, index);
                if let (Some(asked), Projection::Perspective { fov, .. }) = (asked, &mut view.projection) {
                    *fov = asked;
                }
                view
            }
            StageCamera::Fixed(view) => view,
        }
    }

    /// The camera at [`Stage::time_s`]. A fixed one needs no pose, which is large for millions of instances.
    fn first_view(&self, scene: &Scene) -> View {
        match self.camera {
            StageCamera::Fixed(view) => view,
            StageCamera::OfFile { .. } => self.at(scene, 0.0).1,
        }
    }

    /// The pose and the camera `later_s` seconds after [`Stage::time_s`].
    pub fn at(&self, scene: &Scene, later_s: f64) -> (Pose, View) {
        let pose = self.pose(scene, later_s);
        let view = self.view(scene, &pose);
        (pose, view)
    }

    /// Seconds within the animation, `later_s` after [`Stage::time_s`].
    pub fn time_s(&self, later_s: f64) -> f64 {
        self.time_s + later_s
    }
}
