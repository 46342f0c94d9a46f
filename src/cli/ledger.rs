//! `twobounce ledger`: measures every row of a method's ledger and writes its page.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::ExitCode;
use std::rc::Rc;
use std::sync::Arc;

use clap::Args;
use glam::Vec3;
use twobounce::gi::Method;
use twobounce::gi::cones::ledger::page::{FillError, Furnace, Measurements, document, fill_column, furnace_row};
use twobounce::gi::cones::ledger::{
    CHOICES, EDGE, FILL_EDGE, FILL_NOISE, FILL_SCENES, FILL_SETTINGS, FURNACE_EDGES, FURNACE_FILLS, FURNACE_ROOMS,
    OPEN, ROWS,
};
use twobounce::gi::ledger::{Change, Effect, Measured, SHEETS};
use twobounce::layers::Aov;
use twobounce::measure::metrics::{Metrics, compare};
use twobounce::measure::terms::{self, Subtract};
use twobounce::output::file;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::renderer::{RenderOptions, Renderer};
use twobounce::scene::{LoadOptions, Scene, Still, View, analytic};
use twobounce::settings::Settings;
use twobounce::vk::Context;
use twobounce::{Error, Result};

use super::args::{DeviceArgs, size};
use super::progress::watch;
use super::reference::{cache, traced};
use super::{interrupt, out};

#[derive(Args, Debug)]
pub struct LedgerArgs {
    /// The scene to measure on
    #[arg(value_name = "SCENE", default_value = "assets/gallery.glb")]
    pub scene: PathBuf,
    /// The method whose source is measured: cones, lpv or photons
    #[arg(long, value_name = "METHOD", default_value = "cones", value_parser = method)]
    pub method: Method,
    /// The page to write [default: docs/ledger.md, docs/lpv.md or docs/photons.md]
    #[arg(short, long, value_name = "OUT.md")]
    pub output: Option<PathBuf>,
    /// Size of the images in pixels
    #[arg(long, value_name = "WxH", default_value = "128x128", value_parser = size)]
    pub size: (u32, u32),
    #[command(flatten)]
    pub device: DeviceArgs,
}

fn method(text: &str) -> std::result::Result<Method, String> {
    let with_ledger =
        |method: &&Method| SHEETS.iter().any(|sheet| sheet.method == **method) || **method == Method::Cones;
    let methods: Vec<Method> = Method::ALL.iter().filter(with_ledger).copied().collect();
    methods.iter().find(|method| method.name() == text).copied().ok_or_else(|| {
        format!("a ledger have {}", methods.iter().map(|method| method.name()).collect::<Vec<_>>().join(", "))
    })
}

/// Pixels a side of a furnace's image: every pixel should be the same.
const FURNACE_PIXELS: u32 = 48;

pub fn run(args: &LedgerArgs) -> anyhow::Result<ExitCode> {
    interrupt::install()?;
    let sheet = SHEETS.iter().find(|sheet| sheet.method == args.method);
    let (preset, page) = sheet.map_or(("corrected", "docs/ledger.md"), |sheet| (sheet.preset, sheet.page));
    let output = args.output.clone().unwrap_or_else(|| page.into());
    file::check_writable(&output)?;
    let base = Settings { voxels: EDGE, ..Settings::preset(preset)? };
    let context = args.device.open(args.size)?;
    let scene = Scene::load(&args.scene, &LoadOptions::default())?;
    let about = format!(
        "Measured on `{}` at {}×{}, {}³ voxels, on {} ({}).",
        scene.name, args.size.0, args.size.1, EDGE, context.name, context.driver
    );
    let mut renders = Renders { context: &context, scene, base, size: args.size, made: BTreeMap::new() };
    if let Some(sheet) = sheet {
        let mut measured = Measured { about, ..Measured::default() };
        for row in sheet.rows {
            if let Effect::Measured { right, printed } = row.effect {
                out::warn(row.id);
                measured.changes.insert(row.id.into(), renders.change(right, printed)?);
            }
        }
        file::write(&output, sheet.document(&measured).as_bytes())?;
        return Ok(ExitCode::SUCCESS);
    }
    let mut measured = Measurements { about, ..Measurements::default() };
    for row in ROWS.iter().chain(OPEN) {
        if let Effect::Measured { right, printed } = row.effect {
            out::warn(row.id);
            measured.changes.insert(row.id.into(), renders.change(right, printed)?);
        }
    }
    for choice in CHOICES {
        out::warn(choice);
        measured.changes.insert((*choice).into(), renders.change(&[], &[choice])?);
    }
    for path in FILL_SCENES {
        out::warn(path);
        measured.fills.insert(fill_column(path).into(), fills(&context, path, args.size)?);
    }
    for (fill, settings) in FURNACE_FILLS {
        for &room in FURNACE_ROOMS {
            let row = furnace_row(fill, room.0, room.1);
            out::warn(&row);
            let at = |edge: &u32| furnace(&context, settings, room, *edge);
            measured.furnaces.insert(row, FURNACE_EDGES.iter().map(at).collect::<Result<_>>()?);
        }
    }
    file::write(&output, document(&measured).as_bytes())?;
    Ok(ExitCode::SUCCESS)
}

