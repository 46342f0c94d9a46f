//! The reference's clearcoats, sheens, films and further extensions against closed forms.

use std::f32::consts::{FRAC_1_PI, PI, TAU};

use crate::traced::film;
use glam::{DAffine3, DQuat, DVec3, Vec3, Vec4};
use twobounce::layers::Aov;
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::finish::{Anisotropy, Clearcoat, DiffuseTransmission, Finish, Iridescence, Sheen, dispersed};
use twobounce::scene::{LightKind, Material, Mesh, Projection, Scene, View};

/// A camera at −(sin tilt, cos tilt, 0) that looks at the origin, at a square of half side `half`.
fn above(tilt: f32, half: f32) -> View {
    let (sin, cos) = (tilt as f64).sin_cos();
    let mut view = View::look_at(DVec3::new(10.0 * sin, 10.0 * cos, 0.0), DVec3::ZERO, DVec3::Z, 1.0);
    view.projection = Projection::Orthographic { half_height: half, near: 0.0, far: f32::INFINITY };
    view
}

/// A level square at `height` that faces up; its tangent is +X.
fn level(height: f32, half: f32, material: usize) -> Mesh {
    let corner = Vec3::new(-half, height, -half);
    let mut mesh = Mesh::quad("level", material, corner, Vec3::Z * 2.0 * half, Vec3::X * 2.0 * half);
    mesh.tangents = vec![Vec4::new(1.0, 0.0, 0.0, 1.0); mesh.positions.len()];
    mesh
}

fn sheet(material: Material) -> Scene {
    let mut scene = Scene::empty("sheet");
    let material = scene.add_material(material);
    scene.add_mesh(level(0.0, 50.0, material), DAffine3::IDENTITY);
    scene
}

fn traced(scene: &Scene, view: &View, size: u32, samples: u32, depth: Depth) -> Vec3 {
    let options = Options { width: size, height: size, depth, stop: Stop::Samples(samples), seed: 0, occlusion: false };
    let layers = film(scene, view, &options).layers(&[]);
    let pixels = layers.get(Aov::Beauty).expect("the image");
    pixels.iter().map(|&p| Vec3::from(p)).sum::<Vec3>() / pixels.len() as f32
}

/// Radiance under a sky of radiance 1.
fn under_sky(material: Material, tilt: f32, samples: u32) -> Vec3 {
    let scene = Scene { sky: Vec3::ONE, ..sheet(material) };
    traced(&scene, &above(tilt, 1.0), 16, samples, Depth::Full)
}

/// f · cos towards the viewer, for parallel light of irradiance 1 from `from`, without noise.
fn lit_from(material: Material, tilt: f32, from: Vec3) -> Vec3 {
    let mut scene = sheet(material);
    let turn = DQuat::from_rotation_arc(DVec3::NEG_Z, -from.normalize().as_dvec3());
    scene.add_light(LightKind::Directional, Vec3::ONE, DAffine3::from_quat(turn));
    traced(&scene, &above(tilt, 0.1), 4, 4, Depth::Bounces(0))
}

fn lambert(albedo: f32) -> Material {
    Material::lambert("lambert", Vec3::splat(albedo))
}

fn metal(f0: f32, roughness: f32) -> Material {
    Material { base_color: Vec3::splat(f0).extend(1.0), roughness, ..Material::default() }
}

fn with(material: Material, finish: Finish) -> Material {
    Material { finish: Some(Box::new(finish)), ..material }
}

fn coated(material: Material, factor: f32, roughness: f32) -> Material {
    let clearcoat = Clearcoat { factor, roughness, ..Clearcoat::default() };
    with(material, Finish { clearcoat, ..Finish::default() })
}

fn close(found: Vec3, expected: Vec3, tolerance: f32, what: &str) {
    assert!((found - expected).abs().max_element() <= tolerance, "{what}: {found}, expected {expected}");
}

fn schlick(f0: f32, cos: f32) -> f32 {
    f0 + (1.0 - f0) * (1.0 - cos).powi(5)
}

