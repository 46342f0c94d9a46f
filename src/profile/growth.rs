//! The growth of each pass's time with the grid, the triangles and the pixels: a few runs along each axis, and the
//! exponent of a power law.

use std::collections::HashMap;
use std::sync::Arc;

use serde::Serialize;

use super::RepeatedFrame;
use crate::Result;
use crate::measure::timing::Timings;
use crate::renderer::RenderOptions;
use crate::scene::{Mesh, Scene};
use crate::settings::Settings;
use crate::vk::Context;

/// Grid edges of the runs.
const VOXELS: [u32; 4] = [16, 32, 64, 128];
/// How often every triangle is split into four.
const SUBDIVISIONS: usize = 2;
/// Divisors of the image's sides.
const SHRINKS: [u32; 3] = [4, 2, 1];

/// One axis: runs with equal scene and settings except for one number.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Growth {
    /// `voxels` (grid edge), `triangles` (recorded) or `pixels`.
    pub axis: &'static str,
    /// Values along the axis, ascending.
    pub values: Vec<f64>,
    /// Occupied voxels of each run.
    pub occupied_voxels: Vec<u32>,
    pub passes: Vec<PassGrowth>,
    /// Runs that did not fit into memory, with the reason.
    pub left_out: Vec<String>,
}

/// One pass along an axis.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PassGrowth {
    pub name: &'static str,
    /// Median milliseconds of device time at each value.
    pub gpu_ms: Vec<f64>,
    /// The exponent in time ∝ value^exponent, by least squares of the logarithms; null for fewer than two runs.
    pub exponent: Option<f64>,
}

/// A run that differs from the others in one number.
pub struct Along {
    axis: &'static str,
    /// A description, such as "32 voxels".
    pub what: String,
    /// The value on the axis; `None` for the number of recorded triangles.
    value: Option<f64>,
    scene: Option<Scene>,
    settings: Settings,
    options: RenderOptions,
}

/// The result of a run, or the reason why it did not fit into device memory.
pub type RunResult = std::result::Result<Timings, String>;

/// The runs along all three axes.
pub fn runs(subject: &RepeatedFrame) -> Vec<Along> {
    let (settings, options) = (&subject.settings, &subject.options);
    let along = |axis, what: String, value| Along {
        axis,
        what,
        value,
        scene: None,
        settings: settings.clone(),
        options: options.clone(),
    };
    let voxels = VOXELS.map(|voxels| {
        let along = along("voxels", format!("{voxels} voxels"), Some(f64::from(voxels)));
        Along { settings: Settings { voxels, ..settings.clone() }, ..along }
    });
    let finer = |scene: &Scene| {
        let meshes = scene.meshes.iter().map(subdivided).collect();
        Some(Scene { meshes, ..scene.clone() })
    };
    let scenes = std::iter::successors(Some(subject.scene.clone()), finer).take(1 + SUBDIVISIONS);
    let triangles = scenes.map(|scene| {
        let along = along("triangles", format!("{} triangles", scene.triangle_count()), None);
        Along { scene: Some(scene), ..along }
    });
    let pixels = SHRINKS.map(|shrink| {
        let (width, height) = ((options.size.0 / shrink).max(1), (options.size.1 / shrink).max(1));
        let pixels = f64::from(width) * f64::from(height);
        let along = along("pixels", format!("{width}x{height} pixels"), Some(pixels));
        Along { options: RenderOptions { size: (width, height), ..options.clone() }, ..along }
    });
    voxels.into_iter().chain(triangles).chain(pixels).collect()
}

impl Along {
    /// Renders `frames` timed frames.
    ///
    /// # Errors
    /// A lost device, an interruption, or too little device memory.
    pub fn run(&self, context: &Arc<Context>, subject: &RepeatedFrame, frames: u32) -> Result<Timings> {
        let scene = self.scene.as_ref().unwrap_or(subject.scene);
        let (settings, options) = (self.settings.clone(), self.options.clone());
        Ok(RepeatedFrame { scene, settings, options, ..subject.clone() }.run(context, frames)?.timings)
    }
}

/// The axes, from their runs and results.
pub fn growth(runs: &[Along], found: &[RunResult]) -> Vec<Growth> {
    let all = || runs.iter().zip(found);
    ["voxels", "triangles", "pixels"].map(|axis| of_axis(axis, all().filter(|(run, _)| run.axis == axis))).to_vec()
}

fn of_axis<'a>(axis: &'static str, runs: impl Iterator<Item = (&'a Along, &'a RunResult)>) -> Growth {
    let mut growth = Growth { axis, ..Growth::default() };
    let Growth { values, occupied_voxels, passes, left_out, .. } = &mut growth;
    for (run, found) in runs {
        let timings = match found {
            Ok(timings) => timings,
            Err(why) => {
                left_out.push(format!("{}: {why}", run.what));
                continue;
            }
        };
        let counters = timings.all().last().expect("at least one frame").counters;
        let value = run.value.unwrap_or(counters.triangles.into());
        // An image of a few pixels cannot be made smaller, and a repeated value would add nothing.
        if values.last().is_some_and(|last| *last >= value) {
            continue;
        }
        let timed = timings.passes();
        if values.is_empty() {
            *passes = timed.iter().map(|pass| PassGrowth { name: pass.name, ..PassGrowth::default() }).collect();
        }
        // A pass that is missing in a run does not only depend on this axis.
        passes.retain_mut(|pass| {
            let ms = timed.iter().find(|timed| timed.name == pass.name).map(|timed| timed.gpu_ms.median);
            pass.gpu_ms.extend(ms);
            ms.is_some()
        });
        values.push(value);
        occupied_voxels.push(counters.occupied_voxels);
    }
    passes.iter_mut().for_each(|pass| pass.exponent = exponent(values, &pass.gpu_ms));
    growth
}

