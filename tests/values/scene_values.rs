//! Textures, surfaces, cameras and bounds against values computed by hand.

use glam::{Affine2, DAffine3, DQuat, DVec3, Mat2, Vec2, Vec3, Vec4};
use twobounce::ground::grid::Grid;
use twobounce::scene::analytic;
use twobounce::scene::surface::{self, SurfacePoint, WorldFrame};
use twobounce::scene::texture::{ColorSpace, MipChain, Textures, linear_from_srgb, srgb_from_linear};
use twobounce::scene::{
    Alpha, Animation, Bounds, Channel, Interpolation, Material, Mesh, Mip, Projection, Property, Scene, Texture,
    TextureImage, TextureRef, Transform, View, Wrap,
};
use twobounce::settings::{Method, Settings};

const TRILINEAR: Texture =
    Texture { image: 0, wrap: [Wrap::Repeat; 2], mag_linear: true, min_linear: true, mip: Mip::Linear };

/// Grey values, opaque.
fn grey(width: u32, height: u32, values: &[u8]) -> TextureImage {
    let rgba = values.iter().flat_map(|&v| [v, v, v, 255]).collect();
    TextureImage { name: String::new(), width, height, rgba }
}

#[test]
fn srgb_is_exact_for_every_byte() {
    for byte in 0..=255u8 {
        let back = srgb_from_linear(linear_from_srgb(f32::from(byte) / 255.0));
        assert_eq!((back * 255.0).round() as u8, byte);
    }
    // IEC 61966-2-1 for the code 128, computed in f64; tolerance for f32 rounding.
    assert!((linear_from_srgb(128.0 / 255.0) - 0.215_860_5).abs() < 1e-6);
}

#[test]
fn mips_average_light_not_codes_and_alpha_linearly() {
    let image = TextureImage { name: String::new(), width: 2, height: 1, rgba: vec![0, 0, 0, 0, 255, 255, 255, 255] };
    // Half of the light has the sRGB code 188; half of the code is 128.
    assert_eq!(MipChain::new(&image, ColorSpace::Srgb).levels[1].rgba, [188, 188, 188, 128]);
    assert_eq!(MipChain::new(&image, ColorSpace::Linear).levels[1].rgba, [128; 4]);
}

#[test]
fn odd_sizes_lose_no_texel() {
    let chain = MipChain::new(&grey(5, 3, &[0, 0, 0, 0, 250, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]), ColorSpace::Linear);
    let sizes: Vec<_> = chain.levels.iter().map(|l| (l.width, l.height)).collect();
    assert_eq!(sizes, [(5, 3), (2, 1), (1, 1)]);
    // The last of five columns covers 2/5 of the right half, the first of three rows a third.
    assert_eq!([chain.levels[1].rgba[0], chain.levels[1].rgba[4]], [0, 33]);
    assert_eq!(chain.levels[2].rgba[0], 17);
}

#[test]
fn every_level_has_the_same_mean() {
    let values: Vec<u8> = (0..37 * 21u32).map(|i| (i.wrapping_mul(2654435761) >> 24) as u8).collect();
    let mean = |bytes: &[u8]| bytes.chunks(4).map(|t| f64::from(t[0])).sum::<f64>() / (bytes.len() / 4) as f64;
    let chain = MipChain::new(&grey(37, 21, &values), ColorSpace::Linear);
    for level in &chain.levels[1..] {
        // Each level is rounded once, by at most half a code.
        assert!((mean(&level.rgba) - mean(&chain.levels[0].rgba)).abs() <= 0.5, "{}×{}", level.width, level.height);
    }
}

