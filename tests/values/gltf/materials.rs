//! Materials of glTF 2.0 and their extensions: every factor and texture slot, refusals, and clamped values.

use super::files::{File, png};
use glam::{Vec2, Vec3, Vec4};
use serde_json::json;
use twobounce::scene::surface::SurfacePoint;
use twobounce::scene::texture::Textures;
use twobounce::scene::{Alpha, Scene};

#[test]
fn materials_keep_every_factor_and_slot() {
    let mut file = File::quad();
    let texture = file.texture(&png(1, 1, &[255; 4]));
    let slot = json!({"index": texture});
    file.material(json!({
        "name": "all", "doubleSided": true, "alphaMode": "MASK", "alphaCutoff": 0.25, "emissiveFactor": [0.5, 0, 1],
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.6, "roughnessFactor": 0.7,
            "baseColorTexture": slot, "metallicRoughnessTexture": slot},
        "normalTexture": {"index": texture, "scale": 2.0}, "occlusionTexture": {"index": texture, "strength": 0.5},
        "emissiveTexture": slot,
        "extensions": {
            "KHR_materials_emissive_strength": {"emissiveStrength": 10.0}, "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {"specularFactor": 0.8, "specularTexture": slot, "specularColorFactor": [2, 1, 0], "specularColorTexture": slot},
            "KHR_materials_transmission": {"transmissionFactor": 0.9, "transmissionTexture": slot},
            "KHR_materials_volume": {"thicknessFactor": 0.3, "thicknessTexture": slot, "attenuationDistance": 2.0, "attenuationColor": [1, 0.5, 0.25]},
            "KHR_materials_unlit": {}}
    }));
    let scene = file.scene();
    let m = &scene.materials[1];
    assert_eq!((m.name.as_str(), m.double_sided, m.unlit, m.alpha), ("all", true, true, Alpha::Mask(0.25)));
    assert_eq!((m.base_color, m.metallic, m.roughness), (Vec4::new(0.1, 0.2, 0.3, 0.4), 0.6, 0.7));
    assert_eq!((m.normal_scale, m.occlusion_strength, m.emissive), (2.0, 0.5, Vec3::new(5.0, 0.0, 10.0)));
    assert_eq!((m.ior, m.specular, m.specular_color), (1.33, 0.8, Vec3::new(2.0, 1.0, 0.0)));
    assert_eq!((m.transmission, m.thickness, m.attenuation_distance), (0.9, 0.3, 2.0));
    assert_eq!(m.attenuation_color, Vec3::new(1.0, 0.5, 0.25));
    assert_eq!(m.texture_slots().count(), 9);
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
}

