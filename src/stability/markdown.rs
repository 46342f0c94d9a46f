//! The tables of `docs/stability.md` and `docs/notes/stability.md`, from rows in `rows.csv`. `page.md` has the prose of
//! the second page.

use std::collections::BTreeSet;

use super::case::Case;
use super::cases;
use super::export::{CsvLine, read_csv};
use crate::lab::table::{MISSING, fill, markdown};
use crate::settings::PRESETS;

/// The cases with rows, and their rows.
fn measured<'a>(all: &[&'a CsvLine]) -> Vec<(&'static Case, Vec<&'a CsvLine>)> {
    let of_case = |case: &'static Case| -> (&'static Case, Vec<&'a CsvLine>) {
        (case, all.iter().copied().filter(|line| line.case == case.name).collect())
    };
    cases::all().map(of_case).filter(|(_, lines)| !lines.is_empty()).collect()
}

/// The short page, `docs/stability.md`, with its table filled.
///
/// # Errors
/// A sentence about the line of `csv` that cannot be read, or about a mark of `page` without an end.
pub fn summary(csv: &str, page: &str) -> Result<String, String> {
    let lines = read_csv(csv)?;
    let all: Vec<&CsvLine> = lines.iter().collect();
    let cases = measured(&all);
    fill(page, |_, _| Ok(overview(&all, &cases, "notes/stability.md"))).map_err(|error| error.to_string())
}

/// The page of a table.
///
/// # Errors
/// A sentence about the line of `csv` that cannot be read.
pub fn page(csv: &str) -> Result<String, String> {
    let lines = read_csv(csv)?;
    let all: Vec<&CsvLine> = lines.iter().collect();
    let cases = measured(&all);
    let table = |name: &str, _: &str| {
        Ok(match name {
            "overview" => overview(&all, &cases, ""),
            "advice" => cases.iter().map(|(case, lines)| sentence(&grids(&all), case, lines)).collect(),
            _ => cases.iter().map(|(case, lines)| section(&grids(&all), case, lines) + &further_table(lines)).collect(),
        })
    };
    fill(include_str!("page.md"), table).map_err(|error| error.to_string())
}

/// The presets of some rows in the program's order.
fn presets(lines: &[&CsvLine]) -> Vec<&'static str> {
    PRESETS.iter().map(|preset| preset.name).filter(|name| lines.iter().any(|line| line.preset == *name)).collect()
}

fn grids(lines: &[&CsvLine]) -> Vec<u32> {
    lines.iter().map(|line| line.grid).collect::<BTreeSet<u32>>().into_iter().collect()
}

/// The row of a preset and a grid among a case's rows.
fn find<'a>(lines: &[&'a CsvLine], preset: &str, grid: u32) -> Option<&'a CsvLine> {
    lines.iter().copied().find(|line| line.preset == preset && line.grid == grid)
}

fn fails(case: &Case, line: &CsvLine) -> bool {
    line.distance.is_some_and(|distance| distance > case.limit * (1.0 + 1e-9))
}

fn cell(case: &Case, line: Option<&CsvLine>) -> String {
    let words = |line: &CsvLine| {
        let text = case.numbers_in_words(line.median?, line.min?, line.max?);
        Some(if fails(case, line) { format!("**{text}**") } else { text })
    };
    line.and_then(words).unwrap_or_else(|| MISSING.to_owned())
}

fn coded(name: &str) -> String {
    format!("`{name}`")
}

/// Every case and preset on the middle grid. `details` is the page with a section for each case.
fn overview(all: &[&CsvLine], cases: &[(&Case, Vec<&CsvLine>)], details: &str) -> String {
    let (grids, presets) = (grids(all), presets(all));
    let Some(grid) = grids.get((grids.len().max(1) - 1) / 2).copied() else { return String::new() };
    let row = |(case, lines): &(&Case, Vec<&CsvLine>)| {
        // The anchor follows the rule for headings.
        let anchor: String = case.name.chars().filter(|c| c.is_ascii_alphanumeric() || *c == '-').collect();
        let first = [format!("[{}]({details}#{anchor})", case.name), case.unit.value_in_words(case.ideal)];
        first.into_iter().chain(presets.iter().map(|preset| cell(case, find(lines, preset, grid)))).collect::<Vec<_>>()
    };
    let head = ["case", "ideal"].map(str::to_owned).into_iter().chain(presets.iter().map(|preset| coded(preset)));
    format!("## At {grid}³\n\n{}", markdown(head, "-:", cases.iter().map(row)))
}

