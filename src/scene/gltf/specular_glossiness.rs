//! Converts KHR_materials_pbrSpecularGlossiness (archived) to metallic and roughness with KHR_materials_specular and
//! _ior. Nothing is lost: a dielectric with an "infinite" index of refraction reflects its specular colour at normal
//! incidence, and its diffuse part is the remainder.

use glam::{Vec3, Vec4};
use gltf::json::extensions::material::Material as Extensions;
use gltf::json::texture::Info;

use super::accessor::Problem;
use super::finish::Object;
use super::images::Reading;
use super::materials::Loader;
use crate::scene::Material;

pub const NAME: &str = "KHR_materials_pbrSpecularGlossiness";

impl Loader<'_> {
    /// Converts the colours and the roughness of a material with the extension, which takes precedence over metallic
    /// and roughness.
    pub(super) fn specular_glossiness(&mut self, extensions: Option<&Extensions>) -> Result<Option<Material>, Problem> {
        let Some(extensions) = extensions else { return Ok(None) };
        self.extension(&extensions.others, NAME, |loader, object| loader.converted(object).map(Some))
    }

    fn converted(&mut self, object: &Object) -> Result<Material, Problem> {
        let diffuse = object.get("diffuseFactor", [1.0; 4])?.map(|x| self.unit(x, "diffuse colour"));
        let specular = object.get("specularFactor", [1.0; 3])?.map(|x| self.unit(x, "specular colour"));
        let glossiness = object.get("glossinessFactor", 1.0)?;
        let glossiness = self.unit(glossiness, "glossiness");
        let [diffuse_texture, texture]: [Option<Info>; 2] =
            object.textures(["diffuseTexture", "specularGlossinessTexture"])?;
        let roughness_texture = self.slot_read_as(texture.as_ref(), Reading::Glossiness(glossiness.to_bits()))?;
        Ok(Material {
            base_color: Vec4::from(diffuse),
            base_color_texture: self.slot(diffuse_texture.as_ref())?,
            metallic: 0.0,
            // The texture already includes the factor.
            roughness: if roughness_texture.is_some() { 1.0 } else { 1.0 - glossiness },
            metallic_roughness_texture: roughness_texture,
            ior: 0.0,
            specular_color: Vec3::from(specular),
            specular_color_texture: self.slot(texture.as_ref())?,
            ..Material::default()
        })
    }
}
