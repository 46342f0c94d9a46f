//! A [`Scene`] as buffers and one texture array, uploaded once.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DAffine3;
use rayon::prelude::*;

use super::atlas::Atlas;
use super::attributes::CornerWords;
use super::constants::Features;
use super::deform::{DeformOnGpu, DeformPacked};
use super::finish::{self, PackedFinish};
use super::layout::{self, material_flags};
use super::tree::groups::TreesOnce;
use crate::scene::texture::{ColorSpace, MipChain};
use crate::scene::{Alpha, Material, Mesh, Mip, Pose, Scene, Texture, TextureRef, Wrap};
use crate::vk::{
    self, Buffer, Context, Format, Image, ImageDesc, ImageDim, ImageRegion, ImageUsageFlags, Recorder, Sampler,
};
use crate::{Error, Result};

/// One instance of a mesh: a draw of the recording pass.
#[derive(Clone, Copy, Debug)]
pub struct SceneDraw {
    pub instance: usize,
    pub mesh: usize,
    pub first_index: u32,
    pub index_count: u32,
    pub vertex_offset: i32,
    /// Index into [`SceneOnGpu::materials`].
    pub material: u32,
    /// The number of this instance's first triangle, counted over all instances.
    pub first_source: u32,
    /// Whether rays may pass through its triangles.
    pub translucent: bool,
}

/// Scene data that the recording pass and shading read.
pub struct SceneOnGpu {
    /// The layout of every vertex's attributes.
    pub corner: CornerWords,
    pub vertices: Buffer,
    pub indices: Buffer,
    pub materials: Buffer,
    pub texture_levels: Buffer,
    /// The RGBA8 array, read as UNORM and as sRGB.
    pub atlas: Image,
    /// The sampler for texel fetches, whose filter is irrelevant.
    pub texel_sampler: Sampler,
    pub draws: Vec<SceneDraw>,
    /// Sources of the triangles of blended materials.
    pub blended: Vec<u32>,
    /// First vertex of every mesh.
    first_vertex: Vec<i32>,
    pub trees: Arc<TreesOnce>,
    /// Data that deforms vertices, if anything deforms.
    deform: Option<DeformOnGpu>,
}

impl SceneOnGpu {
    /// Records the deformation of the vertices to a pose.
    pub fn deform(&self, r: &mut Recorder, pose: &Pose) {
        if let Some(deform) = &self.deform {
            deform.record(r, &self.vertices, pose);
        }
    }

    /// Records new vertices for mesh `index`, which has no deformation. `mesh` has as many vertices as before.
    pub fn update_mesh(&self, r: &mut Recorder, index: usize, mesh: &Mesh) {
        r.full_barrier(); // the previous frame read them
        let first = self.first_vertex[index] as u64 * self.corner.vertex_bytes() as u64;
        r.update(&self.vertices, first, &self.corner.vertices_of(mesh));
        r.full_barrier();
    }

    /// Records the materials of `scene`, which use the same textures as before.
    pub fn update_materials(&self, r: &mut Recorder, scene: &Scene, pose: &Pose) {
        r.full_barrier(); // the previous frame read them
        let packed = ScenePacked::new(scene, pose);
        r.update(&self.materials, 0, &packed.materials);
        if packed.has_finish {
            r.update(&self.texture_levels, 0, &packed.levels);
        }
        r.full_barrier();
    }
}

/// A scene packed for the GPU, on the CPU: its sizes are known before anything is allocated.
pub struct ScenePacked {
    corner: CornerWords,
    vertices: Vec<u32>,
    indices: Vec<u32>,
    materials: Vec<layout::Material>,
    /// Mip levels, followed by the rows that [`finish`] appends.
    levels: Vec<layout::TextureLevel>,
    has_finish: bool,
    chains: Vec<MipChain>,
    atlas: Atlas,
    draws: Vec<SceneDraw>,
    first_vertex: Vec<i32>,
    deform: DeformPacked,
    pub trees: Arc<TreesOnce>,
    /// The number of triangles over all instances.
    pub triangles: u32,
    /// Sources of the triangles of blended materials.
    pub blended: Vec<u32>,
}

