//! Scenes, settings and frames with invalid values in public fields: each is refused with a message, or rendered.
#![allow(dead_code)]

use std::sync::Arc;

use glam::{DAffine3, DQuat, DVec3, Vec2, Vec3, Vec4};
use twobounce::scene::deform::{Deform, Deformer, Joint, TargetDeltas};
use twobounce::scene::finish::Finish;
use twobounce::scene::{
    Alpha, Animation, Bounds, Channel, Interpolation, LightKind, Material, Mesh, Mip, Projection, Property, Scene,
    Texture, TextureImage, TextureRef, Transform, View, WeightChannel, Wrap,
};
use twobounce::settings::Settings;

use crate::random::Random;

/// Invalid values, chosen at random: the same for the same seed.
pub struct Chance(Random);

impl Chance {
    pub fn new(seed: u64) -> Self {
        Self(Random(seed))
    }

    pub fn below(&mut self, most: usize) -> usize {
        self.0.below(most)
    }

    fn float(&mut self) -> f32 {
        let odd =
            [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX, -f32::MAX, 1e20, -1.0, -0.0, 0.0, 1e-45, 1e6, 2.0];
        odd[self.below(odd.len())]
    }

    fn double(&mut self) -> f64 {
        let odd = [f64::MAX, 1e300, -1e200, 5e-324];
        if self.below(3) == 0 { odd[self.below(odd.len())] } else { self.float().into() }
    }

    fn index(&mut self) -> usize {
        let odd = [0, 1, 2, 3, 7, 1000, u32::MAX as usize, usize::MAX];
        odd[self.below(odd.len())]
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::from_array([0; 3].map(|_| if self.below(2) == 0 { 1.0 } else { self.float() }))
    }

    fn vector64(&mut self) -> DVec3 {
        DVec3::from_array([0; 3].map(|_| if self.below(2) == 0 { 1.0 } else { self.double() }))
    }

    fn slot(&mut self) -> Option<TextureRef> {
        let mut transform = glam::Affine2::IDENTITY;
        if self.below(2) == 0 {
            (transform.translation.x, transform.matrix2.x_axis.x) = (self.float(), self.float());
        }
        let texture = if self.below(2) == 0 { 0 } else { self.index() };
        Some(TextureRef { texture, uv_set: self.below(3), transform })
    }
}

/// A floor with a texture, a lamp, a mesh with a skin and a morph target, lights, a camera and animations.
pub fn scene() -> Scene {
    let mut scene = Scene::empty("nonsense");
    scene.images.push(TextureImage { name: "image".into(), width: 2, height: 2, rgba: vec![200; 16] });
    let wrap = [Wrap::Repeat, Wrap::Mirror];
    scene.textures.push(Texture { image: 0, wrap, mag_linear: true, min_linear: true, mip: Mip::Linear });
    let slot = TextureRef { texture: 0, uv_set: 0, transform: glam::Affine2::IDENTITY };
    let textured = Material { base_color_texture: Some(slot), ..Material::lambert("textured", Vec3::ONE) };
    let textured = scene.add_material(textured);
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    let floor = Mesh::quad("floor", textured, Vec3::ZERO, Vec3::Z, Vec3::X);
    scene.add_mesh(floor.clone(), DAffine3::IDENTITY);
    scene.add_mesh(Mesh::quad("lamp", lamp, Vec3::Y, Vec3::X, Vec3::Z), DAffine3::IDENTITY);
    for kind in [LightKind::Point, LightKind::Directional, LightKind::Spot { inner: 0.2, outer: 0.4 }] {
        scene.add_light(kind, Vec3::ONE, DAffine3::from_translation(DVec3::Y));
    }
    scene.add_camera(&view(&scene));
    let joint = Joint { node: 0, joint_from_mesh: DAffine3::IDENTITY };
    scene.deformers.push(Deformer { node: 0, joints: vec![joint], weights: vec![0.5] });
    let count = floor.positions.len();
    let moved = TargetDeltas { positions: vec![Vec3::Y; count], normals: vec![Vec3::ZERO; count], tangents: vec![] };
    let deform = Deform {
        positions: floor.positions.clone(),
        normals: floor.normals.clone(),
        tangents: floor.tangents.clone(),
        targets: vec![moved],
        influences: 1,
        skin: vec![(0, 1.0); count],
        ..Default::default()
    };
    scene.add_mesh(Mesh { deform: Some(Arc::new(deform)), ..floor }, DAffine3::IDENTITY);
    let (times, interpolation) = (vec![0.0, 1.0], Interpolation::Linear);
    let moves = |property| Channel { node: 0, times: times.clone(), property, values: vec![Vec4::W; 2], interpolation };
    let weights = WeightChannel { deformer: 0, times: times.clone(), values: vec![0.0, 1.0], width: 1, interpolation };
    let channels = vec![moves(Property::Translation), moves(Property::Rotation)];
    scene.animations.push(Animation { name: "moves".into(), duration: 1.0, channels, weights: vec![weights] });
    scene
}

