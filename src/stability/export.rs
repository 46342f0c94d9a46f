//! The table as files: `rows.json` and `rows.csv` for programs; the page is beside.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::cases;
use super::row::{Pictures, Row};
use crate::chart::store::{Store, Stored};
use crate::output::file;
use crate::{Error, Result};

/// The file `rows.json`; `docs/json.md` lists the keys.
#[derive(Clone, Debug, Serialize)]
pub struct Table {
    /// [`super::VERSION`]
    pub version: u32,
    /// The program's version.
    pub program: &'static str,
    /// Rows that were asked for.
    pub planned: usize,
    pub cases: Vec<CaseLine>,
    pub rows: Vec<Row>,
}

/// The file `outline.toml`: the addresses of every row of the whole table in its order, those of other shards too.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outline {
    pub version: u32,
    pub rows: Vec<String>,
}

impl Outline {
    pub fn save(&self, store: &Store) -> Result<()> {
        file::write_kept(&store.path("outline.toml"), self)
    }

    /// That of a folder.
    ///
    /// # Errors
    /// [`Error::File`]: there is none, it is damaged, or it is of another version of the program.
    pub fn load(folder: &Path) -> Result<Self> {
        let path = folder.join("outline.toml");
        let text = std::fs::read_to_string(&path).ok();
        let outline: Option<Self> = text.and_then(|text| toml::from_str(&text).ok());
        let today = outline.filter(|outline| outline.version == super::VERSION);
        today.ok_or_else(|| {
            Error::file(&path, "is missing or of another version; run `twobounce stability` there again")
        })
    }
}

/// What a case is.
#[derive(Clone, Debug, Serialize)]
pub struct CaseLine {
    pub name: &'static str,
    pub meaning: &'static str,
    pub advice: &'static str,
    /// `share`, `ratio` or `frames`.
    pub unit: &'static str,
    pub ideal: f64,
    pub limit: f64,
}

/// Writes all three files of a folder; see [`super::page::html`].
pub fn write(store: &Store, stored: &[Stored<Row, Pictures>], planned: usize, around: (&str, bool)) -> Result<()> {
    let rows: Vec<Row> = stored.iter().map(|stored| stored.row.clone()).collect();
    let (version, program) = (super::VERSION, env!("CARGO_PKG_VERSION"));
    let table = Table { version, program, planned, cases: case_lines(&rows), rows };
    file::write_json(&store.path("rows.json"), &table)?;
    file::write(&store.path("rows.csv"), csv(&table.rows).as_bytes())?;
    file::write(&store.path("index.html"), super::page::html(&table, stored, around).as_bytes())
}

/// The cases that rows are of, in the page's order.
pub fn case_lines(rows: &[Row]) -> Vec<CaseLine> {
    let used = cases::all().filter(|case| rows.iter().any(|row| row.case == case.name));
    let line = |case: &super::case::Case| CaseLine {
        name: case.name,
        meaning: case.meaning,
        advice: case.advice,
        unit: case.unit.name(),
        ideal: case.ideal,
        limit: case.limit,
    };
    used.map(line).collect()
}

/// The columns of `rows.csv`. Times are in `rows.json` alone, so that a table on the same driver has the same bytes.
const COLUMNS: &str = "case,preset,grid,unit,ideal,median,min,max,distance,worst,more,failure";

/// `rows.csv` (RFC 4180): a header, then a line per row. A number that was not measured is an empty cell.
pub fn csv(rows: &[Row]) -> String {
    let line = |row: &Row| {
        let case = cases::named(&row.case);
        let m = row.measured.as_ref();
        let number = |value: Option<f64>| value.map_or(String::new(), short);
        let more = m.map_or(String::new(), |m| {
            m.more.iter().map(|(name, value)| format!("{name} = {}", short(*value))).collect::<Vec<_>>().join("; ")
        });
        let cells = [
            row.case.clone(),
            row.preset.clone(),
            row.grid.to_string(),
            case.map_or(String::new(), |case| case.unit.name().to_owned()),
            number(case.map(|case| case.ideal)),
            number(m.map(|m| m.number.median)),
            number(m.map(|m| m.number.min)),
            number(m.map(|m| m.number.max)),
            number(m.map(|m| m.distance)),
            m.map_or(String::new(), |m| m.worst.clone()),
            more,
            row.failure.clone().unwrap_or_default(),
        ];
        cells.map(|cell| escape(&cell)).join(",") + "\n"
    };
    let lines: String = rows.iter().map(line).collect();
    format!("{COLUMNS}\n{lines}")
}

