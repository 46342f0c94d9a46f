//! Materials: factors checked and clamped, texture slots resolved.

use glam::{Affine2, Mat2, Vec2, Vec3, Vec4};

use super::Warnings;
use super::accessor::Problem;
use super::container::shorten;
use super::document::{self, Document, TextureInfo};
use super::images::Used;
use crate::scene::{Alpha, Material, TextureRef};

/// Uv sets that meshes carry.
const UV_SETS: usize = 2;

/// All materials of the document, behind glTF's default material at index 0.
pub fn load(document: &Document, used: &mut Used, warnings: &mut Warnings) -> Result<Vec<Material>, Problem> {
    let mut materials = vec![Material::default()];
    for (index, source) in document.materials.iter().enumerate() {
        let mut loader = Loader { what: format!("material {index}"), document, used, warnings };
        materials.push(loader.material(source)?);
    }
    Ok(materials)
}

struct Loader<'a> {
    what: String,
    document: &'a Document,
    used: &'a mut Used,
    warnings: &'a mut Warnings,
}

impl Loader<'_> {
    fn material(&mut self, source: &document::Material) -> Result<Material, Problem> {
        let pbr = &source.pbr_metallic_roughness;
        let [r, g, b, a] = pbr.base_color_factor.map(|x| self.unit(x, "base colour"));
        let material = Material {
            name: source.name.clone(),
            base_color: Vec4::new(r, g, b, a),
            base_color_texture: self.slot(&pbr.base_color_texture)?,
            metallic: self.unit(pbr.metallic_factor, "metallic factor"),
            roughness: self.unit(pbr.roughness_factor, "roughness"),
            metallic_roughness_texture: self.slot(&pbr.metallic_roughness_texture)?,
            normal_texture: self.slot(&source.normal_texture)?,
            normal_scale: source.normal_texture.as_ref().map_or(1.0, |t| self.clamp(t.scale, f64::MIN, "normal scale")),
            occlusion_texture: self.slot(&source.occlusion_texture)?,
            occlusion_strength: source
                .occlusion_texture
                .as_ref()
                .map_or(1.0, |t| self.unit(t.strength, "occlusion strength")),
            emissive: self.positive(source.emissive_factor, "emission"),
            emissive_texture: self.slot(&source.emissive_texture)?,
            alpha: self.alpha(source),
            double_sided: source.double_sided,
            unlit: source.extensions.unlit.is_some(),
            ..Material::default()
        };
        self.extensions(source, material)
    }

    fn extensions(&mut self, source: &document::Material, mut m: Material) -> Result<Material, Problem> {
        let extensions = &source.extensions;
        if let Some(e) = &extensions.emissive_strength {
            m.emissive *= self.clamp(e.emissive_strength, 0.0, "emissive strength");
            m.emissive = m.emissive.min(Vec3::MAX);
        }
        if let Some(e) = &extensions.ior {
            // 0 is KHR_materials_ior's way to say "reflects everything"; other values below 1 have no meaning.
            m.ior = if e.ior == 0.0 { 0.0 } else { self.clamp(e.ior, 1.0, "index of refraction") };
        }
        if let Some(e) = &extensions.specular {
            m.specular = self.unit(e.specular_factor, "specular factor");
            m.specular_texture = self.slot(&e.specular_texture)?;
            m.specular_color = self.positive(e.specular_color_factor, "specular colour");
            m.specular_color_texture = self.slot(&e.specular_color_texture)?;
        }
        if let Some(e) = &extensions.transmission {
            m.transmission = self.unit(e.transmission_factor, "transmission");
            m.transmission_texture = self.slot(&e.transmission_texture)?;
        }
        if let Some(e) = &extensions.volume {
            m.thickness = self.clamp(e.thickness_factor, 0.0, "thickness");
            m.thickness_texture = self.slot(&e.thickness_texture)?;
            m.attenuation_color = Vec3::from(e.attenuation_color.map(|x| self.unit(x, "attenuation colour")));
            // Zero would absorb everything over no distance at all; the schema excludes it.
            m.attenuation_distance = e.attenuation_distance.filter(|d| *d > 0.0).map_or(f32::INFINITY, |d| d as f32);
        }
        Ok(m)
    }

    fn alpha(&mut self, source: &document::Material) -> Alpha {
        match source.alpha_mode.as_deref() {
            None | Some("OPAQUE") => Alpha::Opaque,
            Some("MASK") => Alpha::Mask(self.clamp(source.alpha_cutoff.unwrap_or(0.5), 0.0, "alpha cutoff")),
            Some("BLEND") => Alpha::Blend,
            Some(other) => {
                let what = &self.what;
                self.warnings.once(format!("{what} has the unknown alpha mode \"{}\"; it is opaque", shorten(other)));
                Alpha::Opaque
            }
        }
    }

    fn unit(&mut self, value: f64, name: &str) -> f32 {
        if value > 1.0 {
            self.warnings.once(format!("{} has a {name} above 1; it was lowered to 1", self.what));
        }
        self.clamp(value, 0.0, name).min(1.0)
    }

    fn positive(&mut self, value: [f64; 3], name: &str) -> Vec3 {
        Vec3::from(value.map(|x| self.clamp(x, 0.0, name)))
    }

    /// JSON knows neither NaN nor infinity, but a number can be too large for f32.
    fn clamp(&mut self, value: f64, min: f64, name: &str) -> f32 {
        if value < min {
            self.warnings.once(format!("{} has a {name} below {min}; it was raised to {min}", self.what));
        }
        value.max(min).clamp(f64::from(f32::MIN), f64::from(f32::MAX)) as f32
    }

    fn slot(&mut self, info: &Option<TextureInfo>) -> Result<Option<TextureRef>, Problem> {
        let Some(info) = info else { return Ok(None) };
        let Some(texture) = self.used.texture(self.document, info.index, self.warnings)? else { return Ok(None) };
        let transform = info.extensions.transform.as_ref();
        let mut uv_set = transform.and_then(|t| t.tex_coord).unwrap_or(info.tex_coord);
        if uv_set >= UV_SETS {
            self.warnings.once(format!("{} uses uv set {uv_set}; only 0 and 1 are kept, so 0 is used", self.what));
            uv_set = 0;
        }
        let transform = transform.map_or(Affine2::IDENTITY, uv_transform);
        if !transform.is_finite() {
            return Err(format!("{} has a texture transform that is not finite; correct it", self.what));
        }
        Ok(Some(TextureRef { texture, uv_set, transform }))
    }
}

/// KHR_texture_transform: translation · rotation · scale. Counter-clockwise as seen on the image, whose v points down:
/// a negative angle for matrices. (The extension's example, the lower left quadrant turned, fixes the sign.)
fn uv_transform(t: &document::TextureTransform) -> Affine2 {
    let vec2 = |v: [f64; 2]| Vec2::new(v[0] as f32, v[1] as f32);
    let linear = Mat2::from_angle(-t.rotation as f32) * Mat2::from_diagonal(vec2(t.scale));
    Affine2 { matrix2: linear, translation: vec2(t.offset) }
}
