//! The reference against closed forms.

use std::f32::consts::{FRAC_PI_2, PI};
use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DVec3, Vec2, Vec3, Vec4};
use twobounce::layers::{Aov, Layers};
use twobounce::reference::film::Film;
use twobounce::reference::{Control, Depth, Options, Stop, render};
use twobounce::scene::{
    Alpha, Bounds, Instance, Light, LightKind, Material, Mesh, Node, Projection, Scene, Transform, View,
};

/// A scene made by hand: material 0 is glTF's default, node 0 stands still.
struct Built(Scene);

impl Built {
    fn new() -> Self {
        let mut scene = Scene { materials: vec![Material::default()], ..Scene::default() };
        scene.nodes.push(Node { name: String::new(), parent: None, local: Transform::Matrix(DAffine3::IDENTITY) });
        Self(scene)
    }

    /// Triangles with flat normals.
    fn mesh(mut self, triangles: &[[Vec3; 3]], material: Material) -> Self {
        let positions: Vec<Vec3> = triangles.iter().flatten().copied().collect();
        let normals = triangles.iter().flat_map(|[a, b, c]| [(*b - *a).cross(*c - *a).normalize(); 3]).collect();
        let n = positions.len();
        self.0.meshes.push(Mesh {
            name: String::new(),
            positions,
            normals,
            tangents: vec![Vec4::new(1.0, 0.0, 0.0, 1.0); n],
            uvs: [vec![Vec2::ZERO; n], vec![Vec2::ZERO; n]],
            colors: vec![Vec4::ONE; n],
            indices: (0..n as u32).collect(),
            material: self.0.materials.len(),
        });
        self.0.materials.push(material);
        self.0.instances.push(Instance { mesh: self.0.meshes.len() - 1, node: 0 });
        self
    }

    fn light(mut self, kind: LightKind, intensity: f32, at: DVec3) -> Self {
        let local = Transform::Matrix(DAffine3::from_rotation_translation(
            glam::DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2),
            at,
        ));
        self.0.nodes.push(Node { name: String::new(), parent: None, local });
        let node = self.0.nodes.len() - 1;
        let intensity = Vec3::splat(intensity);
        self.0.lights.push(Light { name: String::new(), node, kind, intensity, range: f32::INFINITY, radius: 0.0 });
        self
    }

    fn sky(mut self, radiance: f32) -> Self {
        self.0.sky = Vec3::splat(radiance);
        self
    }

    fn render(&self, view: &View, size: u32, samples: u32, depth: Depth) -> Layers {
        let pose = self.0.pose(None, 0.0);
        let stop = Stop::Samples(samples);
        let options = Options { width: size, height: size, depth, stop, seed: 0, occlusion: true };
        let mut film = Film::new(size, size);
        let never = AtomicBool::new(false);
        render(
            (&self.0, &pose, view),
            &options,
            &mut film,
            Control { progress: &|_| {}, save: &mut |_| Ok(()), cancel: &never },
        )
        .expect("nothing interrupts");
        assert_eq!(film.rejected(), 0, "samples that are not finite");
        film.layers(&[Aov::Direct, Aov::Ao, Aov::Depth])
    }

    fn mean(&self, view: &View, size: u32, samples: u32, depth: Depth) -> f32 {
        mean(&self.render(view, size, samples, depth), Aov::Beauty)
    }
}

fn mean(layers: &Layers, aov: Aov) -> f32 {
    let pixels = layers.get(aov).expect("the layer is there");
    pixels.iter().flatten().sum::<f32>() / (3 * pixels.len()) as f32
}

/// Lambert, nothing else.
fn diffuse(albedo: f32) -> Material {
    let base_color = Vec3::splat(albedo).extend(1.0);
    Material { base_color, metallic: 0.0, specular: 0.0, ..Material::default() }
}

fn emissive(radiance: f32) -> Material {
    Material { emissive: Vec3::splat(radiance), ..diffuse(0.0) }
}