/// Four digits: as many as another driver's rounding leaves.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded.abs() < 1e-4 { format!("{rounded:e}") } else { rounded.to_string() }
}

fn escape(cell: &str) -> String {
    if cell.contains(['"', ',', '\n']) { format!("\"{}\"", cell.replace('"', "\"\"")) } else { cell.to_owned() }
}

/// A line of `rows.csv` as far as tables are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    pub median: f64,
    pub min: f64,
    pub max: f64,
    pub distance: f64,
}

/// The lines of a table by case, preset and grid; `None` where a row could not run.
pub type Rows = BTreeMap<(String, String, u32), Option<Kept>>;

/// Reads a table.
///
/// # Errors
/// A sentence about the line that cannot be read.
pub fn read_csv(text: &str) -> std::result::Result<Rows, String> {
    let mut lines = text.lines();
    if lines.next() != Some(COLUMNS) {
        return Err(format!("the first line is not {COLUMNS}"));
    }
    let read = |line: &str| {
        // Only the last cells, which are not read, may be quoted.
        let cells: Vec<&str> = line.split(',').collect();
        let [case, preset, grid, _, _, median, min, max, distance, ..] = cells[..] else { return None };
        let number = |cell: &str| cell.parse::<f64>().ok();
        let kept = if distance.is_empty() {
            None
        } else {
            let (median, min, max) = (number(median)?, number(min)?, number(max)?);
            Some(Kept { median, min, max, distance: number(distance)? })
        };
        Some(((case.to_owned(), preset.to_owned(), grid.parse().ok()?), kept))
    };
    let row = |(at, line): (usize, &str)| read(line).ok_or_else(|| format!("line {} is not a row", at + 2));
    lines.enumerate().map(row).collect()
}

/// The further numbers of a table's rows, as they are written there.
pub fn read_more(text: &str) -> BTreeMap<(String, String, u32), Vec<(String, String)>> {
    let read = |line: &str| {
        let mut first = line.split(',');
        let key = (first.next()?.to_owned(), first.next()?.to_owned(), first.next()?.parse().ok()?);
        // A row with numbers has no failure, and no name of a number has a comma.
        let more = line.rsplit(',').nth(1)?;
        let pairs = more.split("; ").filter_map(|pair| pair.split_once(" = "));
        Some((key, pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect()))
    };
    text.lines().skip(1).filter_map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::timing::Spread;
    use crate::stability::row::Measured;

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let measured = Measured {
            number: Spread { median: 0.012345, min: 0.0, max: 0.5 },
            distance: 0.5,
            worst: "0.1, 0.2, 0.3 voxels".into(),
            places: vec![],
            more: vec![("rel".into(), 1e-7)],
            frame_gpu_ms: Spread::of([1.0]),
            seconds: 1.0,
        };
        let row = Row {
            key: String::new(),
            address: String::new(),
            origin: None,
            case: "leak-1".into(),
            preset: "fast".into(),
            method: "rays".into(),
            grid: 64,
            command: String::new(),
            measured: Some(measured),
            failure: None,
        };
        let failed = Row { grid: 32, measured: None, failure: Some("no, \"never\"".into()), ..row.clone() };
        let text = csv(&[row, failed]);
        assert!(text.contains("0.01235,0,0.5,0.5,\"0.1, 0.2, 0.3 voxels\",rel = 1e-7,\n"), "{text}");
        let read = read_csv(&text).unwrap();
        let key = |grid| ("leak-1".to_owned(), "fast".to_owned(), grid);
        assert_eq!(read[&key(64)], Some(Kept { median: 0.01235, min: 0.0, max: 0.5, distance: 0.5 }));
        assert_eq!(read[&key(32)], None);
        assert!(read_csv("something else\n").is_err());
    }
}