#[test]
fn every_finish_is_read() {
    let mut file = File::quad();
    let texture = file.texture(&png(1, 1, &[255; 4]));
    let slot = json!({"index": texture, "texCoord": 1});
    file.material(json!({"extensions": {
        "KHR_materials_clearcoat": {"clearcoatFactor": 0.5, "clearcoatTexture": slot, "clearcoatRoughnessFactor": 0.25,
            "clearcoatRoughnessTexture": slot, "clearcoatNormalTexture": {"index": texture, "scale": 2.0,
            "extensions": {"KHR_texture_transform": {"offset": [0.5, 0.25]}}}},
        "KHR_materials_sheen": {"sheenColorFactor": [0.1, 0.2, 0.3], "sheenColorTexture": slot, "sheenRoughnessFactor": 0.4,
            "sheenRoughnessTexture": slot},
        "KHR_materials_anisotropy": {"anisotropyStrength": 0.6, "anisotropyRotation": 1.5, "anisotropyTexture": slot},
        "KHR_materials_iridescence": {"iridescenceFactor": 0.7, "iridescenceTexture": slot, "iridescenceIor": 1.8,
            "iridescenceThicknessMinimum": 200, "iridescenceThicknessMaximum": 300, "iridescenceThicknessTexture": slot},
        "KHR_materials_diffuse_transmission": {"diffuseTransmissionFactor": 0.8, "diffuseTransmissionTexture": slot,
            "diffuseTransmissionColorFactor": [0.9, 0.5, 0.1], "diffuseTransmissionColorTexture": slot},
        "KHR_materials_dispersion": {"dispersion": 0.3}}}));
    let scene = file.scene();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let m = &scene.materials[1];
    let f = m.finish.as_deref().expect("a finish");
    assert_eq!((f.clearcoat.factor, f.clearcoat.roughness, f.clearcoat.normal_scale), (0.5, 0.25, 2.0));
    assert_eq!(f.clearcoat.normal_texture.expect("a slot").transform.translation, Vec2::new(0.5, 0.25));
    assert_eq!((f.sheen.color, f.sheen.roughness), (Vec3::new(0.1, 0.2, 0.3), 0.4));
    assert_eq!((f.anisotropy.strength, f.anisotropy.rotation), (0.6, 1.5));
    assert_eq!((f.iridescence.factor, f.iridescence.ior, f.iridescence.thickness_nm), (0.7, 1.8, [200.0, 300.0]));
    assert_eq!((f.diffuse_transmission.factor, f.diffuse_transmission.color), (0.8, Vec3::new(0.9, 0.5, 0.1)));
    assert_eq!(f.dispersion, 0.3);
    assert_eq!(m.texture_slots().count(), 10);
    let sets: Vec<usize> = f.slots().iter().map(|(slot, _)| slot.expect("all slots").uv_set).collect();
    assert_eq!(sets, [1, 1, 0, 1, 1, 1, 1, 1, 1, 1]);
    let srgb = f.slots().map(|(_, space)| space == twobounce::scene::texture::ColorSpace::Srgb);
    assert_eq!(srgb, [false, false, false, true, false, false, false, false, false, true]);
    // Tangents were generated: the quad has none, and its material needs them.
    assert!(scene.meshes[0].tangents.iter().all(|t| t.truncate().is_normalized()));
}

#[test]
fn a_finish_that_does_nothing_or_is_wrong() {
    let mut file = File::quad();
    file.material(json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatRoughnessFactor": 0.5},
        "KHR_materials_sheen": {}, "KHR_materials_iridescence": {"iridescenceIor": 1.5}, "KHR_materials_dispersion": {}}}));
    file.material(
        json!({"extensions": {"KHR_materials_unlit": {}, "KHR_materials_clearcoat": {"clearcoatFactor": 1}}}),
    );
    file.material(json!({"extensions": {"KHR_materials_clearcoat": {"clearcoatFactor": 3},
        "KHR_materials_iridescence": {"iridescenceFactor": -1, "iridescenceThicknessMaximum": -5}}}));
    let scene = file.scene();
    assert!(scene.materials[1].finish.is_none() && scene.materials[2].finish.is_none());
    assert_eq!(scene.materials[3].finish.as_ref().expect("a coat").clearcoat.factor, 1.0);
    for said in ["a clearcoat above 1; it was lowered", "an iridescence below 0", "an iridescence thickness below 0"] {
        assert!(scene.warnings.iter().any(|w| w.contains("material 2") && w.contains(said)), "{:?}", scene.warnings);
    }
    for wrong in [json!("shiny"), json!({"clearcoatFactor": "much"}), json!({"clearcoatTexture": 3}), json!([1])] {
        let mut file = File::quad();
        file.material(json!({"extensions": {"KHR_materials_clearcoat": wrong}}));
        let refusal = file.load().unwrap_err();
        assert!(refusal.contains("material 0 has a KHR_materials_clearcoat that is not valid"), "{refusal}");
    }
    let mut file = File::quad();
    let slot = json!({"index": 77});
    file.material(
        json!({"extensions": {"KHR_materials_sheen": {"sheenColorFactor": [1, 1, 1], "sheenColorTexture": slot}}}),
    );
    assert!(file.load().unwrap_err().contains("texture 77"), "a missing texture");
}