pub fn view(scene: &Scene) -> View {
    View::framing(scene.bounds(None))
}

type Change<T> = fn(&mut T, &mut Chance);

/// Every kind of field of a scene.
const SCENE: [Change<Scene>; 27] = [
    |s, c| s.sky = c.vector(),
    |s, c| s.sky_gradient = c.vector(),
    |s, c| s.sky_turn = c.float(),
    |s, c| s.materials.truncate(c.below(4)),
    |s, c| s.nodes.truncate(c.below(8)),
    |s, c| s.meshes[c.below(3)].positions[2] = c.vector(),
    |s, c| s.meshes[c.below(3)].normals[2] = c.vector(),
    |s, c| s.meshes[c.below(3)].tangents[1] = c.vector().extend(c.float()),
    |s, c| s.meshes[c.below(3)].uvs[c.below(2)][1] = Vec2::new(c.float(), c.float()),
    |s, c| s.meshes[c.below(3)].colors[1] = c.vector().extend(c.float()),
    |s, c| s.meshes[c.below(3)].indices[2] = c.index() as u32,
    |s, c| s.meshes[c.below(3)].material = c.index(),
    |s, c| s.meshes[c.below(3)].positions.truncate(c.below(4)),
    |s, c| s.meshes[c.below(3)].indices.clear(),
    |s, c| (s.images[0].width, s.images[0].height) = (c.index() as u32, c.index() as u32),
    |s, c| s.textures[0].image = c.index(),
    |s, c| s.nodes[c.below(3)].parent = Some(c.index()),
    |s, c| s.nodes[c.below(3)].local = Transform::Matrix(DAffine3::from_scale(c.vector64())),
    |s, c| {
        let rotation = DQuat::from_xyzw(c.double(), 0.0, 0.0, c.double());
        s.nodes[c.below(3)].local = Transform::Trs { translation: c.vector64(), rotation, scale: c.vector64() };
    },
    |s, c| s.instances[c.below(3)].mesh = c.index(),
    |s, c| s.instances[c.below(3)].node = c.index(),
    |s, c| {
        let light = &mut s.lights[c.below(3)];
        (light.intensity, light.range, light.radius) = (c.vector(), c.float(), c.float());
        if let LightKind::Spot { inner, outer } = &mut light.kind {
            (*inner, *outer) = (c.float(), c.float());
        }
    },
    |s, c| s.cameras[0].projection = projection(c),
    |s, c| s.deformers[0].weights[0] = c.float(),
    |s, c| s.deformers[0].joints[0].joint_from_mesh = DAffine3::from_scale(c.vector64()),
    |s, c| {
        let deform = Arc::make_mut(s.meshes[2].deform.as_mut().unwrap());
        match c.below(6) {
            0 => deform.skin[1] = (c.index() as u32, c.float()),
            1 => deform.influences = c.index(),
            2 => deform.targets[0].positions[1] = c.vector(),
            3 => deform.targets[0].normals[1] = c.vector(),
            4 => (deform.flat, deform.targets) = (true, vec![]),
            _ => deform.normals[1] = c.vector(),
        }
    },
    |s, c| {
        let animation = &mut s.animations[0];
        match c.below(5) {
            0 => animation.channels[c.below(2)].times[c.below(2)] = c.float(),
            1 => animation.channels[c.below(2)].values[c.below(2)] = c.vector().extend(c.float()),
            2 => animation.weights[0].values[1] = c.float(),
            3 => animation.weights[0].times[c.below(2)] = c.float(),
            _ => animation.duration = c.float(),
        }
    },
];