#[test]
fn texels_are_found_in_every_wrap_mode() {
    let chain = MipChain::new(&grey(4, 1, &[0, 85, 170, 255]), ColorSpace::Linear);
    let at = |wrap: Wrap, texel: f32| {
        let nearest = Texture { wrap: [wrap; 2], mag_linear: false, ..TRILINEAR };
        (chain.sample(&nearest, Vec2::new((texel + 0.5) / 4.0, 0.5), 0.0).x * 3.0).round()
    };
    let row = |wrap: Wrap| [-5.0, -1.0, 0.0, 3.0, 4.0, 9.0].map(|texel| at(wrap, texel));
    assert_eq!(row(Wrap::Repeat), [3.0, 3.0, 0.0, 3.0, 0.0, 1.0]);
    assert_eq!(row(Wrap::Mirror), [3.0, 0.0, 0.0, 3.0, 3.0, 1.0]);
    assert_eq!(row(Wrap::Clamp), [0.0, 0.0, 0.0, 3.0, 3.0, 3.0]);
}

#[test]
fn filters_weigh_texels_and_levels() {
    let chain = MipChain::new(&grey(2, 2, &[0, 255, 0, 255]), ColorSpace::Linear);
    let sample = |texture: Texture, u: f32, level: f32| chain.sample(&texture, Vec2::new(u, 0.5), level).x;
    let nearest = Texture { mag_linear: false, min_linear: false, mip: Mip::Nearest, ..TRILINEAR };
    assert_eq!([0.25, 0.5, 0.75, 1.0].map(|u| sample(TRILINEAR, u, 0.0)), [0.0, 0.5, 1.0, 0.5]);
    assert_eq!([0.49, 0.51].map(|u| sample(nearest, u, 0.0)), [0.0, 1.0]);
    let half = 128.0 / 255.0;
    assert_eq!([0.4, 0.6, 9.0].map(|level| sample(nearest, 0.25, level)), [0.0, half, half]);
    assert_eq!([0.5, 1.0, 9.0].map(|level| sample(TRILINEAR, 0.25, level)), [0.5 * half, half, half]);
    assert_eq!(sample(Texture { mip: Mip::None, ..TRILINEAR }, 0.25, 9.0), 0.0);
}

#[test]
fn srgb_texels_are_decoded_before_they_are_filtered() {
    let chain = MipChain::new(&grey(2, 1, &[0, 255]), ColorSpace::Srgb);
    assert_eq!(chain.sample(&TRILINEAR, Vec2::new(0.5, 0.5), 0.0), Vec4::new(0.5, 0.5, 0.5, 1.0));
}

#[test]
fn a_texture_transform_changes_the_level() {
    let slot = |scale: f32| TextureRef {
        texture: 0,
        uv_set: 0,
        transform: Affine2::from_mat2(Mat2::from_diagonal(Vec2::splat(scale))),
    };
    let image = grey(64, 64, &[0; 64 * 64]);
    assert_eq!(slot(1.0).level(&image, 0.25), 4.0);
    assert_eq!(slot(2.0).level(&image, 0.25), 5.0);
    assert_eq!(slot(1.0).level(&image, 0.0), f32::NEG_INFINITY);
}

fn point() -> SurfacePoint {
    SurfacePoint { uvs: [Vec2::ZERO; 2], color: Vec4::ONE, footprint: [0.0; 2] }
}

/// A scene with one material and textures of one texel with these values.
fn textured(texels: &[[u8; 4]], make: impl Fn(&[TextureRef]) -> Material) -> (Scene, Textures) {
    let mut scene = Scene::empty("texels");
    let mut slots = Vec::new();
    for (i, texel) in texels.iter().enumerate() {
        scene.images.push(TextureImage { name: String::new(), width: 1, height: 1, rgba: texel.to_vec() });
        scene.textures.push(Texture { image: i, ..TRILINEAR });
        slots.push(TextureRef { texture: i, uv_set: 0, transform: Affine2::IDENTITY });
    }
    scene.add_material(make(&slots));
    let textures = Textures::of_materials(&scene, &scene.materials);
    (scene, textures)
}

