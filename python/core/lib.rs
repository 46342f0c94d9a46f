//! The native part of the Python package `twobounce`. Python's part (`python/src/twobounce/__init__.py`) has the names,
//! defaults and docs; this part converts values, runs the work without Python's lock, and lets signals and callbacks
//! end it.

mod image;
mod options;
mod scene;
mod work;

use std::sync::{Mutex, PoisonError};

use pyo3::exceptions::{PyException, PyMemoryError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use image::{Image, Pixels};
use scene::Scene;
use twobounce::reference::cache::Cache;

pyo3::create_exception!(
    twobounce,
    Error,
    PyException,
    "A file, a value or a device is wrong; the message is one sentence that says what to do."
);

/// The Python exception for an error.
fn to_python(error: twobounce::Error) -> PyErr {
    match error {
        twobounce::Error::Memory(text) => PyMemoryError::new_err(text),
        other => Error::new_err(other.to_string()),
    }
}

/// `options`: see `options::read`. `progress` is called with the numbers of finished and of needed passes.
#[pyfunction]
fn render(py: Python<'_>, scene: &Scene, options: &Bound<'_, PyDict>, progress: Option<Py<PyAny>>) -> PyResult<Image> {
    let mut options = options::read(options)?;
    let scene = scene.shared();
    let image = work::run(py, |job| {
        options.cancel = Some(job.cancel.clone());
        options.progress = progress.map(|call| job.caller(call, |told: twobounce::Progress| (told.has, told.needed)));
        twobounce::render(&scene, &options)
    })?;
    Ok(Image::new(image))
}

/// `progress` is called with the share of traced paths, and the noise where it is known.
#[pyfunction]
#[pyo3(signature = (scene, options, *, bounces, samples, noise, seed, keep, progress))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
fn path_trace(
    py: Python<'_>,
    scene: &Scene,
    options: &Bound<'_, PyDict>,
    bounces: Option<u32>,
    samples: Option<u32>,
    noise: f64,
    seed: u64,
    keep: bool,
    progress: Option<Py<PyAny>>,
) -> PyResult<Image> {
    let mut options = options::read(options)?;
    let cache = keep.then(Cache::of_user);
    let how = twobounce::PathTracing { bounces, samples, noise, seed, cache };
    let scene = scene.shared();
    let image = work::run(py, |job| {
        options.cancel = Some(job.cancel.clone());
        let tell = progress.map(|call| {
            job.caller(call, |told: twobounce::reference::Progress| {
                (told.paths as f64 / told.expected.max(1) as f64, told.noise)
            })
        });
        // Threads call it in any order.
        let latest = Mutex::new(0);
        let progress = |told: twobounce::reference::Progress| {
            let mut latest = latest.lock().unwrap_or_else(PoisonError::into_inner);
            if told.paths >= *latest {
                *latest = told.paths;
                tell.iter().for_each(|tell| tell(told));
            }
        };
        twobounce::path_trace(&scene, &options, &how, &progress)
    })?;
    Ok(Image::new(image))
}

/// Every key of the settings with its default, as a TOML file.
#[pyfunction]
fn settings(preset: &str) -> PyResult<String> {
    Ok(twobounce::settings::Settings::preset(preset).map_err(to_python)?.to_toml())
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("Error", module.py().get_type::<Error>())?;
    let presets: Vec<&str> = twobounce::settings::PRESETS.iter().map(|preset| preset.name).collect();
    module.add("PRESETS", presets)?;
    module.add_class::<Scene>()?;
    module.add_class::<Image>()?;
    module.add_class::<Pixels>()?;
    module.add_function(wrap_pyfunction!(render, module)?)?;
    module.add_function(wrap_pyfunction!(path_trace, module)?)?;
    module.add_function(wrap_pyfunction!(settings, module)?)
}
