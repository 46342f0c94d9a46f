//! Measures the numbers of pages in `docs/`, and renders their pictures. Each page names its command: `cargo run
//! --release --example pages -- COMMAND`.

mod devices;
mod layers;
mod materials;
mod pictures;
mod plan;
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
    /// Fills the tables of docs/devices.md
    Devices,
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
    /// Prints the table of docs/notes/plan.md
    Plan(plan::Plan),
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
        Page::Devices => {
            let root = Path::new(env!("CARGO_MANIFEST_DIR"));
            for page in ["docs/devices.md", "docs/notes/devices.md"] {
                fill_file(&root.join(page), |name, _| devices::table(name, root))?;
            }
        }
        Page::Layers => layers::run()?,
        Page::Materials { folder, scene } => materials::run(folder, &scene)?,
        Page::Plan(plan) => plan.run()?,
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
