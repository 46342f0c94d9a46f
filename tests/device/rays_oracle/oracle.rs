//! Oracle of the hits that rays and shadow rays must find: brute force over all recorded triangles.
//!
//! The oracle evaluates the shader's formula (Möller and Trumbore 1997) in f64, with a bound of f32's rounding. A hit
//! is *certain* if it exists whatever the rounding, and *possible* if rounding may create it: at edges, where the
//! shader's tolerance of 10⁻⁵ counts as rounding, at the ends of a ray, and behind another triangle at the same
//! distance. Where only certain hits decide, a ray has one right answer; every other ray is *undecided*: any answer
//! that rounding explains is right, and the share of such rays is bounded.

use std::sync::Arc;

use bytemuck::{Pod, Zeroable};
use glam::{DVec2, DVec3, Vec2, Vec3, Vec4};
use twobounce::ground::layout;
use twobounce::renderer::Renderer;
use twobounce::scene::surface::{SurfaceParams, SurfacePoint};
use twobounce::scene::texture::Textures;
use twobounce::scene::{Alpha, Material, Scene};
use twobounce::vk::{Context, download};

use crate::gpu::twins::record::record;

/// Rounding of the shader's products, over the product of the lengths that enter: eight roundings of f32, from two
/// differences through a cross product to a scalar product, of terms whose sizes add up to √2 times that at most.
const ROUNDING: f64 = 12.0 / (1 << 24) as f64;
/// Rounding of a quotient, and of the distance of a voxel's plane.
const QUOTIENT_ROUNDING: f64 = 8.0 / (1 << 24) as f64;
/// The shader's tolerance at edges, in barycentric weights.
const EDGE_TOLERANCE: f64 = 1.001e-5;
/// Relative error per passed surface: its optical depth is cut off after 16 bits, a factor of 2^(2⁻¹⁶). Twice that for
/// the precision that Vulkan requires of log2 and exp2.
const DEPTH_ROUNDING: f64 = 2.2e-5;
/// Error of a linear colour: Vulkan allows the decoding of sRGB half a step of 8 bits, up to 4.5·10⁻³; lavapipe takes
/// 1.2·10⁻³, an NVIDIA H200 2.9·10⁻³.
const DECODING: f64 = 2e-3;
const GPU_DECODING: f64 = 4.5e-3;
/// A GPU's filter resolves positions between texels to 2⁻⁸: in coordinates of a texture of four texels, scaled by 0.9.
const FILTERING: f32 = 1.1e-3;
/// A shadow ray is undecided if its bounds are further apart than this, which exceeds the rounding of colours.
const APART: f64 = 0.02;
/// The shader's word for opaque is 2⁻²⁹.
const OPAQUE: f64 = 2e-9;
/// Distance in voxels along the facet's normal at which a ray from a surface starts.
const RAY_START: f64 = 1e-3;

/// Twin of `Ray` in glsl/test/rays.comp.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Ray {
    pub position: [f32; 3],
    pub least: f32,
    pub d: [f32; 3],
    pub distance: f32,
    pub facet: [f32; 3],
}

/// Twin of `Found` in glsl/test/rays.comp.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Found {
    pub origin: [f32; 3],
    pub source: u32,
    pub uv: [f32; 2],
    pub distance: f32,
    pub sides: u32,
    pub passed: [f32; 3],
}

/// A recorded triangle.
pub struct Facet {
    a: DVec3,
    pub edges: [DVec3; 2],
    lengths: [f64; 2],
    /// Unit.
    pub normal: DVec3,
    source: u32,
    /// Index into the scene's materials.
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
    /// `uvs`, `colors`: those of its corners.
    fn new(triangle: &layout::Triangle, material: usize, uvs: [[f32; 4]; 3], colors: [[f32; 4]; 3]) -> Self {
        let [a, b, c] = triangle.corners.map(|v| Vec3::from(v).as_dvec3());
        let edges = [b - a, c - a];
        Self {
            a,
            edges,
            lengths: edges.map(|e| e.length()),
            normal: edges[0].cross(edges[1]).normalize(),
            source: triangle.source,
            material,
            uvs: [0, 2].map(|k| uvs.map(|uv| Vec2::new(uv[k], uv[k + 1]))),
            colors: colors.map(Vec4::from),
        }
    }

