//! The table `[probes]`.

use crate::settings::{Key, Range, table};

table! {
    /// The defaults are the preset `probes`.
    Settings as "probes" {
        edge: u32 = 8, in "probes per edge" rare, Range::PowerOfTwo(4, 32);
        "edge of the grids of probes";
        "probes ×8 per doubling, of which those about surfaces send rays";
        rays: u32 = 256, in "rays" rare, Range::Whole(32, 1024);
        "rays of each probe in a pass";
        "a ray each, with its shadow rays where it ends";
        cascades: u32 = 1, in "grids" rare, Range::Whole(1, 3);
        "nested grids: the coarsest is the base grid's cube, each finer one has half its side, about the camera";
        "probes in proportion; lists are made anew when the camera leaves a cell";
        glossy: u32 = 4, in "rays" rare, Range::Whole(1, 64);
        "rays for a specular lobe of a roughness between 0.03 and 0.7; rougher lobes are looked up in the probes";
        "a ray each, where something is glossy, with its shadow rays";
        hysteresis: f32 = 0.0, in "share" rare, Range::Number(0.0, 0.99);
        "with bounces = all, share of a probe's light that a pass leaves of the pass before while light still changes; 0: every \
         pass has the same directions and replaces the light. Settled light is the mean of passes either way";
        "no time; light lags behind: half of a change is missing after ln 2 / (1 − share) frames";
        passes: u32 = 8, in "passes" rare, Range::Whole(0, 4096);
        "with bounces = all, passes that are averaged once the light has converged, until something changes. 0: one set of directions";
        "one pass over the probes each; noise falls with the root of their number";
        bias: f32 = 0.3, in "0.75 spacings" rare, Range::Number(0.0, 2.0);
        "distance from the surface, 0.2 along its normal and 0.8 towards the viewer, of the point that probes are asked about whether they see it";
        "none; more: less shadow of surfaces on themselves, more leaks";
        relocations: u32 = 3, in "rounds" rare, Range::Whole(0, 16);
        "rounds in which probes move out of solids and off surfaces, by at most 0.45 spacings along each axis";
        "32 rays per probe and round whenever something moves";
        classify: bool = true, in "switch" rare, Range::Bool;
        "probes in solids, and those without a surface in the cells about them, send no rays and are not read";
        "false: every probe sends rays";
        behind: bool = false, in "switch" rare, Range::Bool;
        "probes behind a surface count for a little, as in the papers, or not at all";
        "none; true: double-sided walls are darker, by a fifth and more with all bounces";
        visibility: bool = true, in "switch" rare, Range::Bool;
        "weigh probes by whether they see the surface, by the distances that they found";
        "false: a little faster, and light comes through walls";
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
