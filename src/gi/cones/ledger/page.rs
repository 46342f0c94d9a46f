//! The ledger's page: its text from what was measured, and back.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::gi::ledger::Change;
use super::{CHOICES, FURNACE_FILLS, FURNACE_ROOMS, OPEN, ROWS};

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
    /// By [`furnace_row`], one per grid of [`super::FURNACE_EDGES`].
    pub furnaces: BTreeMap<String, Vec<Furnace>>,
}

const HEAD: &str = "# The ledger of the printed listings

Written by `twobounce ledger`; `tests/ledger_formulas.rs` holds, for each row with a formula, a test that the printed form
fails and the right form passes. The preset `printed` has every row as printed; `corrected` is `printed` with every row right but
D20 and D29, which it keeps, and nothing else changed. Each row that changes an image is also a setting of its own
(`cones.ledger.d1`, …). Changes are of the whole image, one row at a time, everything else as in `corrected`: *change* is mean
|printed − right| over mean right, *energy* is mean printed over mean right.

In `printed` itself four rows change nothing: D6 and D26 are of cone sets that it does not use, D7 and D8 of the diffuse cones'
jitter, which is off. They matter with `--preset printed --set cones.set=6a`, `cones.set=16` and `cones.jitter=true`; no preset has these.
D21 needs a sky, D23 a surface that transmits.

";

const OPEN_HEAD: &str = "
## What the slides leave open
Or do otherwise without an error: what they say, and what is done here, in `printed` and in `corrected` alike. Where another way is a
setting, *change* and *energy* are that way's against this one.

| row | the slides | here";

const FURNACE_HEAD: &str = "
## Furnaces
A closed room that emits 1, of one albedo ρ: after two bounces every pixel should be 1 + ρ + ρ². Mean over the image (and
darkest … brightest pixel) over that. `sided` is measured as the presets use it, with `cones.weights = abs`, `cones.blend = sum` and 16
cones; the others with the preset `corrected`.

| fill | albedo | room | 32³ | 128³ |
|---|---|---|---|---|
";

/// The page.
pub fn document(measured: &Measurements) -> String {
    let mut text = format!("{HEAD}{}\n\n", measured.about);
    let cells = |key: &str| measured.changes.get(key).map_or("– | –".into(), Change::cells);
    let columns = " | measured with | change | energy |\n|---|---|---|---|---|---|\n";
    for (head, rows) in [("| row | printed | right", ROWS), (OPEN_HEAD, OPEN)] {
        text += head;
        text += columns;
        for row in rows {
            text += &row.line(measured.changes.get(row.id));
        }
    }
    text += "\n## Choices\nAgainst the same settings, one at a time.\n\n";
    text += "| setting | change | energy |\n|---|---|---|\n";
    for choice in CHOICES {
        writeln!(text, "| `{choice}` | {} |", cells(choice)).expect("fmt");
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
        let measured = Measurements { about: "A scene on a device.".into(), changes, furnaces };
        let page = document(&measured);
        assert_eq!(parse(&page), Some(measured));
        assert_eq!(parse(&page.replace("Written by", "Made by")), None);
    }
}