impl ScenePacked {
    pub fn new(scene: &Scene, pose: &Pose) -> Self {
        Self::with(scene, pose, Arc::new(TreesOnce::new(&pose.world_from_instance)))
    }

    /// Packs the scene with its trees, which may be built later.
    pub fn with(scene: &Scene, pose: &Pose, trees: Arc<TreesOnce>) -> Self {
        let mut textures = TextureTable::default();
        let mut materials = Vec::new();
        let mut finishes = Vec::new();
        let mut material_of: HashMap<(usize, u32), u32> = HashMap::new();
        let corner = CornerWords::of_features(Features::of_scene(scene));
        let (mut vertices, mut vertex_count) = (Vec::new(), 0);
        let mut indices = Vec::new();
        let mut mesh_start = Vec::new();
        for mesh in &scene.meshes {
            mesh_start.push((indices.len() as u32, vertex_count));
            indices.extend_from_slice(&mesh.indices);
            vertices.extend(corner.vertices_of(mesh));
            vertex_count += mesh.positions.len() as i32;
        }
        let mut draws = Vec::new();
        let mut blended = Vec::new();
        let mut triangles = 0;
        for (i, instance) in scene.instances.iter().enumerate() {
            let mesh = &scene.meshes[instance.mesh];
            let material = &scene.materials[mesh.material];
            // A thickness is in object space, so a material exists once per scale at which it is used.
            let scale = if material.thickness > 0.0 { object_scale(&pose.world_from_instance[i]) } else { 1.0 };
            let index = *material_of.entry((mesh.material, scale.to_bits())).or_insert_with(|| {
                materials.push(pack_material(scene, material, scale, &mut textures));
                finishes.extend(pack_finish(scene, material, materials.len() - 1, &mut textures));
                materials.len() as u32 - 1
            });
            let (first_index, vertex_offset) = mesh_start[instance.mesh];
            let index_count = mesh.indices.len() as u32;
            draws.push(SceneDraw {
                instance: i,
                mesh: instance.mesh,
                first_index,
                index_count,
                vertex_offset,
                material: index,
                first_source: triangles,
                translucent: material.lets_rays_pass(),
            });
            if material.alpha == Alpha::Blend {
                blended.extend(triangles..triangles + index_count / 3);
            }
            triangles += index_count / 3;
        }
        let chains = textures.chains(scene);
        let sizes: Vec<Vec<_>> =
            chains.iter().map(|chain| chain.levels.iter().map(|l| (l.width, l.height)).collect()).collect();
        let atlas = Atlas::pack(&sizes);
        let slots = materials.iter_mut().flat_map(|m| &mut m.slots);
        let mut levels = textures.place(&atlas, slots.chain(finishes.iter_mut().flat_map(|f| &mut f.slots)));
        finish::append(&finishes, &mut materials, &mut levels);
        let first_vertex: Vec<i32> = mesh_start.iter().map(|start| start.1).collect();
        Self {
            deform: DeformPacked::new(scene, corner, &first_vertex),
            corner,
            vertices,
            indices,
            materials,
            levels,
            has_finish: !finishes.is_empty(),
            chains,
            atlas,
            draws,
            first_vertex,
            trees,
            triangles,
            blended,
        }
    }

    /// Name and bytes of every resource of [`ScenePacked::upload`].
    pub fn plan(&self) -> Vec<(&'static str, u64)> {
        fn bytes<T>(data: &[T]) -> u64 {
            size_of_val(data) as u64
        }
        let mut rows = vec![
            ("scene vertices", bytes(&self.vertices)),
            ("scene indices", bytes(&self.indices)),
            ("materials", bytes(&self.materials)),
            ("texture levels", bytes(&self.levels)),
            ("textures", self.atlas.bytes()),
        ];
        rows.extend(self.deform.plan());
        rows
    }

