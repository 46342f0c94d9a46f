//! The gallery: one room with an example of every main feature.
//!
//! A closed room of 3.4 × 2.5 × 4.25 m, red on the left and teal on the right, so that coloured light reaches the white
//! back wall. Five golden spheres from polished to rough are on a bench. A ring on the wall and a ball on the floor are
//! emissive. A spot light shines through a brass lattice (an alpha mask) onto the tiled floor; a point light of 6 cm radius
//! casts softer shadows. A knot of coloured clay (vertex colours) rotates on a plinth behind a pane of rose glass; a ball
//! of clear glass refracts.

use std::f64::consts::TAU;

use glam::{DQuat, DVec2, DVec3, dvec2, dvec3};
use serde_json::{Value, json};

use super::glb::{Glb, rotation};
use super::shapes::Shape;
use super::texels;
use crate::Result;

/// The room's corners in metres.
const LOW: DVec3 = dvec3(-1.7, 0.0, -2.1);
const HIGH: DVec3 = dvec3(1.7, 2.5, 2.15);
/// Seconds per rotation of the knot.
const LOOP_S: f64 = 2.0;
/// Edge of the floor's texture in metres: four tiles.
const TEXTURE_M: f64 = 1.7;

pub fn gallery() -> Result<Vec<u8>> {
    let mut glb = Glb::default();
    room(&mut glb)?;
    bench(&mut glb);
    knot(&mut glb);
    glasses(&mut glb);
    screen(&mut glb)?;
    emitters(&mut glb);
    lights(&mut glb);
    glb.camera("gallery", [dvec3(0.0, 1.35, 2.0), dvec3(0.0, 0.95, -0.6)], 58.0);
    glb.camera("spheres", [dvec3(0.9, 1.0, 0.2), dvec3(-0.15, 0.6, -1.4)], 45.0);
    Ok(glb.finish("gallery", "CC0 1.0: dedicated to the public domain"))
}

/// Six double-sided sheets; the floor is polished stone.
fn room(glb: &mut Glb) -> Result<()> {
    let size = HIGH - LOW;
    let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
    let white = glb.material(sheet(matte("white plaster", [0.74, 0.72, 0.69])));
    let red = glb.material(sheet(matte("red plaster", [0.62, 0.085, 0.05])));
    let teal = glb.material(sheet(matte("teal plaster", [0.035, 0.33, 0.36])));
    let color = glb.texture("floor colour", &texels::floor_color()?);
    let normal = glb.texture("floor normal", &texels::floor_normal()?);
    let roughness = glb.texture("floor roughness", &texels::floor_roughness()?);
    let floor = glb.material(sheet(json!({
        "name": "floor tiles",
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": color }, "metallicRoughnessTexture": { "index": roughness },
        },
        "normalTexture": { "index": normal, "scale": 0.6 },
    })));
    let repeat = dvec2(size.x, size.z) / TEXTURE_M;
    for (name, corner, u, v, repeat, material) in [
        ("floor", LOW + z, x, -z, repeat, floor),
        ("ceiling", LOW + y, x, z, DVec2::ONE, white),
        ("back wall", LOW, x, y, DVec2::ONE, white),
        ("front wall", LOW + z, y, x, DVec2::ONE, white),
        ("left wall", LOW, y, z, DVec2::ONE, red),
        ("right wall", LOW + x, z, y, DVec2::ONE, teal),
    ] {
        glb.object(name, &Shape::quad(corner, u, v, repeat), material, json!({}));
    }
    Ok(())
}

