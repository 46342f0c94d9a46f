//! The page: one file with its style, its program, its data and its pictures inside.

use serde::Serialize;
use serde_json::{Value, json};

use super::export::Chart;
use super::marks::{Mark, marks};
use super::measure::ChartScene;
use super::store::Stored;
use crate::Result;
use crate::output::svg::{COLORS, escape};

/// What the page's program reads. `colors`: of the bar of passes.
#[derive(Serialize)]
struct Data<'a> {
    colors: &'static [&'static str],
    /// Of the methods that rows are of.
    marks: Vec<Mark>,
    scenes: Vec<Value>,
    rows: &'a [Stored],
}

/// The bytes of `index.html`. `stored`: the chart's rows with their pictures, in the chart's order.
pub fn html(chart: &Chart, scenes: &[ChartScene], stored: &[Stored]) -> Result<String> {
    let scenes = scenes.iter().map(about).collect::<Result<_>>()?;
    let marks = marks(chart.rows.iter().map(|row| row.settings.method));
    let data = serde_json::to_string(&Data { colors: COLORS, marks, scenes, rows: stored })
        .expect("rows are plain data, which JSON can hold")
        // Inside a script nothing may look like the script's end.
        .replace('<', "\\u003c");
    let device = format!("{} ({}), {}×{} pixels", chart.device, chart.driver, chart.width, chart.height);
    let missing = match chart.planned - chart.rows.len() {
        0 => String::new(),
        n => format!("{n} of {} settings are not measured yet; the same command continues.", chart.planned),
    };
    let page = include_str!("page/index.html")
        .replace("{{style}}", include_str!("page/style.css"))
        .replace("{{about}}", &escape(&device))
        .replace("{{missing}}", &escape(&missing))
        .replace("{{plot}}", include_str!("page/plot.js"))
        .replace("{{program}}", include_str!("page/page.js"));
    // Last, so that no text in it is taken for a place to fill in.
    Ok(page.replace("{{data}}", &data))
}

/// What the page says of a scene, and its references.
fn about(scene: &ChartScene) -> Result<Value> {
    let mut references = Vec::new();
    for reference in &scene.references {
        let picture = scene.picture(reference.layers.beauty())?;
        references.push(json!({ "bounces": reference.bounces(), "noise": reference.noise, "picture": picture }));
    }
    let about = format!("{} triangles, camera {}", scene.scene.triangle_count(), scene.camera);
    Ok(json!({ "name": scene.name, "about": about, "size": scene.options.size, "truths": references }))
}
