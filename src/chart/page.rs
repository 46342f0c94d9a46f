//! The page of a chart.

use std::collections::BTreeSet;

use serde::Serialize;
use serde_json::{Value, json};

use super::export::Chart;
use super::marks::marks;
use super::measure::SEED;
use super::outline::Sketch;
use super::row::Row;
use crate::lab::page::Page;
use crate::lab::store::{ExperimentRow as _, Stored};
use crate::output::svg::COLORS;

/// The JSON for the page's script. Settings are in the order of their keys, which a [`Value`] would not keep.
#[derive(Serialize)]
struct ChartData<'a> {
    #[serde(flatten)]
    head: Value,
    rows: &'a [Stored<Row>],
    history: &'a [Row],
}

/// The bytes of `index.html`. `history` holds earlier rows of the same settings, the oldest first.
pub fn html(chart: &Chart, history: &[Row]) -> String {
    let outline = &chart.outline;
    let size = [outline.width, outline.height];
    let about = |Sketch { line, truths }: &Sketch| {
        let about = format!("{} triangles, camera {}", line.triangles, line.camera);
        json!({ "name": line.name, "about": about, "size": size, "truths": truths, "command": line.command })
    };
    let head = json!({
        // The keys are those of the bar of passes.
        "colors": COLORS,
        "marks": marks(chart.rows()),
        "paths_seed": SEED,
        // The places of measurement (machine, device, driver), in alphabetical order.
        "places": chart.rows().filter_map(Row::place).collect::<BTreeSet<_>>(),
        "mix_machines": chart.mix_machines,
        "reference_noise": outline.reference_noise,
        "scenes": outline.scenes.iter().map(about).collect::<Vec<_>>(),
    });
    let page = Page {
        title: "Error against time",
        about: &format!("{}, {}×{} pixels", chart.devices(), outline.width, outline.height),
        missing: &missing(chart),
        running: chart.running,
        style: "",
        body: include_str!("page/body.html"),
        program: include_str!("page/page.js"),
    };
    page.html(&ChartData { head, rows: &chart.rows, history })
}

/// Sentences about missing parts of the chart.
fn missing(chart: &Chart) -> String {
    let mut sentences = Vec::new();
    if !chart.part.is_empty() {
        sentences.push(format!("This is {} of a chart.", chart.part));
    }
    let missing = chart.planned.saturating_sub(chart.rows.len());
    if missing > 0 {
        let planned = chart.planned;
        sentences.push(format!("{missing} of {planned} settings are not measured yet; the same command continues."));
    }
    let noise = chart.rows().filter(|row| row.is_measured()).map(Row::noise).fold(0.0, f64::max);
    if noise > chart.outline.reference_noise {
        let [now, last] = [noise, chart.outline.reference_noise].map(|noise| 100.0 * noise);
        sentences.push(format!(
            "Errors are rough: the references have up to {now:.1} % of noise until rounds bring it to {last} %. Bars show what \
             that may add to rel."
        ));
    }
    sentences.join(" ")
}