/// The presets beyond the limit with their distances and advice; or, if none is, the measured presets.
fn sentence(grids: &[u32], case: &Case, lines: &[&CsvLine]) -> String {
    let far = |preset: &&str| {
        let of_preset = grids.iter().filter_map(|grid| find(lines, preset, *grid)).filter(|line| fails(case, line));
        let words = |line: &CsvLine| {
            let farthest = case.farther(line.min.unwrap_or_default(), line.max.unwrap_or_default());
            format!("{} at {}³", case.unit.value_in_words(farthest), line.grid)
        };
        let far: Vec<String> = of_preset.map(words).collect();
        (!far.is_empty()).then(|| format!("`{preset}` reaches {}", far.join(", ")))
    };
    let presets = presets(lines);
    let failing: Vec<String> = presets.iter().filter_map(far).collect();
    if failing.is_empty() {
        let names: Vec<String> = presets.iter().map(|preset| coded(preset)).collect();
        return format!("- **{}**: nothing: all measured presets ({}) keep the limit.\n", case.name, names.join(", "));
    }
    format!("- **{}**: {} {}.\n", case.name, case.advice, failing.join("; "))
}

fn section(grids: &[u32], case: &Case, lines: &[&CsvLine]) -> String {
    let row = |preset: &str| {
        let cells = grids.iter().map(|grid| cell(case, find(lines, preset, *grid)));
        std::iter::once(coded(preset)).chain(cells).collect::<Vec<_>>()
    };
    let head = std::iter::once("preset".to_owned()).chain(grids.iter().map(|grid| format!("{grid}³")));
    let table = markdown(head, "-:", presets(lines).into_iter().map(row));
    let (ideal, limit) = (case.unit.value_in_words(case.ideal), case.unit.value_in_words(case.limit));
    format!("\n## {}\n\n{} Ideal {ideal}, limit ±{limit}.\n\n{table}", case.name, case.meaning)
}

/// The further numbers of a case, medians over the places, on its coarsest grid.
fn further_table(lines: &[&CsvLine]) -> String {
    let with_more = || lines.iter().copied().filter(|line| line.further().next().is_some());
    let Some(grid) = with_more().map(|line| line.grid).min() else { return String::new() };
    let of_grid: Vec<&CsvLine> = with_more().filter(|line| line.grid == grid).collect();
    let row = |preset: &'static str| {
        let values = find(&of_grid, preset, grid).into_iter().flat_map(|line| line.further().map(|(_, value)| value));
        std::iter::once(coded(preset)).chain(values.map(str::to_owned)).collect::<Vec<_>>()
    };
    let head = std::iter::once("preset").chain(of_grid[0].further().map(|(name, _)| name));
    format!("\nFurther, at {grid}³:\n\n{}", markdown(head, "-:", presets(&of_grid).into_iter().map(row)))
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
        assert!(page.contains("- **flicker**: nothing: all measured presets (`fast`) keep the limit."));
        assert!(page.contains("`cones` reaches 3.000 % at 64³.") && !page.contains("`fast` reaches"));
        assert!(
            page.contains(
                "| preset | worst 1 % of pixels | FLIP of a frame |\n|---|---:|---:|\n| `fast` | 0.1 | 0.02 |"
            )
        );
        assert!(page.contains("| case | ideal | `fast` | `cones` |"));
        assert!(super::page("nonsense").is_err());
        let summary = super::summary(TABLE, "<!-- table: overview -->\n<!-- end -->\n").unwrap();
        assert!(
            summary.contains("| [leak-1](notes/stability.md#leak-1) | 0 | 0 | **2.000 % (3.000 %)** |"),
            "{summary}"
        );
    }
}