#[test]
fn reflectance_follows_ior_specular_and_metallic() {
    let (scene, textures) =
        textured(&[], |_| Material { base_color: Vec4::new(0.5, 0.25, 1.0, 1.0), ..Material::default() });
    let params = |m: Material| m.evaluate(&scene, &textures, &point());
    let metal = params(scene.materials[1].clone());
    assert_eq!((metal.f0, metal.f90, metal.diffuse), (Vec3::new(0.5, 0.25, 1.0), 1.0, Vec3::ZERO));
    let plastic = Material { metallic: 0.0, ..scene.materials[1].clone() };
    let close = |a: Vec3, b: Vec3| assert!((a - b).abs().max_element() < 1e-6, "{a} is not {b}");
    close(params(plastic.clone()).f0, Vec3::splat(0.04));
    assert_eq!(params(plastic.clone()).diffuse, Vec3::new(0.5, 0.25, 1.0));
    let tinted = Material { specular: 0.5, specular_color: Vec3::new(1.0, 2.0, 100.0), ..plastic.clone() };
    // min(0.04 · colour, 1) · specular.
    close(params(tinted.clone()).f0, Vec3::new(0.02, 0.04, 0.5));
    assert_eq!(params(tinted).f90, 0.5);
    close(params(Material { ior: 0.0, ..plastic.clone() }).f0, Vec3::ONE);
    let half = params(Material { metallic: 0.5, ..plastic });
    close(half.f0, Vec3::new(0.27, 0.145, 0.52));
}

#[test]
fn textures_multiply_their_factors_channel_by_channel() {
    let texels = [[128, 128, 128, 51], [9, 102, 51, 9], [128, 128, 255, 255], [51, 9, 9, 9]];
    let (scene, textures) = textured(&texels, |t| Material {
        base_color: Vec4::new(1.0, 0.5, 0.0, 0.5),
        base_color_texture: Some(t[0]),
        metallic_roughness_texture: Some(t[1]),
        normal_texture: Some(t[2]),
        transmission: 0.5,
        transmission_texture: Some(t[3]),
        emissive: Vec3::splat(10.0),
        emissive_texture: Some(t[0]),
        alpha: Alpha::Blend,
        attenuation_color: Vec3::new(1.0, 0.5, 0.25),
        attenuation_distance: 2.0,
        ..Material::default()
    });
    let material = &scene.materials[1];
    let params =
        material.evaluate(&scene, &textures, &SurfacePoint { color: Vec4::new(0.5, 1.0, 1.0, 0.5), ..point() });
    let code128 = linear_from_srgb(128.0 / 255.0);
    assert_eq!(params.base_color, Vec3::new(0.5, 0.5, 0.0) * code128);
    assert_eq!(params.emissive, Vec3::splat(10.0) * code128);
    let close = |a: f32, b: f32| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
    close(params.opacity, 0.5 * 0.2 * 0.5);
    close(params.roughness, 0.4);
    close(params.metallic, 0.2);
    close(params.transmission, 0.5 * 0.2 * 0.8);
    // Half of the attenuation distance gives the square root of the colour.
    assert!((params.transmittance(1.0) - Vec3::new(1.0, 0.5f32.sqrt(), 0.5)).abs().max_element() < 1e-6);
    assert_eq!(params.transmittance(0.0), Vec3::ONE);
    // The code 128 is half a step above 0.
    assert!((params.normal_tangent - Vec3::Z).length() < 0.006);
}

#[test]
fn alpha_modes_and_sides() {
    assert_eq!([0.49, 0.5].map(|a| Alpha::Mask(0.5).opacity(a)), [0.0, 1.0]);
    assert_eq!([Alpha::Opaque, Alpha::Blend].map(|alpha| alpha.opacity(0.25)), [1.0, 0.25]);
    for alpha in [Alpha::Opaque, Alpha::Mask(0.3), Alpha::Mask(0.1), Alpha::Blend] {
        let (scene, textures) =
            textured(&[[0, 0, 0, 51]], |t| Material { alpha, base_color_texture: Some(t[0]), ..Material::default() });
        let material = &scene.materials[1];
        let quick = material.opacity(&scene, &textures, &point());
        assert_eq!(quick, material.evaluate(&scene, &textures, &point()).opacity);
    }
    let single = Material::default();
    let double = Material { double_sided: true, ..Material::default() };
    assert_eq!(
        [single.shows(true), single.shows(false), double.shows(true), double.shows(false)],
        [true, false, true, true]
    );
}

