//! Options from a dictionary. Python's part fills it: every key is present, or its default applies.

use std::path::PathBuf;
use std::time::Duration;

use glam::{DVec3, Vec3};
use pyo3::conversion::FromPyObjectOwned;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use twobounce::output::display::ToneMap;
use twobounce::{Aov, Noise, Options, Sky, Viewpoint, When};

use crate::{Error, to_python};

/// A value of the dictionary; `None` counts as absent.
fn get<'py, T: FromPyObjectOwned<'py>>(options: &Bound<'py, PyDict>, key: &str) -> PyResult<Option<T>> {
    match options.get_item(key)? {
        Some(value) if !value.is_none() => match value.extract::<T>().map_err(Into::<PyErr>::into) {
            Ok(value) => Ok(Some(value)),
            Err(error) => Err(Error::new_err(format!("{key}: {}", error.value(options.py())))),
        },
        _ => Ok(None),
    }
}

/// One of the named choices.
fn named<T: Copy>(key: &str, name: &str, all: &[T], name_of: impl Fn(T) -> &'static str) -> PyResult<T> {
    all.iter().copied().find(|choice| name_of(*choice) == name).ok_or_else(|| {
        let names: Vec<&str> = all.iter().map(|choice| name_of(*choice)).collect();
        Error::new_err(format!("{key}: {name:?} is none of {}", names.join(", ")))
    })
}

/// The options that a dictionary names.
pub fn read(given: &Bound<'_, PyDict>) -> PyResult<Options> {
    let preset: Option<String> = get(given, "preset")?;
    let mut options =
        preset.map_or_else(|| Ok(Options::default()), |name| Options::preset(&name)).map_err(to_python)?;
    for set in get::<Vec<String>>(given, "settings")?.unwrap_or_default() {
        options.set(&set).map_err(to_python)?;
    }
    options.size = get(given, "size")?.unwrap_or(options.size);
    let stage = &mut options.stage;
    if let Some(name) = get::<String>(given, "camera")? {
        stage.viewpoint = Viewpoint::OfFile(name);
    }
    if let Some((eye, target, up)) = get::<([f64; 3], [f64; 3], [f64; 3])>(given, "look_at")? {
        let [eye, target, up] = [eye, target, up].map(DVec3::from);
        stage.viewpoint = Viewpoint::LookAt { eye, target, up };
    }
    stage.fov_degrees = get(given, "fov")?;
    stage.animation = get(given, "animation")?;
    stage.time_s = get(given, "time")?.unwrap_or(0.0);
    stage.repeats = get(given, "loop")?.unwrap_or(false);
    if let Some(map) = get::<PathBuf>(given, "sky_map")? {
        stage.sky = Sky::Map(map);
    } else if let Some(radiance) = get::<[f32; 3]>(given, "sky")? {
        stage.sky = Sky::Even(Vec3::from(radiance));
    }
    stage.sky_intensity = get(given, "sky_intensity")?.unwrap_or(1.0);
    stage.sky_rotation_degrees = get(given, "sky_rotation")?.unwrap_or(0.0);
    for (key, when) in [("default_light", &mut stage.default_light), ("ground", &mut stage.ground)] {
        if let Some(name) = get::<String>(given, key)? {
            *when = named(key, &name, When::ALL, When::name)?;
        }
    }
    for name in get::<Vec<String>>(given, "layers")?.unwrap_or_default() {
        let further: Vec<Aov> =
            Aov::ALL.iter().copied().filter(|aov| !matches!(aov, Aov::Beauty | Aov::Alpha)).collect();
        options.layers.push(named("layers", &name, &further, Aov::name)?);
    }
    options.transparent = get(given, "transparent")?.unwrap_or(false);
    options.noise = match (get::<bool>(given, "refine")?, get::<f64>(given, "noise")?) {
        (Some(false), _) => Some(Noise::Off),
        (_, noise) => noise.map(Noise::AtMost),
    };
    if let Some(seconds) = get::<f64>(given, "time_limit")? {
        let wrong = || Error::new_err("time_limit: give seconds, finite and at least 0");
        options.time_limit = Some(Duration::try_from_secs_f64(seconds).map_err(|_| wrong())?);
    }
    if let Some(name) = get::<String>(given, "tone")? {
        options.tone = named("tone", &name, ToneMap::ALL, ToneMap::name)?;
    }
    options.exposure_ev = get(given, "exposure")?;
    options.device = get(given, "device")?;
    options.validation = get(given, "validation")?.unwrap_or(false);
    options.memory_limit = get(given, "memory_limit")?;
    Ok(options)
}
