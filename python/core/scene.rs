//! Scenes from files, or made of arrays.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DAffine3, DMat3, DVec3, Vec2, Vec3, Vec4};
use pyo3::prelude::*;
use twobounce::scene::{LightKind, Material, Mesh, Mip, Texture, TextureImage, TextureRef, View, Wrap};

use crate::{Error, to_python};

/// A scene. It is shared with the work that renders it, and copied when it changes meanwhile.
#[pyclass(module = "twobounce._core")]
pub struct Scene(Arc<twobounce::Scene>);

impl Scene {
    pub fn shared(&self) -> Arc<twobounce::Scene> {
        self.0.clone()
    }
}

/// Vectors of `N` numbers from the bytes of a contiguous array of f32.
fn vectors<const N: usize, T>(bytes: &[u8], make: impl Fn([f32; N]) -> T) -> Vec<T> {
    let number = |bytes: &[u8]| f32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
    let vector = |bytes: &[u8]| make(std::array::from_fn(|i| number(&bytes[4 * i..])));
    bytes.chunks_exact(4 * N).map(vector).collect()
}

/// The transform of a light that shines in a direction, along its −Z. Its rotation about that axis has no effect.
fn towards(direction: [f64; 3], position: [f64; 3]) -> PyResult<DAffine3> {
    let back = -DVec3::from(direction);
    let back = back.try_normalize().ok_or_else(|| Error::new_err("the direction of a light is zero; give another"))?;
    let (x, y) = back.any_orthonormal_pair();
    Ok(DAffine3::from_mat3_translation(DMat3::from_cols(x, y, back), DVec3::from(position)))
}

#[pymethods]
impl Scene {
    /// An empty scene.
    #[new]
    fn new(name: &str) -> Self {
        Self(Arc::new(twobounce::Scene::empty(name)))
    }

    #[staticmethod]
    fn open(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        py.detach(|| twobounce::Scene::open(path)).map(|scene| Self(Arc::new(scene))).map_err(to_python)
    }

    #[getter]
    fn name(&self) -> &str {
        &self.0.name
    }

    #[getter]
    fn triangles(&self) -> usize {
        self.0.triangle_count()
    }

    #[getter]
    fn cameras(&self) -> Vec<String> {
        self.0.cameras.iter().map(|camera| camera.name.clone()).collect()
    }