type Pixels = Vec<[f32; 3]>;

/// One scene under many settings; each is rendered once.
struct Renders<'a> {
    context: &'a Arc<Context>,
    scene: Scene,
    base: Settings,
    size: (u32, u32),
    made: BTreeMap<String, Rc<Pixels>>,
}

impl Renders<'_> {
    /// What `printed` changes on top of `right`.
    fn change(&mut self, right: &[&str], printed: &[&str]) -> Result<Change> {
        let before = self.image(&[right, printed].concat())?;
        let after = self.image(right)?;
        let sum = |image: &Pixels| image.iter().flatten().map(|v| f64::from(*v)).sum::<f64>();
        let pairs = before.iter().flatten().zip(after.iter().flatten());
        let difference: f64 = pairs.map(|(a, b)| f64::from((a - b).abs())).sum();
        Ok(Change { rel_percent: 100.0 * difference / sum(&after), energy: sum(&before) / sum(&after) })
    }

    fn image(&mut self, assignments: &[&str]) -> Result<Rc<Pixels>> {
        let key = assignments.join(" ");
        if let Some(image) = self.made.get(&key) {
            return Ok(image.clone());
        }
        let mut settings = self.base.clone();
        let mut scene = self.scene.clone();
        for assignment in assignments {
            // The sky is the scene's, not a setting.
            match assignment.strip_prefix("sky=") {
                Some(sky) => scene.sky = Vec3::splat(sky.parse().map_err(|_| Error::Usage(format!("no sky: {sky}")))?),
                None => settings.set(assignment)?,
            }
        }
        let image = Rc::new(render(self.context, scene, settings, self.size)?);
        self.made.insert(key, image.clone());
        Ok(image)
    }
}

fn render(context: &Arc<Context>, scene: Scene, settings: Settings, size: (u32, u32)) -> Result<Pixels> {
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let view = if scene.cameras.is_empty() { View::framing(bounds) } else { scene.view(&pose, 0) };
    let mut renderer = Renderer::new(
        context,
        scene,
        &pose,
        settings,
        RenderOptions { watch: Some(watch()), ..RenderOptions::new(size, bounds) },
    )?;
    interrupt::check()?;
    renderer.render(&pose, &view)?;
    Ok(renderer.read().beauty().to_vec())
}

/// Errors of [`FILL_SETTINGS`] on a scene, on equal terms.
fn fills(context: &Arc<Context>, path: &str, (width, height): (u32, u32)) -> Result<Vec<FillError>> {
    let scene = Scene::load(path.as_ref(), &LoadOptions::default())?;
    let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
    let view = scene.view(&pose, 0);
    let stop = Stop::Noise(FILL_NOISE);
    let options = Options { width, height, depth: Depth::Bounces(2), stop, seed: 0, occlusion: false };
    let (film, _) = traced(&cache(), Still::new(&scene, &pose, &view), &options)?;
    let truth = film.layers(&[Aov::Direct, Aov::Diffuse]);
    let error = |assignments: &&[&str]| {
        let mut settings = terms::on_equal_terms(&Settings { voxels: FILL_EDGE, ..Settings::corrected() });
        assignments.iter().try_for_each(|assignment| settings.set(assignment))?;
        let options = RenderOptions { aovs: vec![Aov::Direct], ..RenderOptions::new((width, height), bounds) };
        let mut renderer = Renderer::new(context, scene.clone(), &pose, settings, options)?;
        interrupt::check()?;
        renderer.render(&pose, &view)?;
        let metrics = compare(&renderer.read(), &truth, Subtract::in_scene(&scene))?.indirect_diffuse;
        let Metrics { rel, energy, .. } =
            metrics.ok_or_else(|| Error::Usage(format!("{path}: no diffuse surface is lit")))?;
        Ok(FillError { rel, energy })
    };
    FILL_SETTINGS.iter().map(error).collect()
}

fn furnace(context: &Arc<Context>, fill: &[&str], (albedo, block): (f32, bool), edge: u32) -> Result<Furnace> {
    let mut settings = Settings { voxels: edge, ..Settings::corrected() };
    fill.iter().try_for_each(|assignment| settings.set(assignment))?;
    let size = (FURNACE_PIXELS, FURNACE_PIXELS);
    let shot = render(context, analytic::furnace(albedo, 1.0, block), settings, size)?;
    // Every bounce adds the albedo of what came before.
    let expected: f64 = (0..=2).map(|bounce| f64::from(albedo).powi(bounce)).sum();
    let ratios: Vec<f64> = shot.iter().map(|p| f64::from(p[1]) / expected).collect();
    Ok(Furnace {
        mean: ratios.iter().sum::<f64>() / ratios.len() as f64,
        range: [ratios.iter().copied().fold(f64::INFINITY, f64::min), ratios.iter().copied().fold(0.0, f64::max)],
    })
}