/// A stone bench along the back with five golden spheres of increasing roughness: one geometry, five materials.
fn bench(glb: &mut Glb) {
    let stone = glb.material(matte("pale stone", [0.66, 0.64, 0.6]));
    let bench = Shape::cuboid(dvec3(-1.1, 0.0, -1.65), dvec3(1.1, 0.45, -1.2));
    glb.object("bench", &bench, stone, json!({}));
    let sphere = glb.geometry(&Shape::sphere(0.18, 14, 28));
    for (i, roughness) in [0.0, 0.2, 0.4, 0.65, 1.0].into_iter().enumerate() {
        let name = format!("gold, roughness {roughness}");
        let gold = glb.material(json!({
            "name": name,
            "pbrMetallicRoughness": {
                "baseColorFactor": [0.96, 0.76, 0.42, 1.0], "metallicFactor": 1.0, "roughnessFactor": roughness,
            },
        }));
        let mesh = glb.mesh(&name, &sphere, gold);
        glb.place(&name, mesh, json!({ "translation": [-0.84 + 0.4 * i as f64, 0.63, -1.42] }));
    }
}

/// A trefoil knot in all colours that rotates on a plinth.
fn knot(glb: &mut Glb) {
    let stone = glb.material(matte("dark stone", [0.22, 0.21, 0.2]));
    let plinth = Shape::cuboid(dvec3(-0.19, 0.0, -0.19), dvec3(0.19, 0.6, 0.19));
    glb.object("plinth", &plinth, stone, json!({ "translation": [-0.99, 0.0, -0.35] }));
    let clay = glb.material(json!({
        "name": "glazed clay",
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.35 },
    }));
    let trefoil = |t: f64| {
        let t = t * TAU;
        dvec3(t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -(3.0 * t).sin()) * 0.088
    };
    let hue = |p: DVec3| {
        let angle = p.y.atan2(p.x);
        dvec3(0.0, TAU / 3.0, 2.0 * TAU / 3.0).to_array().map(|phase| 0.42 + 0.4 * (angle + phase).cos()).into()
    };
    let knot = Shape::tube(trefoil, 0.055, 128, 14).colored(hue);
    let node = glb.object("knot", &knot, clay, json!({ "translation": [-0.99, 0.98, -0.35] }));
    let key = |quarter: u32| {
        let rotation = DQuat::from_rotation_y(TAU / 4.0 * f64::from(quarter));
        (LOOP_S / 4.0 * f64::from(quarter), rotation.to_array())
    };
    glb.rotate("turn", node, &[0, 1, 2, 3, 4].map(key));
}

/// A ball of clear, slightly green glass that refracts, and a thin pane of rose glass with alpha blending.
fn glasses(glb: &mut Glb) {
    let clear = glb.material(json!({
        "name": "clear glass",
        "pbrMetallicRoughness": { "metallicFactor": 0.0, "roughnessFactor": 0.0 },
        "extensions": {
            "KHR_materials_transmission": { "transmissionFactor": 1.0 },
            "KHR_materials_ior": { "ior": 1.5 },
            "KHR_materials_volume": {
                "thicknessFactor": 0.56, "attenuationColor": [0.75, 0.95, 0.88], "attenuationDistance": 0.6,
            },
        },
    }));
    glb.object("glass ball", &Shape::sphere(0.28, 18, 36), clear, json!({ "translation": [0.34, 0.28, 0.12] }));
    let rose = glb.material(sheet(json!({
        "name": "rose glass",
        "alphaMode": "BLEND",
        "pbrMetallicRoughness": {
            "baseColorFactor": [0.8, 0.12, 0.3, 0.45], "metallicFactor": 0.0, "roughnessFactor": 0.15,
        },
    })));
    let pane = Shape::quad(dvec3(-0.26, 0.0, 0.0), DVec3::X * 0.52, DVec3::Y * 0.6, DVec2::ONE);
    let placement = json!({
        "translation": [-0.68, 0.002, 0.1], "rotation": rotation(DQuat::from_rotation_y(0.35)),
    });
    glb.object("rose pane", &pane, rose, placement);
}

