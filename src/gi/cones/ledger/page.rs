//! The ledger's page: its text from what was measured, and back.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::gi::ledger::Change;
use super::{CHOICES, FILL_SCENES, FILL_SETTINGS, FURNACE_FILLS, FURNACE_ROOMS, OPEN, ROWS};

/// Radiance in a furnace after two bounces over Σρᵏ: 1 is right.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Furnace {
    pub mean: f64,
    /// Of the darkest and the brightest pixel.
    pub range: [f64; 2],
}

impl Furnace {
    fn cell(&self) -> String {
        format!("{:.3} ({:.3} … {:.3})", self.mean, self.range[0], self.range[1])
    }

    /// The reverse of [`Self::cell`].
    fn parse(cell: &str) -> Option<Self> {
        let (mean, range) = cell.strip_suffix(')')?.split_once(" (")?;
        let (least, most) = range.split_once(" … ")?;
        Some(Self { mean: mean.parse().ok()?, range: [least.parse().ok()?, most.parse().ok()?] })
    }
}

/// Error of the indirect light on diffuse surfaces with one reading of the fill, on equal terms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FillError {
    pub rel: f64,
    pub energy: f64,
}

impl FillError {
    fn cell(&self) -> String {
        format!("{:.3}, {:.3}", self.rel, self.energy)
    }

    /// The reverse of [`Self::cell`].
    fn parse(cell: &str) -> Option<Self> {
        let (rel, energy) = cell.split_once(", ")?;
        Some(Self { rel: rel.parse().ok()?, energy: energy.parse().ok()? })
    }
}

/// The name of a scene's column in the fills' table.
pub fn fill_column(path: &str) -> &str {
    path.trim_start_matches("assets/").trim_end_matches(".glb")
}

/// What a row of the furnaces' table is called.
pub fn furnace_row(fill: &str, albedo: f32, block: bool) -> String {
    format!("{fill} | {albedo} | {}", if block { "with a block" } else { "empty" })
}

/// What a run of `twobounce ledger` measured.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measurements {
    /// Scene, image size, grid, device and driver, in one sentence.
    pub about: String,
    /// By a row's id, or by the choice's `key=value`.
    pub changes: BTreeMap<String, Change>,
    /// By [`fill_column`], one per element of [`FILL_SETTINGS`].
    pub fills: BTreeMap<String, Vec<FillError>>,
    /// By [`furnace_row`], one per grid of [`super::FURNACE_EDGES`].
    pub furnaces: BTreeMap<String, Vec<Furnace>>,
}

const HEAD: &str = "# The ledger of the printed listings

Written by `twobounce ledger`; `tests/values/ledger_formulas.rs` holds, for each row with a formula, a test that the printed form
fails and the right form passes. The preset `printed` has every row as printed that can run so: D9 and D14 need what the slides leave
out, D24 has one form, and every cone ends after 2048 steps. `corrected` is `printed` with every row right but D20 and D29, which it
keeps, and nothing else changed; `corrected-16` takes the printed set of sixteen diffuse cones instead of five. Each row that changes
an image is also a setting of its own (`cones.ledger.d1`, …). Two rows, D7 and D14, are no errors.

Changes are of the whole image, one row at a time, everything else as in `corrected`. *Change* is the mean of |printed − right| over
the mean of right; *brightness* is the mean of printed over the mean of right. Neither is an error against the truth:
[accuracy](accuracy.md) has these.

In `printed` itself four rows change nothing: D6 and D26 are of cone sets that it does not use, D7 and D8 of the diffuse cones'
jitter, which is off. They matter with `--preset printed --set cones.set=6a`, `cones.set=16` and `cones.jitter=true`.
D21 needs a sky, D23 a surface that transmits.

";

const OPEN_HEAD: &str = "
## What the slides leave open
The slides leave these points open, or the program does otherwise without an error; `printed` and `corrected` do the same. Where
another way is a setting, *change* and *brightness* compare that way with this one.

| row | the slides | here";

const FILLS_HEAD: &str = "
## Two fills, two sets
Errors of the indirect light on diffuse surfaces against path-traced light of two bounces, `rel, energy`, on equal terms (`corrected` with
`lights.shadows=rays lights.lamps=sampled`, 64³ voxels, references with 2.5 % noise). The stairs were tuned on by nobody.

The set of five is the limit, not the fill. Its cones are 90° wide, and with `uniform` every voxel of a wall is seen from all sides.
Over a wall of an empty room at 128³, 81 to 89 % of what the five cones collect is that wall itself (`tests/values/ledger_formulas.rs`).
Bright walls light themselves, dark walls darken themselves, and the sum of both may look right. The cones of the set of sixteen are
35° wide: 37 to 48 % of what they collect is the wall that they leave.

