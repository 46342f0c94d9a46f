//! Rays and shadow rays over the lists of a frame, against brute force over all recorded triangles.
//!
//! The oracle evaluates the shader's formula (Möller and Trumbore 1997) in f64, with the bound of what f32 may round. A hit
//! is *certain* if it is one whatever the rounding, and *possible* if rounding may make it one: at edges, where the shader's
//! tolerance of 10⁻⁵ counts as such, at the ends of a ray, and behind another triangle at the same distance. Where only
//! certain hits decide, a ray has one right answer; every other ray is *undecided*: any answer that rounding explains is
//! right, and the share of such rays is bounded.
//!
//! Every triangle lies within the grid. What sticks out of it is not listed, and rays promise nothing about it.

#[path = "common/gpu.rs"]
mod gpu;
#[path = "common/scenes.rs"]
mod scenes;

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use glam::{Affine2, DAffine3, DVec2, DVec3, Vec2, Vec3, Vec4};
use gpu::twins::record::record;
use half::f16;
use rayon::prelude::*;
use scenes::{Random, add, triangle};
use twobounce::ground::constants::{Features, constants};
use twobounce::ground::layout;
use twobounce::renderer::Renderer;
use twobounce::scene::surface::SurfacePoint;
use twobounce::scene::texture::Textures;
use twobounce::scene::{Alpha, Image, LoadOptions, Material, Mesh, Mip, Scene, Texture, TextureRef, Wrap};
use twobounce::settings::{Bounces, Settings};
use twobounce::vk::*;

/// Rounding of the shader's products, over the product of the lengths that enter: eight roundings of f32, from two
/// differences through a cross product to a scalar product, of terms whose sizes add up to √2 times that at most.
const ROUNDING: f64 = 12.0 / (1 << 24) as f64;
/// Of a quotient, and of the distance of a voxel's plane.
const QUOTIENT_ROUNDING: f64 = 8.0 / (1 << 24) as f64;
/// The shader's tolerance at edges, in barycentric weights.
const EDGE_TOLERANCE: f64 = 1.001e-5;
/// Relative, per surface passed: its optical depth is cut off after 16 bits, a factor of 2^(2⁻¹⁶). Twice that for what
/// Vulkan asks of log2 and exp2.
const DEPTH_ROUNDING: f64 = 2.2e-5;
/// Of a linear colour: Vulkan leaves the decoding of sRGB half a step of 8 bits, up to 4·10⁻³; lavapipe takes 1.2·10⁻³.
const DECODING: f64 = 2e-3;
/// A shadow ray is undecided if its bounds are further apart than this: more than rounding of colours does.
const APART: f64 = 0.02;
/// The shader's word for opaque is 2⁻²⁹.
const OPAQUE: f64 = 2e-9;
/// Voxels along the facet, where a ray from a surface starts.
const RAY_START: f64 = 1e-3;

/// Twin of `Ray` in glsl/test/rays.comp.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Ray {
    position: [f32; 3],
    least: f32,
    d: [f32; 3],
    distance: f32,
    facet: [f32; 3],
}

/// Twin of `Found` in glsl/test/rays.comp.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
struct Found {
    origin: [f32; 3],
    source: u32,
    uv: [f32; 2],
    distance: f32,
    sides: u32,
    passed: [f32; 3],
}

/// A recorded triangle.
struct Facet {
    a: DVec3,
    edges: [DVec3; 2],
    lengths: [f64; 2],
    /// Unit.
    normal: DVec3,
    source: u32,
    /// Into the scene's materials.
    material: usize,
    uvs: [[Vec2; 3]; 2],
    colors: [Vec4; 3],
}

/// Where a ray may meet a triangle: distance and weights, each with the bound of its rounding.
#[derive(Clone, Copy, Debug)]
struct Crossing {
    t: f64,
    uv: DVec2,
    t_rounding: f64,
    uv_rounding: DVec2,
    /// Well inside the triangle.
    inside: bool,
}

