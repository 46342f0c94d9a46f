//! Error against time as an SVG: one panel per scene and reference, log-log, with the frontier as a line.

use std::fmt::Write as _;

use super::frontier::frontier;
use super::row::{Metric, Part, Row, Truth};
use crate::output::svg::{COLORS, LogAxis, escape};

/// Pixels of a panel, and what its axes' labels take on the left, on top, on the right and below.
const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 300.0;
const LEFT: f64 = 58.0;
const TOP: f64 = 34.0;
const RIGHT: f64 = 16.0;
const BOTTOM: f64 = 44.0;

const STYLE: &str = "\
text{font:12px system-ui,sans-serif;fill:#3c4043}.title{font-weight:600;font-size:13px}.tick{stroke:#80868b33}\
.frame{fill:none;stroke:#80868b88}.frontier{fill:none;stroke:#80868b;stroke-width:1.5}.faint{opacity:.35}\
@media(prefers-color-scheme:dark){text{fill:#dadce0}}";

/// What to draw.
pub struct Panel<'a> {
    pub title: String,
    pub rows: Vec<&'a Row>,
    pub truth: Truth,
    pub part: Part,
    pub metric: Metric,
}

/// The numbers of a decade that axes show.
const TICKS: &[f64] = &[1.0, 2.0, 5.0];

/// An axis that holds these values.
fn axis(values: impl Iterator<Item = f64>, start: f64, end: f64) -> LogAxis {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
    if low > high {
        return LogAxis::new((1.0, 10.0), start, end);
    }
    // An eighth of a decade of air, and never a span of less than half a one.
    let air = 0.125f64.max(0.25 - (high / low).log10() / 2.0);
    LogAxis::new((low / 10f64.powf(air), high * 10f64.powf(air)), start, end)
}

/// The presets of some rows in the order of their first row: a preset's place gives its colour.
pub fn presets<'a>(rows: impl IntoIterator<Item = &'a Row>) -> Vec<&'a str> {
    let mut names = Vec::new();
    for row in rows {
        if !names.contains(&row.preset.as_str()) {
            names.push(row.preset.as_str());
        }
    }
    names
}

/// The panels in a grid of `columns`, and a legend of the presets.
pub fn chart(panels: &[Panel], columns: usize) -> String {
    const LEGEND: f64 = 28.0;
    let presets = presets(panels.iter().flat_map(|panel| panel.rows.iter().copied()));
    let width = WIDTH * columns as f64;
    let height = HEIGHT * panels.len().div_ceil(columns) as f64 + LEGEND;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" height=\"{height}\" \
         role=\"img\" aria-label=\"error against time\">\n<style>{STYLE}</style>\n"
    );
    let mut x = LEFT;
    for (i, preset) in presets.iter().enumerate() {
        let color = color(i);
        let _ = writeln!(svg, "<circle cx=\"{x}\" cy=\"14\" r=\"5\" fill=\"{color}\"/>");
        let _ = writeln!(svg, "<text x=\"{}\" y=\"18\">{}</text>", x + 10.0, escape(preset));
        x += 34.0 + 7.0 * preset.len() as f64;
    }
    for (i, panel) in panels.iter().enumerate() {
        let (column, row) = (i % columns, i / columns);
        let (x, y) = (WIDTH * column as f64, LEGEND + HEIGHT * row as f64);
        let _ = writeln!(svg, "<g transform=\"translate({x} {y})\">");
        draw(&mut svg, panel, &presets);
        svg += "</g>\n";
    }
    svg + "</svg>\n"
}

fn color(preset: usize) -> &'static str {
    COLORS[preset % COLORS.len()]
}

