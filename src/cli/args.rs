//! Arguments of several commands, with the range of each value. A command's own arguments are in its file.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};
use glam::DVec3;
use twobounce::gi::Method;
use twobounce::layers::Aov;
use twobounce::renderer::Submit;
use twobounce::settings::PRESETS;
use twobounce::stage::{MAX_SIDE, Sky, Stage, Viewpoint, When};

/// A scene and its view.
#[derive(Args, Clone, Debug)]
pub struct SceneArgs {
    /// The scene: glTF 2.0, .gltf or .glb; - is standard input, demo: the scene of twobounce demo
    #[arg(value_name = "SCENE")]
    pub path: PathBuf,
    /// Size of the image in pixels
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = size)]
    pub size: (u32, u32),
    /// The camera of the file, by name or index; by default its first one, or a camera that frames the scene
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
    /// The scene of the file, by name or index; by default the one that the file names
    #[arg(long, value_name = "NAME|INDEX")]
    pub scene: Option<String>,
    /// One more folder from which the scene may read buffers and textures, in addition to the folder of its file
    #[arg(long, value_name = "DIR")]
    pub assets: Option<PathBuf>,
    /// The animation to play, by name or index, or all; by default the first one
    #[arg(long, value_name = "NAME|INDEX|all")]
    pub animation: Option<String>,
    /// The time within the animation, in seconds
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| n >= 0.0, "write seconds, finite and at least 0"))]
    pub time: f64,
    /// Whether the animation repeats; otherwise its last state stays
    #[arg(long = "loop", value_name = "WHETHER", value_enum, default_value_t = Loop::Off)]
    pub repeats: Loop,
    #[command(flatten)]
    pub sky: SkyArgs,
    /// Halve larger textures until they have at most this many texels a side
    #[arg(long, value_name = "TEXELS", value_parser = clap::value_parser!(u32).range(1..))]
    pub max_texture: Option<u32>,
    /// Refuse a scene if a texture or a required extension would be left out
    #[arg(long)]
    pub strict: bool,
    /// Add the light of a studio, softboxes and a directional light; `auto`: if the scene has no light, no sky and too
    /// little emission
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = named(When::ALL, When::name))]
    pub default_light: When,
    /// Add a grey ground below the scene; `auto`: with the default light, if the camera is above it
    #[arg(long, value_name = "WHEN", default_value = "auto", value_parser = named(When::ALL, When::name))]
    pub ground: When,
}

/// The sky, which is visible and lights the scene.
#[derive(Args, Clone, Debug)]
pub struct SkyArgs {
    /// The sky: a uniform radiance, or an equirectangular map, an .hdr or an .exr
    #[arg(long, value_name = "R,G,B|FILE", default_value = "0,0,0", value_parser = sky_of, allow_hyphen_values = true)]
    pub sky: Sky,
    /// A factor of the sky's radiance
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|n| (0.0..=1e30).contains(&n), "write a factor, finite and at least 0"))]
    pub sky_intensity: f64,
    /// Rotation of the sky's map in degrees, counter-clockwise seen from above; without rotation its middle is towards
    /// +X
    #[arg(long, value_name = "DEGREES", default_value_t = 0.0, allow_negative_numbers = true)]
    #[arg(value_parser = number(|_| true, "write degrees, a finite number"))]
    pub sky_rotation: f64,
}

impl SceneArgs {
    /// The stage that the flags describe.
    pub fn stage(&self) -> Stage {
        let viewpoint = match (self.eye, self.target, &self.camera) {
            (Some(eye), Some(target), _) => Viewpoint::LookAt { eye, target, up: self.up },
            (_, _, Some(name)) => Viewpoint::OfFile(name.clone()),
            _ => Viewpoint::Auto,
        };
        Stage {
            viewpoint,
            fov_degrees: self.fov,
            animation: self.animation.clone(),
            time_s: self.time,
            repeats: self.repeats == Loop::On,
            sky: self.sky.sky.clone(),
            sky_intensity: self.sky.sky_intensity,
            sky_rotation_degrees: self.sky.sky_rotation,
            max_texture: self.max_texture,
            default_light: self.default_light,
            ground: self.ground,
        }
    }

    /// The file of the sky's map.
    pub fn sky_map(&self) -> Option<&PathBuf> {
        self.sky.sky.map()
    }
}

/// The state after an animation's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Loop {
    On,
    Off,
}

