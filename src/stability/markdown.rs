//! The page `docs/stability.md`, from a table that is kept as `rows.csv`.

use std::collections::BTreeSet;

use super::case::Case;
use super::cases;
use super::export::{Kept, Rows, read_csv, read_more};
use crate::settings::PRESETS;

const OPENING: &str = "# Where methods fail

Written by `twobounce stability --markdown docs/stability-rows.csv`, from rows that `twobounce stability` measured on llvmpipe; `twobounce stability -o DIR` measures
them anew and writes a page with pictures. Each case has an ideal, and a limit that presets of the method `rays` are asked to keep; others show what they show.

A scene never stands at one place alone: each is run at nine offsets within a voxel, and at 0°, 15° and 45° to the grid where that can matter. Numbers are medians over the
places, the worst one behind. **Bold** is further from the ideal than the limit, at the worst place. Images have 64×64 pixels. Thicknesses in voxels are of that row's grid.
A dash is not measured; `random` are the first 24 of its scenes. Rows of `accurate`, `cones`, `lpv` and `photons` were measured where they end within a minute or so.

Whether what is beyond a limit is noise, which more rays take away, or stays, is measured in [noise.md](noise.md).

What cannot be seen from outside is held by tests: opacity and radiance bounds of mips by `tests/values/twins_values.rs` and `tests/device/passes_cells.rs`, counters and overflow by
`tests/device/passes_voxelise.rs` and `tests/device/passes_order.rs`, propagation by `tests/device/passes_lpv.rs`, refraction and lobes by `tests/device/passes_gloss.rs`.
";

/// The page of a table.
///
/// # Errors
/// A sentence about the line of `csv` that cannot be read.
pub fn page(csv: &str) -> Result<String, String> {
    let rows = read_csv(csv)?;
    let used = |case: &&Case| rows.keys().any(|(name, _, _)| *name == case.name);
    let cases: Vec<&Case> = cases::all().filter(used).collect();
    let mut page = OPENING.to_owned();
    page += &overview(&rows, &cases);
    page += "\n## What to do about it\n\n";
    for case in &cases {
        page += &sentence(&rows, case);
    }
    for case in &cases {
        page += &section(&rows, case);
        page += &further(csv, case);
    }
    Ok(page)
}

/// The presets of some rows, in the order of the program.
fn presets<'a>(rows: impl Iterator<Item = &'a (String, String, u32)>) -> Vec<&'static str> {
    let names: BTreeSet<&str> = rows.map(|(_, preset, _)| preset.as_str()).collect();
    PRESETS.iter().map(|preset| preset.name).filter(|name| names.contains(name)).collect()
}

fn grids(rows: &Rows) -> Vec<u32> {
    rows.keys().map(|(_, _, grid)| *grid).collect::<BTreeSet<u32>>().into_iter().collect()
}

fn find<'a>(rows: &'a Rows, case: &Case, preset: &str, grid: u32) -> Option<&'a Kept> {
    rows.get(&(case.name.to_owned(), preset.to_owned(), grid))?.as_ref()
}

fn fails(case: &Case, kept: &Kept) -> bool {
    kept.distance > case.limit * (1.0 + 1e-9)
}

fn cell(case: &Case, kept: Option<&Kept>) -> String {
    let Some(kept) = kept else { return " – |".to_owned() };
    let text = case.words(kept.median, kept.min, kept.max);
    if fails(case, kept) { format!(" **{text}** |") } else { format!(" {text} |") }
}

/// Every case and preset on the middle grid.
fn overview(rows: &Rows, cases: &[&Case]) -> String {
    let (all, presets) = (grids(rows), presets(rows.keys()));
    let Some(grid) = all.get((all.len().max(1) - 1) / 2).copied() else { return String::new() };
    let mut text = format!("\n## At {grid}³\n\n| case | ideal |");
    presets.iter().for_each(|preset| text += &format!(" `{preset}` |"));
    text += &format!("\n|---|---:|{}\n", "---:|".repeat(presets.len()));
    for case in cases {
        text += &format!("| [{}](#{}) | {} |", case.name, anchor(case), case.unit.words(case.ideal));
        presets.iter().for_each(|preset| text += &cell(case, find(rows, case, preset, grid)));
        text += "\n";
    }
    text
}

/// As pages make anchors of headings.
fn anchor(case: &Case) -> String {
    case.name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect()
}