fn metal(roughness: f32) -> Material {
    Material { roughness, ..Material::default() }
}

fn glass(ior: f32, thickness: f32) -> Material {
    Material { roughness: 0.0, metallic: 0.0, transmission: 1.0, ior, thickness, ..Material::default() }
}

/// Two triangles a b c d, front where they turn counter-clockwise.
fn quad(a: Vec3, b: Vec3, c: Vec3, d: Vec3) -> [[Vec3; 3]; 2] {
    [[a, b, c], [a, c, d]]
}

/// The square from −`half` to `half` in x and z, at height y, facing up or down.
fn level(y: f32, half: f32, up: bool) -> [[Vec3; 3]; 2] {
    let p = |x: f32, z: f32| Vec3::new(x * half, y, z * half);
    if up {
        quad(p(-1.0, -1.0), p(-1.0, 1.0), p(1.0, 1.0), p(1.0, -1.0))
    } else {
        quad(p(-1.0, -1.0), p(1.0, -1.0), p(1.0, 1.0), p(-1.0, 1.0))
    }
}

/// An icosphere of radius 1, facing out.
fn sphere(subdivisions: u32) -> Vec<[Vec3; 3]> {
    let octahedron = [Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::NEG_Y].map(|v| v);
    let mut triangles = Vec::new();
    for i in 0..4 {
        let (a, b) = (octahedron[i], octahedron[(i + 1) % 4]);
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

fn turned(triangles: Vec<[Vec3; 3]>) -> Vec<[Vec3; 3]> {
    triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}

/// Down the y axis, or tilted by an angle about z, parallel rays over a square of half side `half` at the origin.
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
        let built = Built::new().mesh(&turned(sphere(5)), diffuse(albedo)).light(LightKind::Point, 2.0, DVec3::ZERO);
        let view = View::look_at(DVec3::new(0.3, -0.2, 0.4), DVec3::X, DVec3::Y, 1.5);
        let direct = 2.0 * albedo / PI;
        let one = direct * (1.0 + albedo);
        for (depth, expected) in
            [(Depth::Bounces(0), direct), (Depth::Bounces(1), one), (Depth::Full, direct / (1.0 - albedo))]
        {
            let mean = built.mean(&view, 32, 32, depth);
            // 8,192 triangles lie up to 0.1 % inside the sphere, which brightens by at most 0.2 %; noise is below 0.1 %.
            assert!((mean / expected - 1.0).abs() < 0.003, "albedo {albedo}, {depth:?}: {mean}, expected {expected}");
        }
    }
}

/// Unit squares one above the other at distance 1.
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
    // Noise of the mean: below 0.1 %; the wall's own edge is seen edge on.
    assert!((mean / (0.6 * factor) - 1.0).abs() < 0.003, "{mean}, expected {}", 0.6 * factor);
}

/// What GGX with Fresnel 1 reflects of an even light, by quadrature over microfacet normals: ∫ F D G (v·h) / (n·v)(n·h).
fn directional_albedo(roughness: f64, cos: f64) -> f64 {
    let alpha2 = roughness.powi(4);
    let g1 = |c: f64| 2.0 * c / (c + (alpha2 + (1.0 - alpha2) * c * c).sqrt());
    let view = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
    let steps = 400;
    let mut sum = 0.0;
    for i in 0..steps {
        // With ξ = α² tan² / (1 + α² tan²) the density of D(h) (n·h) is even in ξ.
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

/// A white metal under an even light, from the sky (scattered rays alone) and from a closed lamp (both strategies).
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
            // Sampling a lamp all around is a poor way to find a narrow lobe: more noise.
            assert!(
                (both - expected).abs() < 0.01,
                "roughness {roughness}, tilt {tilt}: lamp {both}, expected {expected}"
            );
        }
    }
}

