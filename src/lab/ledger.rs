//! Ledgers: pages that list, row by row, what a source prints, the correct form, and the effect of the difference on an
//! image.
//!
//! A page is written by hand. A line with settings in its cells describes a measurement, whose results are in its last
//! cells. The table's name determines the kind of cells: see [`Comparison`].

use super::table::{self, cells, coded};
use crate::gi::Method;
use crate::{Error, Result};

/// The page about a method's source.
pub struct Ledger {
    pub method: Method,
    /// The preset to which rows are compared.
    pub preset: &'static str,
    pub page: &'static str,
    /// The text of the page at build time.
    pub text: &'static str,
}

pub const LEDGERS: &[Ledger] = &[
    Ledger::new(Method::Cones, "corrected", "docs/notes/ledger.md", include_str!("../../docs/notes/ledger.md")),
    Ledger::new(Method::Lpv, "lpv", "docs/notes/lpv.md", include_str!("../../docs/notes/lpv.md")),
    Ledger::new(Method::Photons, "photons", "docs/notes/photons.md", include_str!("../../docs/notes/photons.md")),
];

impl Ledger {
    const fn new(method: Method, preset: &'static str, page: &'static str, text: &'static str) -> Self {
        Self { method, preset, page, text }
    }
}

/// The measurement of a line. Settings are `key=value`; `sky=value` is the scene's sky.
#[derive(Clone, Debug, PartialEq)]
pub enum Comparison {
    /// `changes`: compares images with and without `printed`, both with `right`. The third last cell has the settings:
    /// those before "on" are `printed`. The results are mean |printed − right| over the mean of right, and the ratio of
    /// the means.
    Change { printed: Vec<String>, right: Vec<String> },
    /// `fills`: error and energy of the indirect light on diffuse surfaces, against the path tracer. The first cell has
    /// the settings, and the head the scenes.
    Fill { settings: Vec<String>, scenes: Vec<String> },
    /// `furnaces`: radiance in a closed room after two bounces over the exact value. The first cells have the settings,
    /// the walls' albedo, and whether there is a block inside; the head has the grids.
    Furnace { settings: Vec<String>, albedo: f32, block: bool, edges: Vec<u32> },
}

/// A measured line of a page.
#[derive(Clone, Debug)]
pub struct Line {
    /// The number of the line, from 0.
    pub at: usize,
    /// The first cells, which describe the line.
    pub name: String,
    /// The last cells: one for each result.
    pub results: Vec<String>,
    pub job: Comparison,
}

/// The measured lines in the order of the page.
///
/// # Errors
/// A sentence about a line that cannot be read.
pub fn lines(page: &str) -> Result<Vec<Line>> {
    table::tables(page)?;
    let (mut found, mut name, mut head) = (Vec::new(), "", Vec::new());
    for (at, line) in page.lines().enumerate() {
        if let Some(mark) = line.strip_prefix("<!-- table: ") {
            (name, head) = (mark.trim_end_matches(" -->"), Vec::new());
        }
        let Some(cells) = cells(line) else { continue };
        if head.is_empty() {
            head = cells;
            continue;
        }
        let wrong = || Error::Usage(format!("line {} of the page is no row of the table {name}", at + 1));
        if cells.len() != head.len() || cells.len() < 3 {
            return Err(wrong());
        }
        let owned = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
        let settings = |cell: &str| owned(&coded(cell));
        let (count, job) = match name {
            "changes" => {
                let cell = cells[cells.len() - 3];
                let (printed, right) = cell.split_once(" on ").unwrap_or((cell, ""));
                (2, Comparison::Change { printed: settings(printed), right: settings(right) })
            }
            "fills" => (cells.len() - 1, Comparison::Fill { settings: settings(cells[0]), scenes: owned(&head[1..]) }),
            "furnaces" => {
                let edges = head[3..].iter().map(|edge| edge.trim_end_matches('³').parse());
                let edges = edges.collect::<std::result::Result<_, _>>().map_err(|_| wrong())?;
                let albedo = cells[1].parse().map_err(|_| wrong())?;
                let block = cells[2] == "with a block";
                (cells.len() - 3, Comparison::Furnace { settings: settings(cells[0]), albedo, block, edges })
            }
            _ => continue,
        };
        if !matches!(&job, Comparison::Change { printed, .. } if printed.is_empty()) {
            let (first, results) = cells.split_at(cells.len() - count);
            let first = if name == "changes" { &first[..1] } else { first };
            found.push(Line { at, name: first.join(", ").replace('`', ""), results: owned(results), job });
        }
    }
    Ok(found)
}

/// The page with new results for some lines, by their index.
pub fn with_results<'a>(page: &str, results: impl Fn(usize) -> Option<&'a [String]>) -> String {
    let line = |(at, line): (usize, &str)| match (results(at), cells(line)) {
        (Some(results), Some(cells)) => {
            let first = cells[..cells.len() - results.len()].iter().copied();
            format!("| {} |\n", first.chain(results.iter().map(String::as_str)).collect::<Vec<_>>().join(" | "))
        }
        _ => format!("{line}\n"),
    };
    page.lines().enumerate().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_take_the_place_of_results() {
        let page = "Text.\n<!-- table: changes -->\n\n| row | printed | measured with | change | energy |\n|---|---|---|---|---|\n\
                    | D1 | a \\| b | `a=1` on `b=2` `c=3` | – | – |\n| D2 | c | – | – | – |\n\n<!-- end -->\n\
                    <!-- table: furnaces -->\n\n| fill | albedo | room | 32³ |\n|---|---|---|---|\n| `d=4` | 0.5 | empty | – |\n\n<!-- end -->\n";
        let found = lines(page).unwrap();
        let names = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
        assert_eq!(found[0].job, Comparison::Change { printed: names(&["a=1"]), right: names(&["b=2", "c=3"]) });
        let furnace = Comparison::Furnace { settings: names(&["d=4"]), albedo: 0.5, block: false, edges: vec![32] };
        assert_eq!((&found[1].job, found[1].name.as_str(), found.len()), (&furnace, "d=4, 0.5, empty", 2));
        let results = names(&["1.00 %", "2.000"]);
        let filled = with_results(page, |at| (at == found[0].at).then_some(&results[..]));
        assert_eq!(filled.replace("1.00 % | 2.000", "– | –"), page);
        assert_eq!(lines(&filled).unwrap()[0].results, results);
    }
}
