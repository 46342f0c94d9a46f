//! The page of a table.

use serde::Serialize;

use super::case::Case;
use super::export::Table;
use super::row::Row;
use crate::lab::page::Page;
use crate::lab::store::{Origin, Stored};

/// What the page's program reads.
#[derive(Serialize)]
struct Data<'a> {
    cases: &'a [&'static Case],
    rows: &'a [Stored<Row>],
}

/// The bytes of `index.html`. `stored`: the table's rows with their pictures. `part`: such as "part 1 of 4", empty for a whole
/// table; `running`: whether the program still fills it.
pub fn html(table: &Table, stored: &[Stored<Row>], (part, running): (&str, bool)) -> String {
    let devices = Origin::devices(table.rows.iter().filter_map(|row| row.origin.as_ref()));
    let missing = match table.planned.saturating_sub(table.rows.len()) {
        0 => String::new(),
        n => format!("{n} of {} rows are not measured yet; the same command continues.", table.planned),
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
    page.html(&Data { cases: &table.cases, rows: stored })
}
