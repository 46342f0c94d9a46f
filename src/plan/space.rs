//! The search space: for each method a ladder per setting, its cheapest rung first, without those that the scene does
//! not need.

use super::needs::Needs;
use crate::Result;
use crate::gi::Method;
use crate::settings::{Key, PRESETS, Settings};

/// A setting's values, the cheapest first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ladder {
    pub key: &'static str,
    pub rungs: &'static [&'static str],
}

/// A rung of every ladder.
pub type Rungs = Vec<usize>;

/// The search space of one method.
#[derive(Clone, Debug)]
pub struct Space {
    pub method: Method,
    base: Settings,
    pub ladders: Vec<Ladder>,
    /// The starting places, from presets.
    pub starts: Vec<Rungs>,
}

/// Whether a scene and a method need a ladder.
type Use = fn(&Needs, Method) -> bool;

const ALWAYS: Use = |_, _| true;
/// Needed if lamps light items of lists.
const LIT_LAMPS: Use = |needs, method| needs.lamps && GATHERED(needs, method);
const LOBES: Use = |needs, _| needs.lobes;
/// Needed if light travels farther than to the first surface.
const INDIRECT: Use = |_, method| method != Method::None;
/// Needed if indirect light is gathered from lists; paths have no lists.
const GATHERED: Use = |needs, method| INDIRECT(needs, method) && method != Method::Paths;
/// Needed if the ground computes direct light.
const SHADED: Use = |_, method| method != Method::Paths;
const LAMPS: Use = |needs, method| needs.lamps && SHADED(needs, method);
const WIDE_LIGHTS: Use = |needs, method| needs.wide_lights && SHADED(needs, method);

/// A setting, its values and the condition under which it is needed; keys of a method only apply to it. The grid stops
/// at 128, because larger ones take eight times the memory for little gain.
const LADDERS: &[(&str, &[&str], Use)] = &[
    ("voxels", &["16", "32", "64", "128"], SHADED),
    ("bounces", &["1", "2", "all"], INDIRECT),
    ("image.gather_resolution", &["quarter", "half", "full"], GATHERED),
    ("image.interleave", &["1", "2", "4"], GATHERED),
    ("image.samples", &["1", "4"], ALWAYS),
    ("image.direct", &["pixels", "samples"], SHADED),
    ("lights.shadow_rays", &["1", "2", "4", "16"], WIDE_LIGHTS),
    ("lights.lamp_points", &["1", "2", "4", "8", "16", "32"], LAMPS),
    ("lights.voxel_lamp_points", &["1", "2", "4", "8", "16"], LIT_LAMPS),
    ("rays.diffuse", &["2", "4", "6", "9", "14", "22", "32", "44"], INDIRECT),
    ("rays.bounce", &["1", "2", "3", "4", "8"], INDIRECT),
    ("rays.glossy", &["2", "4", "8", "16", "32"], LOBES),
    ("cones.set", &["g1", "g2", "g4", "g6", "g8", "g12", "g16", "g24"], INDIRECT),
    ("cones.step", &["2.0", "1.0"], ALWAYS),
    ("lpv.edge", &["16", "32"], INDIRECT),
    ("photons.diffuse", &["1", "2", "4", "8", "16"], INDIRECT),
    ("photons.bounce", &["1", "2", "4"], INDIRECT),
    ("photons.glossy", &["2", "4", "8", "16"], LOBES),
    ("paths.paths", &["1", "2", "4", "8", "16"], ALWAYS),
    ("probes.edge", &["4", "8", "16", "32"], INDIRECT),
    ("probes.rays", &["32", "64", "128", "256"], INDIRECT),
    ("probes.glossy", &["1", "2", "4", "8"], LOBES),
];