/// One axis as a table.
pub fn table(growth: &Growth) -> String {
    let width = growth.passes.iter().map(|pass| pass.name.len()).max().unwrap_or(0).max("occupied voxels".len());
    let row = |name: &str, cells: Vec<String>, end: &str| {
        let cells: String = cells.iter().map(|cell| format!("  {cell:>10}")).collect();
        format!("{name:width$}{cells}  {end:>8}\n")
    };
    let mut text = row(growth.axis, growth.values.iter().map(f64::to_string).collect(), "exponent");
    let occupied: Vec<f64> = growth.occupied_voxels.iter().map(|count| f64::from(*count)).collect();
    let cells = growth.occupied_voxels.iter().map(u32::to_string).collect();
    text += &row("occupied voxels", cells, &exponent_in_words(exponent(&growth.values, &occupied)));
    for pass in &growth.passes {
        text += &row(
            pass.name,
            pass.gpu_ms.iter().map(|ms| format!("{ms:.3}")).collect(),
            &exponent_in_words(pass.exponent),
        );
    }
    growth.left_out.iter().for_each(|why| text += &format!("left out: {why}\n"));
    text
}

/// An exponent with two digits, without −0.00.
pub(super) fn exponent_in_words(exponent: Option<f64>) -> String {
    exponent.map_or_else(String::new, |e| format!("{:.2}", (e * 100.0).round() / 100.0 + 0.0))
}

/// The slope of the line through (ln x, ln y), by least squares; none for fewer than two points.
pub fn exponent(x: &[f64], y: &[f64]) -> Option<f64> {
    let points: Vec<(f64, f64)> =
        x.iter().zip(y).filter(|(x, y)| **x > 0.0 && **y > 0.0).map(|(x, y)| (x.ln(), y.ln())).collect();
    let count = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(|p| p.0), mean(|p| p.1));
    let covariance: f64 = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let variance: f64 = points.iter().map(|(x, _)| (x - mean_x).powi(2)).sum();
    (points.len() > 1 && variance > 0.0).then(|| covariance / variance)
}

/// The surface of a mesh with every triangle split into four at the middles of its edges. Attributes are averaged and
/// directions are not normalised, so that they interpolate as before.
pub fn subdivided(mesh: &Mesh) -> Mesh {
    let mut fine = Mesh { indices: Vec::with_capacity(4 * mesh.indices.len()), deform: None, ..mesh.clone() };
    let mut middles = HashMap::new();
    let mut middle = |fine: &mut Mesh, a: u32, b: u32| {
        *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
            let (i, j) = (a as usize, b as usize);
            fine.positions.push((mesh.positions[i] + mesh.positions[j]) / 2.0);
            fine.normals.push((mesh.normals[i] + mesh.normals[j]) / 2.0);
            let tangent = (mesh.tangents[i] + mesh.tangents[j]) / 2.0;
            fine.tangents.push(tangent.truncate().extend(mesh.tangents[i].w));
            for set in 0..2 {
                fine.uvs[set].push((mesh.uvs[set][i] + mesh.uvs[set][j]) / 2.0);
            }
            fine.colors.push((mesh.colors[i] + mesh.colors[j]) / 2.0);
            fine.positions.len() as u32 - 1
        })
    };
    for corners in mesh.indices.chunks_exact(3) {
        let [a, b, c] = [corners[0], corners[1], corners[2]];
        let [ab, bc, ca] = [middle(&mut fine, a, b), middle(&mut fine, b, c), middle(&mut fine, c, a)];
        fine.indices.extend([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca]);
    }
    fine
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn exponents_of_power_laws_are_found() {
        let x = [16.0, 32.0, 64.0, 128.0];
        let fit = |f: fn(f64) -> f64| exponent(&x, &x.map(f)).unwrap();
        assert!((fit(|x| 0.3 * x.powf(2.5)) - 2.5).abs() < 1e-12);
        assert!(fit(|_| 7.0).abs() < 1e-12);
        // By hand: ln y = 0, ln 2, 0 at −1, 0, 1 (in units of ln 2), so the slope is 0.
        assert!(exponent(&[1.0, 2.0, 4.0], &[1.0, 2.0, 1.0]).unwrap().abs() < 1e-12);
        assert_eq!(exponent(&[2.0], &[3.0]), None);
        assert_eq!(exponent(&[2.0, 2.0], &[3.0, 4.0]), None, "one value twice has no slope");
    }

    #[test]
    fn a_subdivided_mesh_is_the_same_surface() {
        let (a, b, c, d) = (Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1.0, 1.0, 0.5));
        let mut mesh = Mesh::triangles("two", 0, &[[a, b, c], [b, d, c]]);
        // As in an indexed mesh, the triangles share an edge.
        mesh.indices = vec![0, 1, 2, 1, 4, 2];
        let area = |mesh: &Mesh| -> f32 {
            let corner = |i: u32| mesh.positions[i as usize];
            mesh.indices
                .chunks_exact(3)
                .map(|t| (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length())
                .sum()
        };
        let fine = subdivided(&mesh);
        assert_eq!(fine.indices.len(), 4 * mesh.indices.len());
        assert_eq!(fine.positions.len(), mesh.positions.len() + 5, "a shared edge has one middle");
        // Halves are exact in binary, and square roots are rounded to f32.
        assert!((area(&fine) - area(&mesh)).abs() < 1e-6);
        for t in fine.indices.chunks_exact(3) {
            let normal = |i: u32| fine.normals[i as usize];
            let [p, q, r] = [0, 1, 2].map(|k| fine.positions[t[k] as usize]);
            assert!((q - p).cross(r - p).dot(normal(t[0])) > 0.0, "a triangle was turned around");
        }
    }
}