impl Facet {
    fn new(triangle: &layout::Triangle, material: usize) -> Self {
        let [a, b, c] = triangle.vertices.map(|v| Vec3::from(v.position).as_dvec3());
        let edges = [b - a, c - a];
        let half = |word: u32| [0, 16].map(|shift| f16::from_bits((word >> shift) as u16).to_f32());
        Self {
            a,
            edges,
            lengths: edges.map(|e| e.length()),
            normal: edges[0].cross(edges[1]).normalize(),
            source: triangle.source,
            material,
            uvs: [0, 2].map(|k| triangle.vertices.map(|v| Vec2::new(v.uv[k], v.uv[k + 1]))),
            colors: triangle.vertices.map(|v| {
                let [[r, g], [b, a]] = v.color.map(half);
                Vec4::new(r, g, b, a)
            }),
        }
    }

    fn at(&self, uv: DVec2) -> DVec3 {
        self.a + self.edges[0] * uv.x + self.edges[1] * uv.y
    }

    /// `None` if f32 finds no hit either.
    fn crossing(&self, origin: DVec3, d: DVec3) -> Option<Crossing> {
        let [e1, e2] = self.edges;
        let [l1, l2] = self.lengths;
        let p = d.cross(e2);
        let det = e1.dot(p);
        if det == 0.0 {
            return None;
        }
        let s = origin - self.a;
        let far = s.length() * ROUNDING;
        let det_rounding = l1 * l2 * ROUNDING;
        let side = det.signum();
        let (det, u) = (det.abs(), side * s.dot(p));
        // Too near to parallel for f32 to tell: then either sign of the determinant.
        let parallel = det <= 2.0 * det_rounding;
        let most = (det + det_rounding) * (1.0 + EDGE_TOLERANCE);
        let least = if parallel { -most } else { -EDGE_TOLERANCE * (det + det_rounding) };
        if u < least - far * l2 || u > most + far * l2 {
            return None;
        }
        let q = s.cross(e1);
        let v = side * d.dot(q);
        if v < least - far * l1 || v > most + far * l1 || (!parallel && u + v > most + far * (l1 + l2)) {
            return None;
        }
        if parallel {
            let all = f64::INFINITY;
            return Some(Crossing {
                t: 0.0,
                uv: DVec2::ZERO,
                t_rounding: all,
                uv_rounding: DVec2::INFINITY,
                inside: false,
            });
        }
        let over_det = |value: f64, rounding: f64| {
            let value = value / det;
            let of_det = value.abs() * det_rounding;
            (value, (rounding + of_det) / (det - det_rounding) + QUOTIENT_ROUNDING * value.abs())
        };
        let (t, t_rounding) = over_det(side * e2.dot(q), far * l1 * l2);
        let ((u, u_rounding), (v, v_rounding)) = (over_det(u, far * l2), over_det(v, far * l1));
        let inside = u > u_rounding && v > v_rounding && u + v < 1.0 - u_rounding - v_rounding;
        Some(Crossing { t, uv: DVec2::new(u, v), t_rounding, uv_rounding: DVec2::new(u_rounding, v_rounding), inside })
    }
}

/// Bounds of a right answer, per channel.
type Bounds = [DVec3; 2];

/// How many rays were held against the oracle, and what came of it.
#[derive(Debug, Default)]
struct Tally {
    rays: usize,
    hits: usize,
    undecided_hits: usize,
    /// Shadow rays by the share that passes: all, none, or between.
    open: usize,
    blocked: usize,
    between: usize,
    undecided_shadows: usize,
    wrong: Vec<String>,
}

impl Tally {
    fn and(mut self, other: Self) -> Self {
        self.rays += other.rays;
        self.hits += other.hits;
        self.undecided_hits += other.undecided_hits;
        self.open += other.open;
        self.blocked += other.blocked;
        self.between += other.between;
        self.undecided_shadows += other.undecided_shadows;
        self.wrong.extend(other.wrong);
        self
    }
}

struct Oracle {
    scene: Scene,
    textures: Textures,
    facets: Vec<Facet>,
}

impl Oracle {
    fn new(context: &Arc<Context>, renderer: &Renderer) -> Self {
        let scene = renderer.scene().clone();
        let recorded = record(&scene, &scene.pose(None, 0.0));
        let globals: layout::Globals = download(context, &renderer.ground().base().globals).expect("counters")[0];
        let triangles: Vec<layout::Triangle> = download(context, &renderer.ground().triangles).expect("triangles");
        let count = globals.vertex_count as usize / 3;
        assert_eq!(count + globals.degenerate_count as usize, recorded.len(), "{}", scene.name);
        let facet = |t: &layout::Triangle| Facet::new(t, recorded[t.source as usize].material);
        let facets: Vec<Facet> = triangles[..count].iter().map(facet).collect();
        let edge = f64::from(renderer.ground().desc.grid.edge);
        let within = |p: DVec3| p.min_element() > 0.0 && p.max_element() < edge;
        assert!(facets.iter().all(|f| [DVec2::ZERO, DVec2::X, DVec2::Y].iter().all(|&uv| within(f.at(uv)))));
        Self { textures: Textures::new(&scene), scene, facets }
    }