#[test]
fn texture_transforms_follow_the_extensions_example() {
    let mut file = File::quad();
    let texture = file.texture(&png(1, 1, &[255; 4]));
    let transform =
        json!({"offset": [0, 1], "rotation": std::f64::consts::FRAC_PI_2, "scale": [0.5, 0.5], "texCoord": 1});
    let slot = json!({"index": texture, "extensions": {"KHR_texture_transform": transform}});
    file.material(json!({"emissiveTexture": slot, "normalTexture": slot, "occlusionTexture": slot}));
    let material = &file.scene().materials[1];
    let slot = material.emissive_texture.unwrap();
    assert_eq!((material.normal_texture, material.occlusion_texture), (Some(slot), Some(slot)));
    assert_eq!(slot.uv_set, 1);
    // "Only the lower left quadrant of the source image, rotated clockwise": u in 0…½, v in ½…1.
    for (uv, expected) in [(Vec2::ZERO, Vec2::Y), (Vec2::X, Vec2::new(0.0, 0.5)), (Vec2::Y, Vec2::new(0.5, 1.0))] {
        // f32 rounding of a sine and a cosine.
        assert!((slot.transform.transform_point2(uv) - expected).length() < 1e-6);
    }
}

/// A converted material has the extension's appearance: the diffuse colour, the reflectance at normal incidence, the
/// roughness.
#[test]
fn specular_and_glossiness_are_converted() {
    let material = |extension: serde_json::Value| {
        let mut file = File::quad();
        file.json["extensionsUsed"] = json!(["KHR_materials_pbrSpecularGlossiness"]);
        file.material(json!({"pbrMetallicRoughness": {"baseColorFactor": [1, 0, 0, 1], "metallicFactor": 0.5},
            "extensions": {"KHR_materials_pbrSpecularGlossiness": extension}}));
        let scene = file.scene();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        scene.materials[1].clone()
    };
    let m = material(
        json!({"diffuseFactor": [0.1, 0.6, 0.2, 0.5], "specularFactor": [0.04, 0.5, 0.0], "glossinessFactor": 0.25}),
    );
    assert_eq!((m.base_color, m.metallic, m.roughness), (Vec4::new(0.1, 0.6, 0.2, 0.5), 0.0, 0.75));
    let point = SurfacePoint { uvs: [Vec2::ZERO; 2], color: Vec4::ONE, footprint: [0.0; 2] };
    let surface = m.evaluate(&Scene::default(), &Textures::default(), &point);
    assert_eq!(
        (surface.base_color, surface.f0, surface.f90),
        (Vec3::new(0.1, 0.6, 0.2), Vec3::new(0.04, 0.5, 0.0), 1.0)
    );
    let absent = material(json!({}));
    assert_eq!((absent.base_color, absent.roughness, absent.specular_color), (Vec4::ONE, 0.0, Vec3::ONE));
    assert_eq!(absent.ior, 0.0);
}

#[test]
fn textures_of_specular_and_glossiness_are_converted() {
    let mut file = File::quad();
    // Specular (250, 10, 20), glossiness 0 and 1, in one texture that two materials read with factors of their own.
    let texture = file.texture(&png(2, 1, &[250, 10, 20, 0, 250, 10, 20, 255]));
    let diffuse = file.texture(&png(1, 1, &[9, 8, 7, 6]));
    for glossiness in [1.0, 0.5] {
        let extension = json!({"diffuseTexture": {"index": diffuse}, "specularGlossinessTexture": {"index": texture, "texCoord": 1},
            "glossinessFactor": glossiness});
        file.material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": extension}}));
    }
    let scene = file.scene();
    assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    let image = |slot: Option<twobounce::scene::TextureRef>| {
        &scene.images[scene.textures[slot.unwrap().texture].image].rgba[..]
    };
    let [first, second] = [1, 2].map(|i| &scene.materials[i]);
    assert_eq!((first.roughness, first.metallic, scene.images.len()), (1.0, 0.0, 4));
    assert_eq!(image(first.base_color_texture), [9, 8, 7, 6]);
    assert_eq!(image(first.specular_color_texture), [250, 10, 20, 0, 250, 10, 20, 255]);
    assert_eq!(first.specular_color_texture.unwrap().uv_set, 1);
    // Roughness is green: 1 − factor · alpha.
    assert_eq!(image(first.metallic_roughness_texture), [0, 255, 0, 255, 0, 0, 0, 255]);
    assert_eq!(image(second.metallic_roughness_texture), [0, 255, 0, 255, 0, 128, 0, 255]);
    // Without its image a material has only its factors.
    file.json["images"][0] = json!({"uri": "none.png"});
    let scene = file.scene();
    assert_eq!([1, 2].map(|i| scene.materials[i].roughness), [0.0, 0.5]);
    assert!(scene.materials[1].metallic_roughness_texture.is_none());
}

