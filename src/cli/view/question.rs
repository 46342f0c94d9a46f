//! Questions of the user to the thread that makes frames: the rays of a pixel, and the cost of a setting.

use std::sync::Arc;

use glam::DVec3;
use twobounce::gi::Method;
use twobounce::gi::rays::inspect::{Inspect, Inspected, InspectedRay};
use twobounce::memory::mib;
use twobounce::renderer::Renderer;
use twobounce::scene::Scene;
use twobounce::settings::{Key, Range, Settings};
use twobounce::vk::Context;
use twobounce::{Error, Result};

#[derive(Clone, Debug)]
pub enum Question {
    /// The rays of this pixel of the last picture.
    Rays((u32, u32)),
    /// The cost of a frame with other values of a key.
    Cost(&'static str),
}

/// Answer to a [`Question`].
pub enum Reply {
    Rays(Vec<GatherRay>),
    Cost(&'static str, Vec<Cost>),
}

/// A ray that gathered diffuse light. Positions are in metres in the world; light is radiance.
pub struct GatherRay {
    pub from: DVec3,
    pub to: DVec3,
    pub light: [f32; 3],
    /// The hit surface as text; empty for the sky.
    pub met: String,
}

/// A frame with another value of a setting.
pub struct Cost {
    pub value: String,
    pub is_now: bool,
    /// Milliseconds of device time of a frame from scratch, and bytes of device memory; or the reason why it failed.
    pub taken: std::result::Result<(f64, u64), String>,
}

impl Cost {
    pub fn in_words(&self) -> String {
        match &self.taken {
            Ok((ms, bytes)) => format!("{}: {ms:.1} ms, {:.0} MiB", self.value, mib(*bytes)),
            Err(why) => format!("{}: {why}", self.value),
        }
    }
}

/// The debug views of a frame of the method `rays`, which are created on the first request.
///
/// # Errors
/// The frame has another method.
pub fn inspect<'a>(
    made: &'a mut Option<Inspect>,
    context: &Arc<Context>,
    renderer: &Renderer,
    settings: &Settings,
) -> Result<&'a Inspect> {
    if settings.method != Method::Rays {
        let words =
            format!("only the method rays stores light on surfaces, not {}: choose a preset of rays", settings.method);
        return Err(Error::Usage(words));
    }
    if made.is_none() {
        *made = Some(Inspect::new(context, settings, inspected(renderer))?);
    }
    Ok(made.as_ref().expect("just made"))
}

/// The last frame as input of debug views.
pub fn inspected(renderer: &Renderer) -> Inspected<'_> {
    let frame = renderer.frame();
    Inspected { ground: &frame.ground, method: &*frame.method }
}

/// The rays in the world.
pub fn rays(found: &[InspectedRay], renderer: &Renderer) -> Vec<GatherRay> {
    let (scene, frame) = (renderer.scene(), renderer.frame());
    let grid = &frame.ground.desc.grid;
    let world = |voxels: [f32; 3]| grid.corner + DVec3::from(voxels.map(f64::from)) * grid.voxel_m;
    let ray = |ray: &InspectedRay| GatherRay {
        from: world(ray.from),
        to: world(ray.to),
        light: ray.light.map(|c| c / frame.scale),
        met: ray.source.checked_sub(1).map_or(String::new(), |source| met(scene, source, ray.back != 0)),
    };
    found.iter().filter(|ray| ray.from != ray.to).map(ray).collect()
}

/// A triangle as text: the names of its instance and material, and the side.
fn met(scene: &Scene, source: u32, back: bool) -> String {
    let mut first = 0;
    let instance = scene.instances.iter().find(|instance| {
        first += scene.meshes[instance.mesh].indices.len() as u32 / 3;
        source < first
    });
    let material = instance.map(|instance| scene.meshes[instance.mesh].material);
    let name = material.map_or("?", |material| &scene.materials[material].name);
    let name = if name.is_empty() { format!("material {}", material.unwrap_or(0)) } else { name.to_owned() };
    format!("{name}, {}", if back { "back" } else { "front" })
}

/// Values of a key to compare with `now`: all if there are few, otherwise half and double.
pub fn neighbours(key: &Key, now: &str) -> Vec<String> {
    let whole = |least: u32, most: u32| match now.parse::<u32>() {
        Ok(n) => {
            [n / 2, n, n.saturating_mul(2).max(n + 1)].into_iter().filter(|n| (least..=most).contains(n)).collect()
        }
        Err(_) => vec![],
    };
    let words = |numbers: Vec<u32>| numbers.iter().map(u32::to_string).collect::<Vec<_>>();
    let mut values = match key.range {
        Range::Bool => vec!["false".into(), "true".into()],
        Range::Choice(names) => names().into_iter().map(str::to_owned).collect(),
        Range::OneOf(all) => words(all.to_vec()),
        Range::Whole(least, most) | Range::WholeOrAuto(least, most) | Range::PowerOfTwo(least, most) => {
            words(whole(least, most))
        }
        Range::Number(least, most) | Range::NumberOrAuto(least, most) => match now.parse::<f64>() {
            Ok(n) => [n / 2.0, n, n * 2.0].iter().filter(|n| (least..=most).contains(n)).map(f64::to_string).collect(),
            Err(_) => vec![],
        },
        Range::Center(_) => vec![],
    };
    values.dedup();
    if !values.iter().any(|value| value == now) {
        values.insert(0, now.to_owned());
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_all_of_a_few_or_half_and_double() {
        let entries = Settings::fast().entries();
        let of = |name: &str, now: &str| {
            let key = entries.iter().find(|(key, _)| key.name == name).unwrap_or_else(|| panic!("no {name}")).0;
            neighbours(key, now)
        };
        assert_eq!(of("voxels", "64"), ["32", "64", "128"]);
        assert_eq!(of("rays.diffuse", "1"), ["1", "2"]);
        assert_eq!(of("bounces", "2"), ["1", "2", "all"]);
        assert_eq!(of("grid.side", "auto"), ["auto"]);
    }
}
