//! A small plot of growth: one panel per axis, both axes logarithmic, one line per pass.

use std::collections::BTreeSet;

use super::growth::{Growth, exponent_in_words};
use crate::output::svg::{COLORS_ON_WHITE, LogAxis, escape};

const WIDTH: f64 = 330.0;
const HEIGHT: f64 = 240.0;
const LEFT: f64 = 52.0;
const TOP: f64 = 34.0;
/// Height of a row of the legend.
const ROW: f64 = 15.0;

/// An SVG picture. Passes below a hundredth of the frame are left out, because their times are noise.
pub fn svg(title: &str, growth: &[Growth]) -> String {
    let names: Vec<&str> = shown(growth);
    let panel = WIDTH + 24.0;
    let (width, height) = (panel * growth.len() as f64, TOP + HEIGHT + 52.0 + ROW * names.len() as f64);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"11\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n<text x=\"8\" y=\"16\" font-size=\"13\">{}</text>\n",
        escape(title)
    );
    for (index, axis) in growth.iter().enumerate() {
        let x = panel * index as f64;
        svg += &format!("<g transform=\"translate({x} {TOP})\">\n{}</g>\n", panel_svg(axis, &names));
    }
    svg + "</svg>\n"
}

/// Passes that reach a hundredth of the frame in some run.
fn shown(growth: &[Growth]) -> Vec<&'static str> {
    let mut names = Vec::new();
    for Growth { passes, values, .. } in growth {
        let total = |run: usize| passes.iter().map(|pass| pass.gpu_ms[run]).sum::<f64>();
        let large = |ms: &[f64]| (0..values.len()).any(|run| ms[run] >= 0.01 * total(run));
        names.extend(passes.iter().filter(|pass| large(&pass.gpu_ms)).map(|pass| pass.name));
    }
    let mut seen = BTreeSet::new();
    names.retain(|name| seen.insert(*name));
    names
}

fn panel_svg(axis: &Growth, names: &[&'static str]) -> String {
    let pass = |name: &str| axis.passes.iter().find(|pass| pass.name == name);
    let passes: Vec<_> = names.iter().enumerate().filter_map(|(i, name)| Some((i, pass(name)?))).collect();
    let x = LogAxis::around(axis.values.iter().copied(), 0.0, LEFT, WIDTH - 12.0);
    let y = LogAxis::around(passes.iter().flat_map(|(_, p)| p.gpu_ms.iter().copied()), 0.0, HEIGHT, 20.0);
    let mut svg = String::new();
    let mut add = |line: String| svg += &(line + "\n");
    let bottom = HEIGHT + 6.0;
    for value in y.ticks(&[1.0]) {
        let at = y.place(value);
        add(format!("<path d=\"M{LEFT} {at:.1}H{}\" stroke=\"#ddd\"/>", WIDTH - 12.0));
        add(format!("<text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{value}</text>", LEFT - 5.0, at + 4.0));
    }
    for value in &axis.values {
        let at = x.place(*value);
        add(format!("<path d=\"M{at:.1} {bottom}v4\" stroke=\"#555\"/>"));
        add(format!("<text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">{}</text>", bottom + 16.0, short(*value)));
    }
    add(format!("<path d=\"M{LEFT} 12V{bottom}H{}\" fill=\"none\" stroke=\"#555\"/>", WIDTH - 12.0));
    let by = if axis.axis == "voxels" { "grid edge, voxels" } else { axis.axis };
    add(format!("<text x=\"{LEFT}\" y=\"6\" fill=\"#555\">ms by {by}</text>"));
    for (row, (i, pass)) in passes.iter().enumerate() {
        let color = COLORS_ON_WHITE[i % COLORS_ON_WHITE.len()];
        let runs = axis.values.iter().zip(&pass.gpu_ms).filter(|(_, ms)| **ms > 0.0);
        let points: Vec<String> = runs.map(|(v, ms)| format!("{:.1},{:.1}", x.place(*v), y.place(*ms))).collect();
        add(format!("<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>", points.join(" ")));
        for point in &points {
            let (cx, cy) = point.split_once(',').expect("two numbers");
            add(format!("<circle cx=\"{cx}\" cy=\"{cy}\" r=\"2.5\" fill=\"{color}\"/>"));
        }
        let at = bottom + 36.0 + ROW * row as f64;
        add(format!("<path d=\"M{LEFT} {}h16\" stroke=\"{color}\" stroke-width=\"3\"/>", at - 4.0));
        let power = pass
            .exponent
            .map_or_else(String::new, |_| format!(" ~ {} ^ {}", axis.axis, exponent_in_words(pass.exponent)));
        add(format!("<text x=\"{}\" y=\"{at}\">{}{power}</text>", LEFT + 22.0, escape(pass.name)));
    }
    svg
}

/// A short number such as `12`, `36.9k`, `1.2M`.
fn short(value: f64) -> String {
    let (scale, unit) = match value {
        ..1e4 => (1.0, ""),
        ..1e6 => (1e3, "k"),
        _ => (1e6, "M"),
    };
    format!("{}{unit}", (value / scale * 10.0).round() / 10.0)
}

#[cfg(test)]
mod tests {
    use super::super::growth::PassGrowth;
    use super::*;

    #[test]
    fn lines_pass_through_the_measurements() {
        let pass = |name, gpu_ms: [f64; 2]| PassGrowth { name, gpu_ms: gpu_ms.to_vec(), exponent: Some(2.0) };
        let passes = vec![pass("shade", [1.0, 100.0]), pass("dust", [1e-4, 1e-4])];
        let axis =
            Growth { axis: "voxels", values: vec![16.0, 64.0], occupied_voxels: vec![1, 2], passes, left_out: vec![] };
        let svg = svg("a < b", &[axis]);
        // The smallest value is at the lower left, the largest at the upper right; too small values are left out.
        assert!(svg.contains("<polyline points=\"52.0,240.0 318.0,20.0\""), "{svg}");
        assert!(svg.contains("shade ~ voxels ^ 2.00") && !svg.contains("dust") && svg.contains("a &lt; b"), "{svg}");
    }
}