/// A framed brass lattice in front of the right wall; the spot light shines through it.
fn screen(glb: &mut Glb) -> Result<()> {
    let lattice = glb.texture("lattice", &texels::lattice()?);
    let brass = glb.material(sheet(json!({
        "name": "brass lattice",
        "alphaMode": "MASK",
        "alphaCutoff": 0.5,
        "pbrMetallicRoughness": {
            "baseColorTexture": { "index": lattice }, "metallicFactor": 0.0, "roughnessFactor": 0.6,
        },
    })));
    let wood = glb.material(matte("walnut", [0.16, 0.085, 0.05]));
    let (half, low, high, post) = (0.37, 0.08, 1.58, 0.04);
    let corner = dvec3(-half, low, 0.0);
    let leaf = Shape::quad(corner, DVec3::X * 2.0 * half, DVec3::Y * (high - low), dvec2(3.0, 6.0));
    let mut frame = Shape::default();
    for (min, max) in [
        (dvec3(-half - post, 0.0, -0.02), dvec3(-half, high + post, 0.02)),
        (dvec3(half, 0.0, -0.02), dvec3(half + post, high + post, 0.02)),
        (dvec3(-half, low - post, -0.02), dvec3(half, low, 0.02)),
        (dvec3(-half, high, -0.02), dvec3(half, high + post, 0.02)),
    ] {
        frame.append(&Shape::cuboid(min, max));
    }
    let leaf = glb.object("lattice", &leaf, brass, json!({}));
    let frame = glb.object("frame", &frame, wood, json!({}));
    glb.node(json!({
        "name": "screen",
        "children": [leaf, frame],
        "translation": [1.24, 0.0, -0.8],
        "rotation": rotation(DQuat::from_rotation_y(-0.53)),
    }));
    Ok(())
}

/// The emissive objects: a ring on the back wall, a ball on the floor, a panel in the ceiling (single-sided, facing down).
fn emitters(glb: &mut Glb) {
    let ring = glb.material(glowing("warm neon", [1.0, 0.5, 0.2], 4.0));
    let circle = |t: f64| dvec3((t * TAU).cos(), (t * TAU).sin(), 0.0) * 0.42;
    let placement = json!({ "translation": [0.0, 1.62, -2.03] });
    glb.object("ring", &Shape::tube(circle, 0.04, 64, 12), ring, placement);
    let blue = glb.material(glowing("blue lamp", [0.2, 0.55, 1.0], 4.0));
    glb.object("blue ball", &Shape::sphere(0.12, 12, 24), blue, json!({ "translation": [-0.3, 0.12, -0.2] }));
    let panel = glb.material(glowing("panel", [1.0, 0.93, 0.84], 3.0));
    let corner = dvec3(-0.5, HIGH.y - 0.01, -0.9);
    glb.object("panel", &Shape::quad(corner, DVec3::X, DVec3::Z * 0.8, DVec2::ONE), panel, json!({}));
}

/// A point light with a radius, for soft shadows, and a spot light without one behind the lattice.
fn lights(glb: &mut Glb) {
    let lamp = json!({ "type": "point", "color": [1.0, 0.9, 0.78], "intensity": 1.6, "extras": { "radius": 0.06 } });
    let eye = dvec3(-0.6, 2.1, 0.9);
    glb.light("lamp", lamp, [eye, eye - DVec3::Y]);
    let spot = json!({
        "type": "spot", "color": [1.0, 0.84, 0.62], "intensity": 14.0, "range": 8.0,
        "spot": { "innerConeAngle": 0.4, "outerConeAngle": 0.62 },
    });
    glb.light("spot", spot, [dvec3(1.5, 2.35, -1.75), dvec3(0.3, 0.0, 0.2)]);
}

/// A diffuse material without dielectric reflection.
fn matte(name: &str, [r, g, b]: [f64; 3]) -> Value {
    json!({
        "name": name,
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 } },
    })
}

/// Emits the radiance `color` × `strength` and reflects nothing.
fn glowing(name: &str, color: [f64; 3], strength: f64) -> Value {
    let mut material = matte(name, [0.0; 3]);
    material["emissiveFactor"] = json!(color);
    material["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": strength });
    material
}

/// Makes a material double-sided.
fn sheet(mut material: Value) -> Value {
    material["doubleSided"] = json!(true);
    material
}
