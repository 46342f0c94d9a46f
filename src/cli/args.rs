//! The command line as types, each value within its range.

use std::path::PathBuf;
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, Parser, Subcommand, ValueEnum};
use glam::DVec3;
use twobounce::gi::Method;
use twobounce::gi::ledger::SHEETS;
use twobounce::layers::Aov;
use twobounce::renderer::Submit;
use twobounce::settings::PRESETS;

use super::sky::SkyArgs;

/// Renders glTF scenes with voxel cone tracing: two bounces of indirect light in real time.
#[derive(Debug, Parser)]
#[command(version, subcommand_required = true, arg_required_else_help = true, after_help = OWN_DOCS)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

/// The commands that the list hides.
const OWN_DOCS: &str = "For this project's own pages and scenes:
  study        Run the default study and write docs/study again
  ledger       Measure what each error in the talk's listings changes, and write docs/ledger.md again
  make-assets  Write the scenes in assets/ again";

#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene to an image
    Render(RenderArgs),
    /// Look at a scene in a window
    #[cfg(feature = "window")]
    View(Box<super::view::ViewArgs>),
    /// Play a sequence with everything that moves: in a window, to images, or as a benchmark
    Demo(Box<super::demo::DemoArgs>),
    /// Path-trace a reference image on the CPU
    Reference(super::reference::ReferenceArgs),
    /// Compare an image with its reference
    Compare(super::compare::CompareArgs),
    /// Find the cheapest settings that hold limits on error, time or memory, by measuring
    Plan(Box<super::plan::PlanArgs>),
    /// Chart error against time over many settings: a page, an SVG and rows
    Chart(super::chart::ChartArgs),
    /// Measure where methods fail: leaks, flicker, lost light and more, each a number with an ideal
    Stability(super::stability::StabilityArgs),
    /// Put together what several machines made: charts, rows of stability, films of references
    Merge(super::merge::MergeArgs),
    /// Measure what each pass of a frame costs, per voxel, pixel and cone step, and how that grows
    Profile(super::profile::ProfileArgs),
    /// List every setting, or print the settings that flags add up to
    Settings(SettingsCommandArgs),
    /// List the Vulkan devices, what twobounce needs of them, and what they lack
    Info(InfoArgs),
    /// Print what a shell completes: bash, zsh, fish, elvish, powershell
    Completions(super::completions::CompletionsArgs),
    /// Print the manual page, or write a page per command
    Man(super::man::ManArgs),
    /// Run the default study and write docs/study again
    #[command(hide = true)]
    Study(super::study::StudyArgs),
    /// Measure what each error in the talk's listings changes, and write docs/ledger.md again
    #[command(hide = true)]
    Ledger(LedgerArgs),
    /// Write the scenes in assets/ again
    #[command(hide = true)]
    MakeAssets(MakeAssetsArgs),
}

/// A scene and how to look at it.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// The scene: glTF 2.0, .gltf or .glb; - is standard input, demo: the scene of twobounce demo
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: (u32, u32),
    /// The file's camera to look through; by default its first, or one that frames the scene
    #[arg(long, value_name = "NAME|INDEX", conflicts_with = "eye")]
    pub camera: Option<String>,
    /// Look from this point, in metres
    #[arg(long, value_name = "X,Y,Z", requires = "target", value_parser = point, allow_hyphen_values = true)]
    pub eye: Option<DVec3>,
    /// Look at this point, in metres
    #[arg(long, value_name = "X,Y,Z", requires = "eye", value_parser = point, allow_hyphen_values = true)]
    pub target: Option<DVec3>,
    /// The up direction for --eye
    #[arg(long, value_name = "X,Y,Z", requires = "eye", default_value = "0,1,0", value_parser = point, allow_hyphen_values = true)]
    pub up: DVec3,
    /// Vertical field of view, in degrees [default: 45, or that of the file's camera]
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n > 0.0 && n < 180.0, "write degrees between 0 and 180"))]
    pub fov: Option<f64>,
    /// The file's scene to load; by default the one that the file names
    #[arg(long, value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// Let the scene read buffers and textures of this folder too; else it reads files of its own folder alone
    #[arg(long, value_name = "DIR")]
    pub assets: Option<PathBuf>,
    /// The animation to play, or all at once; by default the first
    #[arg(long, value_name = "NAME|INDEX|all")]
    pub animation: Option<String>,
    /// The time within the animation, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n >= 0.0, "write seconds, finite and at least 0"))]
    pub time: f64,
    /// Whether an animation begins anew when it ends; else it stays as it ended
    #[arg(long = "loop", value_name = "WHETHER", value_enum, default_value_t = Loop::Off)]
    pub repeats: Loop,
    #[command(flatten)]
    pub sky: SkyArgs,
    /// Scale textures down to at most this many texels a side, by halves
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_texture: Option<u32>,
    /// Refuse a scene of which a texture or a required extension would be left out
    #[arg(long)]
    pub strict: bool,
    /// Add a sky and a directional light: `auto` where the scene has no light and no sky and does not light itself
    #[arg(long, value_name = "WHEN", value_enum, default_value_t = DefaultLight::Auto)]
    pub default_light: DefaultLight,
}