fn draw(svg: &mut String, panel: &Panel, presets: &[&str]) {
    let value = |row: &&Row| Some((row.gpu_ms()?, row.error(panel.truth, panel.part, panel.metric)?));
    // A logarithm has no zero; an error of none is drawn as one that no reference can show.
    let points: Vec<(&Row, (f64, f64))> = panel
        .rows
        .iter()
        .filter_map(|row| Some((*row, value(row)?)))
        .map(|(r, (x, y))| (r, (x, y.max(1e-6))))
        .collect();
    let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    let _ = writeln!(svg, "<text class=\"title\" x=\"{LEFT}\" y=\"{}\">{}</text>", TOP - 12.0, escape(&panel.title));
    if points.is_empty() {
        let _ = writeln!(svg, "<text x=\"{LEFT}\" y=\"{}\">nothing to show</text>", HEIGHT / 2.0);
        return;
    }
    let x = axis(points.iter().map(|p| p.1.0), LEFT, right);
    let y = axis(points.iter().map(|p| p.1.1), bottom, TOP);
    for tick in x.ticks(TICKS) {
        let at = x.place(tick);
        let _ = writeln!(svg, "<path class=\"tick\" d=\"M{at:.1} {TOP}V{bottom}\"/>");
        let _ =
            writeln!(svg, "<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", bottom + 16.0, label(tick));
    }
    for tick in y.ticks(TICKS) {
        let at = y.place(tick);
        let _ = writeln!(svg, "<path class=\"tick\" d=\"M{LEFT} {at:.1}H{right}\"/>");
        let _ = writeln!(
            svg,
            "<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            LEFT - 6.0,
            at + 4.0,
            label(tick)
        );
    }
    let _ = writeln!(
        svg,
        "<rect class=\"frame\" x=\"{LEFT}\" y=\"{TOP}\" width=\"{}\" height=\"{}\"/>",
        right - LEFT,
        bottom - TOP
    );
    let middle = (LEFT + right) / 2.0;
    let _ = writeln!(svg, "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">GPU ms a frame</text>", HEIGHT - 8.0);
    let title = axis_label(panel.part, panel.metric);
    let _ = writeln!(
        svg,
        "<text x=\"14\" y=\"{0}\" text-anchor=\"middle\" transform=\"rotate(-90 14 {0})\">{title}</text>",
        (TOP + bottom) / 2.0
    );
    let best = frontier(&points.iter().map(|p| p.1).collect::<Vec<_>>());
    let line: Vec<String> =
        best.iter().map(|&i| format!("{:.1},{:.1}", x.place(points[i].1.0), y.place(points[i].1.1))).collect();
    let _ = writeln!(svg, "<polyline class=\"frontier\" points=\"{}\"/>", line.join(" "));
    for (i, (row, (cost, error))) in points.iter().enumerate() {
        let color = color(presets.iter().position(|p| *p == row.preset).unwrap_or(0));
        let class = if best.contains(&i) { "" } else { " class=\"faint\"" };
        let radius = if row.swept.is_empty() { 6.0 } else { 4.0 };
        let _ = writeln!(
            svg,
            "<circle{class} cx=\"{:.1}\" cy=\"{:.1}\" r=\"{radius}\" fill=\"{color}\"><title>{}: {cost:.0} ms, {error:.3}</title></circle>",
            x.place(*cost),
            y.place(*error),
            escape(&row.name),
        );
    }
}

/// A tick's label: short, so that many fit, and without the rounding of powers of ten.
fn label(tick: f64) -> String {
    if tick >= 1000.0 { format!("{}k", tick / 1000.0) } else { format!("{}", (tick * 1e9).round() / 1e9) }
}

fn axis_label(part: Part, metric: Metric) -> String {
    let metric = match metric {
        Metric::Energy => "|energy − 1|",
        Metric::Rel => "rel",
        Metric::Relmse => "relmse",
        Metric::P95 => "p95",
        Metric::Flip => "flip",
    };
    match part {
        Part::Total => format!("{metric} of the whole image"),
        Part::Indirect => format!("{metric} of the indirect light"),
        Part::Diffuse => format!("{metric} of diffuse surfaces' indirect light"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_hold_their_values_and_have_ticks() {
        for values in [vec![3.0], vec![1.0, 1.0], vec![0.013, 95.0], vec![250.0, 260.0]] {
            let axis = axis(values.iter().copied(), 10.0, 110.0);
            assert!(values.iter().all(|v| (10.0..=110.0).contains(&axis.place(*v))), "{values:?}");
            assert!(!axis.ticks(TICKS).is_empty(), "{values:?}");
        }
    }
}