#[test]
fn mirrored_instances_keep_outward_normals_and_their_bitangent() {
    let mirror = DAffine3::from_scale(DVec3::new(-2.0, 1.0, 1.0));
    let frame = WorldFrame::new(&mirror);
    let slope = Vec3::new(1.0, 1.0, 0.0).normalize();
    // x is mirrored and scaled by 2: the normal of a slope becomes (−½, 1, 0).
    assert!((frame.normal(slope) - Vec3::new(-0.5, 1.0, 0.0).normalize()).length() < 1e-6);
    let (normal, tangent) = (frame.normal(Vec3::Z), frame.tangent(Vec4::new(1.0, 0.0, 0.0, 1.0)));
    assert_eq!((normal, tangent, frame.winding), (Vec3::Z, Vec4::new(-1.0, 0.0, 0.0, -1.0), -1.0));
    // The bitangent of the unmirrored frame is +y; mirroring x does not change it.
    assert_eq!(surface::shading_normal(normal, tangent, Vec3::Y), Vec3::Y);
}

#[test]
fn light_falloffs_end_where_the_extension_says() {
    assert_eq!([0.0, 2.0, 3.0].map(|d| surface::range_window(d, 2.0)), [1.0, 0.0, 0.0]);
    assert_eq!(surface::range_window(1.0, 2.0), 1.0 - 1.0 / 16.0);
    assert_eq!(surface::range_window(1e9, f32::INFINITY), 1.0);
    let [inner, outer] = [0.2f32, 0.6];
    assert_eq!([0.1f32, 0.7].map(|angle| surface::spot_falloff(angle.cos(), inner, outer)), [1.0, 0.0]);
    let middle = 0.5 * (inner.cos() + outer.cos());
    assert!((surface::spot_falloff(middle, inner, outer) - 0.25).abs() < 1e-6);
}

#[test]
fn framing_shows_every_corner() {
    let bounds = Bounds { min: DVec3::new(1e7, -3.0, 2.0), max: DVec3::new(1e7 + 5.0, -2.0, 40.0) };
    let view = View::framing(bounds);
    let Projection::Perspective { fov, near, .. } = view.projection else { panic!("not perspective") };
    let limit = f64::from(0.5 * fov).tan();
    for corner in 0..8 {
        let pick = |bit: i32, lo: f64, hi: f64| if corner >> bit & 1 == 0 { lo } else { hi };
        let (min, max) = (bounds.min, bounds.max);
        let p = DVec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z)) - view.eye;
        let depth = p.dot(view.forward);
        assert!(depth > f64::from(near));
        assert!(p.dot(view.up).abs() <= depth * limit && p.dot(view.right()).abs() <= depth * limit);
    }
    assert!(View::framing(Bounds::EMPTY).eye.is_finite());
}

#[test]
fn views_survive_degenerate_input() {
    for (eye, target, up) in
        [(DVec3::Y, DVec3::ZERO, DVec3::Y), (DVec3::ZERO, DVec3::ZERO, DVec3::Y), (DVec3::Z, DVec3::ZERO, DVec3::ZERO)]
    {
        let view = View::look_at(eye, target, up, 1.0);
        let axes = [view.forward, view.up, view.right()];
        assert!(axes.iter().all(|a| (a.length() - 1.0).abs() < 1e-12), "{axes:?}");
        assert!(view.forward.dot(view.up).abs() < 1e-12);
    }
    let sheared = DAffine3 { matrix3: glam::DMat3::from_diagonal(DVec3::new(3.0, 0.5, -2.0)), translation: DVec3::X };
    let view = View::from_node(sheared, Projection::Orthographic { half_height: 1.0, near: 0.0, far: 1.0 });
    assert_eq!((view.eye, view.forward, view.up), (DVec3::X, DVec3::Z, DVec3::Y));
}