#[test]
fn a_wrong_specular_and_glossiness_is_refused() {
    for (wrong, part) in [
        (json!(3), "it is no object"),
        (json!({"diffuseFactor": [1, 1, 1]}), "is not valid"),
        (json!({"glossinessFactor": "high"}), "is not valid"),
        (json!({"diffuseTexture": {"index": 7}}), "texture 7 is used but does not exist"),
    ] {
        let mut file = File::quad();
        file.material(json!({"extensions": {"KHR_materials_pbrSpecularGlossiness": wrong}}));
        let refusal = file.load().unwrap_err();
        assert!(refusal.contains(part), "{refusal}");
    }
}

/// A quad with four sets of texture coordinates: the first vertex of set n is at (n, 1).
fn quad_of_sets() -> File {
    let mut file = File::quad();
    for set in 0..4 {
        let uvs = file.floats("VEC2", &[set as f32, 1.0].repeat(4));
        file.json["meshes"][0]["primitives"][0]["attributes"][format!("TEXCOORD_{set}")] = json!(uvs);
    }
    file
}

#[test]
fn textures_on_any_two_sets_are_drawn_from_these() {
    for (base, emissive, first, second) in
        [(2, 2, 2, 1), (2, 3, 2, 3), (3, 1, 3, 1), (0, 3, 0, 3), (3, 0, 0, 3), (1, 0, 0, 1), (1, 1, 0, 1)]
    {
        let mut file = quad_of_sets();
        let texture = file.texture(&png(1, 1, &[255; 4]));
        file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": texture, "texCoord": base}},
            "occlusionTexture": {"index": texture, "texCoord": 5},
            "emissiveTexture": {"index": texture, "extensions": {"KHR_texture_transform": {"texCoord": emissive}}}}));
        let scene = file.scene();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let at = |slot: Option<twobounce::scene::TextureRef>| scene.meshes[0].uvs[slot.unwrap().uv_set][0].x;
        let m = &scene.materials[1];
        assert_eq!([at(m.base_color_texture), at(m.emissive_texture)], [base as f32, emissive as f32]);
        assert_eq!([0, 1].map(|set| scene.meshes[0].uvs[set][0].x), [first as f32, second as f32]);
    }
}

/// The note says which textures are wrong.
#[test]
fn a_third_set_in_one_material_gets_a_note() {
    let mut file = quad_of_sets();
    let texture = file.texture(&png(1, 1, &[255; 4]));
    let slot = |set: u32| json!({"index": texture, "texCoord": set});
    file.material(json!({"pbrMetallicRoughness": {"baseColorTexture": slot(2), "metallicRoughnessTexture": slot(3)},
        "normalTexture": slot(3), "emissiveTexture": slot(1)}));
    let scene = file.scene();
    assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
    let note = "material 0 uses more than two sets of texture coordinates; its textures on set 1 are placed by set 2";
    assert!(scene.warnings[0].starts_with(note), "{:?}", scene.warnings);
    assert_eq!([0, 1].map(|set| scene.meshes[0].uvs[set][0].x), [2.0, 3.0]);
}
