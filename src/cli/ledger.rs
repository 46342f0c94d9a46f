//! `twobounce ledger`: measures the rows of a method's ledger and fills the last cells in its page.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

use clap::Args;
use glam::Vec3;
use twobounce::gi::Method;
use twobounce::lab::ledger::{Comparison, LEDGERS, Line, lines, with_results};
use twobounce::lab::specimen::Specimen;
use twobounce::lab::table;
use twobounce::layers::{Aov, Layers};
use twobounce::measure::metrics::{Metrics, compare};
use twobounce::measure::terms::{self, Subtract};
use twobounce::output::file;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::RenderOptions;
use twobounce::scene::analytic;
use twobounce::settings::Settings;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, size};
use super::interrupt;
use super::lab::{Experiment, Pages, Runner};
use super::progress::watch;
use super::reference::{cache, traced};

#[derive(Args, Debug)]
pub struct LedgerArgs {
    /// The scene to measure on
    #[arg(value_name = "SCENE", default_value = "assets/gallery.glb")]
    pub scene: PathBuf,
    /// The method of the ledger: cones, lpv or photons
    #[arg(long, value_name = "METHOD", default_value = "cones", value_parser = method)]
    pub method: Method,
    /// The page to write [default: docs/notes/ledger.md, docs/notes/lpv.md or docs/notes/photons.md]
    #[arg(short, long, value_name = "OUT.md")]
    pub output: Option<PathBuf>,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: (u32, u32),
    #[command(flatten)]
    pub device: DeviceArgs,
}

fn method(text: &str) -> std::result::Result<Method, String> {
    let mut methods = LEDGERS.iter().map(|ledger| ledger.method);
    methods.clone().find(|method| method.name() == text).ok_or_else(|| {
        let names: Vec<&str> = methods.by_ref().map(Method::name).collect();
        format!("these methods have a ledger: {}", names.join(", "))
    })
}

/// Edge of the grid on which changes are measured; D19's numbers are for it.
const EDGE: u32 = 32;
/// Edge of the grid of the table `fills`, and the noise of its references as a share.
const FILL_EDGE: u32 = 64;
const FILL_NOISE: f64 = 0.025;
/// Side in pixels of a furnace's image, in which every pixel should be equal.
const FURNACE_PIXELS: u32 = 48;

pub fn run(args: &LedgerArgs) -> anyhow::Result<ExitCode> {
    interrupt::install()?;
    let ledger = LEDGERS.iter().find(|ledger| ledger.method == args.method).expect("the flag takes no other method");
    let output = args.output.clone().unwrap_or_else(|| ledger.page.into());
    file::check_writable(&output)?;
    // A page that was edited since the program was built keeps its edits.
    let page = std::fs::read_to_string(&output).unwrap_or_else(|_| ledger.text.to_owned());
    let lines = lines(&page).map_err(|error| Error::file(&output, error.to_string()))?;
    let base = Settings { voxels: EDGE, ..Settings::preset(ledger.preset)? };
    let context = args.device.open(args.size)?;
    let specimen = Specimen::load(&args.scene)?;
    let (name, (width, height)) = (&specimen.scene.name, args.size);
    let about =
        format!("Measured on `{name}` at {width}×{height}, {EDGE}³ voxels, on {} ({}).", context.name, context.driver);
    let page = table::fill(&page, |name, text| Ok(if name == "device" { about.clone() } else { text.to_owned() }))?;
    let (made, results) = (BTreeMap::new(), BTreeMap::new());
    let mut rows = LedgerRows { specimen, base, size: args.size, made, lines, results, page, output };
    let runner = Runner { device: &args.device, size: args.size, budget: None };
    runner.run(&mut rows, context, &mut Pages::default())?;
    interrupt::check()?;
    rows.write(false)?;
    Ok(ExitCode::SUCCESS)
}

/// The rows of a page.
struct LedgerRows {
    specimen: Specimen,
    base: Settings,
    size: (u32, u32),
    /// Images of the scene under many settings, each rendered once.
    made: BTreeMap<String, LinearPixels>,
    lines: Vec<Line>,
    /// Results by the indices of lines in the page.
    results: BTreeMap<usize, Vec<String>>,
    page: String,
    output: PathBuf,
}

impl Experiment for LedgerRows {
    fn len(&self) -> usize {
        self.lines.len()
    }

    fn is_measured(&self, row: usize) -> bool {
        self.results.contains_key(&self.lines[row].at)
    }

    fn name(&self, row: usize) -> String {
        self.lines[row].name.clone()
    }

    fn measure(&mut self, row: usize, context: &Arc<Context>, _: &dyn Fn() -> Result<()>) -> Result<()> {
        let line = self.lines[row].clone();
        let results = match &line.job {
            Comparison::Change { printed, right } => self.change(context, right, printed)?,
            Comparison::Fill { settings, scenes } => {
                let of_scene = |scene| fill(context, &format!("assets/{scene}.glb"), settings, self.size);
                scenes.iter().map(of_scene).collect::<Result<_>>()?
            }
            Comparison::Furnace { settings, albedo, block, edges } => {
                let room = Specimen::new(analytic::furnace(*albedo, 1.0, *block));
                edges.iter().map(|edge| furnace(context, &room, settings, *albedo, *edge)).collect::<Result<_>>()?
            }
        };
        self.results.insert(line.at, results);
        Ok(())
    }

