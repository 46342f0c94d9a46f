//! The table of settings: unit, range and cost of each. Parsing, checks, lists and documentation use it.

use std::sync::LazyLock;

use super::methods::{Method, tables_keys};
use super::{Bounces, GridSettings, ImageSettings, LightSettings};

/// Description of one setting, as `twobounce settings` prints it.
#[derive(Clone, Copy, Debug)]
pub struct Key {
    /// The dotted name, as in `--set image.samples=1`.
    pub name: &'static str,
    pub unit: &'static str,
    pub range: Range,
    /// Effect of the setting, and its choices.
    pub meaning: &'static str,
    /// The cost of a larger value or of a more expensive choice.
    pub cost: &'static str,
    /// Whether only `--all` shows the setting: the ledger, the talk's variants, and rarely changed ones.
    pub rare: bool,
}

/// The values of a setting.
#[derive(Clone, Copy, Debug)]
pub enum Range {
    Bool,
    Choice(fn() -> Vec<&'static str>),
    /// A whole number in an inclusive range.
    Whole(u32, u32),
    /// As [`Self::Whole`], or `auto`.
    WholeOrAuto(u32, u32),
    /// A power of two in an inclusive range.
    PowerOfTwo(u32, u32),
    /// One of these whole numbers.
    OneOf(&'static [u32]),
    /// A finite number in an inclusive range.
    Number(f64, f64),
    /// As [`Self::Number`], or `auto`.
    NumberOrAuto(f64, f64),
    /// Three finite numbers within ± the bound, `camera` or `auto`.
    Center(f64),
}

impl std::fmt::Display for Range {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool => f.write_str("true or false"),
            Self::Choice(names) => f.write_str(&either(&names())),
            Self::Whole(least, most) => write!(f, "a whole number, {least} to {most}"),
            Self::WholeOrAuto(least, most) => write!(f, "a whole number, {least} to {most}, or auto"),
            Self::PowerOfTwo(least, most) => write!(f, "a power of two, {least} to {most}"),
            Self::OneOf(values) => f.write_str(&either(&values.iter().map(u32::to_string).collect::<Vec<_>>())),
            Self::Number(least, most) => write!(f, "{}", span(*least, *most)),
            Self::NumberOrAuto(least, most) => write!(f, "{}, or auto", span(*least, *most)),
            Self::Center(most) => write!(f, "x,y,z each within ±{most:e}, camera or auto"),
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

/// The names of a closed list of choices, as a [`Range`].
macro_rules! names {
    ($choice:ty) => {
        $crate::settings::Range::Choice(|| <$choice>::ALL.iter().map(|choice| choice.name()).collect())
    };
}
pub(crate) use names;

/// A common setting.
pub(crate) const fn key(
    name: &'static str,
    unit: &'static str,
    range: Range,
    meaning: &'static str,
    cost: &'static str,
) -> Key {
    Key { name, unit, range, meaning, cost, rare: false }
}

/// A setting that only `--all` shows.
pub(crate) const fn rare(key: Key) -> Key {
    Key { rare: true, ..key }
}

/// Declares tables of settings: each field with its type, its default and the texts of [`Key`], followed by nested
/// tables.
macro_rules! table {
    ($($(#[$doc:meta])* $name:ident as $table:literal {$(
        $(#[$field_attribute:meta])*
        $field:ident: $type:ty = $default:expr, in $unit:literal $($rare:ident)?, $range:expr;
        $meaning:literal;
        $cost:expr;
    )+} $(+ { $($inner:ident: $inner_type:ty),+ })?)+) => {$(
        $(#[$doc])*
        #[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct $name {
            $(#[doc = $meaning] $(#[$field_attribute])* pub $field: $type,)+
            $($(pub $inner: $inner_type,)+)?
        }

        impl Default for $name {
            fn default() -> Self {
                Self { $($field: $default,)+ $($($inner: Default::default(),)+)? }
            }
        }

        impl $name {
            pub(super) const KEYS: &[$crate::settings::Key] = &[$($($crate::settings::$rare)?($crate::settings::key(
                concat!($table, ".", stringify!($field)),
                $unit,
                $range,
                $meaning,
                $cost,
            ))),+];
        }
    )+};
}
pub(crate) use table;

/// The settings outside of tables.
const TOP: &[Key] = &[
    key(
        "method",
        "method",
        names!(Method),
        "method of indirect light: none, voxel cones as in the talk, exact rays, light propagation volumes, cones through voxel photons, irradiance probes, or paths",
        "see the presets",
    ),
    key(
        "voxels",
        "voxels per edge",
        Range::PowerOfTwo(16, 256),
        "edge of the grid of triangle lists and stored light",
        "memory of a volume ×8 per doubling (cones: 32 MiB at 64, 256 at 128, 2 GiB at 256); voxel passes up to ×8, the image ×1.1–1.3",
    ),
    key(
        "bounces",
        "bounces",
        names!(Bounces),
        "indirect bounces; all: each frame continues the light of the last one, and the first repeats until the light has converged",
        "2 also shades and stores a second bounce; all: two bounces a frame, with rays one, and none once a still scene \
         has converged",
    ),
];

static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
    let shared = [TOP, GridSettings::KEYS, LightSettings::KEYS, ImageSettings::KEYS].into_iter().flatten();
    shared.chain(tables_keys()).copied().collect()
});

/// Every setting in the order of the tree: those of all methods, then one table per method.
pub fn keys() -> &'static [Key] {
    &KEYS
}

impl Key {
    /// The row of the setting called `name`.
    pub fn named(name: &str) -> Option<&'static Key> {
        keys().iter().find(|k| k.name == name)
    }

    /// The method whose table contains the setting.
    pub fn method(&self) -> Option<Method> {
        let table = self.name.split_once('.')?.0;
        Method::ALL.iter().copied().find(|method| method.name() == table)
    }

    /// Whether the setting has an effect with this method. Every method can use rays to lights.
    pub fn has_effect(&self, method: Method) -> bool {
        self.method().is_none_or(|own| own == method) || self.name == "rays.tracer"
    }
}
