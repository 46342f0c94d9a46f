//! Pictures whose pixels numpy reads in place.

use std::path::PathBuf;

use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use twobounce::Aov;
use twobounce::measure::metrics::Metrics;

use crate::to_python;

#[pyclass(frozen, module = "twobounce._core")]
pub struct Image(twobounce::Image);

impl Image {
    pub fn new(image: twobounce::Image) -> Self {
        Self(image)
    }
}

/// A layer's pixels, by numpy's array interface: `numpy.asarray` copies nothing, and keeps the picture alive.
#[pyclass(frozen, module = "twobounce._core")]
pub struct Pixels {
    image: Py<Image>,
    layer: Aov,
}

#[pymethods]
impl Pixels {
    #[getter]
    fn __array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let image = &self.image.get().0;
        let pixels = image.layer(self.layer).unwrap_or_default();
        let (width, height) = image.size();
        let interface = PyDict::new(py);
        interface.set_item("version", 3)?;
        interface.set_item("shape", (height, width, 3))?;
        interface.set_item("typestr", if cfg!(target_endian = "little") { "<f4" } else { ">f4" })?;
        // Pixels neither move nor change while the picture lives; numpy gets them as read-only.
        interface.set_item("data", (pixels.as_ptr() as usize, true))?;
        Ok(interface)
    }
}

#[pymethods]
impl Image {
    /// Width and height.
    #[getter]
    fn size(&self) -> (u32, u32) {
        self.0.size()
    }

    #[getter]
    fn layers(&self) -> Vec<&'static str> {
        self.0.layers.layers.iter().map(|(layer, _)| layer.name()).collect()
    }

    fn pixels(slf: &Bound<'_, Self>, layer: &str) -> PyResult<Pixels> {
        let known = slf.get().0.layers.layers.iter().find(|(known, _)| known.name() == layer);
        let (layer, _) = known.ok_or_else(|| PyKeyError::new_err(layer.to_owned()))?;
        Ok(Pixels { image: slf.clone().unbind(), layer: *layer })
    }

    /// 8-bit sRGB, three bytes a pixel.
    fn shown<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, self.0.shown().as_flattened())
    }

    #[getter]
    fn exposure(&self) -> f32 {
        self.0.display.exposure_ev
    }

    #[getter]
    fn notes(&self) -> Vec<String> {
        self.0.notes.clone()
    }

    #[getter]
    fn noise(&self) -> Option<f64> {
        self.0.noise
    }

    /// The settings as a TOML file; `None` for a path-traced picture.
    #[getter]
    fn settings(&self) -> Option<String> {
        self.0.settings.as_ref().map(|settings| settings.to_toml())
    }

    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        py.detach(|| self.0.save(path)).map_err(to_python)
    }

    fn compare<'py>(&self, py: Python<'py>, reference: &Self) -> PyResult<Bound<'py, PyDict>> {
        let compared = py.detach(|| self.0.compare(&reference.0)).map_err(to_python)?;
        let dict = |metrics: &Metrics| {
            let dict = PyDict::new(py);
            Metrics::NAMES.iter().zip(metrics.values()).try_for_each(|(name, value)| dict.set_item(name, value))?;
            PyResult::Ok(dict)
        };
        let all = PyDict::new(py);
        all.set_item("total", dict(&compared.total)?)?;
        all.set_item("flip", compared.flip)?;
        all.set_item("indirect", compared.indirect.as_ref().map(dict).transpose()?)?;
        all.set_item("indirect_diffuse", compared.indirect_diffuse.as_ref().map(dict).transpose()?)?;
        all.set_item("nonfinite", (compared.image.count(), compared.reference.count()))?;
        Ok(all)
    }
}
