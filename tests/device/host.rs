//! The library within a host, by its public names alone: outputs in the host's images, layers, growth, changes,
//! refusals.

use crate::vk_common;

use glam::{DAffine3, DVec3, Vec3, Vec4};
use half::f16;
use twobounce::Error;
use twobounce::ash::vk;
use twobounce::host::{
    Aov, Context, Counters, Growth, HostDevice, HostImage, ImageUse, LayerImage, Output, Prepare, Prepared, Shot,
};
use twobounce::output::display::srgb_code;
use twobounce::scene::{LightKind, Material, Mesh, Pose, Scene};
use twobounce::settings::Settings;
use vk_common::images::TestImage;
use vk_common::prepared::{SIZE, Setup, rendered, room, settings};

fn image_use(stages: vk::PipelineStageFlags2, access: vk::AccessFlags2, layout: vk::ImageLayout) -> ImageUse {
    ImageUse { stages, access, layout }
}

/// The difference of two halves in units in the last place.
fn half_steps(a: u16, b: u16) -> i32 {
    assert!(f16::from_bits(a).is_sign_positive() && f16::from_bits(b).is_sign_positive());
    (i32::from(a) - i32::from(b)).abs()
}

#[test]
fn a_hosts_images_take_radiance_in_many_formats() {
    let settings = settings(&[]);
    let mut setup = Setup::new(room(), &settings, &[]);
    let expected = rendered(&setup, &settings, &[], SIZE).beauty().concat();
    for (format, bytes) in [
        (vk::Format::R32G32B32A32_SFLOAT, 16),
        (vk::Format::R16G16B16A16_SFLOAT, 8),
        (vk::Format::R8G8B8A8_UNORM, 4),
        (vk::Format::B8G8R8A8_SRGB, 4),
    ] {
        // The second level of the third layer; the host drew into it last and samples it next.
        let image = TestImage::new(&setup.host, format, (2 * SIZE.0, 2 * SIZE.1));
        let (device, buffer) = (setup.host.device.clone(), TestImage::readback(&setup.host, SIZE.0 * SIZE.1 * bytes));
        let sampled = (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_READ);
        let output = HostImage {
            image: image.image,
            format,
            size: SIZE,
            level: 1,
            layer: 2,
            before: image_use(vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED),
            after: image_use(sampled.0, sampled.1, vk::ImageLayout::GENERAL),
        };
        let output = setup.prepared.output(Aov::Beauty, output).expect("a format that is listed");
        let from = (image.image, vk::ImageLayout::GENERAL);
        setup.draw(&[output], |commands| buffer.copy(&device, commands, from, SIZE, (1, 2)));
        let channels = || (0..(SIZE.0 * SIZE.1) as usize).flat_map(|pixel| (0..3).map(move |c| (pixel, c)));
        match format {
            vk::Format::R32G32B32A32_SFLOAT => {
                let found = buffer.read::<[f32; 4]>(&setup.host);
                assert!(channels().zip(&expected).all(|((p, c), e)| found[p][c].to_bits() == e.to_bits()), "a copy");
            }
            vk::Format::R16G16B16A16_SFLOAT => {
                let found = buffer.read::<[u16; 4]>(&setup.host);
                let steps =
                    channels().zip(&expected).map(|((p, c), e)| half_steps(found[p][c], f16::from_f32(*e).to_bits()));
                assert!(steps.max() <= Some(1), "rounded to a neighbour");
            }
            _ => {
                // Both conversions round to the nearest code; a driver's sRGB curve may be half a code off.
                let srgb = format == vk::Format::B8G8R8A8_SRGB;
                let found = buffer.read::<[u8; 4]>(&setup.host);
                let code = |e: f32| if srgb { srgb_code(e) } else { (e.clamp(0.0, 1.0) * 255.0).round() as u8 };
                let place = |c: usize| if srgb { 2 - c } else { c };
                let steps = channels().zip(&expected).map(|((p, c), e)| found[p][place(c)].abs_diff(code(*e)));
                assert!(steps.max() <= Some(1), "{format:?}");
                assert!(found.iter().any(|texel| texel[1] > 40), "{format:?} is not black");
            }
        }
        image.destroy(&setup.host);
        buffer.destroy(&setup.host);
    }
    setup.close();
}