    fn check(&self, ray: &Ray, nearest: &Found, shadow: &Found) -> Tally {
        let mut tally = Tally { rays: 1, ..Tally::default() };
        let [position, d, facet] = [ray.position, ray.d, ray.facet].map(|v| Vec3::from(v).as_dvec3());
        let origin = Vec3::from(nearest.origin).as_dvec3();
        let step = facet * RAY_START * if facet.dot(d) < 0.0 { -1.0 } else { 1.0 };
        // Units in the last place of a coordinate; a ray within the surface's plane may start on either side.
        let level = facet.dot(d).abs() < 1e-6 && origin.distance(position - step) < 1e-5;
        let starts = level || origin.distance(position + step) < 1e-5 * (1.0 + position.abs().max_element() / 64.0);
        let crossings: Vec<_> =
            self.facets.iter().filter_map(|f| f.crossing(origin, d).map(|crossing| (f, crossing))).collect();
        let (hit, decided) = self.nearest_is_right(f64::from(ray.least), d, &crossings, nearest);
        tally.hits = usize::from(nearest.source != 0);
        tally.undecided_hits = usize::from(!decided);
        let [low, high] = self.light(origin, d, f64::from(ray.distance), &crossings);
        let passed = Vec3::from(shadow.passed).as_dvec3();
        let lit = passed.cmpge(low).all() && passed.cmple(high).all();
        tally.undecided_shadows = usize::from((high - low).max_element() > APART);
        tally.open = usize::from(passed == DVec3::ONE);
        tally.blocked = usize::from(passed == DVec3::ZERO);
        tally.between = 1 - tally.open - tally.blocked;
        if !(starts && hit && lit) {
            let near = crossings.iter().filter(|c| c.1.inside && c.1.t > 0.0).map(|c| (c.1.t, c.0.source));
            let near: Vec<_> = near.collect();
            tally.wrong.push(format!(
                "start {starts}, hit {hit}, light {lit}: {ray:?}\n nearest {nearest:?}\n passed {passed}, not {low} to {high}; {near:?}"
            ));
        }
        tally
    }

    /// Whether what was found is right, and whether that is the only right answer.
    fn nearest_is_right(&self, least: f64, d: DVec3, all: &[(&Facet, Crossing)], found: &Found) -> (bool, bool) {
        let certain = all.iter().filter(|(_, c)| c.inside && c.t - c.t_rounding > least);
        let nearest = certain.map(|(_, c)| c.t + c.t_rounding).fold(f64::INFINITY, f64::min);
        let possible = |c: &Crossing| c.t + c.t_rounding > least && c.t - c.t_rounding <= nearest;
        let possible: Vec<_> = all.iter().filter(|(_, c)| possible(c)).collect();
        let answers = possible.len() + usize::from(nearest.is_infinite());
        let right = if found.source == 0 {
            nearest.is_infinite()
        } else {
            possible.iter().any(|(facet, c)| {
                let off = DVec2::new(f64::from(found.uv[0]), f64::from(found.uv[1])) - c.uv;
                let place =
                    (f64::from(found.distance) - c.t).abs() <= c.t_rounding && off.abs().cmple(c.uv_rounding).all();
                facet.source + 1 == found.source && place && self.sides_are_right(facet, d, c, found)
            })
        };
        (right, answers == 1)
    }

    /// Which side was met, whether it is dark, and what passes the triangle.
    fn sides_are_right(&self, facet: &Facet, d: DVec3, crossing: &Crossing, found: &Found) -> bool {
        let cosine = facet.normal.dot(d);
        let (back, dark) = (found.sides & 1 != 0, found.sides & 2 != 0);
        let side = back == (cosine > 0.0) || cosine.abs() < 1e-6;
        let [low, high] = self.through(facet, crossing);
        let passed = Vec3::from(found.passed).as_dvec3();
        let light = passed.cmpge(low - 1e-6).all() && passed.cmple(high + 1e-6).all();
        side && light && dark == (back && !self.scene.materials[facet.material].double_sided)
    }

