//! The reference against analytic results.

use std::f32::consts::{FRAC_PI_2, PI};

use crate::traced::film;
use glam::{DAffine3, DVec3, Vec3, Vec4};
use twobounce::layers::{Aov, Layers};
use twobounce::reference::{Depth, Options, Stop};
use twobounce::scene::{Alpha, Bounds, LightKind, Material, Mesh, Projection, Scene, Transform, View};

/// A scene under construction.
struct Built(Scene);

impl Built {
    fn new() -> Self {
        Self(Scene::empty("built"))
    }

    fn mesh(mut self, triangles: &[[Vec3; 3]], material: Material) -> Self {
        let material = self.0.add_material(material);
        self.0.add_mesh(Mesh::triangles("triangles", material, triangles), DAffine3::IDENTITY);
        self
    }

    /// A light at `at` that shines down.
    fn light(mut self, kind: LightKind, intensity: f32, at: DVec3) -> Self {
        let down = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        self.0.add_light(kind, Vec3::splat(intensity), DAffine3::from_translation(at) * down);
        self
    }

    fn sky(mut self, radiance: f32) -> Self {
        self.0.sky = Vec3::splat(radiance);
        self
    }

    fn render(&self, view: &View, size: u32, samples: u32, depth: Depth) -> Layers {
        let stop = Stop::Samples(samples);
        let options = Options { width: size, height: size, depth, stop, seed: 0, occlusion: true };
        film(&self.0, view, &options).layers(&[Aov::Direct, Aov::Ao, Aov::Depth])
    }

    fn mean(&self, view: &View, size: u32, samples: u32, depth: Depth) -> f32 {
        mean(&self.render(view, size, samples, depth), Aov::Beauty)
    }
}

fn mean(layers: &Layers, aov: Aov) -> f32 {
    let pixels = layers.get(aov).expect("the layer is there");
    pixels.iter().flatten().sum::<f32>() / (3 * pixels.len()) as f32
}

fn diffuse(albedo: f32) -> Material {
    Material::lambert("diffuse", Vec3::splat(albedo))
}

fn emissive(radiance: f32) -> Material {
    Material::lamp("emissive", Vec3::splat(radiance))
}

fn metal(roughness: f32) -> Material {
    Material { roughness, ..Material::default() }
}

fn glass(ior: f32, thickness: f32) -> Material {
    Material { roughness: 0.0, metallic: 0.0, transmission: 1.0, ior, thickness, ..Material::default() }
}

