//! Chooses smaller voxels around a camera, by the distance of the surfaces there.

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::boxes::{FACTOR, MOST_BOXES};
use super::grid::Grid;
use crate::scene::{Bounds, Instance, Pose, Projection, Scene, Still};
use crate::settings::{Center, Settings};

/// The maximum edge of a voxel as a share of the distance to the surfaces around the camera. A room in a landscape of a
/// kilometre (`balanced`, all bounces) has `rel` 0.119 with voxels of a half of the distance, and 0.082 with an eighth.
const MOST_OF_WAY: f64 = 0.25;

/// Bytes that every device binds as one storage buffer (Vulkan's least `maxStorageBufferRange`).
const SMALLEST_BINDING: u64 = 1 << 27;

/// The settings with smaller voxels around the camera if those of one grid for the whole scene are too large, and a
/// note about this. `None` if they are not, if the settings place the grid, or if the method supports only one grid.
/// `bounds` are those of the scene over the whole animation.
pub fn fitted_to_camera(
    settings: &Settings,
    Still { scene, pose, view }: Still,
    bounds: Bounds,
) -> Option<(Settings, String)> {
    let free = settings.grid.side.is_none() && !matches!(settings.grid.center, Center::Point(_));
    if !free || !settings.method.wants(settings).nested || matches!(view.projection, Projection::Orthographic { .. }) {
        return None;
    }
    let grid = Grid::place(bounds, settings).ok()?;
    let way = median_distance(scene, pose, view.eye)?;
    let smaller = |boxes: i32| FACTOR.powi(-boxes);
    let fits = |&boxes: &i32| grid.voxel_m * smaller(boxes) <= MOST_OF_WAY * way;
    let most = most_boxes(grid.edge);
    let boxes = (0..most).find(fits).unwrap_or(most);
    if boxes == 0 {
        return None;
    }
    let side = three_digits(grid.voxel_m * f64::from(grid.edge) * smaller(boxes));
    let mut fitted = settings.clone();
    (fitted.grid.center, fitted.grid.side) = (Center::Camera, Some(side));
    let words = format!(
        "voxels of {:.2} m are large for surfaces {way:.2} m from the camera: around it they are {:.3} m (--set \
         grid.center=camera --set grid.side={side})",
        grid.voxel_m,
        side / f64::from(grid.edge)
    );
    Some((fitted, words))
}

/// The settings fitted to the camera, or unchanged if they already fit.
pub fn for_camera(settings: &Settings, seen: Still, bounds: Bounds) -> Settings {
    fitted_to_camera(settings, seen, bounds).map_or_else(|| settings.clone(), |(fitted, _)| fitted)
}

/// The maximum number of boxes whose voxels any device can bind together with those of the base grid.
fn most_boxes(edge: u32) -> i32 {
    let grids = SMALLEST_BINDING / (u64::from(edge).pow(3) * size_of::<u32>() as u64);
    grids.saturating_sub(1).min(MOST_BOXES as u64) as i32
}

/// A length rounded up to three digits, so that the content of the grid stays inside.
fn three_digits(length: f64) -> f64 {
    let unit = 10f64.powi(length.log10().floor() as i32 - 2);
    let digits = (length / unit).ceil();
    // Formatting it this way gives the shortest decimal.
    if unit < 1.0 { digits / (1.0 / unit).round() } else { digits * unit.round() }
}

/// Bins per octave of the distance, and the number of bins below 1 m.
const BINS: f64 = 8.0;
const BELOW: i32 = 160;
const ALL_BINS: usize = 400;
/// Units of a solid angle of 1. Sums of whole numbers do not depend on the order.
const UNITS: f64 = (1u64 << 32) as f64;
/// Indices of triangles per thread.
const PART: usize = 3 << 12;
/// A triangle is split into four until its size is at most this share of its distance, up to [`MOST_CUTS`] times.
const MOST_SEEN: f64 = 0.5;
const MOST_CUTS: u32 = 6;

/// The median distance in metres of all triangles from a point, weighted by their solid angle without occlusion,
/// rounded to a twelfth. `None` without triangles.
pub fn median_distance(scene: &Scene, pose: &Pose, eye: DVec3) -> Option<f64> {
    let sum = |mut bins: Vec<u64>, more: Vec<u64>| {
        bins.iter_mut().zip(more).for_each(|(bin, more)| *bin += more);
        bins
    };
    let none = || vec![0u64; ALL_BINS];
    let of_instance = |bins: Vec<u64>, (instance, world): (&Instance, &DAffine3)| {
        let eye_from_object = DAffine3::from_translation(-eye) * *world;
        let mesh = &scene.meshes[instance.mesh];
        let point = |index: u32| eye_from_object.transform_point3(mesh.positions[index as usize].as_dvec3());
        let of_part = |mut bins: Vec<u64>, part: &[u32]| {
            for corners in part.chunks_exact(3) {
                add([point(corners[0]), point(corners[1]), point(corners[2])], MOST_CUTS, &mut bins);
            }
            bins
        };
        // Millions of small meshes are added to existing bins one after another.
        if mesh.indices.len() <= PART {
            return of_part(bins, &mesh.indices);
        }
        sum(bins, mesh.indices.par_chunks(PART).fold(none, of_part).reduce(none, sum))
    };
    let places = scene.instances.par_iter().zip(&pose.world_from_instance);
    let bins = places.fold(none, of_instance).reduce(none, sum);
    let total: u64 = bins.iter().sum();
    let mut seen = 0;
    let reaches_half = |bin: &u64| {
        seen += bin;
        2 * seen >= total
    };
    let median = bins.iter().position(reaches_half).filter(|_| total > 0)?;
    Some(((median as i32 - BELOW) as f64 / BINS).exp2())
}