    /// Share of the light that passes a triangle: what rounding of the point and of a mask's cutoff may make of it.
    fn through(&self, facet: &Facet, crossing: &Crossing) -> Bounds {
        let material = &self.scene.materials[facet.material];
        if material.alpha == Alpha::Opaque && material.transmission == 0.0 {
            return [DVec3::ZERO; 2];
        }
        let mut cutoffs = vec![material.clone()];
        if let Alpha::Mask(cutoff) = material.alpha {
            // The shader takes what is short of it by 10⁻⁵ as equal.
            cutoffs.push(Material { alpha: Alpha::Mask(cutoff - 1.2e-5), ..material.clone() });
        }
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for k in 0..5 {
            let corner = [DVec2::ZERO, DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)][k];
            let uv =
                (crossing.uv + corner * (crossing.uv_rounding + 1e-6)).clamp(DVec2::splat(-1.0), DVec2::splat(2.0));
            let weights = [1.0 - uv.x - uv.y, uv.x, uv.y];
            let mean = |at: [Vec2; 3]| (0..3).map(|i| at[i].as_dvec2() * weights[i]).sum::<DVec2>().as_vec2();
            let color = (0..3).map(|i| facet.colors[i] * weights[i] as f32).sum();
            let point = SurfacePoint { uvs: facet.uvs.map(mean), color, footprint: [0.0; 2] };
            for material in &cutoffs {
                let at = material.evaluate(&self.scene, &self.textures, &point);
                let opacity = f64::from(at.opacity.clamp(0.0, 1.0));
                let light = DVec3::ONE - opacity + opacity * at.base_color.as_dvec3() * f64::from(at.transmission);
                let decoding = if material.base_color_texture.is_some() {
                    opacity * f64::from(at.transmission) * DECODING
                } else {
                    0.0
                };
                bounds = [bounds[0].min(light - decoding), bounds[1].max(light + decoding)];
            }
        }
        bounds
    }

    /// Share of the light that passes everything between 0 and `distance`.
    fn light(&self, origin: DVec3, d: DVec3, distance: f64, crossings: &[(&Facet, Crossing)]) -> Bounds {
        let [mut low, mut high] = [DVec3::ONE; 2];
        let mut passed = 1.0;
        for (facet, c) in crossings {
            if c.t + c.t_rounding <= 0.0 || c.t - c.t_rounding >= distance {
                continue;
            }
            let material = &self.scene.materials[facet.material];
            let opaque = material.alpha == Alpha::Opaque && material.transmission == 0.0;
            let certain = c.inside && c.t - c.t_rounding > 0.0 && c.t + c.t_rounding < distance;
            let [least, most] = self.through(facet, c).map(|light| light.max(DVec3::ZERO));
            // Between two voxels, a surface that lets light through may count twice or never.
            if certain && (opaque || !straddles(origin, d, c)) {
                (low, high) = (low * least, high * most);
            } else {
                low *= least * least;
            }
            passed += 1.0;
        }
        let rounding = 1.0 + DEPTH_ROUNDING * passed;
        // What certain opaque triangles leave is 0 and nothing else.
        [low / rounding - OPAQUE, high * rounding + if high == DVec3::ZERO { 0.0 } else { OPAQUE }]
    }
}

/// Whether rounding may move a crossing from one voxel to the next. A surface within rounding of the plane between two is
/// listed in one of them, and its hit may count for the other: shadow rays then pass as if it were not there.
fn straddles(origin: DVec3, d: DVec3, c: &Crossing) -> bool {
    let slack = c.t_rounding + QUOTIENT_ROUNDING * (1.0 + c.t.abs());
    let [near, far] = [c.t - slack, c.t + slack].map(|t| origin + d * t);
    (0..3).any(|axis| d[axis] != 0.0 && near[axis].floor() != far[axis].floor())
}

/// A point inside a facet, and the facet: the larger of two, so that needles are met more often than they are aimed at.
fn point_on<'a>(facets: &'a [Facet], random: &mut Random) -> (DVec3, &'a Facet) {
    let mut draw = || &facets[(random.unit() * facets.len() as f64) as usize];
    let area = |f: &Facet| f.edges[0].cross(f.edges[1]).length();
    let two = [draw(), draw()];
    let facet = if area(two[0]) > area(two[1]) { two[0] } else { two[1] };
    let uv = DVec2::new(random.unit(), random.unit());
    (facet.at(if uv.x + uv.y < 1.0 { uv } else { DVec2::ONE - uv }), facet)
}

