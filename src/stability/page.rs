//! The page: one file with its style, its program, its data and its pictures inside.

use serde::Serialize;

use super::case::Case;
use super::export::Table;
use super::row::Row;
use crate::chart::page::Now;
use crate::lab::store::{Origin, Stored};
use crate::output::svg::escape;

/// What the page's program reads.
#[derive(Serialize)]
struct Data<'a> {
    cases: &'a [&'static Case],
    rows: &'a [Stored<Row>],
    #[serde(flatten)]
    now: Now,
}

/// The bytes of `index.html`. `stored`: the table's rows with their pictures. `part`: such as "part 1 of 4", empty for a whole
/// table; `running`: whether the program still fills it.
pub fn html(table: &Table, stored: &[Stored<Row>], (part, running): (&str, bool)) -> String {
    let data = serde_json::to_string(&Data { cases: &table.cases, rows: stored, now: Now::new(running) })
        .expect("rows are plain data, which JSON can hold")
        // Inside a script nothing may look like the script's end.
        .replace('<', "\\u003c");
    let devices = Origin::devices(table.rows.iter().filter_map(|row| row.origin.as_ref()));
    let device = format!("{devices}, images of {0}×{0} pixels", super::SIZE);
    let missing = match table.planned.saturating_sub(table.rows.len()) {
        0 => String::new(),
        n => format!("{n} of {} rows are not measured yet; the same command continues.", table.planned),
    };
    let missing = if part.is_empty() { missing } else { format!("This is {part} of a table. {missing}") };
    let page = include_str!("page/index.html")
        .replace("{{base}}", include_str!("../chart/page/style.css"))
        .replace("{{style}}", include_str!("page/style.css"))
        .replace("{{about}}", &escape(&device))
        .replace("{{missing}}", &escape(&missing))
        .replace("{{follow}}", include_str!("../chart/page/follow.js"))
        .replace("{{plot}}", include_str!("../chart/page/plot.js"))
        .replace("{{program}}", include_str!("page/page.js"));
    // Last, so that no text in it is taken for a place to fill in.
    page.replace("{{data}}", &data)
}