/// Clear glass under an even sky sends on what it receives, whatever its shape.
#[test]
fn a_glass_ball_in_a_white_furnace_is_invisible() {
    for ior in [1.0, 1.33, 1.5] {
        let built = Built::new().mesh(&sphere(5), glass(ior, 1.0)).sky(1.0);
        let mean = built.mean(&above(0.0, 1.0), 16, 256, Depth::Full);
        // Noise of roulette: a facetted ball holds some light for more than its 64 free reflections.
        assert!((mean - 1.0).abs() < 0.002, "ior {ior}: {mean}");
    }
}

/// A slab seen head on: reflected between its faces, absorbed on every way through.
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

/// Sheer things weaken light that goes straight on, for the eye and for shadow rays, without a bounce.
#[test]
fn blended_and_thin_surfaces_let_light_straight_through() {
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
        // Each way is chosen at random: noise below 0.4 % of the mean of 65,536 paths.
        assert!((seen - share).abs() < 0.01, "seen {seen}, expected {share}");
        let expected = 2.0 * 0.6 / PI * share * share;
        assert!((lit - expected).abs() < 0.01 * expected.max(0.2), "lit {lit}, expected {expected}");
    }
}

/// Lamps without extent on a floor: I cos³ / h², the spot's falloff, a directional light's cosine.
#[test]
fn lamps_obey_their_laws() {
    let (inner, outer) = (0.2f32, 0.5f32);
    let floor = || Built::new().mesh(&level(0.0, 4.0, true), diffuse(PI / 4.0));
    let at = DVec3::new(0.0, 2.0, 0.0);
    let point = floor().light(LightKind::Point, 8.0, at);
    let spot = floor().light(LightKind::Spot { inner, outer }, 8.0, at);
    let sun = floor().light(LightKind::Directional, 2.0, at);
    // One pixel a little aside, seen from the far side of the lamp.
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

/// A lamp with a radius sends the same light to whatever sees all of it, but a softer shadow: half where half of it is hidden.
#[test]
fn a_lamp_with_a_radius() {
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

/// A single-sided surface is not there for the eye behind it, but shades; its back neither shines nor reflects.
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

/// A floor beside a wall of infinite height and width, 45° up to its edge: half the sky is hidden at its foot.
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
    // Cosine-weighted, a wall that hides all of one side's sky hides half.
    assert!((mean(&layers, Aov::Ao) - 0.5).abs() < 0.01, "{}", mean(&layers, Aov::Ao));
    assert!((mean(&layers, Aov::Depth) - 10.0).abs() < 1e-3, "{}", mean(&layers, Aov::Depth));
}

/// The same image at any scale and place: bit for bit for powers of two at home, within noise far away.
#[test]
fn scale_and_place_do_not_matter() {
    let room = |scale: f64, offset: DVec3| {
        let mut built = Built::new()
            .mesh(&level(0.0, 1.0, true), diffuse(0.5))
            .mesh(&level(0.5, 0.3, true), Material { double_sided: true, ..metal(0.4) })
            .mesh(&level(1.0, 0.5, false), emissive(3.0));
        built.0.nodes[0].local = Transform::Matrix(DAffine3::from_scale_rotation_translation(
            DVec3::splat(scale),
            glam::DQuat::IDENTITY,
            offset,
        ));
        let bounds = Bounds { min: DVec3::new(-1.0, 0.0, -1.0) * scale + offset, max: DVec3::ONE * scale + offset };
        built.mean(&View::framing(bounds), 32, 64, Depth::Full)
    };
    let home = room(1.0, DVec3::ZERO);
    for scale in [1.0 / 1024.0, 16384.0] {
        assert_eq!(room(scale, DVec3::ZERO), home, "scale {scale}");
    }
    let far = room(1.0, DVec3::new(1e7, -3e6, 5e6));
    // Rounding of f64 far away moves vertices by 10⁻⁹, which changes single paths.
    assert!((far / home - 1.0).abs() < 0.002, "far {far}, home {home}");
}
