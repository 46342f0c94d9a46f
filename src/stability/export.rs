//! The table as files: `rows.json` and `rows.csv` for programs; the page is beside.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::case::Case;
use super::cases;
use super::row::Row;
use crate::lab::store::{Store, Stored};
use crate::lab::table::{from_csv, to_csv};
use crate::output::file;
use crate::{Error, Result};

/// The file `rows.json`; `docs/json.md` lists the keys.
#[derive(Serialize)]
pub struct Table {
    /// [`super::VERSION`]
    pub version: u32,
    /// The program's version.
    pub program: &'static str,
    /// Rows that were asked for.
    pub planned: usize,
    /// Those that rows are of, in the page's order.
    pub cases: Vec<&'static Case>,
    pub rows: Vec<Row>,
}

/// The file `outline.toml`: the addresses of every row of the whole table in its order, those of other shards too.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outline {
    pub version: u32,
    pub rows: Vec<String>,
}

impl Outline {
    pub fn save(&self, store: &Store<Row>) -> Result<()> {
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

/// Writes all three files of a folder; see [`super::page::html`].
pub fn write(store: &Store<Row>, stored: &[Stored<Row>], planned: usize, around: (&str, bool)) -> Result<()> {
    let rows: Vec<Row> = stored.iter().map(|stored| stored.row.clone()).collect();
    let (version, program) = (super::VERSION, env!("CARGO_PKG_VERSION"));
    let table = Table { version, program, planned, cases: cases(&rows), rows };
    file::write_json(&store.path("rows.json"), &table)?;
    file::write(&store.path("rows.csv"), csv(&table.rows).as_bytes())?;
    file::write(&store.path("index.html"), super::page::html(&table, stored, around).as_bytes())
}

fn cases(rows: &[Row]) -> Vec<&'static Case> {
    cases::all().filter(|case| rows.iter().any(|row| row.case == case.name)).collect()
}

/// The columns of `rows.csv`. Times are in `rows.json` alone, so that a table on the same driver has the same bytes.
const COLUMNS: [&str; 12] =
    ["case", "preset", "grid", "unit", "ideal", "median", "min", "max", "distance", "worst", "more", "failure"];

/// `rows.csv` (RFC 4180): a header, then a line per row. A number that was not measured is an empty cell.
pub fn csv(rows: &[Row]) -> String {
    let cells = |row: &Row| {
        let (case, m) = (cases::named(&row.case), row.measured.as_ref());
        let number = |value: Option<f64>| value.map_or(String::new(), short);
        let more = m.map_or(String::new(), |m| {
            m.more.iter().map(|(name, value)| format!("{name} = {}", short(*value))).collect::<Vec<_>>().join("; ")
        });
        [
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
        ]
    };
    to_csv(std::iter::once(COLUMNS.map(str::to_owned)).chain(rows.iter().map(cells)))
}

/// Four digits: as many as another driver's rounding leaves.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded.abs() < 1e-4 { format!("{rounded:e}") } else { rounded.to_string() }
}

/// A line of `rows.csv` as far as tables are compared.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kept {
    pub median: f64,
    pub min: f64,
    pub max: f64,
    pub distance: f64,
}

/// Case, preset and grid.
pub type Key = (String, String, u32);

/// The lines of a table by case, preset and grid; `None` where a row could not run.
pub type Rows = BTreeMap<Key, Option<Kept>>;

/// Further numbers, as they are written: names and values.
pub type More = BTreeMap<Key, Vec<(String, String)>>;

/// Reads a table, and the further numbers of its rows.
///
/// # Errors
/// A sentence about the line that cannot be read.
pub fn read_csv(text: &str) -> std::result::Result<(Rows, More), String> {
    let (head, lines) = from_csv(text)?;
    if head != COLUMNS {
        return Err(format!("the first line is not {}", COLUMNS.join(",")));
    }
    let (mut rows, mut more) = (Rows::new(), More::new());
    for (at, line) in lines.iter().enumerate() {
        let read = || {
            let key = (line.cell("case").to_owned(), line.cell("preset").to_owned(), line.cell("grid").parse().ok()?);
            let [median, min, max, distance] = ["median", "min", "max", "distance"].map(|column| line.number(column));
            let kept = match line.cell("distance") {
                "" => None,
                _ => Some(Kept { median: median?, min: min?, max: max?, distance: distance? }),
            };
            Some((key, kept))
        };
        let (key, kept) = read().ok_or_else(|| format!("line {} is not a row", at + 2))?;
        let pairs = line.cell("more").split("; ").filter_map(|pair| pair.split_once(" = "));
        more.insert(key.clone(), pairs.map(|(name, value)| (name.to_owned(), value.to_owned())).collect());
        rows.insert(key, kept);
    }
    Ok((rows, more))
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
        let (read, more) = read_csv(&text).unwrap();
        let key = |grid| ("leak-1".to_owned(), "fast".to_owned(), grid);
        assert_eq!(read[&key(64)], Some(Kept { median: 0.01235, min: 0.0, max: 0.5, distance: 0.5 }));
        assert_eq!(more[&key(64)], [("rel".to_owned(), "1e-7".to_owned())]);
        assert_eq!(read[&key(32)], None);
        assert!(read_csv("something else\n").is_err());
    }
}
