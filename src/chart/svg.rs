//! Error against time as an SVG: one panel per scene and reference, log-log, with the frontier as a line.

use super::frontier::frontiers;
use super::marks::{Mark, mark, marks};
use super::row::{Reference, Row};
use crate::measure::metrics::Part;
use crate::output::svg::{LogAxis, escape};

/// Width of a panel in pixels, and the margins of its axes' labels at the left, top, right and bottom.
const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 58.0;
const TOP: f64 = 34.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 44.0;

const STYLE: &str = "\
text{font:12px system-ui,sans-serif;fill:#3c4043}.title{font-weight:600;font-size:13px}.tick{stroke:#80868b33}\
.frame{fill:none;stroke:#80868b88}.frontier{fill:none;stroke:#80868b;stroke-width:1.5}.faint{opacity:.35}\
.bar{stroke:#80868b;stroke-width:1.5}\
@media(prefers-color-scheme:dark){text{fill:#dadce0}}";

/// The content of one panel.
pub struct Panel<'a> {
    pub title: String,
    pub rows: Vec<&'a Row>,
    pub reference: Reference,
    pub part: Part,
    /// Whether one frontier joins all machines; otherwise each has its own.
    pub mix_machines: bool,
}

/// Decades of the axes beyond their values.
const AIR: f64 = 0.125;

/// The labelled numbers of a decade.
const TICKS: &[f64] = &[1.0, 2.0, 5.0];

/// The panels in a grid of `columns`, and a legend of the methods.
pub fn chart(panels: &[Panel], columns: usize) -> String {
    const LEGEND: f64 = 28.0;
    let width = WIDTH * columns as f64;
    let height = HEIGHT * panels.len().div_ceil(columns) as f64 + LEGEND;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         role=\"img\" aria-label=\"error against time\">\n<style>{STYLE}</style>\n"
    );
    let mut x = LEFT;
    for mark in marks(panels.iter().flat_map(|panel| panel.rows.iter().copied())) {
        svg += &format!("{}/>\n", path(mark, "", (x, 14.0), 5.0));
        svg += &format!("<text x=\"{}\" y=\"18\">{}</text>\n", x + 10.0, escape(mark.method));
        x += 34.0 + 7.0 * mark.method.len() as f64;
    }
    for (i, panel) in panels.iter().enumerate() {
        let (x, y) = (WIDTH * (i % columns) as f64, LEGEND + HEIGHT * (i / columns) as f64);
        svg += &format!("<g transform=\"translate({x} {y})\">\n{}</g>\n", draw(panel));
    }
    svg + "</svg>\n"
}

/// The beginning of an SVG path element.
fn path(mark: Mark, class: &str, (x, y): (f64, f64), radius: f64) -> String {
    let place = format!("transform=\"translate({x:.1} {y:.1}) scale({radius})\"");
    format!("<path{class} d=\"{}\" {place} fill=\"{}\"", mark.shape, mark.color)
}

