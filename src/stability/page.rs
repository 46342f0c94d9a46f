//! The page: one file with its style, its program, its data and its pictures inside.

use serde::Serialize;

use super::export::{CaseLine, Table};
use super::row::{Pictures, Row};
use crate::chart::store::Stored;
use crate::output::svg::escape;

/// What the page's program reads.
#[derive(Serialize)]
struct Data<'a> {
    cases: &'a [CaseLine],
    rows: &'a [Stored<Row, Pictures>],
}

/// The bytes of `index.html`. `stored`: the table's rows with their pictures.
pub fn html(table: &Table, stored: &[Stored<Row, Pictures>]) -> String {
    let data = serde_json::to_string(&Data { cases: &table.cases, rows: stored })
        .expect("rows are plain data, which JSON can hold")
        // Inside a script nothing may look like the script's end.
        .replace('<', "\\u003c");
    let device = format!("{} ({}), images of {2}×{2} pixels", table.device, table.driver, super::SIZE);
    let missing = match table.planned - table.rows.len() {
        0 => String::new(),
        n => format!("{n} of {} rows are not measured yet; the same command continues.", table.planned),
    };
    let page = include_str!("page/index.html")
        .replace("{{base}}", include_str!("../chart/page/style.css"))
        .replace("{{style}}", include_str!("page/style.css"))
        .replace("{{about}}", &escape(&device))
        .replace("{{missing}}", &escape(&missing))
        .replace("{{plot}}", include_str!("../chart/page/plot.js"))
        .replace("{{program}}", include_str!("page/page.js"));
    // Last, so that no text in it is taken for a place to fill in.
    page.replace("{{data}}", &data)
}
