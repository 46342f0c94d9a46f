//! The time of a pass per unit of its work, and its bytes per time.

use serde::Serialize;

use super::copy::{CopyRates, gb_per_s};
use super::counts::Counts;
use crate::frame::Counters;
use crate::gi::{Method, PassUnit};
use crate::ground::layout;
use crate::measure::timing::{PassTiming, short_bytes};

/// The cost of a pass per unit of work, and by the model, in nanoseconds of device time from the median.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct PassCost {
    pub name: &'static str,
    /// For passes over voxels.
    pub ns_per_occupied_voxel: Option<f64>,
    /// For voxel passes that make lists or visit them, including shadow rays.
    pub ns_per_list_item: Option<f64>,
    /// For passes over the image.
    pub ns_per_pixel: Option<f64>,
    /// For passes that trace cones, including shadow cones.
    pub ns_per_cone_step: Option<f64>,
    /// For passes that trace rays, over their whole time.
    pub rays_per_s: Option<f64>,
    /// Reads and steps of the pass in an instrumented frame.
    pub counts: Counts,
    /// Read bytes by a model in which every read counts fully: see [`Counts`].
    pub fetched_bytes: u64,
    /// Written bytes as stated by the pass; list items and triangles are counted.
    pub written_bytes: u64,
    /// Read and written bytes over the median time, in 10⁹ per second. Caches cause rates above the copy rate.
    pub gb_per_s: f64,
    /// `gb_per_s` divided by the better copy rate of the device.
    pub share_of_copy: f64,
}

/// The amount of work of a frame's passes.
pub struct Work<'a> {
    pub method: Method,
    pub frame: &'a Counters,
    pub pixels: u64,
    pub copy: &'a CopyRates,
}

/// Units of work of the ground's passes, by the beginnings of their names.
const GROUND_UNITS: [(&str, PassUnit); 7] = [
    ("voxelise", PassUnit::MadeItems),
    ("group", PassUnit::WalkedItems),
    ("split", PassUnit::WalkedItems),
    ("visibility", PassUnit::Pixels),
    ("gather", PassUnit::Pixels),
    ("image", PassUnit::Pixels),
    ("resolve", PassUnit::Pixels),
];

