//! The page of a chart.

use serde::Serialize;
use serde_json::{Value, json};

use super::export::{Chart, Surroundings};
use super::marks::{Mark, marks};
use super::outline::Sketch;
use super::paths::SEED;
use super::row::Row;
use crate::lab::page::Page;
use crate::lab::store::Stored;
use crate::output::svg::COLORS;

/// What the page's program reads. `colors`: of the bar of passes.
#[derive(Serialize)]
struct Data<'a> {
    colors: &'static [&'static str],
    /// Of the methods and other programs that rows are of.
    marks: Vec<Mark>,
    /// Of the path tracer's rows.
    paths_seed: u64,
    /// Machine, device and driver of rows.
    places: Vec<[&'a str; 3]>,
    mix_machines: bool,
    /// As a share.
    reference_noise: f64,
    scenes: Vec<Value>,
    rows: &'a [Stored<Row>],
    history: &'a [Row],
}

/// The bytes of `index.html`. `stored`: the chart's rows with their pictures, in the chart's order.
pub fn html(chart: &Chart, sketches: &[Sketch], stored: &[Stored<Row>], around: &Surroundings) -> String {
    let size = [chart.width, chart.height];
    let about = |Sketch { line, truths }: &Sketch| {
        let about = format!("{} triangles, camera {}", line.triangles, line.camera);
        json!({ "name": line.name, "about": about, "size": size, "truths": truths, "command": line.command })
    };
    let data = Data {
        colors: COLORS,
        marks: marks(&chart.rows),
        paths_seed: SEED,
        places: chart.places(),
        mix_machines: chart.mix_machines,
        reference_noise: chart.reference_noise,
        scenes: sketches.iter().map(about).collect(),
        rows: stored,
        history: &around.history,
    };
    let page = Page {
        title: "Error against time",
        about: &format!("{}, {}×{} pixels", chart.devices(), chart.width, chart.height),
        missing: &missing(chart, around),
        running: around.running,
        style: "",
        body: include_str!("page/body.html"),
        program: include_str!("page/page.js"),
    };
    page.html(&data)
}

/// What the chart does not have yet, in sentences.
fn missing(chart: &Chart, around: &Surroundings) -> String {
    let mut sentences = Vec::new();
    if !around.part.is_empty() {
        sentences.push(format!("This is {} of a chart.", around.part));
    }
    let missing = chart.planned.saturating_sub(chart.rows.len());
    if missing > 0 {
        let planned = chart.planned;
        sentences.push(format!("{missing} of {planned} settings are not measured yet; the same command continues."));
    }
    let noise = chart.rows.iter().filter_map(|row| row.measured.as_ref()).map(|m| m.full.noise.max(m.same.noise));
    let noise = noise.fold(0.0, f64::max);
    if noise > chart.reference_noise {
        let [now, last] = [noise, chart.reference_noise].map(|noise| 100.0 * noise);
        sentences.push(format!(
            "Errors are rough: the references have up to {now:.1} % of noise until rounds bring it to {last} %. Bars show what \
             that may add to rel."
        ));
    }
    sentences.join(" ")
}