/// Adds a triangle whose corners are relative to the point.
fn add([a, b, c]: [DVec3; 3], cuts: u32, bins: &mut [u64]) {
    let distance = ((a + b + c) / 3.0).length();
    let longest = (b - a).length().max((c - b).length()).max((a - c).length());
    if cuts > 0 && longest > MOST_SEEN * distance {
        let (ab, bc, ca) = (0.5 * (a + b), 0.5 * (b + c), 0.5 * (c + a));
        for part in [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]] {
            add(part, cuts - 1, bins);
        }
        return;
    }
    let bin = (distance.max(1e-9).log2() * BINS).floor() as i32 + BELOW;
    bins[bin.clamp(0, ALL_BINS as i32 - 1) as usize] += (solid_angle(a, b, c) * UNITS) as u64;
}

/// The formula is from Van Oosterom and Strackee, "The Solid Angle of a Plane Triangle", 1983.
fn solid_angle(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let (la, lb, lc) = (a.length(), b.length(), c.length());
    let over = a.dot(b.cross(c)).abs();
    let under = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
    let angle = 2.0 * over.atan2(under);
    if angle.is_finite() { angle } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::scene::{Material, Mesh, View};

    fn room(half: f32) -> Scene {
        let mut scene = Scene::empty("room");
        let material = scene.add_material(Material::default());
        let walls = Mesh::cuboid("room", material, Vec3::splat(-half), Vec3::splat(half), true);
        scene.add_mesh(walls, DAffine3::IDENTITY);
        scene
    }

    #[test]
    fn every_device_binds_the_boxes_that_are_chosen() {
        assert_eq!([16, 128, 256].map(most_boxes), [5, 5, 1]);
    }

    #[test]
    fn a_cube_is_seen_all_around_at_its_walls() {
        let scene = room(2.0);
        let far = median_distance(&scene, &scene.pose(None, 0.0), DVec3::ZERO).unwrap();
        // The mean over all directions is 1.22 half sides.
        assert!((2.1..2.7).contains(&far), "{far}");
        let angles: f64 = (0..6)
            .map(|side| {
                let [x, y] = [DVec3::AXES[side % 3], DVec3::AXES[(side + 1) % 3]];
                let z = DVec3::AXES[(side + 2) % 3] * if side < 3 { 1.0 } else { -1.0 };
                let corner = |i: f64, j: f64| z + i * x + j * y;
                let [a, b, c, d] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                solid_angle(a, b, c) + solid_angle(a, c, d)
            })
            .sum();
        assert!((angles - 4.0 * std::f64::consts::PI).abs() < 1e-9, "{angles}");
    }

    #[test]
    fn voxels_are_small_where_the_camera_is_in_a_room_of_a_landscape() {
        let mut scene = room(2.0);
        let material = scene.add_material(Material::default());
        let corner = Vec3::new(-500.0, -2.1, -500.0);
        let ground = Mesh::quad("ground", material, corner, Vec3::Z * 1000.0, Vec3::X * 1000.0);
        scene.add_mesh(ground, DAffine3::IDENTITY);
        let (pose, bounds) = (scene.pose(None, 0.0), scene.bounds(None));
        let view = View::look_at(DVec3::ZERO, DVec3::X, DVec3::Y, 1.0);
        let settings = Settings { voxels: 64, ..Settings::default() };
        let (fitted, words) = fitted_to_camera(&settings, Still::new(&scene, &pose, &view), bounds).unwrap();
        // The voxels have edges of 17, 4.2, 1.06 and 0.27 m.
        assert_eq!(fitted.grid.center, Center::Camera);
        assert_eq!(fitted.grid.side, Some(17.0), "{words}");
        let grid = Grid::place(bounds, &fitted).unwrap();
        assert_eq!(grid.boxes, 3);
        // A camera high above only sees distant surfaces, and a room without a landscape has small voxels anyway.
        let above = View { eye: DVec3::Y * 300.0, ..view };
        assert!(fitted_to_camera(&settings, Still::new(&scene, &pose, &above), bounds).is_none());
        let alone = room(2.0);
        assert!(
            fitted_to_camera(&settings, Still::new(&alone, &alone.pose(None, 0.0), &view), alone.bounds(None))
                .is_none()
        );
        // Methods with one grid, and settings that place the grid, are not changed either.
        assert!(fitted_to_camera(&Settings::cones(), Still::new(&scene, &pose, &view), bounds).is_none());
        assert!(fitted_to_camera(&fitted, Still::new(&scene, &pose, &view), bounds).is_none());
    }

    #[test]
    fn lengths_are_rounded_up_to_three_digits() {
        assert_eq!([16.94, 0.012341, 1.0, 12345.0].map(three_digits), [17.0, 0.0124, 1.0, 12400.0]);
    }
}
