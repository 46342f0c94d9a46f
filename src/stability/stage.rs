//! A scene centred at the origin, which is placed in a grid and rendered.

use std::sync::atomic::Ordering;

use glam::{DAffine3, DVec3};

use super::SIZE;
use super::case::Place;
use super::cell::Cell;
use crate::ground::grid_choice::for_camera;
use crate::layers::{Aov, Layers};
use crate::renderer::{RenderOptions, Renderer};
use crate::scene::{Bounds, Pose, Scene, Still, View};
use crate::settings::{Center, Settings};
use crate::{Error, Result};

/// A scene, and the cube at the origin that contains it at every place.
#[derive(Clone)]
pub struct Stage {
    pub scene: Scene,
    /// Half the cube's side in metres, for the scene rotated by any of the angles.
    pub reach: f64,
    pub view: View,
}

impl Stage {
    /// Edge of a voxel with these settings, metres.
    pub fn voxel_m(&self, settings: &Settings) -> f64 {
        let edge = f64::from(settings.voxels);
        settings.grid.side.map_or(2.0 * self.reach / (edge - 2.0 * settings.grid.margin), |side| side / edge)
    }

    /// The settings with a grid that contains the stage if the scene extends beyond it.
    pub fn with_its_grid(&self, settings: &Settings) -> Settings {
        let mut settings = settings.clone();
        (settings.grid.center, settings.grid.side) =
            (Center::Point([0.0; 3]), Some(self.voxel_m(&settings) * f64::from(settings.voxels)));
        settings
    }

    pub fn pose(&self) -> Pose {
        self.scene.pose(None, 0.0)
    }

    pub fn bounds(&self, center: DVec3) -> Bounds {
        Bounds { min: center - self.reach, max: center + self.reach }
    }
}

/// A stage on the device.
pub struct CaseRenderer<'a> {
    cell: Cell<'a>,
    pub stage: Stage,
    pub renderer: Renderer,
    voxel_m: f64,
}

impl<'a> CaseRenderer<'a> {
    /// A renderer with the settings of the cell, [fitted](for_camera) as `render` does.
    pub fn new(cell: &Cell<'a>, stage: Stage) -> Result<Self> {
        Self::about(cell, stage, DVec3::ZERO)
    }

    /// As [`Self::new`], with the grid around `center`.
    pub fn about(cell: &Cell<'a>, stage: Stage, center: DVec3) -> Result<Self> {
        let aovs = vec![Aov::Direct, Aov::Indirect, Aov::Depth];
        let voxel_m = stage.voxel_m(&cell.settings);
        // If the settings fix the size of the grid, distant parts are outside of it.
        let bounds = match (cell.settings.grid.side, stage.scene.bounds(None)) {
            (Some(_), Bounds { min, max }) => Bounds { min: min + center - voxel_m, max: max + center + voxel_m },
            (None, _) => stage.bounds(center),
        };
        let options =
            RenderOptions { aovs, memory_limit: cell.memory_limit, ..RenderOptions::new((SIZE, SIZE), bounds) };
        let world = DAffine3::from_translation(center);
        let (pose, view) = (moved(&stage.pose(), &world), seen(stage.view, &world));
        let settings = for_camera(&cell.settings, Still::new(&stage.scene, &pose, &view), options.bounds);
        let renderer = Renderer::new(cell.context, stage.scene.clone(), &pose, settings, options)?;
        Ok(Self { cell: cell.clone(), stage, renderer, voxel_m })
    }

    /// Renders the scene at a place with its view.
    pub fn shoot(&mut self, place: &Place) -> Result<Layers> {
        self.shoot_at(&place.world(self.voxel_m))
    }

    /// As [`Self::shoot`], without light of earlier frames.
    pub fn shoot_anew(&mut self, place: &Place) -> Result<Layers> {
        self.renderer.forget_light();
        self.shoot(place)
    }

    /// Renders the scene and its view moved by `world`.
    pub fn shoot_at(&mut self, world: &DAffine3) -> Result<Layers> {
        self.frame(world, &self.stage.pose(), self.stage.view)
    }

    /// Renders the scene at a place in another pose and with another view.
    pub fn shoot_as(&mut self, place: &Place, pose: &Pose, view: View) -> Result<Layers> {
        self.frame(&place.world(self.voxel_m), pose, view)
    }

    fn frame(&mut self, world: &DAffine3, pose: &Pose, view: View) -> Result<Layers> {
        if self.cell.cancel.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let report = self.renderer.render(&moved(pose, world), &seen(view, world))?;
        self.cell.frame_ms.borrow_mut().push(report.timings.gpu_ms);
        Ok(self.renderer.read())
    }
}

/// A pose moved as a whole.
pub fn moved(pose: &Pose, world: &DAffine3) -> Pose {
    let mut pose = pose.clone();
    pose.world_from_instance.iter_mut().for_each(|place| *place = *world * *place);
    for light in &mut pose.lights {
        light.position = world.transform_point3(light.position);
        light.direction = world.transform_vector3(light.direction).normalize();
    }
    pose
}

/// A view moved by a rotation or a reflection. A view cannot be reflected, so the image is mirrored instead.
pub fn seen(view: View, world: &DAffine3) -> View {
    View {
        eye: world.transform_point3(view.eye),
        forward: world.transform_vector3(view.forward).normalize(),
        up: world.transform_vector3(view.up).normalize(),
        ..view
    }
}