/// KHR_materials_clearcoat: over black the coat's Fresnel reflection remains, over white nothing is lost, and emission
/// loses its share.
#[test]
fn a_clearcoat_takes_its_share_by_fresnel() {
    for tilt in [0.0f32, 0.6, 1.1, 1.4] {
        let share = 0.8 * schlick(0.04, tilt.cos());
        // A mirror has no noise; f32's rounding remains.
        close(under_sky(coated(lambert(0.0), 0.8, 0.0), tilt, 16), Vec3::splat(share), 1e-4, "smooth over black");
        // Directions of the other lobe sample one lobe's light too: noise of 65,536 samples.
        close(under_sky(coated(lambert(1.0), 0.8, 0.0), tilt, 256), Vec3::ONE, 0.003, "smooth over white");
        let lamp = coated(Material::lamp("lamp", Vec3::splat(2.0)), 0.8, 0.5);
        let mut scene = sheet(lamp);
        scene.sky = Vec3::ZERO;
        let sent = traced(&scene, &above(tilt, 1.0), 4, 4, Depth::Bounces(0));
        close(sent, Vec3::splat(2.0 * (1.0 - share)), 1e-4, "emission");
    }
    // Light sampling finds the same emission as rays that hit it: a lamp above a sheet, whose albedo is 1.
    let mut scene = sheet(lambert(1.0));
    let lamp = scene.add_material(coated(Material::lamp("lamp", Vec3::ONE), 1.0, 0.5));
    scene.add_mesh(
        level(0.0, 400.0, lamp),
        DAffine3::from_rotation_x(std::f64::consts::PI) * DAffine3::from_translation(DVec3::NEG_Y),
    );
    let found = traced(&scene, &above(1.2, 0.1), 16, 64, Depth::Bounces(0));
    // ∫ (1 − F) 2 cos d cos = 1 − 0.04 − 0.96 · 2/42.
    let expected = 1.0 - 0.04 - 0.96 * 2.0 / 42.0;
    // Noise, and the lamp ends at 400 times its height.
    close(found, Vec3::splat(expected), 0.005, "a coated ceiling");
}

/// A coat's own normal map turns its highlight and leaves the base alone.
#[test]
fn a_rough_clearcoat_is_ggx_about_its_own_normal() {
    let (tilt, from) = (0.5f32, Vec3::new(-0.3, 1.0, 0.2).normalize());
    let view = Vec3::new(tilt.sin(), tilt.cos(), 0.0);
    let (h, alpha2) = ((view + from).normalize(), 0.4f32.powi(4));
    let d = alpha2 / (PI * (h.y * h.y * (alpha2 - 1.0) + 1.0).powi(2));
    let g = |cos: f32| 2.0 * cos / (cos + (alpha2 + (1.0 - alpha2) * cos * cos).sqrt());
    let lobe = d * g(view.y) * g(from.y) / (4.0 * view.y);
    let share = schlick(0.04, view.y);
    let expected = share * lobe + (1.0 - share) * 0.5 * FRAC_1_PI * from.y;
    // f32.
    close(lit_from(coated(lambert(0.5), 1.0, 0.4), tilt, from), Vec3::splat(expected), 1e-4 * expected, "coat");
}