";

const FURNACE_HEAD: &str = "
## Furnaces
A closed room emits 1 and has one albedo ρ: after two bounces every pixel should be 1 + ρ + ρ². The table shows the mean over the image
(and the darkest … brightest pixel) over that value. `sided` is measured as the preset `cones` uses it, with `cones.weights = abs`,
`cones.blend = sum` and 16 cones; the others with the preset `corrected`. A furnace is blind to one error: all its walls are equally
bright, so a wall whose cones see that wall itself passes this test. [Two fills, two sets](#two-fills-two-sets) shows that error.

| fill | albedo | room | 32³ | 128³ |
|---|---|---|---|---|
";

/// The page.
pub fn document(measured: &Measurements) -> String {
    let mut text = format!("{HEAD}{}\n\n", measured.about);
    let cells = |key: &str| measured.changes.get(key).map_or("– | –".into(), Change::cells);
    let columns = " | measured with | change | brightness |\n|---|---|---|---|---|---|\n";
    for (head, rows) in [("| row | printed | right", ROWS), (OPEN_HEAD, OPEN)] {
        text += head;
        text += columns;
        for row in rows {
            text += &row.line(measured.changes.get(row.id));
        }
    }
    text += "\n## Choices\nAgainst the same settings, one at a time.\n\n";
    text += "| setting | change | brightness |\n|---|---|---|\n";
    for choice in CHOICES {
        writeln!(text, "| `{choice}` | {} |", cells(choice)).expect("fmt");
    }
    text += FILLS_HEAD;
    let scenes: Vec<&str> = FILL_SCENES.iter().map(|path| fill_column(path)).collect();
    writeln!(text, "| setting | {} |\n|---|{}", scenes.join(" | "), "---|".repeat(scenes.len())).expect("fmt");
    for (i, settings) in FILL_SETTINGS.iter().enumerate() {
        let cell = |scene: &&str| measured.fills.get(*scene).map_or("–".into(), |errors| errors[i].cell());
        let cells: Vec<String> = scenes.iter().map(cell).collect();
        writeln!(text, "| `{}` | {} |", settings.join("` `"), cells.join(" | ")).expect("fmt");
    }
    text += FURNACE_HEAD;
    for (fill, _) in FURNACE_FILLS {
        for &(albedo, block) in FURNACE_ROOMS {
            let row = furnace_row(fill, albedo, block);
            let cells: Vec<String> = measured.furnaces.get(&row).into_iter().flatten().map(Furnace::cell).collect();
            writeln!(text, "| {row} | {} |", cells.join(" | ")).expect("fmt");
        }
    }
    text
}

/// What a page written by [`document`] says; `None` where its head is another's.
pub fn parse(text: &str) -> Option<Measurements> {
    let (about, tables) = text.strip_prefix(HEAD)?.split_once('\n')?;
    let mut measured = Measurements { about: about.into(), ..Measurements::default() };
    for line in tables.lines().filter(|l| l.starts_with("| ")) {
        let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
        let furnaces: Vec<Furnace> = cells.iter().filter_map(|cell| Furnace::parse(cell)).collect();
        let fills: Vec<FillError> = cells[1..].iter().filter_map(|cell| FillError::parse(cell)).collect();
        if fills.len() == FILL_SCENES.len() {
            for (path, error) in FILL_SCENES.iter().zip(fills) {
                measured.fills.entry(fill_column(path).into()).or_default().push(error);
            }
            continue;
        }
        if let Some(change) = cells.len().checked_sub(2).and_then(|i| Change::parse(&cells[i..])) {
            measured.changes.insert(cells[0].trim_matches('`').into(), change);
        } else if !furnaces.is_empty() {
            measured.furnaces.insert(cells[..cells.len() - furnaces.len()].join(" | "), furnaces);
        }
    }
    Some(measured)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_says_what_was_measured() {
        let change = Change { rel_percent: 12.34, energy: 0.987 };
        let keys = ["D1", "D22", "D29", "cones.fill=facing"];
        let changes = keys.iter().map(|k| ((*k).into(), change.clone())).collect();
        let furnace = Furnace { mean: 0.98, range: [0.9, 1.004] };
        let furnaces = [(furnace_row("facing", 0.8, true), vec![furnace; 2])].into();
        let error = FillError { rel: 0.328, energy: 0.798 };
        let fills = FILL_SCENES.iter().map(|path| (fill_column(path).into(), vec![error; FILL_SETTINGS.len()])).collect();
        let measured = Measurements { about: "A scene on a device.".into(), changes, fills, furnaces };
        let page = document(&measured);
        assert_eq!(parse(&page), Some(measured));
        assert_eq!(parse(&page.replace("Written by", "Made by")), None);
    }
}