#[test]
fn a_camera_added_from_a_view_sees_that_view() {
    let view = View::look_at(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-4.0, 0.5, 0.0), DVec3::Y, 0.7);
    let mut scene = Scene::empty("view");
    let camera = scene.add_camera(&view);
    let seen = scene.view(&scene.pose(None, 0.0), camera);
    for (a, b) in [(seen.eye, view.eye), (seen.forward, view.forward), (seen.up, view.up)] {
        assert!((a - b).length() < 1e-14);
    }
}

#[test]
fn scenes_tell_whether_they_have_light() {
    let mut scene = Scene::empty("dark");
    let grey = scene.add_material(Material::lambert("grey", Vec3::splat(0.5)));
    scene.add_mesh(Mesh::quad("quad", grey, Vec3::ZERO, Vec3::X, Vec3::Y), DAffine3::IDENTITY);
    assert!(!scene.has_light());
    let (view, bounds) = (View::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 1.0), scene.bounds(None));
    scene.add_studio(&view, bounds, false);
    assert!(scene.has_light() && scene.instances.len() == 1);
    assert!(Scene { sky: Vec3::ONE, ..Scene::default() }.has_light());
    assert!(analytic::furnace(0.5, 1.0, false).has_light());
}

/// The longer side takes two thirds of the image, and its middle is the image's.
#[test]
fn a_view_that_is_filled_is_filled_to_two_thirds() {
    let tall = [DVec3::new(1.0, 0.0, 2.0), DVec3::new(1.2, 5.0, 2.0), DVec3::new(0.7, 3.0, 1.0)];
    let wide = [DVec3::new(-9.0, 0.0, 0.0), DVec3::new(7.0, 0.3, -3.0), DVec3::new(1.0, 2.0, 4.0)];
    for (points, aspect) in [(tall, 1.5), (wide, 1.5), (wide, 0.5), (tall.map(|p| p * 1e-4), 1.0)] {
        let view = View::filling(&points, 0.7, aspect).unwrap();
        let half = (0.5f64 * 0.7f32 as f64).tan();
        let seen = points.map(|p| {
            let to = p - view.eye;
            let ahead = to.dot(view.forward) * half;
            assert!(ahead > 0.0);
            [to.dot(view.right()) / ahead / aspect, to.dot(view.up) / ahead]
        });
        let ways = [0, 1]
            .map(|axis| seen.iter().fold((1e9f64, -1e9f64), |(low, high), p| (low.min(p[axis]), high.max(p[axis]))));
        assert!(ways.iter().all(|(low, high)| low.max(-*high) > -1.0 && high - low < 4.0 / 3.0 + 1e-9), "{ways:?}");
        let is_filled = |(low, high): &(f64, f64)| (high - 2.0 / 3.0).abs().max((low + 2.0 / 3.0).abs()) < 1e-9;
        assert!(ways.iter().any(is_filled), "{ways:?}");
    }
    assert!(View::filling(&[], 0.7, 1.0).is_none() && View::filling(&[DVec3::ONE], 0.7, 1.0).is_none());
}

/// The volume inside outward triangles (divergence theorem).
fn volume(mesh: &Mesh) -> f64 {
    let corner = |i: u32| mesh.positions[i as usize].as_dvec3();
    mesh.indices.chunks(3).map(|t| corner(t[0]).dot(corner(t[1]).cross(corner(t[2]))) / 6.0).sum()
}

