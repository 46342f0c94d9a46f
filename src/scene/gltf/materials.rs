//! Materials: checks and clamps the factors, resolves the texture slots.

use std::collections::BTreeSet;

use glam::{Affine2, Mat2, Vec2, Vec3, Vec4};
use gltf::json;
use gltf::json::material::AlphaMode;
use gltf::json::texture::Info;
use gltf::json::validation::Checked::{Invalid, Valid};
use serde::Serialize;

use super::accessor::Problem;
use super::container::shorten;
use super::document::Document;
use super::images::{Reading, Used, slots_mut};
use crate::scene::{Alpha, Material, TextureRef};

/// glTF's default material followed by all materials of the document, and for each the two sets of texture coordinates
/// that it reads.
pub fn load(document: &Document, used: &mut Used) -> Result<(Vec<Material>, Vec<[u32; 2]>), Problem> {
    let (mut materials, mut uv_sets) = (vec![Material::default()], vec![[0, 1]]);
    for (index, source) in document.materials.iter().enumerate() {
        let mut loader = Loader { index, what: format!("material {index}"), document, used };
        let mut material = loader.material(source)?;
        uv_sets.push(loader.choose_uv_sets(&mut material));
        materials.push(material);
    }
    Ok((materials, uv_sets))
}

/// The materials of all primitives at the nodes `shown`, by the scene's numbering.
pub fn drawn(document: &Document, shown: &[usize]) -> impl Iterator<Item = usize> + use<> {
    let meshes: BTreeSet<usize> = shown.iter().filter_map(|&node| document.nodes[node].mesh).collect();
    let primitives = meshes.into_iter().filter_map(|mesh| document.meshes.get(mesh)).flat_map(|mesh| &mesh.primitives);
    let drawn: BTreeSet<usize> = primitives.map(|p| p.material.map_or(0, |m| m.value() + 1)).collect();
    drawn.into_iter()
}

pub(super) struct Loader<'a> {
    index: usize,
    pub(super) what: String,
    document: &'a Document,
    used: &'a mut Used,
}