/// Every kind of field of a material.
const MATERIAL: [Change<Material>; 15] = [
    |m, c| m.base_color = c.vector().extend(c.float()),
    |m, c| m.metallic = c.float(),
    |m, c| m.roughness = c.float(),
    |m, c| (m.normal_texture, m.normal_scale) = (c.slot(), c.float()),
    |m, c| (m.occlusion_texture, m.occlusion_strength) = (c.slot(), c.float()),
    |m, c| m.emissive = c.vector(),
    |m, c| m.emissive_texture = c.slot(),
    |m, c| m.alpha = [Alpha::Mask(c.float()), Alpha::Blend][c.below(2)],
    |m, c| m.base_color_texture = c.slot(),
    |m, c| m.ior = c.float(),
    |m, c| (m.specular, m.specular_color) = (c.float(), c.vector()),
    |m, c| (m.transmission, m.ior) = (c.float(), c.float()),
    |m, c| (m.transmission, m.thickness, m.thickness_texture) = (1.0, c.float(), c.slot()),
    |m, c| (m.transmission, m.attenuation_color, m.attenuation_distance) = (1.0, c.vector(), c.float()),
    |m, c| {
        let mut finish = Finish { dispersion: c.float(), ..Finish::default() };
        (finish.clearcoat.factor, finish.clearcoat.roughness) = (c.float(), c.float());
        (finish.clearcoat.normal_texture, finish.clearcoat.normal_scale) = (c.slot(), c.float());
        (finish.sheen.color, finish.sheen.roughness) = (c.vector(), c.float());
        (finish.anisotropy.strength, finish.anisotropy.rotation) = (c.float(), c.float());
        (finish.iridescence.factor, finish.iridescence.ior) = (c.float(), c.float());
        finish.diffuse_transmission.factor = c.float();
        m.finish = Some(Box::new(finish));
    },
];

fn projection(c: &mut Chance) -> Projection {
    let (near, far) = (c.float(), c.float());
    match c.below(2) {
        0 => Projection::Perspective { fov: c.float(), near, far },
        _ => Projection::Orthographic { half_height: c.float(), near, far },
    }
}

/// Changes a field of the scene, or of one of its materials.
pub fn spoil(scene: &mut Scene, chance: &mut Chance) {
    let field = chance.below(SCENE.len() + MATERIAL.len());
    match field.checked_sub(SCENE.len()) {
        None => SCENE[field](scene, chance),
        Some(field) => MATERIAL[field](&mut scene.materials[chance.below(3)], chance),
    }
}

/// A camera, often an invalid one.
pub fn spoilt_view(mut view: View, chance: &mut Chance) -> View {
    match chance.below(4) {
        0 => view.eye = chance.vector64(),
        1 => view.forward = chance.vector64(),
        2 => view.up = chance.vector64(),
        _ => view.projection = projection(chance),
    }
    view
}

/// Bounds, often invalid ones.
pub fn spoilt_bounds(chance: &mut Chance) -> Bounds {
    Bounds { min: chance.vector64(), max: chance.vector64() }
}

/// The settings with another number, boolean or string at one or two places.
pub fn spoilt_settings(settings: &Settings, chance: &mut Chance) -> Settings {
    let mut value = toml::Value::try_from(settings).unwrap();
    for _ in 0..=chance.below(2) {
        match leaf(&mut value, chance) {
            toml::Value::Integer(number) => {
                *number = [0, 1, 2, 3, 5, 64, 77, 4096, i64::from(i32::MAX), i64::from(u32::MAX)][chance.below(10)];
            }
            toml::Value::Float(number) => *number = chance.double(),
            toml::Value::Boolean(truth) => *truth = !*truth,
            _ => {}
        }
    }
    value.try_into().unwrap_or_else(|_| settings.clone())
}

/// A place in the tree of settings that is not itself a table.
fn leaf<'a>(tree: &'a mut toml::Value, chance: &mut Chance) -> &'a mut toml::Value {
    if tree.as_table().is_none_or(|table| table.is_empty()) {
        return tree;
    }
    let table = tree.as_table_mut().expect("looked at above");
    let place = chance.below(table.len());
    leaf(table.iter_mut().nth(place).expect("it has so many").1, chance)
}
