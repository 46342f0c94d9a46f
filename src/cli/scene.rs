//! Opens the scene that the flags describe: file, moment, camera, light.

use std::path::PathBuf;

use glam::{DVec3, Vec3};
use twobounce::scene::{Bounds, LoadOptions, Pose, Scene, View};
use twobounce::{Error, Result};

use super::args::SceneArgs;

/// A scene ready to render.
pub struct Opened {
    pub scene: Scene,
    pub width: u32,
    pub height: u32,
    /// What was ignored, simplified or added: one sentence each.
    pub notes: Vec<String>,
    /// The camera in words, for headers and reports.
    pub camera: String,
    pub shot: Shot,
}

/// Which moment of a scene is seen, and from where.
pub struct Shot {
    animation: Option<usize>,
    time_s: f64,
    chosen: Chosen,
}

/// A camera of the file moves with its node; the others stand still.
enum Chosen {
    Camera(usize),
    Fixed(View),
}

impl SceneArgs {
    /// As if nothing but the scene and the size had been typed.
    pub fn plain(path: PathBuf, size: (u32, u32)) -> Self {
        Self {
            path,
            size,
            camera: None,
            eye: None,
            target: None,
            up: DVec3::Y,
            fov: 45.0,
            scene: None,
            animation: None,
            time: 0.0,
            sky: Vec3::ZERO,
            no_default_light: false,
        }
    }

    /// What can be found wrong without opening the file.
    pub fn check(&self) -> Result<()> {
        let usage = |sentence: &str| Err(Error::Usage(sentence.to_owned()));
        if !self.time.is_finite() || self.time < 0.0 {
            return usage("--time takes seconds, finite and at least 0");
        }
        if !(self.fov > 0.0 && self.fov < 180.0) {
            return usage("--fov takes degrees between 0 and 180");
        }
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

    /// Loads the scene, chooses animation and camera, adds sky and, where nothing shines, a light.
    pub fn open(&self) -> Result<Opened> {
        self.check()?;
        let mut scene = Scene::load(&self.path, &LoadOptions { scene: self.scene.clone() })?;
        scene.sky = self.sky;
        let animation = match &self.animation {
            Some(name) => Some(scene.animation_named(name)?),
            None => (!scene.animations.is_empty()).then_some(0),
        };
        let (chosen, camera) = self.choose_camera(&scene, animation)?;
        let (width, height) = self.size;
        let notes = std::mem::take(&mut scene.warnings);
        let mut opened =
            Opened { scene, width, height, notes, camera, shot: Shot { animation, time_s: self.time, chosen } };
        if !opened.scene.has_light() {
            let note = if self.no_default_light {
                "the scene has no light, emission or sky: the image will be black".into()
            } else {
                let view = opened.view(&opened.pose(0.0));
                opened.scene.add_default_light(&view)
            };
            opened.notes.push(note);
        }
        Ok(opened)
    }

    fn choose_camera(&self, scene: &Scene, animation: Option<usize>) -> Result<(Chosen, String)> {
        if let (Some(eye), Some(target)) = (self.eye, self.target) {
            let view = View::look_at(eye, target, self.up, self.fov.to_radians() as f32);
            let point = |p: DVec3| format!("{},{},{}", p.x, p.y, p.z);
            let words = format!("eye {} target {} up {} fov {}", point(eye), point(target), point(self.up), self.fov);
            return Ok((Chosen::Fixed(view), words));
        }
        let index = match &self.camera {
            Some(name) => Some(scene.camera_named(name)?),
            None => (!scene.cameras.is_empty()).then_some(0),
        };
        Ok(match index {
            Some(index) => (Chosen::Camera(index), format!("{index} {:?}", scene.cameras[index].name)),
            None => (Chosen::Fixed(View::framing(scene.bounds(animation))), "framing the scene".into()),
        })
    }
}

impl Opened {
    /// The scene `later_s` seconds after --time.
    pub fn pose(&self, later_s: f64) -> Pose {
        self.shot.pose(&self.scene, later_s)
    }

    /// The camera in a pose.
    pub fn view(&self, pose: &Pose) -> View {
        self.shot.view(&self.scene, pose)
    }
}

impl Shot {
    /// The scene `later_s` seconds after --time.
    pub fn pose(&self, scene: &Scene, later_s: f64) -> Pose {
        scene.pose(self.animation, (self.time_s + later_s) as f32)
    }

    /// The camera in a pose.
    pub fn view(&self, scene: &Scene, pose: &Pose) -> View {
        match self.chosen {
            Chosen::Camera(index) => scene.view(pose, index),
            Chosen::Fixed(view) => view,
        }
    }

    /// The scene's bounds over the whole animation.
    pub fn bounds(&self, scene: &Scene) -> Bounds {
        scene.bounds(self.animation)
    }
}