#[test]
fn layers_are_handed_out_as_images() {
    let settings = settings(&[]);
    let aovs = [Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Ao, Aov::Indirect];
    let mut setup = Setup::new(room(), &settings, &aovs);
    let expected = rendered(&setup, &settings, &aovs, SIZE);
    for aov in [Aov::Beauty, Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Ao, Aov::Indirect] {
        let LayerImage { channel, format, size, view, .. } = setup.prepared.layer(aov).expect("prepared");
        assert!(format == vk::Format::R32G32B32A32_SFLOAT && size == SIZE && view != vk::ImageView::null());
        let found = setup.texels(aov);
        for (i, (texel, pixel)) in found.iter().zip(expected.get(aov).expect("a layer")).enumerate() {
            let found = channel.map_or([texel[0], texel[1], texel[2]], |channel| [texel[channel]; 3]);
            assert_eq!(found.map(f32::to_bits), pixel.map(f32::to_bits), "{}, pixel {i}", aov.name());
        }
    }
    setup.close();
    let setup = Setup::new(room(), &settings, &[]);
    assert!(setup.prepared.layer(Aov::Depth).is_none() && setup.prepared.layer(Aov::Beauty).is_some());
    setup.close();
}

/// Flat boxes unfold after the scene was prepared: its lists become larger than the first pose suggested.
#[test]
fn what_unfolds_is_told_and_grows() {
    let mut scene = room();
    for i in 0..6 {
        let reach = Vec3::splat(1.9 - 0.1 * i as f32);
        let mesh = Mesh::cuboid("shell", 1, -reach, reach, false);
        let flat =
            DAffine3::from_scale_rotation_translation(DVec3::splat(1e-3), glam::DQuat::IDENTITY, DVec3::splat(2.0));
        scene.add_mesh(mesh, flat);
    }
    let settings = settings(&["voxels=64"]);
    let mut setup = Setup::new(scene, &settings, &[]);
    assert!(setup.poll().is_none() && setup.counters().is_none(), "nothing was recorded");
    setup.draw(&[], |_| ());
    assert!(setup.poll().is_none(), "what was expected fits");
    let shells = &mut setup.pose.world_from_instance[2..];
    shells.iter_mut().for_each(|place| *place = DAffine3::from_translation(DVec3::splat(2.0)));
    setup.draw(&[], |_| ());
    // Lists that were too small for triangles did not yet tell the size that their voxels need.
    let (mut grown, mut found) = (0, Vec::new());
    while let Some(growth) = setup.poll() {
        setup.grow(growth);
        assert!(setup.poll().is_none(), "nothing was recorded since");
        found = setup.texels(Aov::Beauty);
        grown += 1;
    }
    assert!((1..4).contains(&grown), "grown {grown} times");
    assert!(setup.counters().expect("a frame").list_items > 1 << 16);
    let expected = rendered(&setup, &settings, &[], SIZE);
    assert!(found.iter().zip(expected.beauty()).all(|(a, b)| a[..3] == b[..]));
    setup.close();
}

/// Surfaces that a renderer draws of a Lambertian scene are given back as a host's: they get equal light.
#[test]
fn surfaces_that_the_host_drew_get_the_same_light() {
    for method in ["method=rays", "method=cones", "method=photons", "method=lpv", "method=none"] {
        let settings =
            settings(&[method, "image.interleave=1", "image.gather_resolution=full", "lights.lamp_points=16"]);
        let mut scene = room();
        let lamp = scene.add_material(twobounce::scene::Material::lamp("lamp", Vec3::splat(3.0)));
        let square = Mesh::quad("lamp", lamp, Vec3::new(2.5, 3.9, 1.0), Vec3::X, Vec3::Z);
        scene.add_mesh(square, DAffine3::IDENTITY);
        let aovs = [Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Direct, Aov::Indirect];
        let mut setup = Setup::new(scene, &settings, &aovs);
        let expected = rendered(&setup, &settings, &aovs, SIZE);
        let bounds = setup.scene.bounds(None);
        let prepare = Prepare { layers: aovs.to_vec(), given: true, ..Prepare::new(SIZE, bounds) };
        setup.change(&settings, &prepare);
        let found = setup.given_light(None);
        for (aov, found) in [Aov::Direct, Aov::Indirect].into_iter().zip(&found) {
            let expected = expected.get(aov).expect("a layer");
            // The lamp's emission is in the image; of a host's surface only the reflected light is known.
            let lit = |i: &usize| expected[*i][0] < 2.9;
            assert_eq!(found[0], [0.0; 4], "no surface");
            let pixels: Vec<usize> = (1..expected.len()).filter(lit).collect();
            let sum = |light: &dyn Fn(usize) -> f32| pixels.iter().map(|&i| f64::from(light(i))).sum::<f64>();
            let (a, b) = (sum(&|i| found[i][1]), sum(&|i| expected[i][1]));
            // Points are computed from depths instead of triangles: rounding moves a few rays and cones over an edge.
            assert!((a - b).abs() <= 5e-3 * b, "{method}, {}: {a} instead of {b}", aov.name());
            let off =
                pixels.iter().filter(|&&i| (found[i][1] - expected[i][1]).abs() > 0.02 * expected[i][1].abs() + 1e-5);
            let off = off.count();
            assert!(off * 20 <= pixels.len(), "{method}, {}: {off} of {} pixels", aov.name(), pixels.len());
            assert!((aov == Aov::Indirect && method == "method=none") || b > 1.0, "{method}: {b}");
        }
        // The host's passes over an image all draw alike: passes differ in their rays alone, which also start on the
        // surface.
        let sum = |light: &[[f32; 4]]| light.iter().map(|texel| f64::from(texel[1])).sum::<f64>();
        for pass in 1..5 {
            setup.pass = pass;
            let [direct, _] = setup.given_light(None);
            let (first, later) = (sum(&found[0]), sum(&direct));
            assert!((first - later).abs() < 0.02 * first, "{method}: {later} in pass {pass}, {first} in the first");
        }
        setup.close();
    }
}

