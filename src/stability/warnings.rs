//! Detects known weaknesses of a method in a scene from the boxes of its meshes alone, which takes no time.

use glam::{DMat3, DVec3, Vec3};

use crate::gi::Method;
use crate::ground::grid::Grid;
use crate::scene::{Bounds, Mesh, Pose, Scene};
use crate::settings::{LampLight, Settings};

/// The minimum of a wall's two long sides as a share of the scene's longest side.
const WALL: f64 = 0.2;
/// The thickness in voxels below which walls leak: see `docs/notes/stability.md`.
const LEAKS_BELOW: f64 = 2.0;

/// A clause for each known weakness in this scene with these settings. `bounds` are those of the scene.
pub fn known_failures(scene: &Scene, pose: &Pose, bounds: Bounds, settings: &Settings) -> Vec<String> {
    let Ok(grid) = Grid::place(bounds, settings) else { return Vec::new() };
    let mut found = Vec::new();
    let outside = outside(&grid, bounds);
    if outside > 0.0 {
        let percent = (100.0 * outside).ceil();
        found.push(format!(
            "the grid does not cover {percent} % of the scene's box, which sends and blocks no light there"
        ));
    }
    if !matches!(settings.method, Method::Rays | Method::Paths | Method::None)
        && let Some(thin) = thinnest(scene, pose, bounds, settings).filter(|voxels| *voxels < LEAKS_BELOW)
    {
        let method = settings.method.name();
        found.push(format!(
            "a wall of {thin:.2} voxels leaks light with the method {method}: raise voxels, or use rays"
        ));
    }
    let gathered =
        settings.lights.lamps == LampLight::Gathered && !matches!(settings.method, Method::Paths | Method::None);
    let small = |part: &InstanceBox| part.lamp && part.sides.max_element() < grid.voxel_m;
    let lamps = if gathered { parts(scene, pose).filter(small).count() } else { 0 };
    if lamps > 0 {
        found.push(format!("{lamps} lamps are smaller than a voxel and gathered: set lights.lamps to sampled"));
    }
    found
}

/// The thickness in voxels of the thinnest wall among the boxes; `None` without a wall. Boxes at the scene's border do
/// not count, because nothing is behind them. `bounds` are those of the scene.
pub fn thinnest(scene: &Scene, pose: &Pose, bounds: Bounds, settings: &Settings) -> Option<f64> {
    let voxel_m = Grid::place(bounds, settings).ok()?.voxel_m;
    let thickness = |InstanceBox { sides, center, axes, .. }: InstanceBox| {
        let axis = (0..3).min_by(|a, b| sides[*a].total_cmp(&sides[*b]))?;
        let is_long = |other: usize| sides[other] > WALL * bounds.size().max_element();
        let normal = axes.col(axis).normalize_or_zero();
        let near = 2.0 * voxel_m + sides[axis];
        let at_border = [bounds.min, bounds.max].iter().any(|border| (center - border).dot(normal).abs() < near);
        let wide = (0..3).filter(|other| *other != axis).all(is_long);
        (wide && !at_border).then(|| sides[axis] / voxel_m)
    };
    parts(scene, pose).filter_map(thickness).min_by(f64::total_cmp)
}

/// The share of the box's volume outside the grid; for a flat box, of its area or length.
fn outside(grid: &Grid, bounds: Bounds) -> f64 {
    let (least, most) = (grid.corner, grid.corner + grid.voxel_m * f64::from(grid.edge));
    let inside = (bounds.max.min(most) - bounds.min.max(least)).max(DVec3::ZERO);
    let share = |axis: usize| {
        let side = bounds.size()[axis];
        let flat = bounds.min[axis] >= least[axis] && bounds.max[axis] <= most[axis];
        if flat {
            1.0
        } else if side > 0.0 {
            inside[axis] / side
        } else {
            0.0
        }
    };
    1.0 - share(0) * share(1) * share(2)
}

/// The box of a mesh at an instance.
struct InstanceBox {
    /// Lengths of its sides in metres.
    sides: DVec3,
    center: DVec3,
    axes: DMat3,
    lamp: bool,
}

fn parts(scene: &Scene, pose: &Pose) -> impl Iterator<Item = InstanceBox> {
    let bounds = |mesh: &Mesh| {
        let least = mesh.positions.iter().copied().reduce(Vec3::min)?;
        Some((least.as_dvec3(), mesh.positions.iter().copied().reduce(Vec3::max)?.as_dvec3()))
    };
    let of_mesh: Vec<_> = scene.meshes.iter().map(bounds).collect();
    scene.instances.iter().zip(&pose.world_from_instance).filter_map(move |(instance, world)| {
        let ((least, most), axes) = (of_mesh[instance.mesh]?, world.matrix3);
        let lengths = DVec3::new(axes.x_axis.length(), axes.y_axis.length(), axes.z_axis.length());
        let lamp = scene.materials[scene.meshes[instance.mesh].material].emissive != Vec3::ZERO;
        Some(InstanceBox {
            sides: lengths * (most - least),
            center: world.transform_point3(0.5 * (least + most)),
            axes,
            lamp,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stability::scenes::{add_lamp, at, divided, room_with};

    fn found(scene: &Scene, settings: &Settings) -> Vec<String> {
        known_failures(scene, &scene.pose(None, 0.0), scene.bounds(None), settings)
    }

    #[test]
    fn thin_walls_matter_to_methods_that_leak() {
        let scene = divided(0.02).scene;
        let cones = Settings { voxels: 64, ..Settings::cones() };
        let said = found(&scene, &cones);
        // The wall is 0.02 m thick in a grid of 59 voxels over 2 m.
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].contains("0.59 voxels"), "{said:?}");
        assert!(found(&scene, &Settings { voxels: 64, ..Settings::default() }).is_empty());
        assert!(found(&divided(0.2).scene, &cones).is_empty());
    }

    #[test]
    fn the_grid_may_be_too_small() {
        let scene = divided(0.2).scene;
        let mut settings = Settings::cones();
        assert!(found(&scene, &settings).is_empty());
        settings.grid.side = Some(1.0);
        assert!(found(&scene, &settings)[0].contains("50 %"), "{:?}", found(&scene, &settings));
        // With rays, voxels are larger there.
        settings.method = Method::Rays;
        assert!(found(&scene, &settings).is_empty());
    }

    #[test]
    fn small_lamps_matter_where_they_are_gathered() {
        let scene = room_with(|scene| add_lamp(scene, 1.0, 0.01, at(0.0, 0.5, 0.0))).scene;
        assert!(found(&scene, &Settings { voxels: 64, ..Settings::printed() }).iter().any(|s| s.contains("1 lamps")));
        assert!(found(&scene, &Settings::default()).is_empty());
    }
}