    /// # Errors
    /// Too little memory, or the device is lost.
    pub fn upload(self, context: &Arc<Context>) -> Result<SceneOnGpu> {
        let atlas = self.upload_atlas(context)?;
        Ok(SceneOnGpu {
            corner: self.corner,
            vertices: vk::upload(context, "scene vertices", &self.vertices)?,
            indices: vk::upload(context, "scene indices", &self.indices)?,
            materials: vk::upload(context, "materials", &self.materials)?,
            texture_levels: vk::upload(context, "texture levels", &self.levels)?,
            atlas,
            texel_sampler: Sampler::new(context, vk::Filter::NEAREST, vk::SamplerAddressMode::CLAMP_TO_EDGE)?,
            draws: self.draws,
            blended: self.blended,
            first_vertex: self.first_vertex,
            trees: self.trees,
            deform: self.deform.upload(context)?,
        })
    }
}

impl ScenePacked {
    /// Checks that an image of the device can hold all textures.
    ///
    /// # Errors
    /// The largest texture has too many texels a side, or all of them together need too many layers.
    pub fn check_textures(&self, context: &Context) -> Result<()> {
        let most = context.limits.max_image_dimension2_d;
        if self.atlas.width.max(self.atlas.height) > most {
            // The other levels of a chain are below its largest one and take half of its height.
            return Err(Error::Memory(format!(
                "the largest texture has {} texels a side, more than the {} that {} holds with mips: make it smaller or use --max-texture TEXELS",
                self.chains.iter().map(|c| c.levels[0].width.max(c.levels[0].height)).max().unwrap_or_default(),
                most / 3 * 2,
                context.name
            )));
        }
        let (layers, most) = (self.atlas.layers, context.limits.max_image_array_layers);
        if layers > most {
            return Err(Error::Memory(format!(
                "the textures need {layers} layers of an image, more than the {most} of {}: use fewer textures or --max-texture TEXELS",
                context.name
            )));
        }
        Ok(())
    }

    fn upload_atlas(&self, context: &Arc<Context>) -> Result<Image> {
        self.check_textures(context)?;
        let image = Image::new(
            context,
            &ImageDesc {
                label: "textures",
                dim: ImageDim::D2Array,
                format: Format::R8G8B8A8_UNORM,
                width: self.atlas.width,
                height: self.atlas.height,
                depth_or_layers: self.atlas.layers,
                usage: ImageUsageFlags::SAMPLED | ImageUsageFlags::TRANSFER_DST,
                view_formats: &[Format::R8G8B8A8_SRGB],
                ..Default::default()
            },
        )?;
        let (width, height) = (self.atlas.width as usize, self.atlas.height as usize);
        for layer in 0..self.atlas.layers {
            let mut texels = vec![[0_u8; 4]; width * height];
            let here = self.atlas.places.iter().zip(&self.chains).filter(|(place, _)| place.layer == layer);
            for (place, level) in here.flat_map(|(place, chain)| place.levels.iter().zip(&chain.levels)) {
                let rows = level.rgba.chunks_exact(4 * level.width as usize);
                for (row, bytes) in rows.enumerate() {
                    let start = (place.y as usize + row) * width + place.x as usize;
                    texels[start..start + level.width as usize].copy_from_slice(bytemuck::cast_slice(bytes));
                }
            }
            vk::upload_image(context, &image, ImageRegion::layer(&image, 0, layer), &texels)?;
        }
        Ok(image)
    }
}

/// Every used pair of image and colour space, each of which has a mip chain; samplers share chains.
#[derive(Default)]
struct TextureTable {
    used: Vec<(usize, ColorSpace)>,
    chain_of: HashMap<(usize, bool), usize>,
}

impl TextureTable {
    /// The number of a chain.
    fn chain(&mut self, texture: &Texture, space: ColorSpace) -> u32 {
        let srgb = space == ColorSpace::Srgb;
        let chain = *self.chain_of.entry((texture.image, srgb)).or_insert_with(|| {
            self.used.push((texture.image, space));
            self.used.len() - 1
        });
        chain as u32
    }