/// Metal, a mirror and a glossy floor that a renderer draws are given back as a host's: their reflections are equal,
/// with each method.
#[test]
fn glossy_surfaces_that_the_host_drew_mirror_the_same() {
    // Roughness, metallic and specular by the base colour's green.
    let materials = [(0.6, [0.9, 0.0, 0.5]), (0.7, [0.1, 0.0, 1.0]), (0.8, [0.0, 1.0, 1.0]), (0.5, [0.4, 1.0, 1.0])];
    for method in ["method=rays", "method=cones", "method=photons", "method=lpv", "method=none"] {
        let settings = settings(&[
            method,
            "image.interleave=1",
            "image.gather_resolution=full",
            "lights.lamp_points=16",
            "rays.glossy=64",
        ]);
        let mut scene = Scene::empty("glossy room");
        let mut of = |green: f32, [roughness, metallic, specular]: [f32; 3]| {
            let base_color = Vec4::new(0.6, green, 0.6, 1.0);
            scene.add_material(Material {
                base_color,
                roughness,
                metallic,
                specular,
                double_sided: true,
                ..Material::default()
            })
        };
        let [walls, floor, mirror, metal] = materials.map(|(green, material)| of(green, material));
        let lamp = scene.add_material(Material::lamp("lamp", Vec3::splat(3.0)));
        let boxed = |name, material, low, high, inward| Mesh::cuboid(name, material, low, high, inward);
        for mesh in [
            boxed("walls", walls, Vec3::ZERO, Vec3::splat(4.0), true),
            boxed("mirror", mirror, Vec3::splat(1.0), Vec3::splat(2.2), false),
            boxed("metal", metal, Vec3::new(0.2, 0.2, 2.4), Vec3::new(1.2, 1.0, 3.4), false),
            Mesh::quad("floor", floor, Vec3::new(0.0, 0.01, 4.0), Vec3::X * 4.0, Vec3::Z * -4.0),
            Mesh::quad("lamp", lamp, Vec3::new(2.5, 3.9, 1.0), Vec3::X, Vec3::Z),
        ] {
            scene.add_mesh(mesh, DAffine3::IDENTITY);
        }
        scene.add_light(LightKind::Point, Vec3::splat(8.0), DAffine3::from_translation(DVec3::new(3.0, 3.0, 3.0)));
        let aovs = [Aov::Normal, Aov::Depth, Aov::Albedo, Aov::Direct, Aov::Indirect];
        let mut setup = Setup::new(scene, &settings, &aovs);
        let expected = rendered(&setup, &settings, &aovs, SIZE);
        let prepare = Prepare { layers: aovs.to_vec(), given: true, ..Prepare::new(SIZE, setup.scene.bounds(None)) };
        setup.change(&settings, &prepare);
        let seen = |texel: [f32; 4]| materials.iter().find(|(green, _)| (green - texel[1]).abs() < 1e-3);
        let albedo: Vec<[f32; 3]> = expected.get(Aov::Albedo).expect("a layer").to_vec();
        let material = |texel: [f32; 4]| seen(texel).map_or([1.0, 0.0, 1.0], |(_, material)| *material);
        let found = setup.given_light(Some(&material));
        for (aov, found) in [Aov::Direct, Aov::Indirect].into_iter().zip(&found) {
            let expected = expected.get(aov).expect("a layer");
            for (green, [roughness, metallic, _]) in materials {
                // Pixels of one material alone; at edges the host knows one of two surfaces.
                let pixels: Vec<usize> = (1..expected.len()).filter(|&i| (albedo[i][1] - green).abs() < 1e-3).collect();
                let sum = |light: &dyn Fn(usize) -> f32| pixels.iter().map(|&i| f64::from(light(i))).sum::<f64>();
                let (a, b) = (sum(&|i| found[i][0]), sum(&|i| expected[i][0]));
                let words = format!("{method}, {} of roughness {roughness}, metallic {metallic}", aov.name());
                assert!(pixels.len() > 10, "{words}: {} pixels", pixels.len());
                assert!((a - b).abs() <= 0.02 * b + 1e-4, "{words}: {a} instead of {b}");
                let off = |i: &&usize| (found[**i][0] - expected[**i][0]).abs() > 0.05 * expected[**i][0].abs() + 1e-4;
                let off = pixels.iter().filter(off).count();
                // A metal's rays depend on its position, whose last bits differ.
                assert!(off * 8 <= pixels.len() || roughness == 0.4, "{words}: {off} of {} pixels", pixels.len());
            }
        }
        setup.close();
    }
}

