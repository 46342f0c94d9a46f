//! A scene for measurements of single images, by the renderer and by the path tracer.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::Result;
use crate::layers::Layers;
use crate::reference::film::Film;
use crate::reference::{self, Control, Depth, Options, Stop};
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::{LoadOptions, Pose, Scene, Still, View};
use crate::settings::Settings;
use crate::vk::Context;

/// A scene in its first pose, and a view of it.
#[derive(Clone)]
pub struct Specimen {
    pub scene: Scene,
    pub pose: Pose,
    pub view: View,
}

impl Specimen {
    /// The view of the scene's first camera, or else one that frames the scene.
    pub fn new(scene: Scene) -> Self {
        let pose = scene.pose(None, 0.0);
        let view = if scene.cameras.is_empty() { View::framing(scene.bounds(None)) } else { scene.view(&pose, 0) };
        Self { scene, pose, view }
    }

    pub fn load(path: impl AsRef<Path>) -> Result<Self> {
        Ok(Self::new(Scene::load(path.as_ref(), &LoadOptions::default())?))
    }

    pub fn still(&self) -> Still<'_> {
        Still::new(&self.scene, &self.pose, &self.view)
    }

    /// Options for an image with `size` pixels and a grid around the scene.
    pub fn options(&self, size: (u32, u32)) -> RenderOptions {
        RenderOptions::new(size, self.scene.bounds(None))
    }

    pub fn renderer(&self, context: &Arc<Context>, settings: &Settings, options: RenderOptions) -> Result<Renderer> {
        Renderer::new(context, self.scene.clone(), &self.pose, settings.clone(), options)
    }

    /// The first frame of a new renderer.
    pub fn rendered(&self, context: &Arc<Context>, settings: &Settings, options: RenderOptions) -> Result<Layers> {
        let mut renderer = self.renderer(context, settings, options)?;
        renderer.render(&self.pose, &self.view)?;
        Ok(renderer.read())
    }

    /// The path tracer's film of an image with `size` pixels.
    pub fn traced(&self, size: (u32, u32), depth: Depth, stop: Stop) -> Result<Film> {
        let (width, height) = size;
        let options = Options { width, height, depth, stop, seed: 0, occlusion: false };
        let (mut film, never) = (Film::new(width, height), AtomicBool::new(false));
        let control = Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never };
        reference::render(self.still(), &options, &mut film, control)?;
        Ok(film)
    }
}