    pub fn at(&self, uv: DVec2) -> DVec3 {
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
        // Too nearly parallel for f32: the determinant may have either sign.
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

/// The number of rays compared with the oracle, and their results.
#[derive(Debug, Default)]
pub struct Tally {
    rays: usize,
    pub hits: usize,
    pub undecided_hits: usize,
    /// Shadow rays by the share that passes: all, none, or between.
    pub open: usize,
    pub blocked: usize,
    pub between: usize,
    pub undecided_shadows: usize,
    pub wrong: Vec<String>,
}

impl Tally {
    pub fn and(mut self, other: Self) -> Self {
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

pub struct Oracle {
    scene: Scene,
    textures: Textures,
    pub facets: Vec<Facet>,
    /// The errors of texture coordinates and of decoded colours.
    filtering: f32,
    decoding: f64,
}

impl Oracle {
    pub fn new(context: &Arc<Context>, renderer: &Renderer) -> Self {
        let scene = renderer.scene().clone();
        let recorded = record(&scene, &scene.pose(None, 0.0));
        let globals: layout::Globals = download(context, &renderer.ground().base().globals).expect("counters")[0];
        let triangles: Vec<layout::Triangle> = download(context, &renderer.ground().triangles).expect("triangles");
        let count = globals.vertex_count as usize / 3;
        assert_eq!(count + globals.degenerate_count as usize, recorded.len(), "{}", scene.name);
        let words: Vec<u32> = download(context, &renderer.ground().attributes).expect("attributes");
        let corner = renderer.ground().scene.corner;
        let facet = |(place, t): (usize, &layout::Triangle)| {
            let uvs = [0, 1, 2].map(|k| corner.uv(&words, place, k));
            let colors = [0, 1, 2].map(|k| corner.color(&words, place, k));
            Facet::new(t, recorded[t.source as usize].material, uvs, colors)
        };
        let mut facets: Vec<Facet> = triangles[..count].iter().enumerate().map(facet).collect();
        // The device records triangles in any order; rays are aimed at them in theirs.
        facets.sort_by_key(|facet| facet.source);
        let edge = f64::from(renderer.ground().desc.grid.edge);
        let within = |p: DVec3| p.min_element() > 0.0 && p.max_element() < edge;
        assert!(facets.iter().all(|f| [DVec2::ZERO, DVec2::X, DVec2::Y].iter().all(|&uv| within(f.at(uv)))));
        let (filtering, decoding) = if context.is_cpu { (0.0, DECODING) } else { (FILTERING, GPU_DECODING) };
        Self { textures: Textures::of_materials(&scene, &scene.materials), scene, facets, filtering, decoding }
    }

    pub fn check(&self, ray: &Ray, nearest: &Found, shadow: &Found) -> Tally {
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

    /// Whether the found hit is right, and whether it is the only right answer.
    fn nearest_is_right(&self, least: f64, d: DVec3, all: &[(&Facet, Crossing)], found: &Found) -> (bool, bool) {
        let certain = all.iter().filter(|(f, c)| c.inside && c.t - c.t_rounding > least && self.presence(f, c)[0]);
        let nearest = certain.map(|(_, c)| c.t + c.t_rounding).fold(f64::INFINITY, f64::min);
        let possible = |c: &Crossing| c.t + c.t_rounding > least && c.t - c.t_rounding <= nearest;
        let possible: Vec<_> = all.iter().filter(|(f, c)| possible(c) && self.presence(f, c)[1]).collect();
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

    /// Which side was met, whether it is dark, and the share of light that passes the triangle.
    fn sides_are_right(&self, facet: &Facet, d: DVec3, crossing: &Crossing, found: &Found) -> bool {
        let cosine = facet.normal.dot(d);
        let (back, dark) = (found.sides & 1 != 0, found.sides & 2 != 0);
        let side = back == (cosine > 0.0) || cosine.abs() < 1e-6;
        let [low, high] = self.through(facet, crossing);
        let passed = Vec3::from(found.passed).as_dvec3();
        let light = passed.cmpge(low - 1e-6).all() && passed.cmple(high + 1e-6).all();
        side && light && dark == (back && !self.scene.materials[facet.material].double_sided)
    }

    /// Share of the light that passes a triangle, within the rounding of the point and of a mask's cutoff.
    fn through(&self, facet: &Facet, crossing: &Crossing) -> Bounds {
        let material = &self.scene.materials[facet.material];
        if material.alpha == Alpha::Opaque && material.transmission == 0.0 {
            return [DVec3::ZERO; 2];
        }
        let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
        for at in self.surfaces(facet, crossing) {
            let opacity = f64::from(at.opacity.clamp(0.0, 1.0));
            let light = DVec3::ONE - opacity + opacity * at.base_color.as_dvec3() * f64::from(at.transmission);
            let textured = material.base_color_texture.is_some();
            let decoding = if textured { opacity * f64::from(at.transmission) * self.decoding } else { 0.0 };
            bounds = [bounds[0].min(light - decoding), bounds[1].max(light + decoding)];
        }
        bounds
    }

    /// Whether a mask keeps the triangle there: certainly, and within rounding.
    fn presence(&self, facet: &Facet, crossing: &Crossing) -> [bool; 2] {
        if !matches!(self.scene.materials[facet.material].alpha, Alpha::Mask(_)) {
            return [true; 2];
        }
        let present: Vec<bool> = self.surfaces(facet, crossing).map(|at| at.opacity > 0.0).collect();
        [present.iter().all(|present| *present), present.contains(&true)]
    }

    /// Surfaces that a triangle's material may give there, within the rounding of the point, of texels and of a mask's
    /// cutoff.
    fn surfaces(&self, facet: &Facet, crossing: &Crossing) -> impl Iterator<Item = SurfaceParams> {
        let material = &self.scene.materials[facet.material];
        let mut cutoffs = vec![material.clone()];
        if let Alpha::Mask(cutoff) = material.alpha {
            // The shader treats differences up to 10⁻⁵ as equal.
            cutoffs.push(Material { alpha: Alpha::Mask(cutoff - 1.2e-5), ..material.clone() });
        }
        let corners = [DVec2::ZERO, DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)];
        let beside = if self.filtering > 0.0 { &corners[..] } else { &corners[..1] };
        let offsets: Vec<_> =
            corners.iter().flat_map(|corner| beside.iter().map(move |beside| (*corner, *beside))).collect();
        let (uv, uv_rounding) = (crossing.uv, crossing.uv_rounding);
        offsets.into_iter().flat_map(move |(corner, beside)| {
            let uv = (uv + corner * (uv_rounding + 1e-6)).clamp(DVec2::splat(-1.0), DVec2::splat(2.0));
            let weights = [1.0 - uv.x - uv.y, uv.x, uv.y];
            let beside = beside.as_vec2() * self.filtering;
            let mean = |at: [Vec2; 3]| (0..3).map(|i| at[i].as_dvec2() * weights[i]).sum::<DVec2>().as_vec2() + beside;
            let color = (0..3).map(|i| facet.colors[i] * weights[i] as f32).sum();
            let point = SurfacePoint { uvs: facet.uvs.map(mean), color, footprint: [0.0; 2] };
            let evaluate = |material: &Material| material.evaluate(&self.scene, &self.textures, &point);
            cutoffs.iter().map(evaluate).collect::<Vec<_>>()
        })
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
        // Certain opaque triangles leave 0 and nothing else.
        [low / rounding - OPAQUE, high * rounding + if high == DVec3::ZERO { 0.0 } else { OPAQUE }]
    }
}

/// Whether rounding may move a crossing from one voxel to the next. A surface within rounding of the plane between two
/// voxels is listed in one of them, and its hit may count for the other: shadow rays then pass it.
fn straddles(origin: DVec3, d: DVec3, c: &Crossing) -> bool {
    let slack = c.t_rounding + QUOTIENT_ROUNDING * (1.0 + c.t.abs());
    let [near, far] = [c.t - slack, c.t + slack].map(|t| origin + d * t);
    (0..3).any(|axis| d[axis] != 0.0 && near[axis].floor() != far[axis].floor())
}