#[test]
fn passes_are_timed_where_that_was_asked_for() {
    let mut setup = Setup::new(room(), &settings(&[]), &[]);
    setup.draw(&[], |_| ());
    assert_eq!(setup.prepared.timings(0).expect("a device"), None);
    let (scene, pose) = (&setup.scene, &setup.pose);
    let prepare = Prepare { timestamps: true, ..Prepare::new(SIZE, scene.bounds(None)) };
    setup.prepared = Prepared::new(&setup.context, scene, pose, &settings(&[]), &prepare).expect("it fits");
    assert_eq!(setup.prepared.timings(0).expect("a device"), None, "nothing was recorded");
    setup.draw(&[], |_| ());
    let timings = setup.prepared.timings(0).expect("a device").expect("a frame");
    let image = timings.zones.iter().find(|zone| zone.name == "image").expect("a pass");
    assert!(timings.zones.len() > 5 && image.gpu_ms > 0.0 && image.gpu_ms < timings.gpu_ms);
    assert!(setup.counters().expect("a frame").triangles == 24, "two boxes");
    setup.close();
}

#[test]
fn a_light_that_moves_and_a_sky_that_dims_show_at_once() {
    let settings = settings(&["method=cones", "image.interleave=1"]);
    let mut scene = room();
    scene.sky = Vec3::splat(0.2);
    let mut setup = Setup::new(scene, &settings, &[]);
    let before = setup.texels(Aov::Beauty);
    setup.scene.lights[0].intensity *= 0.25;
    setup.pose.lights[0].position.x -= 1.5;
    setup.scene.sky *= 0.5;
    let found = setup.texels(Aov::Beauty);
    let expected = rendered(&setup, &settings, &[], SIZE);
    assert!(found.iter().zip(expected.beauty()).all(|(a, b)| a[..3] == b[..]));
    assert!(found != before, "it shows");
    setup.close();
}

/// With all bounces each frame continues from the light of the one before, until it settles.
#[test]
fn light_of_all_bounces_settles_over_frames() {
    let settings = settings(&["method=cones", "image.interleave=1", "bounces=all"]);
    let mut setup = Setup::new(room(), &settings, &[]);
    let sum = |texels: &[[f32; 4]]| texels.iter().flat_map(|t| &t[..3]).map(|&v| f64::from(v)).sum::<f64>();
    let first = setup.texels(Aov::Beauty);
    (0..24).for_each(|_| setup.draw(&[], |_| ()));
    let last = sum(&setup.texels(Aov::Beauty));
    // The renderer's frames settle within 10⁻³ of all light.
    let expected = rendered(&setup, &settings, &[], SIZE);
    let expected: f64 = expected.beauty().iter().flatten().map(|&v| f64::from(v)).sum();
    assert!((last / expected - 1.0).abs() < 5e-3, "{last} instead of {expected}");
    assert!(sum(&first) < 0.98 * last, "{} at first, then {last}", sum(&first));
    setup.prepared.forget_light();
    assert!(setup.texels(Aov::Beauty) == first, "from nothing again");
    setup.close();
}

