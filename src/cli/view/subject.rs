//! What is open: a scene, how it was asked for, and what it takes to look at it.

use std::sync::Arc;

use twobounce::renderer::RenderOptions;
use twobounce::scene::{Scene, View};
use twobounce::vk::Context;

use super::eye::Eye;
use super::worker::Stage;
use crate::cli::args::{RunArgs, SceneArgs};
use crate::cli::scene::{Opened, Shot};

pub struct Subject {
    pub args: SceneArgs,
    /// Scene and flags as typed, which `render` takes too.
    pub typed: Vec<String>,
    pub scene: Arc<Scene>,
    pub shot: Shot,
    /// Where all of it is seen from.
    pub framing: Eye,
    /// Of the scene's bounds, metres.
    pub diagonal_m: f64,
    options: RenderOptions,
}

impl Subject {
    pub fn new(args: SceneArgs, typed: Vec<String>, opened: Opened, run: &RunArgs) -> Self {
        let options = opened.run_options(run);
        let Opened { scene, shot, .. } = opened;
        let framing = Eye::of(&View::framing(options.bounds), 1.0);
        let distance = (options.bounds.center() - framing.eye).length();
        let framing = Eye { target: framing.eye + (framing.target - framing.eye) * distance, ..framing };
        let diagonal_m = options.bounds.size().length().max(1e-3);
        Self { args, typed, scene: Arc::new(scene), shot, framing, diagonal_m, options }
    }

    /// The camera that was asked for, `later_s` seconds after --time.
    pub fn first_view(&self, later_s: f64) -> View {
        self.shot.view(&self.scene, &self.shot.pose(&self.scene, later_s))
    }

    /// For a worker.
    pub fn stage(&self, context: &Arc<Context>) -> Stage {
        let (context, scene) = (context.clone(), self.scene.clone());
        Stage { context, scene, shot: self.shot.clone(), options: self.options.clone() }
    }
}