    /// The chains, computed in parallel.
    fn chains(&self, scene: &Scene) -> Vec<MipChain> {
        self.used.par_iter().map(|&(image, space)| MipChain::new(&scene.images[image], space)).collect()
    }

    /// Places all levels in the atlas, and replaces numbers of chains in the slots by their places.
    fn place<'s>(
        &self,
        atlas: &Atlas,
        slots: impl Iterator<Item = &'s mut layout::TextureSlot>,
    ) -> Vec<layout::TextureLevel> {
        let mut levels = Vec::new();
        let mut first = Vec::new();
        for place in &atlas.places {
            first.push(levels.len() as u32);
            levels.extend_from_slice(&place.levels);
        }
        for slot in slots.filter(|slot| slot.level_count > 0) {
            let chain = slot.layer as usize;
            let place = &atlas.places[chain];
            (slot.layer, slot.first_level, slot.level_count) = (place.layer, first[chain], place.levels.len() as u32);
        }
        levels
    }
}

/// The bits that `glsl/ground/layout.glsl` documents at `TextureSlot`.
fn sampler_flags(texture: &Texture) -> u32 {
    let wrap = |w: Wrap| match w {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    };
    let mip = match texture.mip {
        Mip::None => 0,
        Mip::Nearest => 1,
        Mip::Linear => 2,
    };
    wrap(texture.wrap[0])
        | wrap(texture.wrap[1]) << 2
        | u32::from(texture.mag_linear) << 4
        | u32::from(texture.min_linear) << 5
        | mip << 6
}

/// A slot. Its layer is the number of a chain until [`TextureTable::place`] replaces it.
fn pack_slot(
    scene: &Scene,
    texture: Option<TextureRef>,
    space: ColorSpace,
    table: &mut TextureTable,
) -> layout::TextureSlot {
    let Some(t) = texture else { return bytemuck::Zeroable::zeroed() };
    layout::TextureSlot {
        layer: table.chain(&scene.textures[t.texture], space),
        first_level: 0,
        level_count: 1,
        flags: sampler_flags(&scene.textures[t.texture]),
        uv_set: t.uv_set as u32,
        linear: t.transform.matrix2.to_cols_array(),
        offset: t.transform.translation.into(),
    }
}

/// The optional extensions of material `index` for the device; `None` if it has none.
fn pack_finish(scene: &Scene, m: &Material, index: usize, table: &mut TextureTable) -> Option<PackedFinish> {
    let finish = m.finish.as_deref().filter(|_| !m.unlit)?;
    let slots = finish.slots().map(|(texture, space)| pack_slot(scene, texture, space, table));
    Some(PackedFinish::new(index, finish, slots))
}

fn pack_material(scene: &Scene, m: &Material, object_scale: f32, table: &mut TextureTable) -> layout::Material {
    let slots = m.slots().map(|(texture, space)| pack_slot(scene, texture, space, table));
    let (alpha_bit, alpha_cutoff) = match m.alpha {
        Alpha::Opaque => (0, 0.0),
        Alpha::Mask(cutoff) => (material_flags::MASK, cutoff),
        Alpha::Blend => (material_flags::BLEND, 0.0),
    };
    let bit = |on: bool, bit: u32| if on { bit } else { 0 };
    layout::Material {
        base_color: m.base_color.into(),
        emissive: m.emissive.into(),
        metallic: m.metallic,
        roughness: m.roughness,
        normal_scale: m.normal_scale,
        alpha_cutoff,
        ior: m.ior,
        specular: m.specular,
        specular_color: m.specular_color.into(),
        transmission: m.transmission,
        thickness_m: m.thickness * object_scale,
        attenuation_color: m.attenuation_color.into(),
        attenuation_distance_m: m.attenuation_distance.min(f32::MAX),
        flags: alpha_bit | bit(m.double_sided, material_flags::DOUBLE_SIDED) | bit(m.unlit, material_flags::UNLIT),
        slots,
    }
}

/// The mean scale of a transform.
fn object_scale(world_from_object: &DAffine3) -> f32 {
    world_from_object.matrix3.determinant().abs().cbrt() as f32
}