#[test]
fn a_change_of_size_is_as_if_prepared_anew() {
    let first = settings(&[]);
    let mut setup = Setup::new(room(), &first, &[]);
    setup.draw(&[], |_| ());
    let second = settings(&["rays.diffuse=3", "image.samples=4"]);
    let prepare = Prepare { layers: vec![Aov::Normal], ..Prepare::new(SIZE, setup.scene.bounds(None)) };
    setup.change(&second, &prepare);
    let found = setup.texels(Aov::Beauty);
    let expected = rendered(&setup, &second, &[Aov::Normal], SIZE);
    assert!(found.iter().zip(expected.beauty()).all(|(a, b)| a[..3] == b[..]));
    let larger = Prepare { size: (40, 30), ..prepare };
    setup.change(&second, &larger);
    assert_eq!(setup.prepared.layer(Aov::Beauty).expect("prepared").size, (40, 30));
    setup.close();
}

#[test]
fn what_cannot_be_is_refused_in_one_sentence() {
    let setup = Setup::new(room(), &settings(&[]), &[]);
    let image = |format, size| {
        let any = ImageUse::default();
        HostImage { image: vk::Image::null(), format, size, level: 0, layer: 0, before: any, after: any }
    };
    let refused = |layer, image| {
        let message = setup.prepared.output(layer, image).expect_err("refused").to_string();
        assert!(!message.contains('\n') && !message.contains(". "), "one sentence: {message}");
        message
    };
    let float = vk::Format::R16G16B16A16_SFLOAT;
    assert!(refused(Aov::Beauty, image(float, (24, 17))).contains("24x17 does not fit a frame of 24x16"));
    assert!(refused(Aov::Beauty, image(vk::Format::R8G8B8A8_UINT, SIZE)).contains("HostImage::FORMATS"));
    assert!(refused(Aov::Beauty, image(vk::Format::D32_SFLOAT, SIZE)).contains("D32_SFLOAT"));
    assert!(refused(Aov::Depth, image(float, SIZE)).contains("depth was not prepared: name it in Prepare::layers"));
    let inputs = setup.prepared.inputs(image(float, SIZE), image(float, SIZE), image(float, SIZE), None).map(drop);
    assert!(inputs.unwrap_err().to_string().contains("set Prepare::given"));
    let light = setup.prepared.given_output(Aov::Direct, image(float, SIZE)).map(drop);
    assert!(light.unwrap_err().to_string().contains("set Prepare::given"));
    let bounds = setup.scene.bounds(None);
    let little = Prepare { memory_limit: Some(1 << 16), ..Prepare::new(SIZE, bounds) };
    let refused = Prepared::new(&setup.context, &setup.scene, &setup.pose, &settings(&[]), &little).map(drop);
    assert!(matches!(&refused, Err(Error::Memory(_))), "{refused:?}");
    let empty = Prepare::new((24, 0), bounds);
    let refused = Prepared::new(&setup.context, &setup.scene, &setup.pose, &settings(&[]), &empty).map(drop);
    assert!(refused.unwrap_err().to_string().contains("24x0 has no pixels"));
    // The host enabled the required features, which geometry shaders are not.
    let talk = settings(&["grid.conservative=geometry-shader"]);
    let whole = Prepare::new(SIZE, setup.scene.bounds(None));
    let refused = Prepared::new(&setup.context, &setup.scene, &setup.pose, &talk, &whole).map(drop).unwrap_err();
    assert!(refused.to_string().contains("needs geometry shaders") && refused.to_string().contains("to compute"));
    assert_eq!(setup.host.missing(), Vec::<String>::new(), "this device has everything");
    assert!(setup.host.missing_with(vk::API_VERSION_1_1).contains(&"Vulkan 1.2".to_owned()));
    setup.close();
}

#[test]
fn everything_goes_to_other_threads() {
    fn send<T: Send>() {}
    fn sync<T: Sync>() {}
    let _: [fn(); 11] = [
        send::<Prepared>,
        send::<Context>,
        send::<HostDevice<'static>>,
        send::<Output>,
        send::<LayerImage>,
        send::<Growth>,
        send::<Counters>,
        send::<Prepare>,
        send::<Scene>,
        send::<Shot<'static>>,
        send::<Error>,
    ];
    let _: [fn(); 4] = [sync::<Context>, sync::<Scene>, sync::<Pose>, sync::<Settings>];
}
