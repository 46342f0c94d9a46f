//! The subject of the window: a scene, its command, and the options and eye of its view.

use std::sync::Arc;

use twobounce::renderer::RenderOptions;
use twobounce::scene::{Scene, View};
use twobounce::stage::{Shot, Staged};

use super::eye::Eye;
use crate::cli::args::{RunArgs, SceneArgs};
use crate::cli::scene::run_options;

pub struct Subject {
    pub args: SceneArgs,
    /// The words after the command: flags that `render` may understand too.
    pub typed: Vec<String>,
    pub scene: Arc<Scene>,
    pub shot: Shot,
    pub options: RenderOptions,
    /// A view of the whole scene.
    pub framing: Eye,
    /// The diagonal of the scene's bounds in metres.
    pub diagonal_m: f64,
}

impl Subject {
    pub fn new(args: SceneArgs, typed: Vec<String>, opened: Staged, run: &RunArgs) -> Self {
        let options = run_options(&opened, run);
        let Staged { scene, shot, .. } = opened;
        let framing = Eye::of_view(&View::framing(options.bounds), 1.0);
        let distance = (options.bounds.center() - framing.eye).length();
        let framing = Eye { target: framing.eye + (framing.target - framing.eye) * distance, ..framing };
        let diagonal_m = options.bounds.size().length().max(1e-3);
        Self { args, typed, scene: Arc::new(scene), shot, options, framing, diagonal_m }
    }
}