/// Rays of every kind in turn.
fn rays(facets: &[Facet], edge: u32, count: usize) -> Vec<Ray> {
    let (mut random, size) = (Random::new(u64::from(edge)), f64::from(edge));
    let mut ray = |i: usize| {
        let r = &mut random;
        let anywhere = r.point() * size;
        let direction = r.direction();
        let (on, facet) = point_on(facets, r);
        let (other, _) = point_on(facets, r);
        let none = DVec3::ZERO;
        let distance = r.unit() * 1.5 * size;
        let (position, to, distance, facet) = match i % 8 {
            // From anywhere; every other one to a light at an infinite distance.
            0 => (anywhere, direction, if i.is_multiple_of(16) { 1e30 } else { distance }, none),
            // From a surface, to either side.
            1 => (on, direction, distance, facet.normal),
            // Along an axis; every other one in the planes between voxels.
            2 => {
                let axis = DVec3::AXES[i / 16 % 3] * if r.unit() < 0.5 { -1.0 } else { 1.0 };
                (if i % 16 == 2 { anywhere } else { anywhere.floor() }, axis, distance, none)
            }
            // From outside of the grid, to something in it or past it.
            3 => {
                let from = DVec3::splat(size / 2.0) + direction * size * (0.9 + r.unit());
                let to = if i % 16 == 3 { other } else { anywhere };
                (from, to - from, 1.5 * distance, none)
            }
            // Grazing a surface: nearly along it, from close to it.
            4 => {
                let tilt = facet.normal * 0.02 * (r.unit() - 0.5);
                let along = facet.normal.cross(direction).normalize() + tilt;
                (on + facet.normal * 0.1 * (r.unit() - 0.5), along, distance, none)
            }
            // Very short, from a surface.
            5 => (on, direction, 10f64.powf(-3.0 + 3.0 * r.unit()), facet.normal),
            // Ends right before a surface, or right behind it.
            6 => {
                let distance = (on - anywhere).length();
                (anywhere, on - anywhere, distance + 0.1 * (r.unit() - 0.5), none)
            }
            // From one surface to another, as to a point of a lamp.
            _ => (on, other - on, (other - on).length() - 0.01, facet.normal),
        };
        Ray {
            position: position.as_vec3().into(),
            least: if i.is_multiple_of(24) { 0.3 * distance.min(size) as f32 } else { 0.0 },
            d: to.normalize_or(DVec3::X).as_vec3().into(),
            distance: distance.max(0.0) as f32,
            facet: facet.as_vec3().into(),
        }
    };
    (0..count).map(&mut ray).collect()
}

fn trace(context: &Arc<Context>, renderer: &Renderer, settings: &Settings, shadow: bool, rays: &[Ray]) -> Vec<Found> {
    let mut constants = constants(settings, Features::of(renderer.scene(), settings));
    constants.push((20, u32::from(shadow)));
    let desc = ComputeDesc { label: "rays", shader: "test/rays.comp", constants: &constants };
    let pipeline = Compute::new(context, &desc).expect("a pipeline");
    let inputs = upload(context, "inputs", rays).expect("an upload");
    let none = Found { passed: [f32::NAN; 3], ..Found::zeroed() };
    let outputs = upload(context, "outputs", &vec![none; rays.len()]).expect("an upload");
    let mut binds = renderer.ground().binds();
    binds.extend([Bind::buffer("inputs", &inputs), Bind::buffer("outputs", &outputs)]);
    let mut recorder = Recorder::new(context, RecorderOptions::default()).expect("a recorder");
    let count = rays.len() as u32;
    recorder.zone("rays", ZoneKind::Compute, 0, |r| {
        r.dispatch(&pipeline, &pipeline.select(&binds), &count, [count.div_ceil(64), 1, 1]);
    });
    recorder.finish().expect("a dispatch");
    let found = download(context, &outputs).expect("outputs");
    assert_eq!(context.take_validation_messages(), Vec::<String>::new());
    found
}

