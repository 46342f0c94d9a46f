//! Whether a scene meets a known failure: looked for in the boxes about its meshes alone, which takes no time.

use glam::{DAffine3, DVec3, Vec3};

use crate::gi::Method;
use crate::ground::grid::Grid;
use crate::scene::{Bounds, Mesh, Pose, Scene};
use crate::settings::{LampLight, Settings};

/// A wall's two long sides are at least such a share of the scene's longest.
const WALL: f64 = 0.2;
/// Below so many voxels of thickness walls leak: see `docs/stability.md`.
const LEAKS_BELOW: f64 = 2.0;

/// A clause for each known failure that the scene meets with these settings. `bounds`: of the scene.
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
    let boxes: Vec<Part> = parts(scene, pose).collect();
    if !matches!(settings.method, Method::Rays | Method::None)
        && let Some(thin) = thinnest_wall(&boxes, bounds, grid.voxel_m).filter(|voxels| *voxels < LEAKS_BELOW)
    {
        let method = settings.method.name();
        found.push(format!(
            "a wall of {thin:.2} voxels leaks light with the method {method}: raise voxels, or use rays"
        ));
    }
    let gathered = settings.lights.lamps == LampLight::Gathered && settings.method != Method::None;
    let small = |part: &&Part| part.lamp && part.sides().max_element() < grid.voxel_m;
    let lamps = boxes.iter().filter(small).count();
    if gathered && lamps > 0 {
        found.push(format!("{lamps} lamps are smaller than a voxel and gathered: set lights.lamps to sampled"));
    }
    found
}

/// Voxels of the thinnest wall that the boxes show; `None` without such a wall. `bounds`: of the scene.
pub fn thinnest(scene: &Scene, pose: &Pose, bounds: Bounds, settings: &Settings) -> Option<f64> {
    let grid = Grid::place(bounds, settings).ok()?;
    let boxes: Vec<Part> = parts(scene, pose).collect();
    thinnest_wall(&boxes, bounds, grid.voxel_m)
}

/// Share of the box's volume that is not in the grid; of a flat box, of its area or length.
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

/// The box about a mesh, in the mesh's own space.
struct Part {
    least: Vec3,
    most: Vec3,
    world: DAffine3,
    lamp: bool,
}

impl Part {
    /// Metres along the mesh's axes.
    fn sides(&self) -> DVec3 {
        let side = |axis: usize| {
            let along = DVec3::AXES[axis] * f64::from((self.most - self.least)[axis]);
            self.world.transform_vector3(along).length()
        };
        DVec3::new(side(0), side(1), side(2))
    }

    fn center(&self) -> DVec3 {
        self.world.transform_point3(0.5 * (self.least + self.most).as_dvec3())
    }
}

fn parts(scene: &Scene, pose: &Pose) -> impl Iterator<Item = Part> {
    let bounds = |mesh: &Mesh| {
        let least = mesh.positions.iter().copied().reduce(Vec3::min)?;
        Some((least, mesh.positions.iter().copied().reduce(Vec3::max)?))
    };
    let of_mesh: Vec<_> = scene.meshes.iter().map(bounds).collect();
    let places = scene.instances.iter().zip(&pose.world_from_instance);
    places.filter_map(move |(instance, world)| {
        let (least, most) = of_mesh[instance.mesh]?;
        let lamp = scene.materials[scene.meshes[instance.mesh].material].emissive != Vec3::ZERO;
        Some(Part { least, most, world: *world, lamp })
    })
}

/// Voxels. Nothing is behind what stands at the scene's border.
fn thinnest_wall(parts: &[Part], bounds: Bounds, voxel_m: f64) -> Option<f64> {
    let longest = bounds.size().max_element();
    let thickness = |part: &Part| {
        let sides = part.sides();
        let axis = (0..3).min_by(|a, b| sides[*a].total_cmp(&sides[*b]))?;
        let wide = (0..3).filter(|other| *other != axis).all(|other| sides[other] > WALL * longest);
        let normal = part.world.transform_vector3(DVec3::AXES[axis]).normalize_or_zero();
        let near = 2.0 * voxel_m + sides[axis];
        let beside = |border: DVec3| ((part.center() - border).dot(normal)).abs() < near;
        let at_border = beside(bounds.min) || beside(bounds.max);
        (wide && !at_border).then(|| sides[axis] / voxel_m)
    };
    parts.iter().filter_map(thickness).min_by(f64::total_cmp)
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
        // 0.02 m of 2 m in 59 voxels.
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
        // Rays have larger voxels there.
        settings.method = Method::Rays;
        assert!(found(&scene, &settings).is_empty());
    }

    #[test]
    fn small_lamps_matter_where_they_are_gathered() {
        let scene = room_with(|scene| {
            add_lamp(scene, 1.0, 0.01, at(0.0, 0.5, 0.0));
        });
        assert!(
            found(&scene.scene, &Settings { voxels: 64, ..Settings::printed() }).iter().any(|s| s.contains("1 lamps"))
        );
        assert!(found(&scene.scene, &Settings::default()).is_empty());
    }
}