/// What comes after an animation's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Loop {
    On,
    Off,
}

/// When light is added that the file does not have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum DefaultLight {
    On,
    Off,
    Auto,
}

/// Where the settings come from. Later ones win: preset, then file, then method, then single keys.
#[derive(Args, Clone, Debug)]
pub struct SettingsArgs {
    /// Start from this preset
    #[arg(long, value_name = "NAME", default_value = PRESETS[0].name)]
    pub preset: String,
    /// Then take the keys of this TOML file
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// Then choose the method: as --set method=NAME
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Method::ALL.iter().map(|m| m.name())))]
    pub method: Option<String>,
    /// Then set single keys, in the order given; `twobounce settings` lists them
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
}

/// How frames are handed to a device.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// What is submitted to the device at once; `pass` also times each pass by the CPU's clock
    #[arg(long, default_value = "short", value_parser = submit())]
    pub submit: Submit,
    /// Use no more device memory than this
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// Which device to use and how.
#[derive(Args, Clone, Debug)]
pub struct DeviceArgs {
    /// The device to use; `twobounce info` lists them. TWOBOUNCE_DEVICE does the same
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Run with Vulkan's validation layers and fail on any of their messages
    #[arg(long)]
    pub validation: bool,
}

#[derive(Args, Debug)]
pub struct RenderArgs {
    #[command(flatten)]
    pub scene: SceneArgs,
    /// The image to write: .png (exposed, tone-mapped) or .exr (linear radiance); - is standard output, a .png or, with --aov,
    /// an .exr
    #[arg(short, long, value_name = "OUT.png|OUT.exr")]
    pub output: PathBuf,
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Further layers of an .exr, separated by commas
    #[arg(long, value_name = "LAYER,…", value_delimiter = ',', value_parser = aov())]
    pub aov: Vec<Aov>,
    /// Make pixels transparent that no surface covers; the sky lights all the same
    #[arg(long)]
    pub transparent: bool,
    /// Exposure of a .png in stops: radiance is multiplied by 2^EV [default: automatic, and printed]
    #[arg(long, value_name = "EV", allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n.abs() <= 60.0, "write stops between -60 and 60"))]
    pub exposure: Option<f64>,
    /// Warm up, then render the same image N times from scratch, time each, and write the last
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "frames", value_parser = clap::value_parser!(u32).range(1..))]
    pub repeat: u32,
    /// With --repeat, reuse what did not change since the last frame, as an animation does
    #[arg(long)]
    pub still: bool,
    /// Render N frames of the animation, or those with these numbers, from 0 on, every STEP-th; the output is a pattern such as
    /// out_%04d.png
    #[arg(long, value_name = "N|A-B[:STEP]", value_parser = frames)]
    pub frames: Option<Frames>,
    /// Print the N commands that share the frames, a line each, and do nothing
    #[arg(long, value_name = "N", requires = "frames", value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub list: Option<u32>,
    /// Frames per second for --frames
    #[arg(long, value_name = "F", requires = "frames", default_value_t = 30.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n > 0.0, "write frames per second, finite and above 0"))]
    pub fps: f64,
    /// How fast --frames plays the animation; backward below 0
    #[arg(long, value_name = "FACTOR", requires = "frames", default_value_t = 1.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n != 0.0, "write a factor, finite and not 0"))]
    pub speed: f64,
    /// Print what each pass took, and what memory is taken
    #[arg(long)]
    pub timings: bool,
    /// Print what memory is taken
    #[arg(short, long)]
    pub verbose: bool,
    /// Print nothing but notes and errors
    #[arg(short, long, conflicts_with_all = ["verbose", "timings"])]
    pub quiet: bool,
    /// Write timings, counters and memory as JSON; - is standard output
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Write a Chrome trace (Perfetto opens it)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    #[command(flatten)]
    pub run: RunArgs,
}

#[derive(Args, Debug)]
pub struct MakeAssetsArgs {
    /// The folder to write into; made where it is missing
    #[arg(value_name = "DIR", default_value = "assets")]
    pub dir: PathBuf,
}

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

#[derive(Args, Debug)]
pub struct SettingsCommandArgs {
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Show every setting, also the ledger and the talk's variants
    #[arg(long)]
    pub all: bool,
    /// Print the list as a Markdown page
    #[arg(long, conflicts_with = "toml")]
    pub markdown: bool,
    /// Print the effective settings as a file for --config
    #[arg(long)]
    pub toml: bool,
}

#[derive(Args, Debug)]
pub struct InfoArgs {
    /// Print JSON; sizes in bytes
    #[arg(long)]
    pub json: bool,
}

/// Frames of an animation by their numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frames {
    pub first: u32,
    pub last: u32,
    pub step: u32,
}

impl Frames {
    pub fn numbers(self) -> impl ExactSizeIterator<Item = u32> {
        (0..self.count()).map(move |i| self.first + i * self.step)
    }

    pub fn count(self) -> u32 {
        (self.last - self.first) / self.step + 1
    }
}

