//! Ledgers: rows that say what a source prints, what is right instead, and how that is measured; and the pages of the methods
//! that have rows alone. The talk's, with furnaces and choices, is `src/gi/cones/ledger`.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::{Method, lpv, photons};

/// One row. The wording is Markdown.
pub struct Row {
    pub id: &'static str,
    /// What the source has. Where a sheet has two columns for it, ` | ` stands between their cells.
    pub printed: &'static str,
    pub right: &'static str,
    pub effect: Effect,
}

/// What a row does to an image.
pub enum Effect {
    /// Images with `right` and with `right` + `printed` (both `key=value`, on top of the ledger's preset) are compared.
    Measured { right: &'static [&'static str], printed: &'static [&'static str] },
    /// As printed it does not compile or is undefined: there only the right form exists.
    NeverRan,
    /// Both forms gave the same image on every scene of the study: the switch is gone, a test of the formula stays.
    NoImage,
    /// There is no other form here.
    Fixed,
}

impl Row {
    /// The row of a table: its cells, then those of what was measured.
    pub(crate) fn line(&self, change: Option<&Change>) -> String {
        let with = match self.effect {
            Effect::NeverRan => "never ran as printed".into(),
            Effect::NoImage => "no image of the study shows it".into(),
            Effect::Fixed | Effect::Measured { right: [], .. } => "–".into(),
            Effect::Measured { right, .. } => format!("`{}`", right.join("`, `")),
        };
        let cells = change.map_or("– | –".into(), Change::cells);
        format!("| {} | {} | {} | {with} | {cells} |\n", self.id, self.printed, self.right)
    }
}

/// What one comparison gave.
#[derive(Clone, Debug, PartialEq)]
pub struct Change {
    /// mean \|printed − right\| / mean(right), in percent.
    pub rel_percent: f64,
    /// mean(printed) / mean(right).
    pub energy: f64,
}

impl Change {
    /// Two cells of a Markdown table.
    pub(crate) fn cells(&self) -> String {
        format!("{:.2} % | {:.3}", self.rel_percent, self.energy)
    }

    /// The reverse of [`Self::cells`].
    pub(crate) fn parse(cells: &[&str]) -> Option<Self> {
        let [rel, energy] = cells else { return None };
        Some(Self { rel_percent: rel.strip_suffix(" %")?.parse().ok()?, energy: energy.parse().ok()? })
    }
}

/// The ledger of a method that has rows alone.
pub struct Sheet {
    pub method: Method,
    /// Its rows are measured on top of it.
    pub preset: &'static str,
    /// Its own page.
    pub page: &'static str,
    pub title: &'static str,
    pub head: &'static str,
    /// Titles of the columns of [`Row::printed`] and [`Row::right`], with ` | ` between them.
    pub columns: &'static str,
    /// Names of the images that are compared: of the source's form, and of the one here.
    pub compared: [&'static str; 2],
    pub rows: &'static [Row],
}

pub const SHEETS: &[Sheet] = &[
    Sheet {
        method: Method::Lpv,
        preset: "lpv",
        page: "docs/lpv.md",
        title: "Light propagation volumes, and their ledger",
        head: lpv::ledger::HEAD,
        columns: "on the page | not on the page | here",
        compared: ["source", "here"],
        rows: lpv::ledger::ROWS,
    },
    Sheet {
        method: Method::Photons,
        preset: "photons",
        page: "docs/photons.md",
        title: "Photon-normalised cones, and their ledger",
        head: photons::ledger::HEAD,
        columns: "printed | right",
        compared: ["printed", "right"],
        rows: photons::ledger::ROWS,
    },
];

/// What a run of `twobounce ledger --method` measured: scene, image size, grid, device and driver in one sentence, and changes
/// by their rows' ids.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Measured {
    pub about: String,
    pub changes: BTreeMap<String, Change>,
}

impl Sheet {
    fn head(&self) -> String {
        let [source, here] = self.compared;
        format!(
            "# {}\n\nWritten by `twobounce ledger --method {}`. {}\nChanges are of the whole image, one row at a time, everything else as in \
             `{}`: *change* is mean |{source} − {here}| over mean {here}, *energy* is mean {source} over mean {here}.\n\n",
            self.title, self.method, self.head, self.preset
        )
    }

    /// The page.
    pub fn document(&self, measured: &Measured) -> String {
        let mut text = format!("{}{}\n\n", self.head(), measured.about);
        let columns = format!("| row | {} | measured with | change | energy |", self.columns);
        write!(text, "{columns}\n{}|\n", "|---".repeat(columns.matches(" | ").count() + 1)).expect("fmt");
        for row in self.rows {
            write!(text, "{}", row.line(measured.changes.get(row.id))).expect("fmt");
        }
        text
    }

    /// What a page written by [`Self::document`] says; `None` where its head is another's.
    pub fn parse(&self, text: &str) -> Option<Measured> {
        let (about, table) = text.strip_prefix(&self.head())?.split_once('\n')?;
        let mut measured = Measured { about: about.into(), ..Measured::default() };
        for line in table.lines().filter(|line| line.starts_with("| ")) {
            let cells: Vec<&str> = line.trim_matches('|').split(" | ").map(str::trim).collect();
            if let Some(change) = cells.len().checked_sub(2).and_then(|i| Change::parse(&cells[i..])) {
                measured.changes.insert(cells[0].into(), change);
            }
        }
        Some(measured)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_says_what_was_measured() {
        for sheet in SHEETS {
            let measured_rows = sheet.rows.iter().filter(|row| matches!(row.effect, Effect::Measured { .. }));
            let change = Change { rel_percent: 12.34, energy: 0.987 };
            let changes = measured_rows.map(|row| (row.id.to_owned(), change.clone())).collect();
            let measured = Measured { about: "A scene on a device.".into(), changes };
            let page = sheet.document(&measured);
            let cells = |line: &str| line.matches(" | ").count();
            let table: Vec<&str> = page.lines().filter(|line| line.starts_with("| ")).collect();
            assert!(table.len() > 10 && table.iter().all(|line| cells(line) == cells(table[0])), "{}", sheet.page);
            assert_eq!(sheet.parse(&page), Some(measured));
            assert_eq!(sheet.parse(&page.replace("Written by", "Made by")), None);
        }
    }
}