/// Holds `count` rays over `scene` against brute force.
fn compare(scene: &Scene, settings: &Settings, count: usize, undecided: f64) -> Tally {
    let (context, edge) = (gpu::context(), settings.voxels);
    let renderer = gpu::render(&context, scene, settings, 8);
    let oracle = Oracle::new(&context, &renderer);
    let rays = rays(&oracle.facets, edge, count);
    let start = Instant::now();
    let nearest = trace(&context, &renderer, settings, false, &rays);
    let shadows = trace(&context, &renderer, settings, true, &rays);
    let traced = start.elapsed();
    let tally = (0..count)
        .into_par_iter()
        .map(|i| oracle.check(&rays[i], &nearest[i], &shadows[i]))
        .reduce(Tally::default, Tally::and);
    let seconds = [traced, start.elapsed() - traced].map(|time| time.as_secs_f64());
    println!(
        "{}, {edge}³, {} triangles: {count} rays, {} hits ({} undecided); shadow rays {} open, {} blocked, {} between ({} \
         undecided); {:.1} s and {:.1} s of brute force",
        scene.name,
        oracle.facets.len(),
        tally.hits,
        tally.undecided_hits,
        tally.open,
        tally.blocked,
        tally.between,
        tally.undecided_shadows,
        seconds[0],
        seconds[1]
    );
    let wrong = &tally.wrong;
    let shown = wrong.iter().take(3).cloned().collect::<Vec<_>>().join("\n");
    assert!(wrong.is_empty(), "{}, {edge}³: {} of {count} rays are wrong:\n{shown}", scene.name, wrong.len());
    assert!(tally.hits * 3 > count, "few rays hit anything");
    let most = (count as f64 * undecided) as usize;
    assert!(tally.undecided_hits <= most && tally.undecided_shadows <= most, "too many rays are undecided");
    tally
}

fn voxels(edge: u32) -> Settings {
    Settings { voxels: edge, bounces: Bounces::One, ..Settings::fast() }
}

#[test]
fn rays_in_the_gallery() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/gallery.glb");
    let scene = Scene::load(&path, &LoadOptions::default()).expect("the gallery");
    // Fewer rays: it has more triangles. More of them are undecided: small triangles are seen from far, some twice.
    compare(&scene, &voxels(64), 20_000, 0.012);
}

/// A room of double-sided walls with a cloud of triangles: of every size, one- and two-sided, every fifth thin.
fn room() -> Scene {
    let (mut scene, mut random) = (Scene::empty("room"), Random::new(11));
    let both = |color: Vec3, double_sided: bool| Material { double_sided, ..Material::lambert("cloud", color) };
    let walls = scene.add_material(both(Vec3::splat(0.6), true));
    scene.add_mesh(Mesh::cuboid("walls", walls, Vec3::ZERO, Vec3::new(8.0, 6.0, 7.0), true), DAffine3::IDENTITY);
    for double_sided in [false, true] {
        let cloud: Vec<_> = (0..1000)
            .map(|i| {
                let center = DVec3::new(1.0, 1.0, 1.0) + random.point() * DVec3::new(6.0, 4.0, 5.0);
                let [a, b, c] = triangle(&mut random, center, 0.05 + random_size(i));
                if i % 5 == 0 { [a, b, b + (c - b) * 0.02] } else { [a, b, c] }
            })
            .collect();
        add(&mut scene, &cloud, both(random.point().as_vec3(), double_sided));
    }
    scene
}

/// From small to large, by number.
fn random_size(i: usize) -> f64 {
    1.2 * ((i * 7 % 100) as f64 / 100.0).powi(3)
}

#[test]
fn rays_in_a_cloud_of_triangles() {
    compare(&room(), &voxels(32), 100_000, 0.003);
    compare(&room(), &voxels(64), 100_000, 0.003);
}

