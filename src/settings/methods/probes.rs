//! The table `[probes]`.

use crate::settings::{Key, Range, table};

table! {
    /// The defaults are the preset `probes`.
    Settings as "probes" {
        edge: u32 = 8, in "probes per edge" rare, Range::PowerOfTwo(4, 32);
        "edge of the grids of probes";
        "probes ×8 per doubling";
        rays: u32 = 256, in "rays" rare, Range::Whole(32, 1024);
        "rays of each probe in a pass";
        "a ray each, with its shadow rays";
        cascades: u32 = 1, in "grids" rare, Range::Whole(1, 3);
        "nested grids about the camera, as lpv.cascades";
        "probes in proportion";
        glossy: u32 = 4, in "rays" rare, Range::Whole(1, 64);
        "rays for a specular lobe; rough lobes read the probes";
        "a ray each";
        hysteresis: f32 = 0.0, in "share" rare, Range::Number(0.0, 0.99);
        "with bounces = all, share of the previous pass in a probe's light while light changes";
        "none; light lags: half of a change is missing after ln 2 / (1 − share) frames";
        passes: u32 = 8, in "passes" rare, Range::Whole(0, 4096);
        "with bounces = all, passes that are averaged once the light has converged, as rays.passes";
        "one pass over the probes each";
        bias: f32 = 0.3, in "0.75 spacings" rare, Range::Number(0.0, 2.0);
        "distance from the surface of the point whose visibility is tested";
        "none; more: less self-shadowing, more leaks";
        relocations: u32 = 3, in "rounds" rare, Range::Whole(0, 16);
        "rounds in which probes move away from surfaces and out of solids";
        "32 rays per probe and round after a change";
        classify: bool = true, in "switch" rare, Range::Bool;
        "whether probes in solids or far from surfaces are switched off";
        "false: every probe sends rays";
        behind: bool = false, in "switch" rare, Range::Bool;
        "whether probes behind a surface count, as in the papers";
        "none; true: double-sided walls are darker";
        visibility: bool = true, in "switch" rare, Range::Bool;
        "whether probes are weighted by visibility";
        "false: a little faster, but walls leak";
    }
}

/// The table's keys.
pub const KEYS: &[&[Key]] = &[Settings::KEYS];
