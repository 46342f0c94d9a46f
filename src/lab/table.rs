//! Tables of numbers: CSV files, and tables in Markdown pages.
//!
//! A page holds a table between `<!-- table: NAME -->` and `<!-- end -->`. A program writes the text between the two
//! marks, and people write the rest of the page. Tests compare tables, and no sentences.

use std::borrow::Cow;
use std::path::Path;

use crate::output::file;
use crate::{Error, Result};

const OPEN: &str = "<!-- table: ";
const CLOSE: &str = "<!-- end -->";

/// A cell whose number was not measured.
pub const MISSING: &str = "–";

/// First characters of a text that a spreadsheet takes for a formula.
const FORMULA: [u8; 6] = *b"=+-@\t\r";

/// The cell with an apostrophe in front if a spreadsheet would take it for a formula, which could be a name chosen by
/// someone else. Numbers are unchanged.
fn defused(cell: &[u8]) -> Cow<'_, [u8]> {
    let is_number = || str::from_utf8(cell).is_ok_and(|text| text.parse::<f64>().is_ok());
    match cell.first() {
        Some(first) if FORMULA.contains(first) && !is_number() => [b"'", cell].concat().into(),
        _ => cell.into(),
    }
}

/// The original text of a cell that [`defused`] wrote.
fn as_given(cell: &str) -> &str {
    match cell.as_bytes() {
        [b'\'', first, ..] if FORMULA.contains(first) => &cell[1..],
        _ => cell,
    }
}

/// Rows of cells as CSV (RFC 4180, with newlines). No cell is a formula.
pub fn to_csv<C: AsRef<[u8]>>(rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for row in rows {
        let row: Vec<C> = row.into_iter().collect();
        writer
            .write_record(row.iter().map(|cell| defused(cell.as_ref())))
            .expect("memory takes every byte, and all rows have as many cells");
    }
    String::from_utf8(writer.into_inner().expect("memory takes every byte")).expect("cells are text")
}

/// A row of a CSV file: pairs of a column's name and a cell.
#[derive(Clone, Debug)]
pub struct CsvRow(Vec<(String, String)>);

impl CsvRow {
    /// The cell of a column; empty if the file has no such column.
    pub fn cell(&self, column: &str) -> &str {
        self.0.iter().find(|(name, _)| name == column).map_or("", |(_, value)| value)
    }

    /// The cell as a number; `None` if it is empty or no number.
    pub fn number(&self, column: &str) -> Option<f64> {
        self.cell(column).parse().ok()
    }
}

/// The columns and the rows of a CSV file.
///
/// # Errors
/// A sentence about the line that cannot be read.
pub fn from_csv(text: &str) -> std::result::Result<(Vec<String>, Vec<CsvRow>), String> {
    let mut reader = csv::Reader::from_reader(text.as_bytes());
    let head: Vec<String> = reader.headers().map_err(|e| e.to_string())?.iter().map(str::to_owned).collect();
    let row = |(i, record): (usize, csv::Result<csv::StringRecord>)| {
        let record = record.map_err(|_| format!("line {} is not a row", i + 2))?;
        Ok(CsvRow(head.iter().cloned().zip(record.iter().map(as_given).map(str::to_owned)).collect()))
    };
    let rows = reader.records().enumerate().map(row).collect::<std::result::Result<_, String>>()?;
    Ok((head, rows))
}

/// The rows of a CSV file.
///
/// # Errors
/// [`Error::File`] if it cannot be read.
pub fn read_csv(path: &Path) -> Result<Vec<CsvRow>> {
    let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, e.to_string()))?;
    Ok(from_csv(&text).map_err(|why| Error::file(path, why))?.1)
}

/// A Markdown table. `align` has a character for each column, `-` for text and `:` for numbers; the last one applies to
/// all further columns.
pub fn markdown<H: AsRef<str>, C: AsRef<str>>(
    head: impl IntoIterator<Item = H>,
    align: &str,
    rows: impl IntoIterator<Item = impl IntoIterator<Item = C>>,
) -> String {
    fn line<C: AsRef<str>>(cells: impl IntoIterator<Item = C>) -> (String, usize) {
        let (mut text, mut count) = ("|".to_owned(), 0);
        for cell in cells {
            text += &format!(" {} |", cell.as_ref());
            count += 1;
        }
        (text + "\n", count)
    }
    let (head, columns) = line(head);
    let last = align.chars().last().unwrap_or('-');
    let rule =
        align.chars().chain(std::iter::repeat(last)).take(columns).map(|c| if c == ':' { "---:|" } else { "---|" });
    head + "|" + &rule.collect::<String>() + "\n" + &rows.into_iter().map(|row| line(row).0).collect::<String>()
}