/// A preset with changes.
type Begin = (&'static str, &'static [&'static str]);

/// The starting points of a method.
fn begins(method: Method) -> &'static [Begin] {
    const SHARED_HALF: &str = "image.gather_resolution=half";
    match method {
        Method::Rays => &[("fast", &[]), ("balanced", &[]), ("accurate", &[])],
        Method::Cones => &[("cones", &["cones.set=g8", "image.interleave=4", SHARED_HALF]), ("cones", &[])],
        Method::Lpv => &[("lpv", &[])],
        Method::Photons => &[("photons", &["photons.diffuse=4", SHARED_HALF]), ("photons", &[])],
        Method::Paths => &[("paths", &[])],
        Method::Probes => &[("probes", &["probes.edge=4", "probes.rays=128"]), ("probes", &[])],
        _ => &[("fast", &[])],
    }
}

/// The methods that are tried first: they often do best, or take little time.
const FIRST: [Method; 4] = [Method::None, Method::Rays, Method::Lpv, Method::Photons];

/// The grid at which every search begins: that of presets, 128³, takes up to eight times as long.
const FIRST_GRID: &str = "voxels=64";

/// The spaces of all methods, with the ladders that the scene needs. `fixed` holds `key=value` of fixed settings.
///
/// # Errors
/// [`crate::Error::Usage`] for a key or a value that does not exist.
pub fn spaces(needs: &Needs, fixed: &[String]) -> Result<Vec<Space>> {
    let mut set = Settings::default();
    fixed.iter().try_for_each(|assignment| set.set(assignment))?;
    let names: Vec<&str> = fixed.iter().filter_map(|assignment| Some(assignment.split_once('=')?.0.trim())).collect();
    let mut methods = Method::ALL.to_vec();
    methods.sort_by_key(|method| FIRST.iter().position(|first| first == method).unwrap_or(FIRST.len()));
    let methods = methods.iter().filter(|method| !names.contains(&"method") || set.method == **method);
    methods.map(|method| Space::new(*method, needs, fixed, &names)).collect()
}

impl Space {
    fn new(method: Method, needs: &Needs, fixed: &[String], names: &[&str]) -> Result<Self> {
        let starts = begins(method).iter().map(|begin| start(method, begin, fixed)).collect::<Result<Vec<_>>>()?;
        let is_of = |key: &str| Key::named(key).and_then(Key::method).is_none_or(|of| of == method);
        let tried = LADDERS.iter().filter(|(key, _, of)| is_of(key) && of(needs, method) && !names.contains(key));
        let ladders: Vec<Ladder> = tried.map(|(key, rungs, _)| Ladder { key, rungs }).collect();
        let mut space = Self { method, base: starts[0].clone(), ladders, starts: Vec::new() };
        for settings in &starts {
            let place = space.place(settings);
            if !space.starts.contains(&place) {
                space.starts.push(place);
            }
        }
        Ok(space)
    }

    /// The settings at a place.
    pub fn settings(&self, place: &[usize]) -> Settings {
        let mut settings = self.base.clone();
        for (ladder, &rung) in self.ladders.iter().zip(place) {
            let assignment = format!("{}={}", ladder.key, ladder.rungs[rung]);
            settings.set(&assignment).expect("every rung is a value of its key: a test sets them all");
        }
        settings
    }

    /// The place of settings; a value without a rung counts as the lowest.
    pub fn place(&self, settings: &Settings) -> Rungs {
        let entries = settings.entries();
        let rung = |ladder: &Ladder| {
            let value = entries.iter().find(|entry| entry.0.name == ladder.key).map(|entry| entry.1.as_str());
            ladder.rungs.iter().position(|rung| value == Some(*rung)).unwrap_or(0)
        };
        self.ladders.iter().map(rung).collect()
    }

    /// Every combination of rungs.
    pub fn places(&self) -> Vec<Rungs> {
        let grow = |places: Vec<Rungs>, ladder: &Ladder| {
            let with = |place: &Rungs, rung| place.iter().copied().chain([rung]).collect();
            places.iter().flat_map(|place| (0..ladder.rungs.len()).map(move |rung| with(place, rung))).collect()
        };
        self.ladders.iter().fold(vec![Vec::new()], grow)
    }
}

/// A preset with changes, on the first grid, with the fixed settings.
fn start(method: Method, begin: &Begin, fixed: &[String]) -> Result<Settings> {
    let (preset, changes) = begin;
    let mut settings = Settings { method, ..Settings::preset(preset)? };
    settings.set(FIRST_GRID)?;
    let sets = changes.iter().copied().chain(fixed.iter().map(String::as_str));
    sets.into_iter().try_for_each(|assignment| settings.set(assignment))?;
    Ok(settings)
}

/// The preset with the fewest differences, and these, for a command.
pub fn as_preset(settings: &Settings) -> (&'static str, Vec<String>) {
    let all = PRESETS.iter().map(|preset| (preset.name, settings.changes_from(&(preset.settings)())));
    all.min_by_key(|(_, differs)| differs.len()).expect("there are presets")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all() -> Needs {
        Needs { lamps: true, wide_lights: true, lobes: true, ..Needs::default() }
    }

    #[test]
    fn every_rung_is_a_value_and_presets_stand_on_rungs() {
        for space in spaces(&all(), &[]).unwrap() {
            for (i, ladder) in space.ladders.iter().enumerate() {
                for rung in 0..ladder.rungs.len() {
                    let mut place = space.starts[0].clone();
                    place[i] = rung;
                    assert_eq!(space.place(&space.settings(&place)), place, "{} {}", space.method, ladder.key);
                }
            }
            for (place, begin) in space.starts.iter().zip(begins(space.method)) {
                let settings = start(space.method, begin, &[]).unwrap();
                assert!(space.settings(place).means_same(&settings), "{begin:?} stands beside the ladders");
            }
        }
    }

    #[test]
    fn what_a_scene_has_no_use_for_is_not_tried() {
        let keys = |needs: &Needs| {
            let spaces = spaces(needs, &["method=rays".into(), "voxels=32".into()]).unwrap();
            assert_eq!(spaces.len(), 1);
            assert_eq!(spaces[0].settings(&spaces[0].starts[0]).voxels, 32);
            spaces[0].ladders.iter().map(|ladder| ladder.key).collect::<Vec<_>>()
        };
        let plain = keys(&Needs::default());
        assert!(
            !plain.contains(&"lights.lamp_points") && !plain.contains(&"rays.glossy") && !plain.contains(&"voxels")
        );
        assert!(keys(&all()).contains(&"lights.lamp_points") && keys(&all()).contains(&"rays.glossy"));
    }

    #[test]
    fn settings_are_said_as_the_nearest_preset() {
        let mut settings = Settings::fast();
        settings.set("rays.diffuse=6").unwrap();
        assert_eq!(as_preset(&settings), ("fast", vec!["rays.diffuse=6".to_owned()]));
        assert_eq!(as_preset(&Settings::lpv()), ("lpv", vec![]));
    }
}