    fn keep_failure(&mut self, row: usize, error: Error) -> Result<()> {
        Err(Error::Usage(format!("{}: {error}", self.lines[row].name)))
    }

    fn line(&self, row: usize) -> Option<String> {
        let line = &self.lines[row];
        Some(format!("{}: {}", line.name, self.results.get(&line.at)?.join(", ")))
    }

    fn write(&mut self, running: bool) -> Result<()> {
        if running {
            return Ok(()); // the page names one device, so it is written as a whole
        }
        let page = with_results(&self.page, |at| self.results.get(&at).map(Vec::as_slice));
        file::write(&self.output, page.as_bytes())
    }
}

type LinearPixels = Vec<[f32; 3]>;

impl LedgerRows {
    /// How much `printed` changes the image with `right`, and the ratio of their brightness.
    fn change(&mut self, context: &Arc<Context>, right: &[String], printed: &[String]) -> Result<Vec<String>> {
        let before = self.image(context, &[right, printed].concat())?;
        let after = self.image(context, right)?;
        let sum = |image: &LinearPixels| image.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
        let pairs = before.iter().flatten().zip(after.iter().flatten());
        let difference: f64 = pairs.map(|(a, b)| f64::from((a - b).abs())).sum();
        let (rel_percent, energy) = (100.0 * difference / sum(&after), sum(&before) / sum(&after));
        Ok(vec![format!("{rel_percent:.2} %"), format!("{energy:.3}")])
    }

    fn image(&mut self, context: &Arc<Context>, assignments: &[String]) -> Result<LinearPixels> {
        let key = assignments.join(" ");
        if let Some(image) = self.made.get(&key) {
            return Ok(image.clone());
        }
        let (mut settings, mut specimen) = (self.base.clone(), self.specimen.clone());
        for assignment in assignments {
            // The sky belongs to the scene, and is not a setting.
            match assignment.strip_prefix("sky=") {
                Some(sky) => {
                    let sky = sky.parse().map_err(|_| Error::Usage(format!("no sky: {sky}")))?;
                    specimen.scene.sky = Vec3::splat(sky);
                }
                None => settings.set(assignment)?,
            }
        }
        let image = render(context, &specimen, &settings, specimen.options(self.size))?.beauty().to_vec();
        self.made.insert(key, image.clone());
        Ok(image)
    }
}

fn render(context: &Arc<Context>, specimen: &Specimen, settings: &Settings, options: RenderOptions) -> Result<Layers> {
    interrupt::check()?;
    specimen.rendered(context, settings, RenderOptions { watch: Some(watch()), ..options })
}

/// Error and energy of the indirect light on a scene's diffuse surfaces, on equal terms.
fn fill(context: &Arc<Context>, path: &str, assignments: &[String], size: (u32, u32)) -> Result<String> {
    let specimen = Specimen::load(path)?;
    let (stop, (width, height)) = (Stop::Noise(FILL_NOISE), size);
    let options = Options { width, height, depth: Depth::Bounces(2), stop, seed: 0, occlusion: false };
    let (film, _) = traced(&cache(), specimen.still(), &options)?;
    let mut settings = terms::on_equal_terms(&Settings { voxels: FILL_EDGE, ..Settings::corrected() });
    assignments.iter().try_for_each(|assignment| settings.set(assignment))?;
    let options = RenderOptions { aovs: vec![Aov::Direct], ..specimen.options(size) };
    let image = render(context, &specimen, &settings, options)?;
    let truth = film.layers(&[Aov::Direct, Aov::Diffuse]);
    let metrics = compare(&image, &truth, Subtract::in_scene(&specimen.scene))?.indirect_diffuse;
    let none = || Error::Usage(format!("{path}: no diffuse surface is lit"));
    let Metrics { rel, energy, .. } = metrics.ok_or_else(none)?;
    Ok(format!("{rel:.3}, {energy:.3}"))
}

/// The mean over a furnace's pixels, the darkest and the brightest one, all divided by the exact value.
fn furnace(context: &Arc<Context>, room: &Specimen, fill: &[String], albedo: f32, edge: u32) -> Result<String> {
    let mut settings = Settings { voxels: edge, ..Settings::corrected() };
    fill.iter().try_for_each(|assignment| settings.set(assignment))?;
    let image = render(context, room, &settings, room.options((FURNACE_PIXELS, FURNACE_PIXELS)))?;
    // Every bounce multiplies the previous light by the albedo and adds it.
    let expected: f64 = (0..=2).map(|bounce| f64::from(albedo).powi(bounce)).sum();
    let ratios: Vec<f64> = image.beauty().iter().map(|p| f64::from(p[1]) / expected).collect();
    let (least, most) = ratios.iter().fold((f64::INFINITY, 0.0f64), |(a, b), &v| (a.min(v), b.max(v)));
    Ok(format!("{:.3} ({least:.3} … {most:.3})", ratios.iter().sum::<f64>() / ratios.len() as f64))
}
