//! Two Cornell boxes: a room of 2 m in the classic layout, lit by a square lamp or by a point light.
//!
//! The walls are double-sided sheets, and all materials are diffuse, so that the images test only the light.

use glam::{DVec2, DVec3, dvec3};
use serde_json::{Value, json};

use super::glb::Glb;
use super::shapes::Shape;

const CC0: &str = "CC0 1.0: dedicated to the public domain";

/// The box with an emissive square of 0.5 m just below the ceiling.
pub fn area() -> Vec<u8> {
    let mut glb = room();
    let mut lamp = matte("lamp", [0.0; 3]);
    lamp["doubleSided"] = json!(false);
    lamp["emissiveFactor"] = json!([1.0, 0.8, 0.5]);
    lamp["extensions"]["KHR_materials_emissive_strength"] = json!({ "emissiveStrength": 16.0 });
    let lamp = glb.material(lamp);
    let square = Shape::quad(dvec3(-0.25, 0.995, -0.25), DVec3::X * 0.5, DVec3::Z * 0.5, DVec2::ONE);
    glb.object("lamp", &square, lamp, json!({}));
    glb.finish("cornell-area", CC0)
}

/// The box with a white point light of intensity 1.25.
pub fn point() -> Vec<u8> {
    let mut glb = room();
    let light = json!({ "type": "point", "color": [1.0, 1.0, 1.0], "intensity": 1.25, "extras": { "radius": 0.05 } });
    let eye = dvec3(0.0, 0.7, 0.0);
    glb.light("lamp", light, [eye, eye - DVec3::Y]);
    glb.finish("cornell-point", CC0)
}

/// The box without a light: open to +Z, a red wall on the left, a green one on the right, two blocks.
fn room() -> Glb {
    let mut glb = Glb::default();
    let white = glb.material(matte("white", [0.73; 3]));
    let red = glb.material(matte("red", [0.61, 0.055, 0.045]));
    let green = glb.material(matte("green", [0.11, 0.44, 0.085]));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let low = DVec3::NEG_ONE;
    for (name, corner, u, v, material) in [
        ("floor", low, z, x, white),
        ("ceiling", low + y, x, z, white),
        ("back", low, x, y, white),
        ("left", low, y, z, red),
        ("right", low + x, z, y, green),
    ] {
        glb.object(name, &Shape::quad(corner, u, v, DVec2::ONE), material, json!({}));
    }
    let tall = Shape::cuboid(dvec3(-0.3, -1.0, -0.3), dvec3(0.3, 0.2, 0.3));
    glb.object("tall block", &tall.moved(0.3, dvec3(-0.35, 0.0, -0.3)), white, json!({}));
    let short = Shape::cuboid(dvec3(-0.3, -1.0, -0.3), dvec3(0.3, -0.4, 0.3));
    glb.object("short block", &short.moved(-0.29, dvec3(0.33, 0.0, 0.35)), white, json!({}));
    glb.camera("front", [dvec3(0.0, 0.0, 3.9), DVec3::ZERO], 39.0);
    glb
}

/// A double-sided diffuse material without dielectric reflection.
fn matte(name: &str, color: [f64; 3]) -> Value {
    let [r, g, b] = color;
    json!({
        "name": name,
        "doubleSided": true,
        "pbrMetallicRoughness": { "baseColorFactor": [r, g, b, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0 },
        "extensions": { "KHR_materials_specular": { "specularFactor": 0.0 } },
    })
}