/// A sheet that scatters all light to its far side, or a part.
#[test]
fn diffuse_transmission_sends_light_through() {
    let color = Vec3::new(0.9, 0.5, 0.2);
    let leaf = |factor: f32| {
        let diffuse_transmission = DiffuseTransmission { factor, color, ..DiffuseTransmission::default() };
        with(lambert(0.6), Finish { diffuse_transmission, ..Finish::default() })
    };
    for (factor, cos) in [(1.0, 1.0), (0.25, 0.6)] {
        let slant = Vec3::new(0.0, cos, (1.0f32 - cos * cos).sqrt());
        let behind = lit_from(leaf(factor), 0.7, -slant);
        close(behind, color * (factor * FRAC_1_PI * cos), 1e-5, "from behind");
        let before = lit_from(leaf(factor), 0.7, slant);
        close(before, Vec3::splat(0.6 * (1.0 - factor) * FRAC_1_PI * cos), 1e-5, "from before");
    }
    let white = DiffuseTransmission { factor: 0.7, ..DiffuseTransmission::default() };
    for thickness in [0.0, 1.0] {
        let leaf = with(lambert(1.0), Finish { diffuse_transmission: white.clone(), ..Finish::default() });
        let mut scene = Scene { sky: Vec3::ONE, ..Scene::empty("box") };
        let material = scene.add_material(Material { thickness, double_sided: true, ior: 1.0, ..leaf });
        scene.add_mesh(Mesh::cuboid("box", material, Vec3::splat(-1.0), Vec3::ONE, false), DAffine3::IDENTITY);
        let found = traced(&scene, &above(0.5, 0.5), 16, 64, Depth::Full);
        // Nothing is absorbed, not even on the way through the box. Noise.
        close(found, Vec3::ONE, 0.01, "a white box");
    }
}

/// The highlight of a brushed metal is that of GGX with two roughnesses, and turns with the material.
#[test]
fn anisotropy_is_ggx_with_two_roughnesses() {
    let brushed = |strength: f32, rotation: f32| {
        let anisotropy = Anisotropy { strength, rotation, texture: None };
        with(metal(0.7, 0.5), Finish { anisotropy, ..Finish::default() })
    };
    let (tilt, alpha) = (0.6f32, 0.25f32);
    let view = Vec3::new(tilt.sin(), tilt.cos(), 0.0);
    for from in [Vec3::new(-0.9, 1.0, 0.1), Vec3::new(-0.4, 1.0, 0.5)].map(Vec3::normalize) {
        for (strength, rotation) in [(0.0, 0.0), (0.6, 0.0), (0.6, PI / 2.0), (1.0, 0.4)] {
            let along = alpha + (1.0 - alpha) * strength * strength;
            let (sin, cos) = rotation.sin_cos();
            // The tangent is +X and the normal +Y, so the bitangent is −Z.
            let (t, b) = (Vec3::new(cos, 0.0, -sin), Vec3::new(sin, 0.0, cos));
            let stretched = |v: Vec3| Vec3::new(v.dot(t) * along, v.y, v.dot(b) * alpha);
            let g = |v: Vec3| 2.0 * v.y / (v.y + stretched(v).length());
            let h = (view + from).normalize();
            let e = (h.dot(t) / along).powi(2) + (h.dot(b) / alpha).powi(2) + h.y * h.y;
            let d = 1.0 / (PI * along * alpha * e * e);
            let expected = schlick(0.7, view.dot(h)) * d * g(view) * g(from) / (4.0 * view.y);
            let found = lit_from(brushed(strength, rotation), tilt, from);
            // f32.
            close(found, Vec3::splat(expected), 2e-4 * expected, &format!("strength {strength}, rotation {rotation}"));
        }
    }
    let plain = lit_from(metal(0.7, 0.5), tilt, Vec3::Y);
    assert_eq!(lit_from(brushed(0.0, 0.0), tilt, Vec3::Y).to_array(), plain.to_array(), "no strength, no difference");
}

