//! The page `docs/stability.md`, from a table that is kept as `rows.csv`. Its prose stands in `page.md`.

use std::collections::BTreeSet;

use super::case::Case;
use super::cases;
use super::export::{Kept, Key, More, Rows, read_csv};
use crate::lab::table::{MISSING, fill, markdown};
use crate::settings::PRESETS;

/// The page of a table.
///
/// # Errors
/// A sentence about the line of `csv` that cannot be read.
pub fn page(csv: &str) -> Result<String, String> {
    let (rows, more) = read_csv(csv)?;
    let used = |case: &&Case| rows.keys().any(|(name, _, _)| *name == case.name);
    let cases: Vec<&Case> = cases::all().filter(used).collect();
    let table = |name: &str, _: &str| {
        Ok(match name {
            "overview" => overview(&rows, &cases),
            "advice" => cases.iter().map(|case| sentence(&rows, case)).collect(),
            _ => cases.iter().map(|case| section(&rows, case) + &further(&more, case)).collect(),
        })
    };
    fill(include_str!("page.md"), table).map_err(|error| error.to_string())
}

/// The presets of some rows, in the order of the program.
fn presets<'a>(rows: impl Iterator<Item = &'a Key>) -> Vec<&'static str> {
    let names: BTreeSet<&str> = rows.map(|(_, preset, _)| preset.as_str()).collect();
    PRESETS.iter().map(|preset| preset.name).filter(|name| names.contains(name)).collect()
}

fn presets_of(rows: &Rows, case: &Case) -> Vec<&'static str> {
    presets(rows.keys().filter(|(name, _, _)| *name == case.name))
}

fn grids(rows: &Rows) -> Vec<u32> {
    rows.keys().map(|(_, _, grid)| *grid).collect::<BTreeSet<u32>>().into_iter().collect()
}

fn find<'a>(rows: &'a Rows, case: &Case, preset: &str, grid: u32) -> Option<&'a Kept> {
    rows.get(&(case.name.clone(), preset.to_owned(), grid))?.as_ref()
}

fn fails(case: &Case, kept: &Kept) -> bool {
    kept.distance > case.limit * (1.0 + 1e-9)
}

fn cell(case: &Case, kept: Option<&Kept>) -> String {
    let Some(kept) = kept else { return MISSING.to_owned() };
    let text = case.words(kept.median, kept.min, kept.max);
    if fails(case, kept) { format!("**{text}**") } else { text }
}

fn head(first: &[&str], presets: &[&str]) -> Vec<String> {
    first.iter().map(|title| (*title).to_owned()).chain(presets.iter().map(|preset| format!("`{preset}`"))).collect()
}

/// Every case and preset on the middle grid.
fn overview(rows: &Rows, cases: &[&Case]) -> String {
    let (all, presets) = (grids(rows), presets(rows.keys()));
    let Some(grid) = all.get((all.len().max(1) - 1) / 2).copied() else { return String::new() };
    let line = |case: &&Case| {
        let first = [format!("[{}](#{})", case.name, anchor(case)), case.unit.words(case.ideal)];
        let cells = presets.iter().map(|preset| cell(case, find(rows, case, preset, grid)));
        first.into_iter().chain(cells).collect::<Vec<_>>()
    };
    let table = markdown(head(&["case", "ideal"], &presets), "-:", cases.iter().map(line));
    format!("## At {grid}³\n\n{table}")
}

/// As pages make anchors of headings.
fn anchor(case: &Case) -> String {
    case.name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect()
}

/// Who is beyond the limit, by how much, and what to do; or who was measured and is not.
fn sentence(rows: &Rows, case: &Case) -> String {
    let presets = presets_of(rows, case);
    let far = |preset: &&str| {
        let of_preset = grids(rows).into_iter().filter_map(|grid| Some((grid, find(rows, case, preset, grid)?)));
        let far = of_preset.filter(|(_, kept)| fails(case, kept));
        let far = far.map(|(grid, kept)| format!("{} at {grid}³", case.unit.words(case.farther(kept.min, kept.max))));
        let far: Vec<String> = far.collect();
        (!far.is_empty()).then(|| format!("`{preset}` reaches {}", far.join(", ")))
    };
    let failing: Vec<String> = presets.iter().filter_map(far).collect();
    if failing.is_empty() {
        let names: Vec<String> = presets.iter().map(|preset| format!("`{preset}`")).collect();
        return format!("- **{}**: nothing; measured were {}, which keep the limit.\n", case.name, names.join(", "));
    }
    format!("- **{}**: {} {}.\n", case.name, case.advice, failing.join("; "))
}

fn section(rows: &Rows, case: &Case) -> String {
    let grids = grids(rows);
    let line = |preset: &str| {
        let cells = grids.iter().map(|grid| cell(case, find(rows, case, preset, *grid)));
        std::iter::once(format!("`{preset}`")).chain(cells).collect::<Vec<_>>()
    };
    let head = std::iter::once("preset".to_owned()).chain(grids.iter().map(|grid| format!("{grid}³")));
    let table = markdown(head, "-:", presets_of(rows, case).into_iter().map(line));
    let (ideal, limit) = (case.unit.words(case.ideal), case.unit.words(case.limit));
    format!("\n## {}\n\n{} Ideal {ideal}, limit ±{limit}.\n\n{table}", case.name, case.meaning)
}

/// The other numbers of a case, medians over the places, on its coarsest grid.
fn further(all: &More, case: &Case) -> String {
    let with_more = || all.iter().filter(|((name, _, _), more)| *name == case.name && !more.is_empty());
    let Some(grid) = with_more().map(|((_, _, grid), _)| *grid).min() else { return String::new() };
    let of_grid: Vec<_> = with_more().filter(|((_, _, of), _)| *of == grid).collect();
    let line = |preset: &'static str| {
        let found = of_grid.iter().find(|((_, name, _), _)| name == preset);
        let values = found.into_iter().flat_map(|(_, more)| more.iter().map(|(_, value)| value.clone()));
        std::iter::once(format!("`{preset}`")).chain(values).collect::<Vec<_>>()
    };
    let head = std::iter::once("preset").chain(of_grid[0].1.iter().map(|(name, _)| name.as_str()));
    let table = markdown(head, "-:", presets(of_grid.iter().map(|(key, _)| *key)).into_iter().map(line));
    format!("\nFurther, at {grid}³:\n\n{table}")
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
