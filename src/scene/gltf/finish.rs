//! The extensions of materials for which the `gltf` crate has no types: clearcoat, sheen, anisotropy, iridescence,
//! diffuse transmission, dispersion. Parts without effect are dropped with their textures.

use glam::Vec3;
use gltf::json::material::NormalTexture;
use gltf::json::texture::Info;
use serde::de::DeserializeOwned;
use serde_json::{Map, Value};

use super::accessor::Problem;
use super::container::shorten;
use super::materials::Loader;
use crate::scene::finish::{Anisotropy, Clearcoat, DiffuseTransmission, Finish, Iridescence, Sheen};

/// The object of an extension at a material.
pub(super) struct Object<'a> {
    /// The name of the material, for messages.
    what: &'a str,
    name: &'static str,
    fields: &'a Map<String, Value>,
}

impl Object<'_> {
    fn wrong(&self, why: &str) -> Problem {
        format!("{} has a {} that is not valid ({why}); correct it", self.what, self.name)
    }

    /// The value of a field, or `absent` without the field.
    pub(super) fn get<T: DeserializeOwned>(&self, field: &str, absent: T) -> Result<T, Problem> {
        let Some(value) = self.fields.get(field) else { return Ok(absent) };
        T::deserialize(value).map_err(|e| self.wrong(&shorten(&e.to_string())))
    }

    pub(super) fn textures(&self, fields: [&str; 2]) -> Result<[Option<Info>; 2], Problem> {
        Ok([self.get(fields[0], None)?, self.get(fields[1], None)?])
    }
}

impl Loader<'_> {
    /// Reads all of them; `None` if none has an effect.
    pub(super) fn finish(&mut self, extensions: &Map<String, Value>) -> Result<Option<Box<Finish>>, Problem> {
        let finish = Finish {
            clearcoat: self.extension(extensions, "KHR_materials_clearcoat", Self::clearcoat)?,
            sheen: self.extension(extensions, "KHR_materials_sheen", Self::sheen)?,
            anisotropy: self.extension(extensions, "KHR_materials_anisotropy", Self::anisotropy)?,
            iridescence: self.extension(extensions, "KHR_materials_iridescence", Self::iridescence)?,
            diffuse_transmission: self.extension(extensions, "KHR_materials_diffuse_transmission", Self::diffusion)?,
            dispersion: self.extension(extensions, "KHR_materials_dispersion", Self::dispersion)?,
        };
        Ok((finish != Finish::default()).then(|| Box::new(finish)))
    }

    /// Reads one of the material's extensions, or returns its default.
    pub(super) fn extension<T: Default>(
        &mut self,
        all: &Map<String, Value>,
        name: &'static str,
        read: impl Fn(&mut Self, &Object) -> Result<T, Problem>,
    ) -> Result<T, Problem> {
        let (what, none) = (self.what.clone(), Map::new());
        match all.get(name) {
            None => Ok(T::default()),
            Some(Value::Object(fields)) => read(self, &Object { what: &what, name, fields }),
            Some(_) => Err(Object { what: &what, name, fields: &none }.wrong("it is no object")),
        }
    }

    fn clearcoat(&mut self, object: &Object) -> Result<Clearcoat, Problem> {
        let factor = object.get("clearcoatFactor", 0.0)?;
        let roughness = object.get("clearcoatRoughnessFactor", 0.0)?;
        let [texture, roughness_texture] = object.textures(["clearcoatTexture", "clearcoatRoughnessTexture"])?;
        let normal: Option<NormalTexture> = object.get("clearcoatNormalTexture", None)?;
        let factor = self.unit(factor, "clearcoat");
        if factor == 0.0 {
            return Ok(Clearcoat::default());
        }
        Ok(Clearcoat {
            factor,
            texture: self.slot(texture.as_ref())?,
            roughness: self.unit(roughness, "clearcoat roughness"),
            roughness_texture: self.slot(roughness_texture.as_ref())?,
            normal_texture: self.plain_slot(normal.as_ref())?,
            normal_scale: self.clamp(normal.map_or(1.0, |n| n.scale), f32::NEG_INFINITY, "clearcoat normal scale"),
        })
    }

    fn sheen(&mut self, object: &Object) -> Result<Sheen, Problem> {
        let color = object.get("sheenColorFactor", [0.0; 3])?;
        let roughness = object.get("sheenRoughnessFactor", 0.0)?;
        let [color_texture, roughness_texture] = object.textures(["sheenColorTexture", "sheenRoughnessTexture"])?;
        let color = Vec3::from(color.map(|x| self.unit(x, "sheen colour")));
        if color == Vec3::ZERO {
            return Ok(Sheen::default());
        }
        Ok(Sheen {
            color,
            color_texture: self.slot(color_texture.as_ref())?,
            roughness: self.unit(roughness, "sheen roughness"),
            roughness_texture: self.slot(roughness_texture.as_ref())?,
        })
    }

    fn anisotropy(&mut self, object: &Object) -> Result<Anisotropy, Problem> {
        let [strength, rotation] = [object.get("anisotropyStrength", 0.0)?, object.get("anisotropyRotation", 0.0)?];
        let texture: Option<Info> = object.get("anisotropyTexture", None)?;
        let strength = self.unit(strength, "anisotropy");
        if strength == 0.0 {
            return Ok(Anisotropy::default());
        }
        let rotation = self.clamp(rotation, f32::NEG_INFINITY, "anisotropy rotation");
        Ok(Anisotropy { strength, rotation, texture: self.slot(texture.as_ref())? })
    }

    fn iridescence(&mut self, object: &Object) -> Result<Iridescence, Problem> {
        let none = Iridescence::default();
        let factor = object.get("iridescenceFactor", 0.0)?;
        let [thin, thick] = none.thickness_nm;
        let thickness =
            [object.get("iridescenceThicknessMinimum", thin)?, object.get("iridescenceThicknessMaximum", thick)?];
        let ior = object.get("iridescenceIor", none.ior)?;
        let [texture, thickness_texture] = object.textures(["iridescenceTexture", "iridescenceThicknessTexture"])?;
        let factor = self.unit(factor, "iridescence");
        let thickness_nm = thickness.map(|nm| self.clamp(nm, 0.0, "iridescence thickness"));
        if factor == 0.0 || thickness_nm == [0.0; 2] {
            return Ok(none);
        }
        Ok(Iridescence {
            factor,
            texture: self.slot(texture.as_ref())?,
            ior: self.clamp(ior, 1.0, "iridescence index of refraction"),
            thickness_nm,
            thickness_texture: self.slot(thickness_texture.as_ref())?,
        })
    }

    fn dispersion(&mut self, object: &Object) -> Result<f32, Problem> {
        Ok(self.clamp(object.get("dispersion", 0.0)?, 0.0, "dispersion"))
    }

    fn diffusion(&mut self, object: &Object) -> Result<DiffuseTransmission, Problem> {
        let factor = object.get("diffuseTransmissionFactor", 0.0)?;
        let color = object.get("diffuseTransmissionColorFactor", [1.0; 3])?;
        let textures = ["diffuseTransmissionTexture", "diffuseTransmissionColorTexture"];
        let [texture, color_texture] = object.textures(textures)?;
        let factor = self.unit(factor, "diffuse transmission");
        if factor == 0.0 {
            return Ok(DiffuseTransmission::default());
        }
        Ok(DiffuseTransmission {
            factor,
            texture: self.slot(texture.as_ref())?,
            color: Vec3::from(color.map(|x| self.unit(x, "diffuse transmission colour"))),
            color_texture: self.slot(color_texture.as_ref())?,
        })
    }
}