/// One row per pass, in the order of the frame.
pub fn costs(passes: &[PassTiming], counted: &[(&'static str, Counts)], work: &Work) -> Vec<PassCost> {
    passes.iter().map(|pass| cost(pass, counted, work)).collect()
}

fn cost(pass: &PassTiming, counted: &[(&'static str, Counts)], work: &Work) -> PassCost {
    let Work { method, frame, pixels, copy } = *work;
    let name = pass.name;
    let counts = counted.iter().find(|row| row.0 == name).map_or_else(Counts::default, |row| row.1);
    let mut units = GROUND_UNITS.iter().chain(method.pass_units());
    let unit = units.find(|(start, _)| name.starts_with(start)).map(|(_, unit)| *unit);
    let ms = pass.gpu_ms.median;
    let per = |applies: bool, count: u64| (applies && count > 0).then(|| ms * 1e6 / count as f64);
    let (items, triangles) = (u64::from(frame.list_items), u64::from(frame.triangles));
    let written_bytes = if unit == Some(PassUnit::MadeItems) {
        // A pass writes an item and the head of its voxel.
        items * (size_of::<layout::ListItem>() as u64 + 4) + 4 * u64::from(frame.occupied_voxels)
    } else if name == "group" {
        // Items are written twice: first with their orientation, then with the item that is lit for them.
        2 * items * size_of::<layout::ItemPart>() as u64
    } else if name == "record" {
        triangles * size_of::<layout::Triangle>() as u64
    } else {
        pass.bytes
    };
    let of_voxels = matches!(unit, Some(PassUnit::Voxels | PassUnit::MadeItems | PassUnit::WalkedItems));
    let (made, walked) = (unit == Some(PassUnit::MadeItems), unit == Some(PassUnit::WalkedItems));
    let fetched_bytes = counts.fetched_bytes();
    let gb_per_s = gb_per_s(fetched_bytes + written_bytes, ms);
    PassCost {
        name,
        ns_per_occupied_voxel: per(of_voxels, frame.occupied_voxels.into()),
        ns_per_list_item: per(made || walked, if made { items } else { counts.list_items }),
        ns_per_pixel: per(unit == Some(PassUnit::Pixels), pixels),
        ns_per_cone_step: per(true, counts.cone_steps + counts.shadow_steps),
        rays_per_s: (counts.rays > 0 && ms > 0.0).then(|| counts.rays as f64 * 1e3 / ms),
        counts,
        fetched_bytes,
        written_bytes,
        gb_per_s,
        share_of_copy: if copy.best() > 0.0 { gb_per_s / copy.best() } else { 0.0 },
    }
}

/// The costs as a table.
pub fn table(costs: &[PassCost], copy: &CopyRates) -> String {
    let width = costs.iter().map(|row| row.name.len()).max().unwrap_or(0).max(4);
    let line = |name: &str, cells: [String; 8]| {
        let (costs, rates) = cells.split_at(6);
        let costs: String = costs.iter().map(|cell| format!("  {cell:>10}")).collect();
        format!("{name:width$}{costs}  {:>8}  {:>8}\n", rates[0], rates[1])
    };
    let heads = ["ns/voxel", "ns/item", "ns/pixel", "ns/step", "fetched", "written", "GB/s", "of copy"];
    let mut text = line("pass", heads.map(String::from));
    let ns = |ns: Option<f64>| ns.map_or(String::new(), |ns| format!("{ns:.2}"));
    for row in costs {
        let [fetched, written] = [row.fetched_bytes, row.written_bytes].map(short_bytes);
        let [rate, share] = [row.gb_per_s, row.share_of_copy].map(|rate| format!("{rate:.2}"));
        let [voxel, item] = [row.ns_per_occupied_voxel, row.ns_per_list_item].map(ns);
        let [pixel, step] = [row.ns_per_pixel, row.ns_per_cone_step].map(ns);
        text += &line(row.name, [voxel, item, pixel, step, fetched, written, rate, share]);
    }
    text += &work_table(costs, width);
    let CopyRates { buffer_gb_per_s, shader_gb_per_s } = copy;
    let cut: u64 = costs.iter().map(|row| row.counts.rays_cut).sum();
    if cut > 0 {
        text += &format!(
            "the driver ended {cut} rays before they were over, and their light is missing: take fewer rays a pass, and more \
             image.passes\n"
        );
    }
    text + &format!(
        "Voxels: occupied ones. Items: listed or read ones. ns/step: time over steps of cones. Steps/ray: boxes of the\n\
         tree of triangles that a ray visits. Fetched bytes: a model, counted in an instrumented frame, in which no\n\
         read is cached. The device copies {buffer_gb_per_s:.2} GB/s by itself, {shader_gb_per_s:.2} GB/s in a shader \
         (read and written)\n"
    )
}

/// A row for each pass with counting shaders: the number of invocations and of traced rays.
fn work_table(costs: &[PassCost], width: usize) -> String {
    let line = |name: &str, [invocations, rays, steps, rate]: [String; 4]| {
        let line = format!("{name:width$}  {invocations:>12}  {rays:>12}  {steps:>10}  {rate:>10}");
        line.trim_end().to_owned() + "\n"
    };
    let mut text = format!("\n{}", line("pass", ["invocations", "rays", "steps/ray", "M rays/s"].map(String::from)));
    for row in costs.iter().filter(|row| row.counts.invocations > 0) {
        let Counts { invocations, rays, ray_steps, .. } = row.counts;
        let of_rays = |text: String| if rays > 0 { text } else { String::new() };
        let steps = of_rays(format!("{:.1}", ray_steps as f64 / rays as f64));
        let rate = row.rays_per_s.map_or(String::new(), |rate| format!("{:.3}", rate * 1e-6));
        text += &line(row.name, [invocations.to_string(), of_rays(rays.to_string()), steps, rate]);
    }
    text + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::timing::Spread;

    fn pass(name: &'static str, ms: f64) -> PassTiming {
        PassTiming { name, gpu_ms: Spread::of_values([ms]), bytes: 1000, ..PassTiming::default() }
    }

    #[test]
    fn costs_are_over_what_a_pass_works_on() {
        let frame = Counters { triangles: 10, degenerate: 0, list_items: 400, occupied_voxels: 100 };
        let shade = Counts { list_items: 400, cone_steps: 2000, ..Default::default() };
        let copy = CopyRates { buffer_gb_per_s: 2.0, shader_gb_per_s: 1.0 };
        let passes = [pass("voxelise", 1.0), pass("shade 2", 2.0), pass("image", 4.0), pass("reset", 1.0)];
        let work = Work { method: Method::Rays, frame: &frame, pixels: 64, copy: &copy };
        let rows = costs(&passes, &[("shade 2", shade)], &work);
        assert_eq!((rows[0].ns_per_occupied_voxel, rows[0].ns_per_list_item), (Some(1e4), Some(2500.0)));
        assert_eq!((rows[0].ns_per_pixel, rows[0].ns_per_cone_step), (None, None));
        assert_eq!(rows[0].written_bytes, 400 * 16 + 100 * 4);
        assert_eq!((rows[1].ns_per_list_item, rows[1].ns_per_cone_step), (Some(5000.0), Some(1000.0)));
        assert_eq!((rows[1].fetched_bytes, rows[1].written_bytes), (4800, 1000));
        // 5800 bytes in 2 ms are 2.9 MB/s.
        assert!((rows[1].gb_per_s - 0.0029).abs() < 1e-12 && (rows[1].share_of_copy - 0.00145).abs() < 1e-12);
        assert_eq!((rows[2].ns_per_pixel, rows[2].ns_per_occupied_voxel), (Some(62500.0), None));
        assert_eq!((rows[3].ns_per_occupied_voxel, rows[3].ns_per_list_item), (None, None));
        let of_all = table(&rows, &copy);
        assert!(
            of_all.lines().nth(3).is_some_and(|line| line.starts_with("image") && line.contains("62500.00")),
            "{of_all}"
        );
        assert!(!of_all.contains("ended"));
        let cut = costs(&passes, &[("image", Counts { rays_cut: 6, ..shade })], &work);
        assert!(table(&cut, &copy).contains("ended 6 rays before"));
    }
}