impl Loader<'_> {
    fn material(&mut self, source: &json::Material) -> Result<Material, Problem> {
        let normal = source.normal_texture.as_ref();
        let occlusion = source.occlusion_texture.as_ref();
        let colors = match self.specular_glossiness(source.extensions.as_ref())? {
            Some(colors) => colors,
            None => self.metallic_roughness(&source.pbr_metallic_roughness)?,
        };
        let material = Material {
            name: source.name.clone().unwrap_or_default(),
            normal_texture: self.plain_slot(normal)?,
            normal_scale: normal.map_or(1.0, |t| self.clamp(t.scale, f32::NEG_INFINITY, "normal scale")),
            occlusion_texture: self.plain_slot(occlusion)?,
            occlusion_strength: occlusion.map_or(1.0, |t| self.unit(t.strength.0, "occlusion strength")),
            emissive: self.positive(source.emissive_factor.0, "emission"),
            emissive_texture: self.slot(source.emissive_texture.as_ref())?,
            alpha: self.alpha(source),
            double_sided: source.double_sided,
            ..colors
        };
        match &source.extensions {
            Some(extensions) => self.extensions(extensions, material),
            None => Ok(material),
        }
    }

    fn metallic_roughness(&mut self, pbr: &json::material::PbrMetallicRoughness) -> Result<Material, Problem> {
        let [r, g, b, a] = pbr.base_color_factor.0.map(|x| self.unit(x, "base colour"));
        Ok(Material {
            base_color: Vec4::new(r, g, b, a),
            base_color_texture: self.slot(pbr.base_color_texture.as_ref())?,
            metallic: self.unit(pbr.metallic_factor.0, "metallic factor"),
            roughness: self.unit(pbr.roughness_factor.0, "roughness"),
            metallic_roughness_texture: self.slot(pbr.metallic_roughness_texture.as_ref())?,
            ..Material::default()
        })
    }

    fn extensions(
        &mut self,
        extensions: &json::extensions::material::Material,
        mut m: Material,
    ) -> Result<Material, Problem> {
        m.unlit = extensions.unlit.is_some();
        if let Some(e) = &extensions.emissive_strength {
            m.emissive *= self.clamp(e.emissive_strength.0, 0.0, "emissive strength");
            m.emissive = m.emissive.min(Vec3::MAX);
        }
        if let Some(e) = &extensions.ior {
            // In KHR_materials_ior 0 means "reflects everything"; other values below 1 have no meaning.
            m.ior = if e.ior.0 == 0.0 { 0.0 } else { self.clamp(e.ior.0, 1.0, "index of refraction") };
        }
        if let Some(e) = &extensions.specular {
            m.specular = self.unit(e.specular_factor.0, "specular factor");
            m.specular_texture = self.slot(e.specular_texture.as_ref())?;
            m.specular_color = self.positive(e.specular_color_factor.0, "specular colour");
            m.specular_color_texture = self.slot(e.specular_color_texture.as_ref())?;
        }
        if let Some(e) = &extensions.transmission {
            m.transmission = self.unit(e.transmission_factor.0, "transmission");
            m.transmission_texture = self.slot(e.transmission_texture.as_ref())?;
        }
        if let Some(e) = &extensions.volume {
            m.thickness = self.clamp(e.thickness_factor.0, 0.0, "thickness");
            m.thickness_texture = self.slot(e.thickness_texture.as_ref())?;
            m.attenuation_color = Vec3::from(e.attenuation_color.0.map(|x| self.unit(x, "attenuation colour")));
            // The schema excludes 0, which would absorb all light at once.
            let distance = e.attenuation_distance.0;
            m.attenuation_distance = if distance > 0.0 { distance } else { f32::INFINITY };
        }
        if !m.unlit {
            m.finish = self.finish(&extensions.others)?;
        }
        Ok(m)
    }

    fn alpha(&mut self, source: &json::Material) -> Alpha {
        match source.alpha_mode {
            Valid(AlphaMode::Opaque) => Alpha::Opaque,
            Valid(AlphaMode::Mask) => {
                Alpha::Mask(self.clamp(source.alpha_cutoff.unwrap_or_default().0, 0.0, "alpha cutoff"))
            }
            Valid(AlphaMode::Blend) => Alpha::Blend,
            Invalid => {
                let mode = self.document.stated(&format!("/materials/{}/alphaMode", self.index));
                self.document.warn(format!("{} has the unknown alpha mode \"{mode}\"; it is opaque", self.what));
                Alpha::Opaque
            }
        }
    }

    pub(super) fn unit(&mut self, value: f32, name: &str) -> f32 {
        if value > 1.0 {
            self.document.warn(format!("{} has {} above 1; it was lowered to 1", self.what, with_article(name)));
        }
        self.clamp(value, 0.0, name).min(1.0)
    }

    fn positive(&mut self, value: [f32; 3], name: &str) -> Vec3 {
        Vec3::from(value.map(|x| self.clamp(x, 0.0, name)))
    }

    /// Clamps to at least `min` and to finite values: JSON has no infinity, but a number too large for f32 becomes
    /// infinite.
    pub(super) fn clamp(&mut self, value: f32, min: f32, name: &str) -> f32 {
        if value < min {
            self.document.warn(format!("{} has {} below {min}; it was raised to {min}", self.what, with_article(name)));
        }
        value.max(min).clamp(f32::MIN, f32::MAX)
    }

    /// A normal or occlusion slot. The crate does not parse KHR_texture_transform there, so it is read again as another
    /// slot.
    pub(super) fn plain_slot(&mut self, texture: Option<&impl Serialize>) -> Result<Option<TextureRef>, Problem> {
        let info = texture.map(|t| serde_json::to_value(t).and_then(serde_json::from_value::<Info>)).transpose();
        let info = info.map_err(|e| {
            format!("{} has a texture transform that is not valid ({}); correct it", self.what, shorten(&e.to_string()))
        })?;
        self.slot(info.as_ref())
    }

    /// A mesh keeps the two sets of texture coordinates that the slots of its material read, and the slots are
    /// renumbered to them. A third set is rare and gets a note.
    fn choose_uv_sets(&mut self, m: &mut Material) -> [u32; 2] {
        let mut read: Vec<usize> = m.drawn_slots().map(|(slot, _)| slot.uv_set).collect();
        let mut seen = BTreeSet::new();
        read.retain(|set| seen.insert(*set));
        let (kept, left_out) = read.split_at(read.len().min(2));
        let mut sets = [0, 1];
        for &set in kept.iter().filter(|set| **set > 1) {
            let free = sets.iter().position(|other| !kept.contains(other)).unwrap_or_default();
            sets[free] = set;
        }
        for set in left_out {
            let (what, [first, second]) = (&self.what, sets);
            self.document.warn(format!(
                "{what} uses more than two sets of texture coordinates; its textures on set {set} are placed by set {first}, those on {first} and {second} by their own"
            ));
        }
        for slot in slots_mut(m).flatten() {
            slot.uv_set = sets.iter().position(|set| *set == slot.uv_set).unwrap_or_default();
        }
        sets.map(|set| set as u32)
    }

    pub(super) fn slot(&mut self, info: Option<&Info>) -> Result<Option<TextureRef>, Problem> {
        self.slot_read_as(info, Reading::Plain)
    }

    pub(super) fn slot_read_as(
        &mut self,
        info: Option<&Info>,
        reading: Reading,
    ) -> Result<Option<TextureRef>, Problem> {
        let Some(info) = info else { return Ok(None) };
        let Some(texture) = self.used.texture(self.document, info.index.value(), reading)? else {
            return Ok(None);
        };
        let transform = info.extensions.as_ref().and_then(|e| e.texture_transform.as_ref());
        let uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord) as usize;
        // Translation · rotation · scale. The rotation is counter-clockwise on the image, where v points down, so its
        // matrix has the negative angle. (The example of KHR_texture_transform, a rotated lower left quadrant,
        // determines the sign.)
        let transform = transform.map_or(Affine2::IDENTITY, |t| Affine2 {
            matrix2: Mat2::from_angle(-t.rotation.0) * Mat2::from_diagonal(Vec2::from(t.scale.0)),
            translation: Vec2::from(t.offset.0),
        });
        if !transform.is_finite() {
            return Err(format!("{} has a texture transform that is not finite; correct it", self.what));
        }
        Ok(Some(TextureRef { texture, uv_set, transform }))
    }
}

/// "a normal scale", "an index of refraction".
fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o']) { "an" } else { "a" };
    format!("{article} {noun}")
}
