//! Measures the numbers of pages in `docs/`, and renders their pictures. Each page names its command: `cargo run
//! --release --example pages -- COMMAND`.

mod audit;
mod changes;
mod devices;
mod flight;
mod frontier;
mod frontier_tables;
mod kinds;
mod layers;
mod materials;
mod noise;
mod pictures;
mod plan;
mod refit;
mod strengths;
mod tables;
mod talk;

use std::fs;
use std::path::{Path, PathBuf};

use clap::Parser;
use twobounce::lab::table::fill_file;
use twobounce::stability::markdown::summary;

#[derive(Parser)]
#[command(about = "Measures the numbers of pages in docs/, and makes their pictures")]
enum Page {
    /// Prints for docs/notes/plan.md the passes and bytes of frames of different scenes, with those that no pass uses
    Audit {
        #[arg(default_values = ["assets/cornell-point.glb", "assets/gallery.glb", "assets/demo.glb"])]
        scenes: Vec<PathBuf>,
    },
    /// Prints for docs/notes/costs.md the cost of each change of a renderer: the change itself, and the next frame
    Changes {
        #[arg(default_value = "assets/gallery.glb")]
        scene: PathBuf,
    },
    /// Fills the tables of docs/devices.md
    Devices,
    /// Prints for docs/notes/study/rooms/README.md the change from frame to frame in a camera's flight
    Flight(flight::Flight),
    /// Measures rows of docs/notes/frontier.md, or fills its tables
    Frontier(frontier::Frontier),
    /// Fills the section of this driver in docs/notes/layers.md
    Layers,
    /// Fills the table of docs/materials.md
    Materials {
        /// A folder for the pictures behind the numbers
        folder: Option<PathBuf>,
        /// The beginning of a scene's name; the other lines stay as the page has them
        #[arg(default_value = "")]
        scene: String,
    },
    /// Prints for docs/notes/noise.md stability cases with changed settings
    Noise(noise::Noise),
    /// Prints for docs/notes/noise.md random scenes against the path tracer
    Random(noise::RandomScenes),
    /// Prints the table of docs/notes/plan.md
    Plan(plan::Plan),
    /// Prints for docs/notes/costs.md the further steps of rays in a tree that was only refitted
    Refit { scenes: Vec<PathBuf> },
    /// Fills the tables of docs/stability.md from docs/stability-rows.csv
    Stability,
    /// Fills the tables of README.md, docs/accuracy.md and docs/notes/strengths.md
    Strengths {
        /// The presets whose leaks and noise are measured again, or none; the other lines stay
        #[arg(value_delimiter = ',', default_values = tables::CHOSEN)]
        presets: Vec<String>,
    },
    /// Renders the pictures of docs/notes/talk.md, and fills its table of times
    Talk {
        #[arg(long)]
        keep_times: bool,
    },
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    match Page::parse() {
        Page::Audit { scenes } => audit::run(&scenes)?,
        Page::Changes { scene } => changes::run(&scene)?,
        Page::Devices => {
            let root = Path::new(env!("CARGO_MANIFEST_DIR"));
            for page in ["docs/devices.md", "docs/notes/devices.md"] {
                fill_file(&root.join(page), |name, _| devices::table(name, root))?;
            }
        }
        Page::Flight(flight) => flight.run()?,
        Page::Frontier(frontier) => frontier.run()?,
        Page::Layers => layers::run()?,
        Page::Materials { folder, scene } => materials::run(folder, &scene)?,
        Page::Noise(noise) => noise.run()?,
        Page::Random(random) => random.run()?,
        Page::Plan(plan) => plan.run()?,
        Page::Refit { scenes } => refit::run(&scenes)?,
        Page::Stability => {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/stability.md");
            let rows = fs::read_to_string(path.with_file_name("stability-rows.csv"))?;
            fs::write(&path, summary(&rows, &fs::read_to_string(&path)?)?)?;
        }
        Page::Strengths { presets } => strengths::run(&presets)?,
        Page::Talk { keep_times } => talk::run(keep_times)?,
    }
    Ok(())
}
