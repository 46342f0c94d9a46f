//! The page: one file with its style, its program, its data and its pictures inside.

use serde::Serialize;

use super::export::Chart;
use super::measure::{Subject, Truth};
use super::picture::data_uri;
use super::row::Measured;
use super::store::Stored;
use super::svg::presets;
use crate::Result;
use crate::output::svg::{COLORS, escape};
use crate::reference::Depth;

/// What the page's program reads.
#[derive(Serialize)]
struct Data<'a> {
    colors: &'static [&'static str],
    presets: Vec<&'a str>,
    scenes: Vec<SceneData>,
    rows: Vec<RowData<'a>>,
}

#[derive(Serialize)]
struct SceneData {
    name: String,
    about: String,
    /// Pixels.
    size: (u32, u32),
    truths: Vec<TruthData>,
}

#[derive(Serialize)]
struct TruthData {
    bounces: Option<u32>,
    noise: f64,
    picture: String,
}

#[derive(Serialize)]
struct RowData<'a> {
    scene: &'a str,
    name: &'a str,
    preset: &'a str,
    swept: bool,
    changes: &'a [String],
    settings: Vec<(&'static str, String)>,
    measured: Option<&'a Measured>,
    failure: Option<&'a str>,
    image: Option<&'a str>,
    full: Option<&'a str>,
    same: Option<&'a str>,
}

/// The bytes of `index.html`. `stored`: the chart's rows with their pictures, in the chart's order.
pub fn html(chart: &Chart, subjects: &[Subject], stored: &[Stored]) -> Result<String> {
    let scenes = subjects.iter().map(scene_data).collect::<Result<_>>()?;
    let presets = presets(&chart.rows);
    let rows = stored.iter().map(row_data).collect();
    let data = serde_json::to_string(&Data { colors: COLORS, presets, scenes, rows })
        .expect("rows are plain data, which JSON can hold")
        // Inside a script nothing may look like the script's end.
        .replace('<', "\\u003c");
    let about = format!("{} ({}), {}×{} pixels", chart.device, chart.driver, chart.width, chart.height);
    let missing = match chart.planned - chart.rows.len() {
        0 => String::new(),
        n => format!("{n} of {} settings are not measured yet; the same command goes on.", chart.planned),
    };
    let page = include_str!("page/index.html")
        .replace("{{style}}", include_str!("page/style.css"))
        .replace("{{about}}", &escape(&about))
        .replace("{{missing}}", &escape(&missing))
        .replace("{{plot}}", include_str!("page/plot.js"))
        .replace("{{program}}", include_str!("page/page.js"));
    // Last, so that no text in it is taken for a place to fill in.
    Ok(page.replace("{{data}}", &data))
}

fn scene_data(subject: &Subject) -> Result<SceneData> {
    let truth = |truth: &Truth| {
        let picture = data_uri(&subject.picture(truth.layers.beauty())?);
        let bounces = match truth.depth {
            Depth::Full => None,
            Depth::Bounces(n) => Some(n),
        };
        Ok(TruthData { bounces, noise: truth.noise, picture })
    };
    Ok(SceneData {
        name: subject.name.clone(),
        about: format!("{} triangles, camera {}", subject.scene.triangle_count(), subject.camera),
        size: subject.size,
        truths: subject.truths.iter().map(truth).collect::<Result<_>>()?,
    })
}

fn row_data(stored: &Stored) -> RowData<'_> {
    let row = &stored.row;
    let pictures = stored.pictures.as_ref();
    RowData {
        scene: &row.scene,
        name: &row.name,
        preset: &row.preset,
        swept: !row.swept.is_empty(),
        changes: &row.changes,
        settings: row.settings.entries().into_iter().map(|(key, value)| (key.name, value)).collect(),
        measured: row.measured.as_ref(),
        failure: row.failure.as_deref(),
        image: pictures.map(|p| p.image.as_str()),
        full: pictures.map(|p| p.full.as_str()),
        same: pictures.map(|p| p.same.as_str()),
    }
}