/// The sources of settings. Later ones win: preset, then file, then method, then single keys.
#[derive(Args, Clone, Debug)]
pub struct SettingsArgs {
    /// The preset from which the settings start
    #[arg(long, value_name = "NAME", default_value = PRESETS[0].name)]
    pub preset: String,
    /// A TOML file with keys that replace those of the preset
    #[arg(long, value_name = "FILE.toml")]
    pub config: Option<PathBuf>,
    /// The method, as --set method=NAME; it replaces that of the preset and the file
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(Method::ALL.iter().map(|m| m.name())))]
    pub method: Option<String>,
    /// A setting, applied last and in the order given; `twobounce settings` lists the keys
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
}

/// The submission of frames to a device.
#[derive(Args, Clone, Debug)]
pub struct RunArgs {
    /// The amount of work per submission to the device; `pass` also times each pass by the CPU's clock
    #[arg(long, default_value = "short", value_parser = submit())]
    pub submit: Submit,
    /// Also time each level of mips and each step of propagation
    #[arg(long)]
    pub steps: bool,
    /// Use no more device memory than this
    #[arg(long, value_name = "SIZE", value_parser = memory_size)]
    pub memory_limit: Option<u64>,
    #[command(flatten)]
    pub device: DeviceArgs,
}

/// The device and its use.
#[derive(Args, Clone, Debug)]
pub struct DeviceArgs {
    /// The device to use; `twobounce info` lists them. TWOBOUNCE_DEVICE does the same
    #[arg(long, value_name = "NAME|INDEX")]
    pub device: Option<String>,
    /// Run with Vulkan's validation layers; any of their messages is an error
    #[arg(long)]
    pub validation: bool,
}

/// The numbers of the frames of an animation.
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

pub fn frames(text: &str) -> Result<Frames, &'static str> {
    let read = || {
        let Some((first, rest)) = text.split_once('-') else {
            let count = text.parse::<u32>().ok()?;
            return Some(Frames { first: 0, last: count.checked_sub(1)?, step: 1 });
        };
        let (last, step) = rest.split_once(':').unwrap_or((rest, "1"));
        let (first, last, step) = (first.parse().ok()?, last.parse().ok()?, step.parse().ok()?);
        (first <= last && last < u32::MAX && step > 0).then_some(Frames { first, last, step })
    };
    read().ok_or("write a number of frames, or the numbers of the first and the last one, such as 60, 0-59 or 0-59:2")
}

pub fn size(text: &str) -> Result<(u32, u32), String> {
    let side = |s: &str| s.parse().ok().filter(|n| (1..=MAX_SIDE).contains(n));
    text.split_once(['x', 'X'])
        .and_then(|(w, h)| Some((side(w)?, side(h)?)))
        .ok_or_else(|| format!("write WIDTHxHEIGHT, each from 1 to {MAX_SIDE}, such as 1280x720"))
}

fn sky_of(text: &str) -> Result<Sky, &'static str> {
    let path = Path::new(text);
    if path.extension().is_some_and(|ending| ["hdr", "exr"].iter().any(|known| ending.eq_ignore_ascii_case(known))) {
        return Ok(Sky::Map(path.to_owned()));
    }
    let color = point(text).ok().map(|color| color.as_vec3()).filter(|c| c.is_finite() && c.min_element() >= 0.0);
    color.map(Sky::Even).ok_or(
        "write red,green,blue, each finite and at least 0, such as 0.2,0.3,0.5, or the name of a map that ends in .hdr or .exr",
    )
}

pub fn point(text: &str) -> Result<DVec3, &'static str> {
    let write = "write three finite numbers separated by commas, such as 0,1.5,-3";
    let values = text.split(',').map(|s| number(|_| true, write)(s.trim())).collect::<Result<Vec<_>, _>>()?;
    values.try_into().map(DVec3::from_array).map_err(|_| write)
}

/// Parses a finite number in a range; `write` describes the valid values.
pub fn number(
    fits: fn(f64) -> bool,
    write: &'static str,
) -> impl Fn(&str) -> Result<f64, &'static str> + Clone + Send + Sync {
    move |text| text.parse().ok().filter(|n: &f64| n.is_finite() && fits(*n)).ok_or(write)
}

/// Parses a percentage as a share.
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

/// One of `all` by its name.
pub fn named<T>(all: &[T], name: fn(T) -> &'static str) -> impl TypedValueParser<Value = T> + use<T>
where
    T: Copy + Send + Sync + 'static,
{
    let all = all.to_vec();
    PossibleValuesParser::new(all.iter().map(|one| name(*one)))
        .try_map(move |text| all.iter().copied().find(|one| name(*one) == text).ok_or("no such name"))
}

pub fn aov() -> impl TypedValueParser<Value = Aov> {
    let further = Aov::ALL.iter().copied().filter(|aov| !matches!(aov, Aov::Beauty | Aov::Alpha));
    named(&further.collect::<Vec<_>>(), Aov::name)
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
