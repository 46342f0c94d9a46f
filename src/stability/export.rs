//! Files of the table: `rows.json` and `rows.csv` for programs, and the page; and the comparison with an earlier table.

use serde::{Deserialize, Serialize};

use super::case::Case;
use super::cases;
use super::row::Row;
use crate::Result;
use crate::lab::page::Page;
use crate::lab::store::{Origin, Store, Stored};
use crate::lab::table::to_csv;
use crate::measure::timing::Spread;
use crate::output::file;

/// The file `rows.json`; `docs/json.md` lists the keys.
#[derive(Serialize)]
pub struct Table {
    /// [`super::VERSION`]
    version: u32,
    /// The program's version.
    program: &'static str,
    /// The number of requested rows.
    planned: usize,
    /// The cases of the rows, in the page's order.
    cases: Vec<&'static Case>,
    rows: Vec<Row>,
}

/// The file `outline.toml`: the addresses of every row of the whole table in order, including those of other shards.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Outline {
    pub version: u32,
    pub rows: Vec<String>,
}

/// Writes all three files of a folder. `planned` is the number of requested rows; `part` is text such as "part 1 of 4",
/// or empty for a whole table; `running` says whether the program still fills it.
pub fn write(store: &Store<Row>, stored: &[Stored<Row>], planned: usize, part: &str, running: bool) -> Result<()> {
    let rows: Vec<Row> = stored.iter().map(|stored| stored.row.clone()).collect();
    let cases = cases::all().filter(|case| rows.iter().any(|row| row.case == case.name)).collect();
    let table = Table { version: super::VERSION, program: env!("CARGO_PKG_VERSION"), planned, cases, rows };
    file::write_json(&store.path("rows.json"), &table)?;
    file::write(&store.path("rows.csv"), csv(&table.rows).as_bytes())?;
    let devices = Origin::devices(table.rows.iter().filter_map(|row| row.origin.as_ref()));
    let missing = match planned.saturating_sub(table.rows.len()) {
        0 => String::new(),
        n => format!("{n} of {planned} rows are not measured yet; the same command continues."),
    };
    let page = Page {
        title: "Where methods fail",
        about: &format!("{devices}, images of {0}×{0} pixels", super::SIZE),
        missing: &if part.is_empty() { missing } else { format!("This is {part} of a table. {missing}") },
        running,
        style: include_str!("page/style.css"),
        body: include_str!("page/body.html"),
        program: include_str!("page/page.js"),
    };
    let data = serde_json::json!({ "cases": table.cases, "rows": stored });
    file::write(&store.path("index.html"), page.html(&data).as_bytes())
}

/// The columns of `rows.csv`. Times are only in `rows.json`, so that a table on one driver always has the same bytes.
const COLUMNS: [&str; 12] =
    ["case", "preset", "grid", "unit", "ideal", "median", "min", "max", "distance", "worst", "more", "failure"];

/// `rows.csv` (RFC 4180): a header, then a line per row. A number that was not measured is an empty cell.
pub fn csv(rows: &[Row]) -> String {
    let cells = |row: &Row| {
        let (case, m) = (cases::named(&row.case), row.measured.as_ref());
        let number = |value: Option<f64>| value.map_or(String::new(), short);
        let spread = |of: fn(&Spread) -> f64| number(m.map(|m| of(&m.number)));
        let more = m.map_or(String::new(), |m| {
            m.more.iter().map(|(name, value)| format!("{name} = {}", short(*value))).collect::<Vec<_>>().join("; ")
        });
        [
            row.case.clone(),
            row.preset.clone(),
            row.grid.to_string(),
            case.map_or(String::new(), |case| format!("{:?}", case.unit).to_lowercase()),
            number(case.map(|case| case.ideal)),
            spread(|number| number.median),
            spread(|number| number.min),
            spread(|number| number.max),
            number(m.map(|m| m.distance)),
            m.map_or(String::new(), |m| m.worst.clone()),
            more,
            row.failure.clone().unwrap_or_default(),
        ]
    };
    to_csv(std::iter::once(COLUMNS.map(str::to_owned)).chain(rows.iter().map(cells)))
}

/// A number with four digits, which is the precision that rounding of other drivers leaves.
fn short(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    if rounded.abs() < 1e-4 { format!("{rounded:e}") } else { rounded.to_string() }
}

/// A line of `rows.csv` with the columns that are read again. A row that could not run has no numbers.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
pub struct CsvLine {
    pub case: String,
    pub preset: String,
    pub grid: u32,
    pub median: Option<f64>,
    pub min: Option<f64>,
    pub max: Option<f64>,
    pub distance: Option<f64>,
    /// Further numbers as text: `name = value; …`.
    pub more: String,
}

impl CsvLine {
    /// Whether both are of one case, preset and grid.
    pub fn is_same_as(&self, other: &Self) -> bool {
        (&self.case, &self.preset, self.grid) == (&other.case, &other.preset, other.grid)
    }