#[test]
fn boxes_are_closed_and_their_normals_follow_their_winding() {
    let cube = |inward| Mesh::cuboid("cube", 0, Vec3::splat(-1.0), Vec3::new(1.0, 2.0, 3.0), inward);
    assert_eq!([volume(&cube(false)), volume(&cube(true))], [24.0, -24.0]);
    for mesh in [cube(false), cube(true)] {
        for t in mesh.indices.chunks(3) {
            let [a, b, c] = [0, 1, 2].map(|i| mesh.positions[t[i] as usize]);
            assert!(t.iter().all(|&i| mesh.normals[i as usize].dot((b - a).cross(c - a)) > 0.0));
        }
    }
}

#[test]
fn the_grid_leaves_its_margin_about_the_longest_side() {
    let bounds = Bounds { min: DVec3::new(1.0, 2.0, 3.0), max: DVec3::new(3.0, 13.0, 6.0) };
    let mut settings = Settings { voxels: 16, ..Settings::default() };
    settings.grid.margin = 2.5;
    let grid = Grid::place(bounds, &settings).expect("a grid");
    // Eleven metres are eleven voxels of sixteen.
    assert!((grid.voxel_m - 1.0).abs() < 1e-12, "{}", grid.voxel_m);
    assert!((grid.corner - DVec3::new(-6.0, -0.5, -3.5)).length() < 1e-12, "{}", grid.corner);
    // A cube that does not hold the scene: with rays a larger cube does, which contains the first one's voxels.
    settings.grid.side = Some(8.0);
    let grid = Grid::place(bounds, &settings).expect("a grid");
    assert_eq!((grid.boxes, grid.voxel_m, grid.finest_m()), (1, 2.0, 0.5));
    settings.method = Method::Cones;
    let grid = Grid::place(bounds, &settings).expect("a grid");
    assert_eq!((grid.boxes, grid.voxel_m), (0, 0.5));
}

#[test]
fn degenerate_triangles_are_counted_not_dropped() {
    let mut scene = Scene::empty("flat");
    let line = [Vec3::ZERO, Vec3::X, 2.0 * Vec3::X];
    scene.add_mesh(Mesh::triangles("two", 0, &[line, [Vec3::ZERO, Vec3::X, Vec3::Y]]), DAffine3::IDENTITY);
    scene.add_mesh(
        Mesh::quad("crushed", 0, Vec3::ZERO, Vec3::X, Vec3::Y),
        DAffine3::from_scale(DVec3::new(1.0, 0.0, 1.0)),
    );
    let far = DAffine3::from_rotation_translation(DQuat::from_rotation_y(1.0), DVec3::splat(1e7));
    scene.add_mesh(Mesh::quad("far", 0, Vec3::ZERO, 1e-3 * Vec3::X, 1e-3 * Vec3::Y), far);
    assert_eq!((scene.triangle_count(), scene.degenerate_triangles(&scene.pose(None, 0.0))), (6, 3));
}

#[test]
fn long_animations_of_large_meshes_are_bounded_quickly() {
    let mut scene = Scene::empty("long");
    let triangles: Vec<[Vec3; 3]> =
        (0..30_000).map(|i| [0.0, 1.0, 2.0].map(|z| Vec3::new(i as f32 / 30_000.0, 0.5, z))).collect();
    scene.add_mesh(Mesh::triangles("many", 0, &triangles), DAffine3::IDENTITY);
    scene.nodes[0].local = Transform::Trs { translation: DVec3::ZERO, rotation: DQuat::IDENTITY, scale: DVec3::ONE };
    let times: Vec<f32> = (0..5000).map(|i| i as f32).collect();
    let values = times.iter().map(|t| Vec4::Y * *t).collect();
    let channel =
        Channel { node: 0, times, property: Property::Translation, values, interpolation: Interpolation::Linear };
    scene.animations.push(Animation {
        name: "up".into(),
        duration: 4999.0,
        channels: vec![channel],
        ..Animation::default()
    });
    let expected =
        Bounds { min: DVec3::new(0.0, 0.5, 0.0), max: DVec3::new(f64::from(29_999f32 / 30_000.0), 4999.5, 2.0) };
    assert_eq!(scene.bounds(Some(0)), expected);
}
