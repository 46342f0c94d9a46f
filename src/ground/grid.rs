//! The place of a grid, and the scale of its stored light.

use glam::{DAffine3, DMat3, DVec3, Vec3};

use super::boxes::{FACTOR, MOST_BOXES};
use crate::scene::{Bounds, LightKind, Scene};
use crate::settings::{Bounces, Center, Settings};
use crate::{Error, Result};

/// The base grid: a cube of `edge`³ voxels in the world. All lengths on the GPU are in its voxels, relative to its
/// least corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// The least corner in metres in the world.
    pub corner: DVec3,
    /// The edge of a voxel in metres.
    pub voxel_m: f64,
    pub edge: u32,
    /// The number of boxes of finer voxels within the grid, each with a quarter of the side of the one around it.
    pub boxes: u32,
    /// The centre of these boxes in voxels of the grid; `None` for the camera.
    pub about: Option<Vec3>,
}

impl Grid {
    /// The cube around `bounds` (over the whole animation) with the settings' margin, or at the place that the settings
    /// choose. If that cube does not contain the scene and the method supports boxes of finer voxels, the cube becomes
    /// the smallest box, and the grid contains the scene.
    ///
    /// # Errors
    /// The margin leaves no room for the scene, or the side is not a positive number.
    pub fn place(bounds: Bounds, settings: &Settings) -> Result<Self> {
        let empty = bounds.min.cmpgt(bounds.max).any();
        let (min, max) = if empty { (DVec3::ZERO, DVec3::ZERO) } else { (bounds.min, bounds.max) };
        let edge = f64::from(settings.voxels);
        let inner = edge - 2.0 * settings.grid.margin;
        if inner < 1.0 {
            return Err(Error::Usage(format!(
                "grid.margin = {} leaves no voxel of {} for the scene: make it less than {}",
                settings.grid.margin,
                settings.voxels,
                (edge - 1.0) / 2.0
            )));
        }
        let longest = (max - min).max_element();
        // A scene without extent still gets a cube.
        let fitted = if longest > 0.0 { longest * edge / inner } else { 1.0 };
        let finest = settings.grid.side.unwrap_or(fitted);
        if !(finest > 0.0 && finest.is_finite()) {
            return Err(Error::Usage(format!("grid.side = {finest} is no length: give metres above 0")));
        }
        let middle = (min + max) / 2.0;
        let center = match settings.grid.center {
            Center::Scene | Center::Camera => middle,
            Center::Point(point) => DVec3::from_array(point),
        };
        let holds = |boxes: u32| {
            // Geometry on the faces of the cube, or slightly outside, is lit too.
            let half = 0.5 * finest * FACTOR.powi(boxes as i32) - 0.5 * finest / edge;
            min.cmpge(center - half).all() && max.cmple(center + half).all()
        };
        let nests = settings.method.wants(settings).nested;
        let boxes = if nests { (0..MOST_BOXES as u32).find(|&n| holds(n)).unwrap_or(MOST_BOXES as u32) } else { 0 };
        let side = finest * FACTOR.powi(boxes as i32);
        Ok(Self {
            corner: center - side / 2.0,
            voxel_m: side / edge,
            edge: settings.voxels,
            boxes,
            about: (settings.grid.center != Center::Camera).then(|| Vec3::splat(0.5 * settings.voxels as f32)),
        })
    }

    /// The edge of the smallest voxels in metres.
    pub fn finest_m(&self) -> f64 {
        self.voxel_m / FACTOR.powi(self.boxes as i32)
    }

    /// The transform from world metres to voxels.
    pub fn voxel_from_world(&self) -> DAffine3 {
        DAffine3::from_mat3_translation(
            DMat3::from_diagonal(DVec3::splat(1.0 / self.voxel_m)),
            -self.corner / self.voxel_m,
        )
    }
}

/// A further grid, placed in voxels of the base grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridPlace {
    /// Voxels along its edge.
    pub edge: u32,
    /// Its least corner, in voxels of the base grid.
    pub corner: [f32; 3],
    /// The edge of one of its voxels in voxels of the base grid. Powers of two are exact.
    pub voxel: f32,
}

impl GridPlace {
    /// The transform from voxels of the base grid to its own: x, y and z of the offset, and the scale, which is applied
    /// first.
    pub fn from_base(&self) -> [f32; 4] {
        let scale = 1.0 / self.voxel;
        let [x, y, z] = self.corner.map(|c| 0.0 - c * scale);
        [x, y, z, scale]
    }

    /// The base grid as a place.
    pub fn base(edge: u32) -> Self {
        Self { edge, corner: [0.0; 3], voxel: 1.0 }
    }
}

/// The power of two by which stored radiance is multiplied for RGBA16F. The highest radiance that the lights certainly
/// cause becomes 2¹⁴ to 2¹⁵, and 29 bits below it are kept. With all bounces, whose light may add up, it becomes 2⁸ to
/// 2⁹, and radiance 128 times higher saturates.
///
/// The brightest surface near a point light is assumed to be one voxel away; nearer ones saturate.
pub fn radiance_scale(scene: &Scene, voxel_m: f64, bounces: Bounces) -> f32 {
    let largest = |v: Vec3| f64::from(v.max_element());
    let map = scene.sky_map.as_ref().map(|map| f64::from(map.brightest_of_rest()));
    let mut peak = map.unwrap_or(largest(scene.sky + scene.sky_gradient));
    for material in &scene.materials {
        peak = peak.max(largest(material.emissive));
    }
    let reflected: f64 = scene
        .lights
        .iter()
        .map(|light| match light.kind {
            LightKind::Directional => largest(light.intensity) / std::f64::consts::PI,
            _ => largest(light.intensity) / (std::f64::consts::PI * voxel_m * voxel_m),
        })
        .sum();
    let of_sky: f64 = scene.sky_lights().map(|light| largest(light.irradiance) / std::f64::consts::PI).sum();
    peak = peak.max(reflected + of_sky);
    if !(peak > 0.0 && peak.is_finite()) {
        return 1.0;
    }
    // f32 holds 2^±126, which exceeds any real scene.
    let highest = if bounces == Bounces::All { 8.0 } else { 14.0 };
    (highest - peak.log2().floor()).clamp(-100.0, 100.0).exp2() as f32
}
