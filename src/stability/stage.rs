//! A scene about the origin, put at places in a grid, and rendered there.

use glam::{DAffine3, DVec3};

use super::SIZE;
use super::case::Place;
use super::cell::Cell;
use crate::Result;
use crate::ground::clearance::for_camera;
use crate::layers::{Aov, Layers};
use crate::renderer::{FrameReport, RenderOptions, Renderer};
use crate::scene::{Bounds, Pose, Scene, Still, View};
use crate::settings::{Center, Settings};

/// A scene, and the cube about the origin that it stays in wherever it is put.
#[derive(Clone)]
pub struct Stage {
    pub scene: Scene,
    pub view: View,
    /// Half the cube's side, metres.
    pub reach: f64,
}

impl Stage {
    /// `reach`: of the scene turned by any of the angles.
    pub fn new(scene: Scene, reach: f64, view: View) -> Self {
        Self { scene, view, reach }
    }

    /// Edge of a voxel with these settings, metres.
    pub fn voxel_m(&self, settings: &Settings) -> f64 {
        let edge = f64::from(settings.voxels);
        settings.grid.side.map_or(2.0 * self.reach / (edge - 2.0 * settings.grid.margin), |side| side / edge)
    }

    /// The settings with a grid that is about the stage wherever the scene goes beyond it.
    pub fn with_its_grid(&self, settings: &Settings) -> Settings {
        let mut settings = settings.clone();
        (settings.grid.center, settings.grid.side) =
            (Center::Point([0.0; 3]), Some(self.voxel_m(&settings) * f64::from(settings.voxels)));
        settings
    }

    pub fn pose(&self) -> Pose {
        self.scene.pose(None, 0.0)
    }

    /// What the scene takes at `center`, and so much more on every side.
    fn scene_bounds(&self, center: DVec3, more: f64) -> Bounds {
        let Bounds { min, max } = self.scene.bounds(None);
        Bounds { min: min + center - more, max: max + center + more }
    }

    pub fn bounds(&self, center: DVec3) -> Bounds {
        Bounds { min: center - self.reach, max: center + self.reach }
    }
}

/// A stage on the device.
pub struct Studio<'a> {
    cell: &'a Cell<'a>,
    pub stage: Stage,
    renderer: Renderer,
    voxel_m: f64,
}

impl<'a> Studio<'a> {
    /// With the settings of the cell.
    pub fn new(cell: &'a Cell, stage: Stage) -> Result<Self> {
        Self::with(cell, stage, cell.settings.clone(), DVec3::ZERO)
    }

    /// With other settings, [fitted](for_camera) as `render` does, and the grid about `center`.
    pub fn with(cell: &'a Cell, stage: Stage, settings: Settings, center: DVec3) -> Result<Self> {
        let aovs = vec![Aov::Direct, Aov::Indirect, Aov::Depth];
        let voxel_m = stage.voxel_m(&settings);
        // Where settings say how large the grid is, what reaches farther is outside of it.
        let bounds = match settings.grid.side {
            Some(_) => stage.scene_bounds(center, voxel_m),
            None => stage.bounds(center),
        };
        let options =
            RenderOptions { aovs, memory_limit: cell.memory_limit, ..RenderOptions::new((SIZE, SIZE), bounds) };
        let (pose, world) = (stage.pose(), DAffine3::from_translation(center));
        let (pose, view) = (moved(&pose, &world), seen(stage.view, &world));
        let settings = for_camera(&settings, Still::new(&stage.scene, &pose, &view), options.bounds);
        let renderer = Renderer::new(cell.context, stage.scene.clone(), &pose, settings, options)?;
        Ok(Self { cell, stage, renderer, voxel_m })
    }

    /// The scene at a place, as its view shows it.
    pub fn shoot(&mut self, place: &Place) -> Result<Layers> {
        self.shoot_at(&place.world(self.voxel_m), &self.stage.pose(), self.stage.view)
    }

    /// The same without the light of earlier frames.
    pub fn shoot_anew(&mut self, place: &Place) -> Result<Layers> {
        self.renderer.forget_light();
        self.shoot(place)
    }

    /// The same of a scene that stands otherwise, and another view.
    pub fn shoot_as(&mut self, place: &Place, pose: &Pose, view: View) -> Result<Layers> {
        self.shoot_at(&place.world(self.voxel_m), pose, view)
    }

    /// Everything, the view too, moved by `world`.
    pub fn shoot_at(&mut self, world: &DAffine3, pose: &Pose, view: View) -> Result<Layers> {
        self.frame(&moved(pose, world), &seen(view, world))?;
        Ok(self.renderer.read())
    }

    /// As it stands.
    pub fn frame(&mut self, pose: &Pose, view: &View) -> Result<FrameReport> {
        self.cell.go_on()?;
        let report = self.renderer.render(pose, view)?;
        self.cell.took(&report);
        Ok(report)
    }

    /// The next frame remakes lists and light.
    pub fn make_anew(&mut self) {
        self.renderer.make_anew();
    }

    /// Lights and materials of another stage from now on; its meshes are those that were there.
    pub fn relight(&mut self, stage: Stage) -> Result<()> {
        self.renderer.change_scene(stage.scene.clone(), &stage.pose(), &[])?;
        self.stage = stage;
        Ok(())
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

/// A view moved with it, by a rotation or a mirror: which a view cannot be, so that the image comes out mirrored.
pub fn seen(view: View, world: &DAffine3) -> View {
    View {
        eye: world.transform_point3(view.eye),
        forward: world.transform_vector3(view.forward).normalize(),
        up: world.transform_vector3(view.up).normalize(),
        ..view
    }
}