impl std::fmt::Display for Frames {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}-{}", self.first, self.last)?;
        if self.step == 1 { Ok(()) } else { write!(f, ":{}", self.step) }
    }
}

fn frames(text: &str) -> Result<Frames, &'static str> {
    let read = || {
        let Some((first, rest)) = text.split_once('-') else {
            let count = text.parse::<u32>().ok()?;
            return Some(Frames { first: 0, last: count.checked_sub(1)?, step: 1 });
        };
        let (last, step) = rest.split_once(':').unwrap_or((rest, "1"));
        let (first, last, step) = (first.parse().ok()?, last.parse().ok()?, step.parse().ok()?);
        (first <= last && last < u32::MAX && step > 0).then_some(Frames { first, last, step })
    };
    read().ok_or("write how many frames, or the numbers of the first and the last one, such as 60, 0-59 or 0-59:2")
}

/// The largest side of an image, in pixels.
pub const MAX_SIDE: u32 = 16384;

pub fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((side(w)?, side(h)?)))
        .ok_or_else(|| format!("write WIDTHxHEIGHT, each from 1 to {MAX_SIDE}, such as 1280x720"))
}

fn method(text: &str) -> Result<Method, String> {
    let with_ledger =
        |method: &&Method| SHEETS.iter().any(|sheet| sheet.method == **method) || **method == Method::Cones;
    let methods: Vec<Method> = Method::ALL.iter().filter(with_ledger).copied().collect();
    methods.iter().find(|method| method.name() == text).copied().ok_or_else(|| {
        format!("a ledger have {}", methods.iter().map(|method| method.name()).collect::<Vec<_>>().join(", "))
    })
}

pub fn point(text: &str) -> Result<DVec3, &'static str> {
    let write = "write three finite numbers separated by commas, such as 0,1.5,-3";
    let values = text.split(',').map(|s| number(|_| true, write)(s.trim())).collect::<Result<Vec<_>, _>>()?;
    values.try_into().map(DVec3::from_array).map_err(|_| write)
}

/// Reads a finite number that fits; `write` says what else to write.
pub fn number(
    fits: fn(f64) -> bool,
    write: &'static str,
) -> impl Fn(&str) -> Result<f64, &'static str> + Clone + Send + Sync {
    move |text| text.parse().ok().filter(|n: &f64| n.is_finite() && fits(*n)).ok_or(write)
}

/// A percentage, as a share.
pub fn percent(text: &str) -> Result<f64, &'static str> {
    number(|n| n > 0.0, "write a percentage above 0")(text).map(|n| n / 100.0)
}

pub fn minutes(text: &str) -> Result<Duration, &'static str> {
    let write = "write a number of minutes above 0";
    let duration = Duration::try_from_secs_f64(60.0 * number(|n| n > 0.0, write)(text)?).ok();
    duration.filter(|d| !d.is_zero()).ok_or(write)
}

/// A duration such as 90s, 5min or 1h; a number alone is seconds.
pub fn budget(text: &str) -> Result<Duration, &'static str> {
    let write = "write a time above 0, such as 60s, 5min or 1h";
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match &text[digits.len()..] {
        "" | "s" => 1.0,
        "m" | "min" => 60.0,
        "h" => 3600.0,
        _ => return Err(write),
    };
    let duration = Duration::try_from_secs_f64(unit * number(|n| n > 0.0, write)(digits.trim())?).ok();
    duration.filter(|d| !d.is_zero()).ok_or(write)
}

pub fn memory_size(text: &str) -> Result<u64, String> {
    let digits = text.trim_end_matches(|c: char| c.is_ascii_alphabetic());
    let unit = match text[digits.len()..].to_ascii_lowercase().as_str() {
        "kib" | "k" => 10,
        "mib" | "m" => 20,
        "gib" | "g" => 30,
        _ => 64,
    };
    let bytes = digits.trim().parse::<f64>().ok().map(|n| n * f64::exp2(f64::from(unit)));
    bytes
        .filter(|b| unit < 64 && *b >= 1.0 && *b < f64::exp2(63.0))
        .map(|b| b as u64)
        .ok_or_else(|| "write a size with its unit, such as 512MiB or 2GiB".into())
}

pub fn aov() -> impl TypedValueParser<Value = Aov> {
    let further = || Aov::ALL.iter().filter(|aov| !matches!(aov, Aov::Beauty | Aov::Alpha));
    PossibleValuesParser::new(further().map(|aov| aov.name()))
        .try_map(move |name| further().find(|aov| aov.name() == name).copied().ok_or("no such layer"))
}

fn submit() -> impl TypedValueParser<Value = Submit> {
    let short = PossibleValue::new("short").help("What takes well below 100 ms on a GPU, a second on a CPU device");
    let frame = PossibleValue::new("frame").help("The whole frame at once");
    let pass = PossibleValue::new("pass").help("Each pass by itself");
    PossibleValuesParser::new([short, frame, pass]).map(|name| match name.as_str() {
        "pass" => Submit::PerPass,
        "frame" => Submit::Frame,
        _ => Submit::Short,
    })
}