    /// Names and values of further numbers.
    pub fn further(&self) -> impl Iterator<Item = (&str, &str)> {
        self.more.split("; ").filter_map(|pair| pair.split_once(" = "))
    }
}

/// Reads a table.
///
/// # Errors
/// A sentence about the line that cannot be read.
pub fn read_csv(text: &str) -> std::result::Result<Vec<CsvLine>, String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    if reader.headers().is_ok_and(|head| *head != COLUMNS[..]) {
        return Err(format!("the first line is not {}", COLUMNS.join(",")));
    }
    let line = |(i, line): (usize, csv::Result<CsvLine>)| line.map_err(|_| format!("line {} is not a row", i + 2));
    reader.deserialize().enumerate().map(line).collect()
}

/// The largest change that another driver's rounding may cause: a share of the distance from the ideal, and of the
/// case's limit (or of a thousandth if the limit is 0).
const SHARE: f64 = 0.1;
const OF_LIMIT: f64 = 0.2;

/// The changes, one sentence each.
#[derive(Debug, Default)]
pub struct Changes {
    /// Rows that are farther from the ideal, or no longer measured.
    pub worse: Vec<String>,
    pub better: Vec<String>,
    /// Rows that the earlier table lacks.
    pub unknown: Vec<String>,
    /// The number of rows in both.
    pub compared: usize,
}

/// Compares the rows of `now` with those of `before`. Rows that are only in the earlier table are ignored.
pub fn changes(before: &[CsvLine], now: &[CsvLine]) -> Changes {
    let mut changes = Changes::default();
    for new in now {
        let name = format!("{} {} {}³", new.case, new.preset, new.grid);
        let Some(old) = before.iter().find(|old| old.is_same_as(new)) else {
            changes.unknown.push(name);
            continue;
        };
        changes.compared += 1;
        match (old.distance, new.distance) {
            (Some(old), Some(now)) => {
                let line = format!("{name}: {now} from the ideal, was {old}");
                let limit = cases::named(&new.case).map_or(0.0, |case| case.limit);
                let tolerance = SHARE * old + OF_LIMIT * if limit > 0.0 { limit } else { 1e-3 };
                match now - old {
                    d if d > tolerance => changes.worse.push(line),
                    d if d < -tolerance => changes.better.push(line),
                    _ => {}
                }
            }
            (Some(_), None) => changes.worse.push(format!("{name} could not run, and did before")),
            (None, Some(_)) => changes.better.push(format!("{name} runs, and did not before")),
            (None, None) => {}
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::row::Measured;

    #[test]
    fn a_table_is_read_as_it_was_written() {
        let measured = Measured {
            number: Spread { median: 0.012345, min: 0.0, max: 0.5 },
            distance: 0.5,
            worst: "0.1, 0.2, 0.3 voxels".into(),
            more: vec![("rel".into(), 1e-7)],
            ..Measured::default()
        };
        let (case, preset) = ("leak-1".into(), "fast".into());
        let row = Row { case, preset, grid: 64, measured: Some(measured), ..Row::default() };
        let failed = Row { grid: 32, measured: None, failure: Some("no, \"never\"".into()), ..row.clone() };
        let text = csv(&[row, failed]);
        assert!(text.contains("0.01235,0,0.5,0.5,\"0.1, 0.2, 0.3 voxels\",rel = 1e-7,\n"), "{text}");
        let read = read_csv(&text).unwrap();
        let CsvLine { median, min, max, distance, .. } = read[0];
        assert_eq!([median, min, max, distance], [0.01235, 0.0, 0.5, 0.5].map(Some));
        assert_eq!(read[0].further().collect::<Vec<_>>(), [("rel", "1e-7")]);
        assert_eq!((read[1].grid, read[1].distance), (32, None));
        assert!(read_csv("something else\n").is_err());
    }

    #[test]
    fn worse_and_better_are_told_apart() {
        let table = |case: &str, distance| {
            [CsvLine { case: case.into(), preset: "fast".into(), grid: 32, distance, ..CsvLine::default() }]
        };
        // The limit of leaks is a thousandth, and that of stillness is 0.
        let told = |case, old, new| {
            let changes = changes(&table(case, old), &table(case, new));
            (changes.worse.len(), changes.better.len(), changes.compared)
        };
        assert_eq!(told("leak-1", Some(0.0), Some(0.0001)), (0, 0, 1));
        assert_eq!(told("leak-1", Some(0.0), Some(0.001)), (1, 0, 1));
        assert_eq!(told("flicker", Some(0.0), Some(0.001)), (1, 0, 1));
        assert_eq!(told("leak-1", Some(0.05), Some(0.04)), (0, 1, 1));
        assert_eq!(told("leak-1", Some(0.05), Some(0.054)), (0, 0, 1));
        assert_eq!(told("leak-1", Some(0.05), None), (1, 0, 1));
        assert_eq!(told("leak-1", None, Some(0.05)), (0, 1, 1));
        let changes = changes(&table("leak-1", None), &table("leak-2", None));
        assert_eq!((changes.unknown, changes.compared), (vec!["leak-2 fast 32³".to_owned()], 0));
    }
}