/// The cells of a line of a Markdown table; `None` for another line, and for the rule below a head.
pub fn cells(line: &str) -> Option<Vec<&str>> {
    let cells = line.strip_prefix("| ")?.trim_end().strip_suffix(" |")?;
    Some(cells.split(" | ").map(str::trim).collect())
}

/// The texts between backticks.
pub fn coded(text: &str) -> Vec<&str> {
    text.split('`').skip(1).step_by(2).collect()
}

/// A page with new text between its marks. `table` maps a table's name and old text to its new text.
///
/// # Errors
/// Errors of `table`, and a sentence about a mark without an end.
pub fn fill(page: &str, mut table: impl FnMut(&str, &str) -> Result<String>) -> Result<String> {
    let (mut text, mut rest) = (String::new(), page);
    while let Some((before, after)) = rest.split_once(OPEN) {
        let wrong = |why: String| Error::Usage(why);
        let (name, after) =
            after.split_once(" -->\n").ok_or_else(|| wrong("a mark of a table does not end its line".into()))?;
        let (old, after) = after.split_once(CLOSE).ok_or_else(|| wrong(format!("the table {name} has no {CLOSE}")))?;
        text += &format!("{before}{OPEN}{name} -->\n\n{}\n\n{CLOSE}", table(name, old.trim())?.trim());
        rest = after;
    }
    Ok(text + rest)
}

/// The tables of a page: their names and texts.
///
/// # Errors
/// As [`fill`].
pub fn tables(page: &str) -> Result<Vec<(String, String)>> {
    let mut found = Vec::new();
    fill(page, |name, text| {
        found.push((name.to_owned(), text.to_owned()));
        Ok(text.to_owned())
    })?;
    Ok(found)
}

/// Fills the tables of a page on disk. Returns whether something changed.
///
/// # Errors
/// As [`fill`]; also a page that cannot be read or written.
pub fn fill_file(path: &Path, table: impl FnMut(&str, &str) -> Result<String>) -> Result<bool> {
    let before = std::fs::read_to_string(path).map_err(|e| Error::file(path, format!("cannot be read: {e}")))?;
    let after = fill(&before, table).map_err(|error| match error {
        Error::Usage(why) => Error::file(path, why),
        other => other,
    })?;
    if after != before {
        file::write(path, after.as_bytes())?;
    }
    Ok(after != before)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_csv_file_is_read_as_it_was_written() {
        let rows = [["a", "b"], ["1", "x, \"y\""], ["", "two\nlines"]];
        let text = to_csv(rows);
        assert_eq!(text, "a,b\n1,\"x, \"\"y\"\"\"\n,\"two\nlines\"\n");
        let (head, read) = from_csv(&text).unwrap();
        assert_eq!(head, ["a", "b"]);
        assert_eq!((read[0].number("a"), read[0].cell("b"), read[1].number("a")), (Some(1.0), "x, \"y\"", None));
        assert_eq!(from_csv("a,b\n1,2\n3\n").unwrap_err(), "line 3 is not a row");
    }

    #[test]
    fn no_cell_is_a_formula() {
        let rows = [["name", "x"], ["=HYPERLINK(\"a\")", "-1.5e-3"], ["@SUM(A1)", "+2"], ["-", "'"], ["\t=1", "a=b"]];
        let text = to_csv(rows);
        assert_eq!(text, "name,x\n\"'=HYPERLINK(\"\"a\"\")\",-1.5e-3\n'@SUM(A1),+2\n'-,'\n'\t=1,a=b\n");
        let (_, read) = from_csv(&text).unwrap();
        assert!(rows[1..].iter().zip(&read).all(|(row, read)| [read.cell("name"), read.cell("x")] == *row));
    }

    #[test]
    fn people_keep_what_they_wrote_around_tables() {
        let page =
            "before\n<!-- table: one -->\nold\n<!-- end -->\nbetween\n<!-- table: two -->\n<!-- end -->\nafter\n";
        let filled = fill(page, |name, _| Ok(markdown(["a", "b"], "-:", [[name, "1"]]))).unwrap();
        assert!(filled.starts_with("before\n") && filled.ends_with("<!-- end -->\nafter\n"), "{filled}");
        assert_eq!(tables(&filled).unwrap()[1], ("two".into(), "| a | b |\n|---|---:|\n| two | 1 |".into()));
        assert_eq!(fill(&filled, |_, text| Ok(text.to_owned())).unwrap(), filled, "filled twice");
        for wrong in ["<!-- table: presets -->\n", "<!-- table: presets --> x"] {
            assert!(tables(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn cells_may_hold_escaped_bars() {
        assert_eq!(cells("| \\|n.y\\| = 1 | `a` `b=c` |"), Some(vec!["\\|n.y\\| = 1", "`a` `b=c`"]));
        assert_eq!((cells("|---|---|"), cells("text"), coded("x `a` y `b=c`")), (None, None, vec!["a", "b=c"]));
    }
}