    /// Name and duration in seconds of each animation.
    #[getter]
    fn animations(&self) -> Vec<(String, f32)> {
        self.0.animations.iter().map(|animation| (animation.name.clone(), animation.duration)).collect()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    /// `numbers`: base colour (4), emissive (3), metallic, roughness, transmission, index of refraction, thickness.
    fn add_material(
        &mut self,
        name: String,
        numbers: [f32; 12],
        double_sided: bool,
        texture: Option<usize>,
    ) -> PyResult<usize> {
        let [r, g, b, a, er, eg, eb, metallic, roughness, transmission, ior, thickness] = numbers;
        if texture.is_some_and(|texture| texture >= self.0.textures.len()) {
            return Err(Error::new_err("a material has a texture that the scene does not have; add it first"));
        }
        let map = |texture| TextureRef { texture, uv_set: 0, transform: glam::Affine2::IDENTITY };
        Ok(Arc::make_mut(&mut self.0).add_material(Material {
            name,
            base_color: Vec4::new(r, g, b, a),
            base_color_texture: texture.map(map),
            emissive: Vec3::new(er, eg, eb),
            metallic,
            roughness,
            transmission,
            ior,
            thickness,
            double_sided,
            ..Material::default()
        }))
    }

    /// `rgba`: 8-bit sRGB, rows from the top.
    fn add_texture(&mut self, width: u32, height: u32, rgba: Vec<u8>) -> usize {
        let scene = Arc::make_mut(&mut self.0);
        scene.images.push(TextureImage { name: "texture".into(), width, height, rgba });
        let (image, wrap) = (scene.images.len() - 1, [Wrap::Repeat; 2]);
        scene.textures.push(Texture { image, wrap, mag_linear: true, min_linear: true, mip: Mip::Linear });
        scene.textures.len() - 1
    }

    /// Bytes of contiguous arrays: f32 positions and normals (3 a vertex) and uvs (2), u32 indices. `transform`: 3 rows
    /// of 4.
    fn add_mesh(
        &mut self,
        arrays: (Vec<u8>, Vec<u8>, Vec<u8>, Vec<u8>),
        material: usize,
        transform: [[f64; 4]; 3],
    ) -> PyResult<usize> {
        let (positions, normals, uvs, indices) = arrays;
        let positions = vectors(&positions, Vec3::from_array);
        let index = |bytes: &[u8]| u32::from_ne_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]);
        let indices: Vec<u32> = indices.chunks_exact(4).map(index).collect();
        if material >= self.0.materials.len() {
            return Err(Error::new_err("a mesh has a material that the scene does not have; add it first"));
        }
        if indices.iter().any(|&index| index as usize >= positions.len()) {
            return Err(Error::new_err("a mesh has an index beyond its vertices"));
        }
        let count = positions.len();
        let of_vertices = |bytes: Vec<u8>, size: usize| (bytes.len() == size * count).then_some(bytes);
        let uvs = of_vertices(uvs, 8).map_or_else(|| vec![Vec2::ZERO; count], |uvs| vectors(&uvs, Vec2::from_array));
        let mesh = match of_vertices(normals, 12) {
            Some(normals) => Mesh {
                normals: vectors(&normals, Vec3::from_array).into_iter().map(Vec3::normalize_or_zero).collect(),
                tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); count],
                uvs: [uvs, vec![Vec2::ZERO; count]],
                colors: vec![Vec4::ONE; count],
                positions,
                indices,
                material,
                ..Mesh::default()
            },
            None => {
                let corners: Vec<Vec3> = indices.iter().map(|&index| positions[index as usize]).collect();
                let mut mesh = Mesh::triangles("mesh", material, corners.as_chunks().0);
                mesh.uvs[0] = indices.iter().map(|&index| uvs[index as usize]).collect();
                mesh
            }
        };
        let column = |i: usize| DVec3::new(transform[0][i], transform[1][i], transform[2][i]);
        let axes = DMat3::from_cols(column(0), column(1), column(2));
        Ok(Arc::make_mut(&mut self.0).add_mesh(mesh, DAffine3::from_mat3_translation(axes, column(3))))
    }

    /// `place`: position, and direction of a spot or directional light. `cone`: inner and outer half angle of a spot
    /// light in radians.
    fn add_light(
        &mut self,
        intensity: [f32; 3],
        place: (Option<[f64; 3]>, Option<[f64; 3]>),
        cone: Option<[f32; 2]>,
        radius: f32,
    ) -> PyResult<usize> {
        let (position, direction) = place;
        let (kind, position) = match (position, cone) {
            (Some(position), Some([inner, outer])) => (LightKind::Spot { inner, outer }, position),
            (Some(position), None) => (LightKind::Point, position),
            (None, _) => (LightKind::Directional, [0.0; 3]),
        };
        let place = towards(direction.unwrap_or([0.0, 0.0, -1.0]), position)?;
        let scene = Arc::make_mut(&mut self.0);
        let index = scene.add_light(kind, Vec3::from(intensity), place);
        scene.lights[index].radius = radius;
        Ok(index)
    }

    /// `fov`: vertical, in degrees.
    fn add_camera(&mut self, eye: [f64; 3], target: [f64; 3], up: [f64; 3], fov: f64) -> usize {
        let [eye, target, up] = [eye, target, up].map(DVec3::from);
        let view = View::look_at(eye, target, up, fov.to_radians() as f32);
        Arc::make_mut(&mut self.0).add_camera(&view)
    }
}