/// Sheen's lobe by its formula at one pair of directions, and conservation of energy: white over white.
#[test]
fn sheen_follows_its_formula_and_keeps_energy() {
    let velvet = |base: f32, color: f32, roughness: f32| {
        let sheen = Sheen { color: Vec3::splat(color), roughness, ..Sheen::default() };
        with(lambert(base), Finish { sheen, ..Finish::default() })
    };
    // At 60° on both sides Λ needs only its lower half.
    let (tilt, roughness) = (1.2f32, 0.6f32);
    let (view, from) = (Vec3::new(tilt.sin(), tilt.cos(), 0.0), Vec3::new(0.0, tilt.cos(), tilt.sin()));
    let alpha = roughness * roughness;
    let k = (1.0 - alpha) * (1.0 - alpha);
    let mix = |at_one: f32, at_zero: f32| at_one + (at_zero - at_one) * k;
    let cos = tilt.cos();
    let l = mix(21.5473, 25.3245) / (1.0 + mix(3.82987, 3.32435) * cos.powf(mix(0.19823, 0.16801)))
        + mix(-1.97760, -1.27393) * cos
        + mix(-4.32054, -4.85967);
    let h = (view + from).normalize();
    let d = (2.0 + 1.0 / alpha) * (1.0 - h.y * h.y).powf(0.5 / alpha) / TAU;
    let expected = 0.5 * d / ((1.0 + 2.0 * l.exp()) * 4.0 * cos);
    close(lit_from(velvet(0.0, 0.5, roughness), tilt, from), Vec3::splat(expected), 1e-4 * expected, "lobe");
    for roughness in [0.0, 0.2, 0.5, 1.0] {
        for tilt in [0.0, 0.8, 1.3, 1.5] {
            let sent = under_sky(velvet(1.0, 1.0, roughness), tilt, 256);
            // Noise, and the table's steps.
            let kept = sent.min_element() > 0.6 && sent.max_element() < 1.01;
            assert!(kept, "roughness {roughness}, tilt {tilt}: {sent}");
        }
    }
    assert!(under_sky(velvet(0.0, 1.0, 1.0), 0.0, 256).x > 0.1, "sheen alone shines");
}

/// Reflectance of a film on a base, from Airy's sum at single wavelengths.
fn airy(film_ior: f32, nm: f32, f0: f32, cos: f32) -> Vec3 {
    let cos_film = (1.0 - (1.0 - cos * cos) / (film_ior * film_ior)).sqrt();
    let base = (1.0 + f0.sqrt()) / (1.0 - f0.sqrt());
    let r12 = schlick(((film_ior - 1.0) / (film_ior + 1.0)).powi(2), cos).sqrt();
    let r23 = schlick(((base - film_ior) / (base + film_ior)).powi(2), cos_film).sqrt();
    // Amplitudes: a denser medium reflects with the opposite sign.
    let (r12, r23) = (-r12 as f64, if base < film_ior { r23 } else { -r23 } as f64);
    // Of twice the variance that the extension's notes state: so is their transform's exponent, −variance · phase².
    let gauss = |x: f64, middle: f64, variance: f64| (-(x - middle).powi(2) / (4.0 * variance)).exp() / 2f64.sqrt();
    let (mut xyz, mut white) = (DVec3::ZERO, DVec3::ZERO);
    for i in 0..4000 {
        // Waves per metre.
        let k = 1.2e6 + 1.6e6 * i as f64 / 4000.0;
        let phase = std::f64::consts::TAU * (2.0 * film_ior * nm * cos_film) as f64 * 1e-9 * k;
        let (a, b) = (r12 * r12 + r23 * r23, 2.0 * r12 * r23 * phase.cos());
        let reflected = (a + b) / (1.0 + r12 * r12 * r23 * r23 + b);
        let eye = DVec3::new(
            5.4856e-13 * gauss(k, 1.6810e6, 4.3278e9) + 9.7470e-14 * gauss(k, 2.2399e6, 4.5282e9),
            4.4201e-13 * gauss(k, 1.7953e6, 9.3046e9),
            5.2481e-13 * gauss(k, 2.2084e6, 6.6121e9),
        );
        xyz += eye * reflected;
        white += eye;
    }
    // The Gaussians' own white point maps only nearly to the renderer's white; the constant part bypasses them.
    let constant = {
        let (a, b) = (r12 * r12, r23 * r23);
        a + (1.0 - a) * (1.0 - a) * b / (1.0 - a * b)
    };
    let varying = (xyz - white * constant) * (1.6e6 / 4000.0) / 1.0685e-7;
    let rgb = DVec3::new(
        3.2404542 * varying.x - 1.5371385 * varying.y - 0.4985314 * varying.z,
        -0.9692660 * varying.x + 1.8760108 * varying.y + 0.0415560 * varying.z,
        0.0556434 * varying.x - 0.2040259 * varying.y + 1.0572252 * varying.z,
    );
    (rgb + constant).as_vec3().clamp(Vec3::ZERO, Vec3::ONE)
}