/// The quad a b c d as two triangles; on the front it is counter-clockwise.
fn quad(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> [[Vec3; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// The square from −`half` to `half` in x and z at height y, facing up or down.
fn level(y: f32, half: f32, up: bool) -> [[Vec3; 3]; 2] {
    let p = |x: f32, z: f32| Vec3::new(x * half, y, z * half);
    if up {
        quad(p(-1.0, -1.0), p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0))
    } else {
        quad(p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0))
    }
}

/// A sphere of radius 1 from a subdivided octahedron, facing out.
fn sphere(subdivisions: u32) -> Vec<[Vec3; 3]> {
    let equator = [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y];
    let mut triangles = Vec::new();
    for i in 0..4 {
        let (a, b) = (equator[i], equator[(i + 1) % 4]);
        triangles.extend([[a, b, Vec3::Z], [b, a, Vec3::NEG_Z]]);
    }
    for _ in 0..subdivisions {
        let split = |[a, b, c]: [Vec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(Vec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        triangles = triangles.into_iter().flat_map(split).collect();
    }
    triangles
}

fn reversed(triangles: Vec<[Vec3; 3]>) -> Vec<[Vec3; 3]> {
    triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}

/// An orthographic view of a square of half side `half` at the origin, down the y axis or tilted by an angle around z.
fn above(tilt: f32, half: f32) -> View {
    let eye = DVec3::new(10.0 * (tilt as f64).sin(), 10.0 * (tilt as f64).cos(), 0.0);
    let mut view = View::look_at(eye, DVec3::ZERO, DVec3::Z, 1.0);
    view.projection = Projection::Orthographic { half_height: half, near: 0.0, far: f32::INFINITY };
    view
}

/// A point light I at the centre of a sphere of radius 1 and albedo ρ: after n bounces Σ ρᵏ times the direct ρI/π.
#[test]
fn sphere_around_a_point_light() {
    for albedo in [0.5, 0.8] {
        let built = Built::new().mesh(&reversed(sphere(5)), diffuse(albedo)).light(LightKind::Point, 2.0, DVec3::ZERO);
        let view = View::look_at(DVec3::new(0.3, -0.2, 0.4), DVec3::X, DVec3::Y, 1.5);
        let direct = 2.0 * albedo / PI;
        let one = direct * (1.0 + albedo);
        for (depth, expected) in
            [(Depth::Bounces(0), direct), (Depth::Bounces(1), one), (Depth::Full, direct / (1.0 - albedo))]
        {
            let mean = built.mean(&view, 32, 32, depth);
            // The 8,192 triangles are up to 0.1 % inside the sphere, so they are at most 0.2 % brighter; noise is below
            // 0.1 %.
            assert!((mean / expected - 1.0).abs() < 0.003, "albedo {albedo}, {depth:?}: {mean}, expected {expected}");
        }
    }
}

/// Parallel unit squares at distance 1.
#[test]
fn form_factor_of_parallel_squares() {
    let built = Built::new().mesh(&level(0.0, 0.5, true), diffuse(0.6)).mesh(&level(1.0, 0.5, false), emissive(1.0));
    let root = 2f32.sqrt();
    let factor = 2.0 / PI * ((4f32 / 3.0).sqrt().ln() + 2.0 * root * (1.0 / root).atan() - FRAC_PI_2);
    let mean = built.mean(&above(0.0, 0.5), 32, 256, Depth::Bounces(0));
    // Noise of the mean: below 0.1 %.
    assert!((mean / (0.6 * factor) - 1.0).abs() < 0.003, "{mean}, expected {}", 0.6 * factor);
}

/// Unit squares that share an edge at a right angle.
#[test]
fn form_factor_of_perpendicular_squares() {
    let p = |y: f32, z: f32| Vec3::new(-0.5, y, z);
    let wall = quad(p(0.0, -0.5), p(1.0, -0.5), p(1.0, 0.5), p(0.0, 0.5));
    let built = Built::new().mesh(&level(0.0, 0.5, true), diffuse(0.6)).mesh(&wall, emissive(1.0));
    let root = 2f32.sqrt();
    let factor = (FRAC_PI_2 - root * (1.0 / root).atan() + 0.75f32.ln() / 4.0) / PI;
    let mean = built.mean(&above(0.0, 0.5), 32, 256, Depth::Bounces(0));
    // Noise of the mean: below 0.1 %; the wall is seen edge on.
    assert!((mean / (0.6 * factor) - 1.0).abs() < 0.003, "{mean}, expected {}", 0.6 * factor);
}

/// The share of uniform light that GGX with Fresnel 1 reflects, by quadrature over microfacet normals: ∫ F D G (v·h) /
/// (n·v)(n·h).
fn directional_albedo(roughness: f64, cos: f64) -> f64 {
    let alpha2 = roughness.powi(4);
    let g1 = |c: f64| 2.0 * c / (c + (alpha2 + (1.0 - alpha2) * c * c).sqrt());
    let view = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let steps = 400;
    let mut sum = 0.0;
    for i in 0..steps {
        // With ξ = α² tan² / (1 + α² tan²) the density D(h) (n·h) is uniform in ξ.
        let xi = (i as f64 + 0.5) / steps as f64;
        let tan2 = alpha2 * xi / (1.0 - xi);
        let (cos_h, sin_h) = (1.0 / (1.0 + tan2).sqrt(), (tan2 / (1.0 + tan2)).sqrt());
        for j in 0..steps {
            let phi = std::f64::consts::TAU * (j as f64 + 0.5) / steps as f64;
            let h = DVec3::new(sin_h * phi.cos(), sin_h * phi.sin(), cos_h);
            let (vh, light) = (view.dot(h), 2.0 * view.dot(h) * h - view);
            if vh > 0.0 && light.z > 0.0 {
                sum += g1(cos) * g1(light.z) * vh / (cos * cos_h);
            }
        }
    }
    sum / (steps * steps) as f64
}

/// A white metal in uniform light, from the sky (scattered rays only) and from an emissive box (both strategies).
#[test]
fn ggx_white_furnace() {
    let lamp = |half: f32| {
        let mut box_ = level(-half, half, true).to_vec();
        box_.extend(level(half, half, false));
        let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * half;
        for s in [-1.0, 1.0] {
            let x = quad(p(s, -1.0, -s), p(s, -1.0, s), p(s, 1.0, s), p(s, 1.0, -s));
            let z = quad(p(s, -1.0, s), p(-s, -1.0, s), p(-s, 1.0, s), p(s, 1.0, s));
            box_.extend(x.into_iter().chain(z));
        }
        box_
    };
    for roughness in [0.1f32, 0.3, 0.5, 0.7, 1.0] {
        for tilt in [0.2f32, 0.9, 1.3] {
            let expected = directional_albedo(roughness as f64, (tilt as f64).cos()) as f32;
            let square = || Built::new().mesh(&level(0.0, 1.0, true), metal(roughness));
            let sky = square().sky(1.0).mean(&above(tilt, 0.1), 16, 64, Depth::Full);
            let both = square().mesh(&lamp(4.0), emissive(1.0)).mean(&above(tilt, 0.1), 16, 64, Depth::Full);
            // Quadrature: below 0.1 %; noise of the mean over 16,384 paths: up to 0.3 %.
            assert!(
                (sky - expected).abs() < 0.004,
                "roughness {roughness}, tilt {tilt}: sky {sky}, expected {expected}"
            );
            // Light sampling rarely finds a narrow lobe, so the noise is higher.
            assert!(
                (both - expected).abs() < 0.01,
                "roughness {roughness}, tilt {tilt}: lamp {both}, expected {expected}"
            );
        }
    }
}

/// In a uniform environment clear glass of any shape has the radiance of the environment.
#[test]
fn a_glass_ball_in_a_white_furnace_is_invisible() {
    for ior in [1.0, 1.33, 1.5] {
        let built = Built::new().mesh(&sphere(5), glass(ior, 1.0)).sky(1.0);
        let mean = built.mean(&above(0.0, 1.0), 16, 256, Depth::Full);
        // Noise of roulette: in the facetted ball some paths exceed the 64 reflections without roulette.
        assert!((mean - 1.0).abs() < 0.002, "ior {ior}: {mean}");
    }
}

/// A slab at normal incidence: reflection between its faces, absorption on every pass.
#[test]
fn a_slab_absorbs_as_beer_says() {
    let (thickness, transmitted) = (0.5f32, 0.3f32);
    let material =
        Material { attenuation_color: Vec3::splat(transmitted), attenuation_distance: thickness, ..glass(1.5, 1.0) };
    let mut faces = level(0.25, 8.0, true).to_vec();
    faces.extend(level(-0.25, 8.0, false));
    let built = Built::new().mesh(&faces, material).sky(1.0);
    let f = 0.04f32;
    let through = (1.0 - f).powi(2) * transmitted / (1.0 - (f * transmitted).powi(2));
    let reflected = f + (1.0 - f).powi(2) * f * transmitted.powi(2) / (1.0 - (f * transmitted).powi(2));
    let mean = built.mean(&above(0.0, 0.1), 16, 64, Depth::Full);
    // Noise of the choice between reflecting and refracting.
    assert!((mean - through - reflected).abs() < 0.005, "{mean}, expected {}", through + reflected);
}

/// Blended and thin surfaces attenuate unscattered light, for camera rays and for shadow rays, without a bounce.
#[test]
fn blended_and_thin_surfaces_pass_light_unscattered() {
    let blended =
        Material { base_color: Vec4::new(0.0, 0.0, 0.0, 0.3), alpha: Alpha::Blend, double_sided: true, ..diffuse(0.0) };
    let thin =
        Material { double_sided: true, specular: 0.0, base_color: Vec4::new(0.5, 0.5, 0.5, 1.0), ..glass(1.5, 0.0) };
    for (material, share) in [(blended, 0.7f32), (thin, 0.5)] {
        let sky = Built::new().mesh(&level(1.0, 4.0, true), material.clone()).sky(1.0);
        let seen = sky.mean(&above(0.0, 0.5), 16, 256, Depth::Bounces(0));
        let lit = Built::new()
            .mesh(&level(0.0, 4.0, true), diffuse(0.6))
            .mesh(&level(1.0, 4.0, true), material)
            .light(LightKind::Directional, 2.0, DVec3::ZERO)
            .mean(&above(0.0, 0.5), 16, 256, Depth::Bounces(0));
        // Each passage is a random choice: noise below 0.4 % of the mean of 65,536 paths.
        assert!((seen - share).abs() < 0.01, "seen {seen}, expected {share}");
        let expected = 2.0 * 0.6 / PI * share * share;
        assert!((lit - expected).abs() < 0.01 * expected.max(0.2), "lit {lit}, expected {expected}");
    }
}

/// Lights without extent on a floor: I cos³ / h², the spot's falloff, a directional light's irradiance.
#[test]
fn punctual_lights_give_their_irradiance() {
    let (inner, outer) = (0.2f32, 0.5f32);
    let floor = || Built::new().mesh(&level(0.0, 4.0, true), diffuse(PI / 4.0));
    let at = DVec3::new(0.0, 2.0, 0.0);
    let point = floor().light(LightKind::Point, 8.0, at);
    let spot = floor().light(LightKind::Spot { inner, outer }, 8.0, at);
    let sun = floor().light(LightKind::Directional, 2.0, at);
    // One pixel at distance x from the foot of the light.
    for x in [0.0f32, 0.5, 0.8, 1.2] {
        let mut view = above(0.0, 0.001);
        view.eye.x = x as f64;
        let cos = 2.0 / (4.0 + x * x).sqrt();
        let lambert = 8.0 * cos.powi(3) / 4.0 / 4.0;
        let falloff = ((cos - outer.cos()) / (inner.cos() - outer.cos())).clamp(0.0, 1.0).powi(2);
        for (name, built, expected) in
            [("point", &point, lambert), ("spot", &spot, lambert * falloff), ("sun", &sun, 0.5)]
        {
            let value = built.mean(&view, 1, 2, Depth::Full);
            // f32.
            assert!((value - expected).abs() < 1e-4, "{name} at {x}: {value}, expected {expected}");
        }
    }
}

/// A light with a radius gives the same irradiance where all of it is visible, and half of it where half is occluded.
#[test]
fn a_light_with_a_radius() {
    let p = |x: f32, z: f32| Vec3::new(x * 8.0, 1.0, z * 8.0);
    let half_plane = quad(p(0.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(0.0, 1.0));
    let floor = || {
        let mut built = Built::new().mesh(&level(0.0, 4.0, true), diffuse(PI / 4.0));
        built = built.light(LightKind::Point, 8.0, DVec3::new(0.0, 2.0, 0.0));
        built.0.lights[0].radius = 0.4;
        built
    };
    let view = above(0.0, 0.001);
    let open = floor().mean(&view, 1, 256, Depth::Full);
    let half = floor().mesh(&half_plane, diffuse(0.5)).mean(&view, 1, 256, Depth::Bounces(0));
    // I / d² · ρ / π = 0.5; stratified noise of 256 samples.
    assert!((open - 0.5).abs() < 0.002, "open {open}");
    assert!((half - 0.25).abs() < 0.01, "half {half}");
}

/// The back of a single-sided surface is invisible to the camera but casts shadows; it neither emits nor reflects.
#[test]
fn single_sided_surfaces() {
    let floor =
        || Built::new().mesh(&level(0.0, 4.0, true), diffuse(0.5)).light(LightKind::Directional, 2.0, DVec3::ZERO);
    let view = above(0.0, 0.5);
    let open = floor().mean(&view, 8, 8, Depth::Full);
    let facing_down = floor().mesh(&level(1.0, 4.0, false), diffuse(0.5)).mean(&view, 8, 8, Depth::Full);
    assert!((open - 1.0 / PI).abs() < 1e-4 && facing_down == 0.0, "open {open}, shaded {facing_down}");
    let lamp = Material { double_sided: false, ..emissive(3.0) };
    let from_behind = Built::new().mesh(&level(0.0, 4.0, true), diffuse(0.0)).mesh(&level(1.0, 4.0, false), lamp);
    assert_eq!(from_behind.mean(&view, 8, 8, Depth::Full), 0.0, "a lamp is invisible from behind");
}

/// A floor beside a wall of practically infinite height and width: half the sky is occluded at its foot.
#[test]
fn ambient_occlusion_of_a_wall() {
    let p = |y: f32, z: f32| Vec3::new(-0.5, y, z * 1e3);
    let wall = quad(p(0.0, -1.0), p(1e3, -1.0), p(1e3, 1.0), p(0.0, 1.0));
    let built = Built::new()
        .mesh(&level(0.0, 1.0, true), diffuse(0.5))
        .mesh(&wall, Material { double_sided: true, ..diffuse(0.5) });
    let mut view = above(0.0, 0.005);
    view.eye.x = -0.494;
    let layers = built.render(&view, 8, 64, Depth::Bounces(0));
    // The wall occludes one of two equal halves of the hemisphere.
    assert!((mean(&layers, Aov::Ao) - 0.5).abs() < 0.01, "{}", mean(&layers, Aov::Ao));
    assert!((mean(&layers, Aov::Depth) - 10.0).abs() < 1e-3, "{}", mean(&layers, Aov::Depth));
}

/// Scale and translation do not change the image: the bits are equal for powers of two at the origin, equal within
/// noise far away.
#[test]
fn scale_and_place_do_not_matter() {
    let room = |scale: f64, offset: DVec3| {
        let mut built = Built::new()
            .mesh(&level(0.0, 1.0, true), diffuse(0.5))
            .mesh(&level(0.5, 0.3, true), Material { double_sided: true, ..metal(0.4) })
            .mesh(&level(1.0, 0.5, false), emissive(3.0));
        let place = DAffine3::from_translation(offset) * DAffine3::from_scale(DVec3::splat(scale));
        built.0.nodes.iter_mut().for_each(|node| node.local = Transform::Matrix(place));
        let bounds = Bounds { min: DVec3::new(-1.0, 0.0, -1.0) * scale + offset, max: DVec3::ONE * scale + offset };
        built.mean(&View::framing(bounds), 32, 64, Depth::Full)
    };
    let home = room(1.0, DVec3::ZERO);
    for scale in [1.0 / 1024.0, 16384.0] {
        assert_eq!(room(scale, DVec3::ZERO), home, "scale {scale}");
    }
    let far = room(1.0, DVec3::new(1e7, -3e6, 5e6));
    // Far away, rounding of f64 moves vertices by 10⁻⁹, which changes single paths.
    assert!((far / home - 1.0).abs() < 0.002, "far {far}, home {home}");
}