/// Sheets with every way to let light through: masks, blending, tinted transmission, by textures and by factors, one- and
/// two-sided, and a few opaque ones. Every fourth lies in an axis plane.
fn veils() -> Scene {
    let (mut scene, mut random) = (Scene::empty("veils"), Random::new(12));
    let texel = |k: usize, random: &mut Random| {
        // Red transmits, blue is metal; three in eight are holes for the masks.
        let alpha = if random.unit() < 0.375 { 0 } else { 100 + (random.unit() * 156.0) as u8 };
        let color = random.point() * 255.0;
        if k.is_multiple_of(4) { [255, 255, 0, alpha] } else { [color.x as u8, color.y as u8, color.z as u8, alpha] }
    };
    let rgba: Vec<u8> = (0..8 * 4).flat_map(|k| texel(k, &mut random)).collect();
    scene.images.push(Image { name: "veil".into(), width: 8, height: 4, rgba });
    for (linear, wrap) in [(false, [Wrap::Repeat, Wrap::Mirror]), (true, [Wrap::Mirror, Wrap::Clamp])] {
        scene.textures.push(Texture { image: 0, wrap, mag_linear: linear, min_linear: linear, mip: Mip::None });
    }
    let transform = Affine2::from_scale_angle_translation(Vec2::new(1.7, 0.9), 0.3, Vec2::new(0.2, -0.4));
    let by = |texture: usize| Some(TextureRef { texture, uv_set: 0, transform });
    let tint = || Material { base_color: Vec4::new(0.9, 0.6, 0.3, 0.8), ..Material::lambert("veil", Vec3::ONE) };
    let glass = |transmission: f32| Material { transmission, ..tint() };
    let kinds = [
        Material { alpha: Alpha::Mask(0.37), base_color_texture: by(0), ..tint() },
        Material { alpha: Alpha::Mask(0.2), base_color_texture: by(1), ..tint() },
        Material { alpha: Alpha::Mask(0.5), base_color_texture: by(0), ..glass(0.7) },
        Material { alpha: Alpha::Blend, ..tint() },
        Material { alpha: Alpha::Blend, base_color_texture: by(1), ..tint() },
        Material { alpha: Alpha::Blend, base_color_texture: by(0), ..glass(0.5) },
        glass(1.0),
        Material { transmission_texture: by(1), ..glass(0.9) },
        Material { metallic: 0.8, metallic_roughness_texture: by(0), ..glass(1.0) },
        Material { base_color_texture: by(1), transmission_texture: by(0), ..glass(1.0) },
        tint(),
    ];
    for (kind, material) in kinds.into_iter().enumerate() {
        for double_sided in [false, true] {
            let opaque = kind == 10;
            let index = scene.add_material(Material { double_sided, ..material.clone() });
            for i in 0..if opaque { 4 } else { 12 } {
                let (mut u, mut v) = (random.direction(), random.direction());
                if i % 4 == 0 {
                    (u, v) = (DVec3::AXES[(kind + i / 4) % 3], DVec3::AXES[(kind + i / 4 + 1) % 3]);
                }
                let [u, v] = [u, v].map(|e| (e * (0.8 + 1.5 * random.unit())).as_vec3());
                let corner = (random.point() * 6.0).as_vec3() - (u + v) / 2.0;
                scene.add_mesh(Mesh::quad("veil", index, corner, u, v), DAffine3::IDENTITY);
            }
        }
    }
    scene
}

#[test]
fn rays_through_masks_blending_and_glass() {
    let tally = compare(&veils(), &voxels(32), 100_000, 0.003);
    assert!(tally.open > 10_000 && tally.blocked > 10_000 && tally.between > 10_000, "{tally:?}");
}

/// Slivers and needles across the grid, every other one a veil, and one large triangle that crosses everything.
fn slivers() -> Scene {
    let (mut scene, mut random) = (Scene::empty("slivers"), Random::new(13));
    let veil = Material { alpha: Alpha::Blend, base_color: Vec4::new(0.5, 0.5, 0.5, 0.25), ..Material::default() };
    for material in [Material { double_sided: true, ..Material::lambert("sliver", Vec3::ONE) }, veil] {
        let slivers: Vec<_> = (0..750)
            .map(|i| {
                let [a, b] = [random.point(), random.point()].map(|p| 8.0 * p);
                // Needles are 0.004 voxels wide at most.
                let width = if i % 15 == 0 { 1e-3 } else { 0.25 };
                [a, b, (b + width * random.direction()).clamp(DVec3::ZERO, DVec3::splat(8.0))]
            })
            .collect();
        add(&mut scene, &slivers, material);
    }
    let large = [DVec3::new(0.1, 0.3, 7.9), DVec3::new(7.8, 7.6, 0.2), DVec3::new(0.4, 7.7, 3.1)];
    add(&mut scene, &[large], Material::lambert("large", Vec3::ONE));
    scene
}

#[test]
fn rays_between_slivers_and_needles() {
    // Rounding of a needle's determinant is as large as the needle is wide.
    compare(&slivers(), &voxels(32), 100_000, 0.02);
}