#[test]
fn iridescence_is_interference() {
    let filmed = |f0: f32, ior: f32, nm: f32| {
        let iridescence = Iridescence { factor: 1.0, ior, thickness_nm: [0.0, nm], ..Iridescence::default() };
        with(metal(f0, 0.0), Finish { iridescence, ..Finish::default() })
    };
    for tilt in [0.0f32, 0.7, 1.2] {
        let plain = under_sky(metal(0.3, 0.0), tilt, 4);
        close(under_sky(filmed(0.3, 1.4, 0.0), tilt, 4), plain, 1e-5, "no thickness");
        if tilt == 0.0 {
            // The least product of reflectances is 10⁻⁵, and its root 0.003; slanted, Schlick's formula lets even air
            // reflect.
            close(under_sky(filmed(0.3, 1.0, 400.0), tilt, 4), plain, 0.01, "a film of air");
        }
        for (f0, ior, nm) in [(0.04, 1.33, 250.0), (0.2, 1.5, 380.0), (0.6, 1.8, 550.0), (0.05, 1.9, 300.0)] {
            let found = under_sky(filmed(f0, ior, nm), tilt, 4);
            let expected = airy(ior, nm, f0, tilt.cos());
            // Orders of interference beyond the second, and channels out of gamut that are clamped before and after.
            let what = format!("f0 {f0}, film {ior}, {nm} nm, tilt {tilt}");
            close(found, expected, 0.02, &what);
        }
    }
    let colors = [200.0, 300.0, 400.0].map(|nm| under_sky(filmed(0.2, 1.5, nm), 0.0, 4));
    assert!(colors.iter().all(|c| c.max_element() - c.min_element() > 0.03), "films have colours: {colors:?}");
}

/// A lamp under glass, half covered: each channel sees its edge at the position of Snell's law.
#[test]
fn dispersion_refracts_each_channel_by_its_own_index() {
    let (ior, dispersion, tilt, edge) = (1.5f32, 8.0f32, 1.0f32, -0.65f32);
    let [red, green, blue] = [0, 1, 2].map(|channel| dispersed(ior, dispersion, channel));
    // Abbe's number, by its definition.
    assert!(((green - 1.0) / (blue - red) - 20.0 / dispersion).abs() < 1e-4 && green == ior);
    let glass = Material {
        metallic: 0.0,
        roughness: 0.0,
        specular: 0.0,
        transmission: 1.0,
        thickness: 1.0,
        ior,
        ..Material::default()
    };
    let mut scene = sheet(with(glass, Finish { dispersion, ..Finish::default() }));
    let lamp = scene.add_material(Material::lamp("lamp", Vec3::ONE));
    let mut mesh = level(-1.0, 50.0, lamp);
    mesh.positions.iter_mut().for_each(|p| p.x = p.x.min(edge));
    scene.add_mesh(mesh, DAffine3::IDENTITY);
    let half = 0.2;
    let found = traced(&scene, &above(tilt, half), 64, 64, Depth::Full);
    for (channel, ior) in [red, green, blue].into_iter().enumerate() {
        let sin = tilt.sin() / ior;
        let shift = sin / (1.0 - sin * sin).sqrt();
        // The view covers x from −wide to wide on the glass.
        let wide = half / tilt.cos();
        let lit = ((edge + shift + wide) / (2.0 * wide)).clamp(0.0, 1.0);
        assert!((0.05..0.95).contains(&lit), "the edge of channel {channel} is in view: {lit}");
        // Radiance within glass is n² times as high. Noise of 262,144 samples, a third of them per channel.
        let expected = lit / (ior * ior);
        assert!((found[channel] / expected - 1.0).abs() < 0.02, "{channel}: {found}, expected {expected}");
    }
}