fn draw(panel: &Panel) -> String {
    // A logarithm has no zero, so an error of zero is drawn as one that no reference can show.
    let point = |row: &Row| Some((row.ms()?, row.rel(panel.reference, panel.part)?.max(1e-6)));
    let rows: Vec<(&Row, (f64, f64))> = panel.rows.iter().filter_map(|row| Some((*row, point(row)?))).collect();
    let points: Vec<(f64, f64)> = rows.iter().map(|row| row.1).collect();
    let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    let mut svg = String::new();
    let mut add = |line: String| svg += &(line + "\n");
    add(format!("<text class=\"title\" x=\"{LEFT}\" y=\"{}\">{}</text>", TOP - 12.0, escape(&panel.title)));
    if points.is_empty() {
        add(format!("<text x=\"{LEFT}\" y=\"{}\">nothing to show</text>", HEIGHT / 2.0));
        return svg;
    }
    let x = LogAxis::around(points.iter().map(|p| p.0), AIR, LEFT, right);
    let y = LogAxis::around(points.iter().map(|p| p.1), AIR, bottom, TOP);
    // The bar shows by how much an error may be smaller without the reference's noise.
    let least = |row: &Row, error: f64| (error - row.noise_in_rel(panel.reference, panel.part).unwrap_or(0.0)).max(0.0);
    for tick in x.ticks(TICKS) {
        let (at, under) = (x.place(tick), bottom + 16.0);
        add(format!("<path class=\"tick\" d=\"M{at:.1} {TOP}V{bottom}\"/>"));
        add(format!("<text x=\"{at:.1}\" y=\"{under}\" text-anchor=\"middle\">{}</text>", label(tick)));
    }
    for tick in y.ticks(TICKS) {
        let (at, beside) = (y.place(tick), LEFT - 6.0);
        add(format!("<path class=\"tick\" d=\"M{LEFT} {at:.1}H{right}\"/>"));
        add(format!("<text x=\"{beside}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>", at + 4.0, label(tick)));
    }
    let (width, height) = (right - LEFT, bottom - TOP);
    add(format!("<rect class=\"frame\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{width}\" height=\"{height}\"/>"));
    let (across, down) = ((LEFT + right) / 2.0, (TOP + bottom) / 2.0);
    add(format!("<text x=\"{across}\" y=\"{}\" text-anchor=\"middle\">{}</text>", HEIGHT - 8.0, times(&rows)));
    let title = match panel.part {
        Part::Total => "rel of the whole image",
        Part::Indirect => "rel of the indirect light",
        Part::Diffuse => "rel of diffuse surfaces' indirect light",
    };
    let turned = format!("transform=\"rotate(-90 14 {down})\"");
    add(format!("<text x=\"14\" y=\"{down}\" text-anchor=\"middle\" {turned}>{title}</text>"));
    let places: Vec<_> = rows.iter().map(|(row, _)| row.place().filter(|_| !panel.mix_machines)).collect();
    let best = frontiers(&points, &places);
    let place = |(cost, error): (f64, f64)| (x.place(cost), y.place(error));
    for best in &best {
        let line = best.iter().map(|&i| place(points[i])).map(|(x, y)| format!("{x:.1},{y:.1}"));
        add(format!("<polyline class=\"frontier\" points=\"{}\"/>", line.collect::<Vec<_>>().join(" ")));
    }
    let best = best.concat();
    for (i, (row, (cost, error))) in rows.iter().enumerate() {
        let (at, least) = (place((*cost, *error)), least(row, *error));
        let end = if least > 0.0 { y.place(least).min(bottom) } else { bottom };
        // A bar that the mark covers is not drawn.
        if end > at.1 + 7.0 {
            let class = if best.contains(&i) { "bar" } else { "bar faint" };
            add(format!("<path class=\"{class}\" d=\"M{:.1} {:.1}V{end:.1}\"/>", at.0, at.1));
        }
    }
    for (i, (row, (cost, error))) in rows.into_iter().enumerate() {
        let class = if best.contains(&i) { "" } else { " class=\"faint\"" };
        let radius = if row.swept.is_empty() { 6.0 } else { 4.0 };
        let mark = mark(row);
        let given = if row.is_import() { " as given" } else { "" };
        let title = format!("<title>{}, {}: {cost:.0} ms{given}, {error:.3}</title>", escape(&row.name), mark.method);
        add(format!("{}>{title}</path>", path(mark, class, place((cost, error)), radius)));
    }
    svg
}

/// The kind of an axis's times.
fn times(rows: &[(&Row, (f64, f64))]) -> &'static str {
    let traced = rows.iter().any(|(row, _)| row.paths().is_some());
    let given = rows.iter().any(|(row, _)| row.is_import());
    match (traced, given) {
        (false, false) => "GPU ms a frame",
        (true, false) => "ms a frame: GPU; path tracer: wall clock",
        (false, true) => "ms a frame: GPU; other programs: as given",
        (true, true) => "ms a frame: GPU; path tracer: wall clock; others: as given",
    }
}

/// A tick's label, which is short and has no rounding errors of powers of ten.
fn label(tick: f64) -> String {
    if tick >= 1000.0 { format!("{}k", tick / 1000.0) } else { format!("{}", (tick * 1e9).round() / 1e9) }
}