/// Who is beyond the limit, by how much, and what to do; or who was measured and is not.
fn sentence(rows: &Rows, case: &Case) -> String {
    let presets = presets(rows.keys().filter(|(name, _, _)| name == case.name));
    let mut failing = Vec::new();
    for preset in &presets {
        let of_preset = grids(rows).into_iter().filter_map(|grid| Some((grid, find(rows, case, preset, grid)?)));
        let far: Vec<String> = of_preset
            .filter(|(_, kept)| fails(case, kept))
            .map(|(grid, kept)| format!("{} at {grid}³", case.unit.words(case.farther(kept.min, kept.max))))
            .collect();
        if !far.is_empty() {
            failing.push(format!("`{preset}` reaches {}", far.join(", ")));
        }
    }
    if failing.is_empty() {
        let names: Vec<String> = presets.iter().map(|preset| format!("`{preset}`")).collect();
        return format!("- **{}**: nothing; measured were {}, which keep the limit.\n", case.name, names.join(", "));
    }
    format!("- **{}**: {} {}.\n", case.name, case.advice, failing.join("; "))
}

fn section(rows: &Rows, case: &Case) -> String {
    let grids = grids(rows);
    let (ideal, limit) = (case.unit.words(case.ideal), case.unit.words(case.limit));
    let mut text = format!("\n## {}\n\n{} Ideal {ideal}, limit ±{limit}.\n\n| preset |", case.name, case.meaning);
    grids.iter().for_each(|grid| text += &format!(" {grid}³ |"));
    text += &format!("\n|---|{}\n", "---:|".repeat(grids.len()));
    for preset in presets(rows.keys().filter(|(name, _, _)| name == case.name)) {
        text += &format!("| `{preset}` |");
        grids.iter().for_each(|grid| text += &cell(case, find(rows, case, preset, *grid)));
        text += "\n";
    }
    text
}

/// The other numbers of a case, medians over the places, on its coarsest grid.
fn further(csv: &str, case: &Case) -> String {
    let all = read_more(csv);
    let with_more = || all.iter().filter(|((name, _, _), more)| name == case.name && !more.is_empty());
    let Some(grid) = with_more().map(|((_, _, grid), _)| *grid).min() else { return String::new() };
    let of_grid: Vec<_> = with_more().filter(|((_, _, of), _)| *of == grid).collect();
    let names = || of_grid[0].1.iter().map(|(name, _)| name);
    let mut text = format!("\nFurther, at {grid}³:\n\n| preset |");
    names().for_each(|name| text += &format!(" {name} |"));
    text += &format!("\n|---|{}\n", "---:|".repeat(names().count()));
    for preset in presets(of_grid.iter().map(|(key, _)| *key)) {
        let found = of_grid.iter().find(|((_, name, _), _)| name == preset);
        text += &format!("| `{preset}` |");
        found.iter().flat_map(|(_, more)| more.iter()).for_each(|(_, value)| text += &format!(" {value} |"));
        text += "\n";
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    const TABLE: &str = "case,preset,grid,unit,ideal,median,min,max,distance,worst,more,failure
leak-1,cones,64,share,0,0.02,0.01,0.03,0.03,\"0.1, 0.2\",,
leak-1,fast,64,share,0,0,0,0,0,,,
flicker,fast,64,share,0,0,0,0,0,,,
slide,fast,64,share,0,0.01,0.01,0.01,0.01,\"0.1, 0.2\",worst 1 % of pixels = 0.1; FLIP of a frame = 0.02,
";

    #[test]
    fn failures_are_named_and_the_rest_is_not() {
        let page = page(TABLE).unwrap();
        assert!(page.contains("| `fast` | 0 |\n| `cones` | **2.000 % (3.000 %)** |"), "{page}");
        assert!(page.contains("- **flicker**: nothing; measured were `fast`, which keep the limit."));
        assert!(page.contains("`cones` reaches 3.000 % at 64³.") && !page.contains("`fast` reaches"));
        assert!(
            page.contains(
                "| preset | worst 1 % of pixels | FLIP of a frame |\n|---|---:|---:|\n| `fast` | 0.1 | 0.02 |"
            )
        );
        assert!(page.contains("| case | ideal | `fast` | `cones` |"));
        assert!(super::page("nonsense").is_err());
    }
}
