//! One row per setting: unit, range, and what more of it costs. Parsing, checks, lists and docs all read this table.

use super::{
    Blend, Bounces, ConeSet, DirectLight, Emitters, Fill, Form, Gather, GatherResolution, Lists, Reuse, RoughnessFit,
    ShadeDirect, ShadeItems, Shadows, Weights, Work,
};

/// What `twobounce settings` says about one setting.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// Dotted, as in `--set start.diffuse_along=1`.
    pub name: &'static str,
    pub unit: &'static str,
    pub range: Range,
    /// What it does, and the choices where there are some.
    pub meaning: &'static str,
    /// What more of it costs.
    pub cost: &'static str,
}

/// The values that a setting takes.
#[derive(Clone, Copy, Debug)]
pub enum Range {
    Bool,
    Choice(fn() -> Vec<&'static str>),
    /// The same, or `auto`.
    ChoiceOrAuto(fn() -> Vec<&'static str>),
    /// A whole number between these, both included.
    Whole(u32, u32),
    /// The same, or `auto`.
    WholeOrAuto(u32, u32),
    /// A power of two between these, both included.
    PowerOfTwo(u32, u32),
    /// One of these whole numbers.
    OneOf(&'static [u32]),
    /// A finite number between these, both included.
    Number(f64, f64),
    /// The same, or `auto`.
    NumberOrAuto(f64, f64),
    /// Three finite numbers within ± the bound, or `auto`.
    PointOrAuto(f64),
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool => f.write_str("true or false"),
            Self::Choice(names) => f.write_str(&either(&names())),
            Self::ChoiceOrAuto(names) => f.write_str(&either(&[names(), vec!["auto"]].concat())),
            Self::Whole(least, most) => write!(f, "a whole number, {least} to {most}"),
            Self::WholeOrAuto(least, most) => write!(f, "a whole number, {least} to {most}, or auto"),
            Self::PowerOfTwo(least, most) => write!(f, "a power of two, {least} to {most}"),
            Self::OneOf(values) => f.write_str(&either(&values.iter().map(u32::to_string).collect::<Vec<_>>())),
            Self::Number(least, most) => write!(f, "{}", span(*least, *most)),
            Self::NumberOrAuto(least, most) => write!(f, "{}, or auto", span(*least, *most)),
            Self::PointOrAuto(most) => write!(f, "x,y,z each within ±{most:e}, or auto"),
        }
    }
}

fn either(values: &[impl AsRef<str>]) -> String {
    match values {
        [start @ .., last] if !start.is_empty() => {
            format!("{} or {}", start.iter().map(AsRef::as_ref).collect::<Vec<_>>().join(", "), last.as_ref())
        }
        _ => values.iter().map(AsRef::as_ref).collect(),
    }
}

fn span(least: f64, most: f64) -> String {
    let short = |v: f64| if v != 0.0 && !(1e-3..1e5).contains(&v.abs()) { format!("{v:e}") } else { v.to_string() };
    format!("{} to {}", short(least), short(most))
}

macro_rules! names {
    ($choice:ident) => {
        Range::Choice(|| $choice::ALL.iter().map(|c| c.name()).collect())
    };
    ($choice:ident or auto) => {
        Range::ChoiceOrAuto(|| $choice::ALL.iter().map(|c| c.name()).collect())
    };
}

const fn key(name: &'static str, unit: &'static str, range: Range, meaning: &'static str, cost: &'static str) -> Key {
    Key { name, unit, range, meaning, cost }
}

/// A row of the ledger.
const fn row(name: &'static str, meaning: &'static str) -> Key {
    key(name, "form", names!(Form), meaning, "see docs/ledger.md")
}

/// A distance in voxels at a cone's start or end.
const fn voxels(name: &'static str, meaning: &'static str) -> Key {
    key(name, "voxels", Range::Number(0.0, 64.0), meaning, "no time; more: less self-light, less contact")
}

/// Every setting, in the order of the tree.
pub const KEYS: &[Key] = &[
    key(
        "voxels",
        "voxels per edge",
        Range::PowerOfTwo(16, 256),
        "edge of both volumes",
        "memory ×8 per doubling (32 MiB at 64, 256 at 128, 2 GiB at 256); shading and mips up to ×8, the image ×1.1–1.3",
    ),
    key(
        "gather",
        "choice",
        names!(Gather),
        "what looks along the directions of the set: cones, or exact rays that read the volume where they hit",
        "a ray walks voxels and lists; a cone of the same set samples the volume many times",
    ),
    key(
        "cones",
        "set",
        names!(ConeSet),
        "diffuse cones around the normal: the talk's five sets, and cosine-distributed ones (g)",
        "the image's time grows with the number: ×2 from 1 to 5, ×1.7 to 6, ×5.7 to 16",
    ),
    key(
        "bounces",
        "bounces",
        names!(Bounces),
        "indirect bounces; all: the last frame's second volume lights the first. A first frame repeats until one changes less than 0.1 % of the light, 32 times at most",
        "2 adds a volume and, mostly, its shading; all: both volumes gather, 2 bounces a frame",
    ),
    key(
        "fill",
        "choice",
        names!(Fill),
        "how triangles fill a voxel's targets: uniform keeps energy, facing leaks less, coverage clips exactly, sided drops dark backs",
        "coverage clips each listed triangle: more shading time",
    ),
    key(
        "weights",
        "choice",
        names!(Weights),
        "how the three facing volumes are mixed along a cone: d2, norm1 (both sum to 1), abs (brightens), extinction",
        "extinction takes three logarithms per step",
    ),
    key(
        "blend",
        "choice",
        names!(Blend),
        "how a cone's samples are composited: over, or sum (a wall's alpha adds up to 1; with fill = sided, weights = abs)",
        "sum goes on a little past the volume's border",
    ),
    key("step", "diameters", Range::Number(0.1, 4.0), "length of a cone's step", "less: longer steps are fewer"),
    key(
        "aperture",
        "factor",
        Range::Number(0.05, 4.0),
        "what the diffuse set's apertures are multiplied with",
        "less: wider cones take fewer steps",
    ),
    key(
        "exit_margin",
        "diameters",
        Range::Number(0.0, 4.0),
        "how far past the volume's border a cone with blend = sum goes on, an eighth of the volume at most",
        "a step or two per cone that leaves the volume",
    ),
    key(
        "shadows",
        "choice",
        names!(Shadows),
        "how lights are occluded: not at all, soft cones through the volume, exact rays through the triangle lists",
        "a cone or a ray per light, pixel and shaded voxel",
    ),
    key(
        "emitters",
        "choice",
        names!(Emitters),
        "how emissive surfaces light the scene: through cones, or sampled as area lights with exact shadows",
        "sampled: emitter_samples rays per pixel and shaded voxel side",
    ),
    key(
        "emitter_samples",
        "points",
        Range::Whole(1, 256),
        "points on lamps per pixel and voxel side with emitters = sampled; noise only in penumbrae, and where lamps are more",
        "a ray each",
    ),
    key(
        "lists",
        "choice",
        names!(Lists),
        "voxelise again for the second bounce, as the talk does, or reuse the first bounce's lists: the same image with shade.items=each",
        "rebuild voxelises twice",
    ),
    key(
        "shading",
        "choice",
        names!(Work),
        "how voxels are shaded: a fragment per voxel of the grid, as in the talk, or a thread per list item and one per occupied voxel: the same image with shade.items=each",
        "raster grows with the grid, cells with what stands in it, and takes 32 bytes per list item",
    ),
    key(
        "mips",
        "choice",
        names!(Work),
        "how coarser voxels are made: all of them, as in the talk, or the parents of occupied ones: the same image",
        "raster grows with the grid, cells with what stands in it",
    ),
    key(
        "reuse",
        "choice",
        names!(Reuse),
        "what is kept of the last frame: nothing, or lists and volumes while nothing that they show changes: the same image",
        "still: a frame in which only the camera moves is pass 5 alone",
    ),
    key(
        "roughness_fit",
        "choice",
        names!(RoughnessFit),
        "specular cone's half angle from roughness: polynomial 47.5°, power 41°, linear 67.5° at roughness 1; ggx: fitted to the lobe, narrow where it is smooth",
        "wider cones take fewer steps",
    ),
    key(
        "specular",
        "choice",
        names!(Gather),
        "what looks where a glossy surface mirrors: a cone, or exact rays along the lobe that read the volume where they hit",
        "a ray walks voxels and lists, a narrow cone takes a step per voxel; only where something is glossy",
    ),
    key(
        "refraction",
        "choice",
        names!(Gather),
        "what looks through glass: a cone, bent once, or rays that refract wherever glass with a thickness begins or ends",
        "a ray per interface, 8 at most; only where something transmits",
    ),
    key(
        "specular_rays",
        "rays",
        Range::Whole(1, 64),
        "rays for a rough lobe, mirrored or transmitted; a lobe that sends on a tenth of its light takes a tenth of them, a smooth one takes one",
        "a ray each",
    ),
    key(
        "first_bounce_shadows",
        "switch",
        Range::Bool,
        "shadow lights in the first bounce too; the talk does not, which makes it too bright",
        "a shadow test per light and shaded voxel of the first bounce",
    ),
    key("jitter", "switch", Range::Bool, "turn the diffuse cones per pixel: noise instead of bands", "little"),
    key(
        "shade.gather",
        "choice",
        names!(Gather or auto),
        "what the voxels of the second bounce gather with; auto: as the image",
        "as gather, per shaded voxel side",
    ),
    key(
        "shade.cones",
        "set",
        names!(ConeSet or auto),
        "diffuse set of the voxels of the second bounce; auto: as the image",
        "as cones, per shaded voxel side",
    ),
    key(
        "shade.emitter_samples",
        "points",
        Range::WholeOrAuto(1, 256),
        "points on lamps per shaded voxel side; auto: as emitter_samples",
        "as emitter_samples, per shaded voxel side",
    ),
    key(
        "shade.direct",
        "choice",
        names!(ShadeDirect),
        "where the second bounce's voxels have their direct light from; kept: from the first bounce, the same bits, where lists are reused and shadows are the same (rays in both bounces, or none)",
        "kept: 24 bytes per list item instead of a second shading of it",
    ),
    key(
        "shade.items",
        "choice",
        names!(ShadeItems),
        "which of a voxel's triangles are lit; alike: the largest of those of one material that face alike, for all of them, where shading goes through cells and lists are reused (masked and blended ones stay by themselves)",
        "alike: less to light where triangles are smaller than voxels, for a pass over the lists and 12 bytes per item",
    ),
    key(
        "volume.center",
        "metres",
        Range::PointOrAuto(1e9),
        "centre of the cube that is voxelised; auto: of the scene's bounds",
        "nothing",
    ),
    key(
        "volume.side",
        "metres",
        Range::NumberOrAuto(1e-6, 1e9),
        "side of the cube; auto: the scene's longest side and the margin",
        "nothing; larger: coarser voxels",
    ),
    key("volume.margin", "voxels", Range::Number(0.0, 7.0), "empty border when the side is auto", "coarser voxels"),
    voxels("start.diffuse_normal", "where diffuse cones start, along the normal"),
    voxels("start.diffuse_along", "where diffuse cones start, along the cone"),
    voxels("start.specular_normal", "where specular cones start, along the normal"),
    voxels("start.specular_along", "where specular cones start, along the cone"),
    voxels("start.refraction_normal", "where refraction cones start, along the normal"),
    voxels("start.refraction_along", "where refraction cones start, along the cone"),
    voxels("start.shadow_normal", "where shadow cones start, along the normal"),
    voxels("start.shadow_along", "where shadow cones start, along the cone"),
    voxels("start.shadow_end", "how far before the light a shadow cone stops"),
    key(
        "shadow.rays",
        "rays",
        Range::Whole(1, 64),
        "rays to every light with a radius, with shadows = rays: 1 casts hard shadows, more cast penumbrae, with noise in them alone",
        "a ray each per sample of the image and shaded voxel side, where a light has a radius",
    ),
    key(
        "shadow.step",
        "diameters",
        Range::Number(0.05, 1.0),
        "step of a shadow cone over its diameter",
        "time in inverse proportion: less costs more",
    ),
    key(
        "shadow.half_angle",
        "degrees",
        Range::NumberOrAuto(0.1, 45.0),
        "half angle of every shadow cone; auto: from each light's radius",
        "wider cones take fewer steps",
    ),
    key(
        "interleave",
        "pixels",
        Range::OneOf(&[1, 2, 4]),
        "neighbours in squares of so many pixels (and voxels) look along directions of their own and share what they find, where depth and normals agree",
        "a filter of (n + 1)² texels; fewer directions per pixel give the same light",
    ),
    key(
        "gather_resolution",
        "choice",
        names!(GatherResolution),
        "where diffuse light is gathered: at every pixel, or at every second or fourth and brought up by depth and normals",
        "half: a quarter of the gathers, and a second draw of the triangles",
    ),
    key(
        "image.samples",
        "samples per pixel",
        Range::OneOf(&[1, 4]),
        "edges are anti-aliased, cones are traced once per pixel and surface",
        "4: colour and depth ×4 in memory, direct light up to ×4",
    ),
    key(
        "image.direct",
        "choice",
        names!(DirectLight),
        "where direct light and its shadows are looked for: at every sample, or once per pixel and surface",
        "samples: up to image.samples shadow rays or cones per pixel and light",
    ),
    row("ledger.d1", "D1: which volumes the −x −y −z mips read"),
    row("ledger.d2", "D2: the −y mip's fourth column"),
    row("ledger.d6", "D6: the axis of cone set 6a"),
    row("ledger.d7", "D7: the jitter's rotation matrix"),
    row("ledger.d8", "D8: the jitter's angle"),
    row("ledger.d10", "D10: how far a cone reaches: √2, or the exit from the cube"),
    row("ledger.d11", "D11: the volume's border: edge voxels repeated, or transparent"),
    row("ledger.d12", "D12: opacity correction of the shadow cone's short steps"),
    row("ledger.d13", "D13: the shadow cone's mip level"),
    row("ledger.d15", "D15: the shadow cone's volume: isotropic, or directional"),
    row("ledger.d17", "D17: the cone's diameter: max(1/N, 2t)·s, or max(1/N, 2t·s)"),
    row("ledger.d18", "D18: when a cone ends: alpha ≥ 1, or near 1"),
    row("ledger.d21", "D21: the sky behind diffuse cones: dropped, or through the remaining alpha"),
    row("ledger.d22", "D22: the tangent frame about the normal"),
    row("ledger.d23", "D23: where refraction starts: outside the surface, or on the refracted side"),
    row("ledger.d24", "D24: refraction at back faces and total reflection"),
    row("ledger.d26", "D26: set 16's weights: equal, or cosine"),
];

impl Key {
    /// The row of the setting called `name`.
    pub fn named(name: &str) -> Option<&'static Key> {
        KEYS.iter().find(|k| k.name == name)
    }
}
