//! The extensions of materials for which the `gltf` crate has no types: clearcoat, sheen, anisotropy, iridescence, diffuse
//! transmission, dispersion. What changes nothing is dropped with its textures.

use glam::Vec3;
use gltf::json::texture::Info;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::accessor::Problem;
use super::container::shorten;
use super::materials::Loader;
use crate::scene::finish::{Anisotropy, Clearcoat, DiffuseTransmission, Finish, Iridescence, Sheen};

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct ClearcoatJson {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<NormalInfo>,
}

#[derive(Deserialize)]
struct NormalInfo {
    #[serde(flatten)]
    info: Info,
    scale: Option<f32>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct SheenJson {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct AnisotropyJson {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<Info>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct IridescenceJson {
    iridescence_factor: f32,
    iridescence_texture: Option<Info>,
    iridescence_ior: Option<f32>,
    iridescence_thickness_minimum: Option<f32>,
    iridescence_thickness_maximum: Option<f32>,
    iridescence_thickness_texture: Option<Info>,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct DiffuseTransmissionJson {
    diffuse_transmission_factor: f32,
    diffuse_transmission_texture: Option<Info>,
    diffuse_transmission_color_factor: Option<[f32; 3]>,
    diffuse_transmission_color_texture: Option<Info>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct DispersionJson {
    dispersion: f32,
}

impl Loader<'_> {
    /// `None` if none of them changes anything.
    pub(super) fn finish(&mut self, extensions: &Map<String, Value>) -> Result<Option<Box<Finish>>, Problem> {
        let mut finish = Finish::default();
        if let Some(json) = self.extension(extensions, "KHR_materials_clearcoat")? {
            finish.clearcoat = self.clearcoat(json)?;
        }
        if let Some(json) = self.extension(extensions, "KHR_materials_sheen")? {
            finish.sheen = self.sheen(json)?;
        }
        if let Some(json) = self.extension(extensions, "KHR_materials_anisotropy")? {
            finish.anisotropy = self.anisotropy(json)?;
        }
        if let Some(json) = self.extension(extensions, "KHR_materials_iridescence")? {
            finish.iridescence = self.iridescence(json)?;
        }
        if let Some(json) = self.extension(extensions, "KHR_materials_diffuse_transmission")? {
            finish.diffuse_transmission = self.diffuse_transmission(json)?;
        }
        if let Some(json) = self.extension::<DispersionJson>(extensions, "KHR_materials_dispersion")? {
            finish.dispersion = self.clamp(json.dispersion, 0.0, "dispersion");
        }
        Ok((finish != Finish::default()).then(|| Box::new(finish)))
    }

    fn extension<T: DeserializeOwned>(&self, all: &Map<String, Value>, name: &str) -> Result<Option<T>, Problem> {
        let Some(value) = all.get(name) else { return Ok(None) };
        let wrong = |why: &str| format!("{} has a {name} that is not valid ({why}); correct it", self.what);
        // An array of the fields in their order would be taken for an object.
        if !value.is_object() {
            return Err(wrong("it is no object"));
        }
        T::deserialize(value).map(Some).map_err(|e| wrong(&shorten(&e.to_string())))
    }

    fn clearcoat(&mut self, json: ClearcoatJson) -> Result<Clearcoat, Problem> {
        let factor = self.unit(json.clearcoat_factor, "clearcoat");
        if factor == 0.0 {
            return Ok(Clearcoat::default());
        }
        let normal = json.clearcoat_normal_texture.as_ref();
        let scale = normal.and_then(|n| n.scale).unwrap_or(1.0);
        Ok(Clearcoat {
            factor,
            texture: self.slot(json.clearcoat_texture.as_ref())?,
            roughness: self.unit(json.clearcoat_roughness_factor, "clearcoat roughness"),
            roughness_texture: self.slot(json.clearcoat_roughness_texture.as_ref())?,
            normal_texture: self.slot(normal.map(|n| &n.info))?,
            normal_scale: self.clamp(scale, f32::NEG_INFINITY, "clearcoat normal scale"),
        })
    }

    fn sheen(&mut self, json: SheenJson) -> Result<Sheen, Problem> {
        let color = Vec3::from(json.sheen_color_factor.map(|x| self.unit(x, "sheen colour")));
        if color == Vec3::ZERO {
            return Ok(Sheen::default());
        }
        Ok(Sheen {
            color,
            color_texture: self.slot(json.sheen_color_texture.as_ref())?,
            roughness: self.unit(json.sheen_roughness_factor, "sheen roughness"),
            roughness_texture: self.slot(json.sheen_roughness_texture.as_ref())?,
        })
    }

    fn anisotropy(&mut self, json: AnisotropyJson) -> Result<Anisotropy, Problem> {
        let strength = self.unit(json.anisotropy_strength, "anisotropy");
        if strength == 0.0 {
            return Ok(Anisotropy::default());
        }
        let rotation = self.clamp(json.anisotropy_rotation, f32::NEG_INFINITY, "anisotropy rotation");
        Ok(Anisotropy { strength, rotation, texture: self.slot(json.anisotropy_texture.as_ref())? })
    }

    fn iridescence(&mut self, json: IridescenceJson) -> Result<Iridescence, Problem> {
        let none = Iridescence::default();
        let factor = self.unit(json.iridescence_factor, "iridescence");
        let stated = [json.iridescence_thickness_minimum, json.iridescence_thickness_maximum];
        let mut thickness_nm = none.thickness_nm;
        for (thickness, stated) in thickness_nm.iter_mut().zip(stated) {
            *thickness = self.clamp(stated.unwrap_or(*thickness), 0.0, "iridescence thickness");
        }
        if factor == 0.0 || thickness_nm == [0.0; 2] {
            return Ok(none);
        }
        Ok(Iridescence {
            factor,
            texture: self.slot(json.iridescence_texture.as_ref())?,
            ior: self.clamp(json.iridescence_ior.unwrap_or(none.ior), 1.0, "iridescence index of refraction"),
            thickness_nm,
            thickness_texture: self.slot(json.iridescence_thickness_texture.as_ref())?,
        })
    }

    fn diffuse_transmission(&mut self, json: DiffuseTransmissionJson) -> Result<DiffuseTransmission, Problem> {
        let factor = self.unit(json.diffuse_transmission_factor, "diffuse transmission");
        if factor == 0.0 {
            return Ok(DiffuseTransmission::default());
        }
        let color = json.diffuse_transmission_color_factor.unwrap_or([1.0; 3]);
        Ok(DiffuseTransmission {
            factor,
            texture: self.slot(json.diffuse_transmission_texture.as_ref())?,
            color: Vec3::from(color.map(|x| self.unit(x, "diffuse transmission colour"))),
            color_texture: self.slot(json.diffuse_transmission_color_texture.as_ref())?,
        })
    }
}
