//! Shapes as triangles, counter-clockwise seen from outside. In closed ones each edge has its reverse, by position.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3, dvec2, dvec3};
use serde::Deserialize;

/// A shape of a description.
#[derive(Clone, Deserialize, PartialEq)]
#[serde(rename_all = "lowercase")]
pub enum Form {
    /// A parallelogram with normal `u` × `v`. Its uv goes from (0, `repeat.y`) at `corner` to (`repeat.x`, 0) at the
    /// opposite corner; `repeat` is (1, 1) if absent.
    Quad { corner: [f64; 3], u: [f64; 3], v: [f64; 3], repeat: Option<[f64; 2]> },
    /// Closed boxes between two corners each; then rotated by an angle in radians around the Y axis, and translated.
    Boxes { corners: Vec<[[f64; 3]; 2]>, moved: Option<(f64, [f64; 3])> },
    /// A closed sphere around the origin with `rings` of latitude and `segments` of longitude.
    Sphere { radius: f64, rings: u32, segments: u32 },
    /// A closed sphere as above with a morph target that gives it eight lobes, four outward and four inward, by this
    /// share of the radius.
    Blob { radius: f64, rings: u32, segments: u32, lobes: f64 },
    /// A closed ellipsoid about the Y axis that stands at the origin.
    Blade { radius: f64, height: f64 },
    /// A trefoil knot in all colours around the Z axis.
    Knot {},
    /// A tube around a circle in the plane of X and Y.
    Ring { radius: f64 },
}

/// Triangles with normals; `uvs` and `colors` are empty or one per vertex.
#[derive(Clone, Default)]
pub struct Shape {
    pub positions: Vec<DVec3>,
    pub normals: Vec<DVec3>,
    pub uvs: Vec<DVec2>,
    /// Linear Rec. 709.
    pub colors: Vec<DVec3>,
    pub indices: Vec<u32>,
    /// Differences that a morph target adds to positions and normals.
    pub morph: Option<(Vec<DVec3>, Vec<DVec3>)>,
}

impl Shape {
    pub fn of_form(form: &Form) -> Self {
        match form {
            &Form::Quad { corner, u, v, repeat } => {
                Self::quad(corner.into(), u.into(), v.into(), repeat.map_or(DVec2::ONE, DVec2::from))
            }
            Form::Boxes { corners, moved } => {
                let mut shape = Self::default();
                corners.iter().for_each(|&[min, max]| shape.add_box(min.into(), max.into()));
                moved.map_or(shape.clone(), |(angle, by)| shape.moved(angle, by.into()))
            }
            &Form::Sphere { radius, rings, segments } => Self::sphere(radius, rings, segments),
            &Form::Blob { radius, rings, segments, lobes } => Self::sphere(radius, rings, segments).lobed(lobes),
            &Form::Blade { radius, height } => {
                let sphere = Self::sphere(1.0, 32, 10);
                let half = dvec3(radius, 0.5 * height, radius);
                Self {
                    positions: sphere.positions.iter().map(|p| (*p + DVec3::Y) * half).collect(),
                    normals: sphere.normals.iter().map(|n| (*n / half).normalize()).collect(),
                    ..sphere
                }
            }
            Form::Knot {} => {
                let curve = |t: f64| {
                    let t = t * TAU;
                    dvec3(t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos(), -(3.0 * t).sin()) * 0.088
                };
                let hue = |p: &DVec3| {
                    let angle = p.y.atan2(p.x);
                    DVec3::from([0.0, 1.0, 2.0].map(|third| 0.42 + 0.4 * (angle + third * TAU / 3.0).cos()))
                };
                let knot = Self::tube(curve, 0.055, 128, 14);
                Self { colors: knot.positions.iter().map(hue).collect(), ..knot }
            }
            Form::Ring { radius } => {
                let circle = |t: f64| dvec3((t * TAU).cos(), (t * TAU).sin(), 0.0) * *radius;
                Self::tube(circle, 0.04, 64, 12)
            }
        }
    }

    fn quad(corner: DVec3, u: DVec3, v: DVec3, repeat: DVec2) -> Self {
        Self {
            positions: vec![corner, corner + u, corner + u + v, corner + v],
            normals: vec![u.cross(v).normalize(); 4],
            uvs: vec![dvec2(0.0, repeat.y), repeat, dvec2(repeat.x, 0.0), DVec2::ZERO],
            colors: vec![],
            indices: vec![0, 1, 2, 0, 2, 3],
            morph: None,
        }
    }

    fn add_box(&mut self, min: DVec3, max: DVec3) {
        let size = max - min;
        for axis in 0..3 {
            let (mut u, mut v) = (DVec3::ZERO, DVec3::ZERO);
            u[(axis + 1) % 3] = size[(axis + 1) % 3];
            v[(axis + 2) % 3] = size[(axis + 2) % 3];
            let mut high = min;
            high[axis] = max[axis];
            self.append(&Self::quad(high, u, v, DVec2::ONE));
            self.append(&Self::quad(min, v, u, DVec2::ONE));
        }
    }

    fn sphere(radius: f64, rings: u32, segments: u32) -> Self {
        let mut normals = vec![DVec3::Y];
        for ring in 1..rings {
            let (sin, cos) = (PI * f64::from(ring) / f64::from(rings)).sin_cos();
            normals.extend((0..segments).map(|segment| {
                let (z, x) = (TAU * f64::from(segment) / f64::from(segments)).sin_cos();
                dvec3(x * sin, cos, z * sin)
            }));
        }
        normals.push(DVec3::NEG_Y);
        let (south, last) = (normals.len() as u32 - 1, normals.len() as u32 - 1 - segments);
        let mut indices = vec![];
        for s in 0..segments {
            let next = (s + 1) % segments;
            indices.extend([0, 1 + next, 1 + s]);
            for row in (1..last).step_by(segments as usize) {
                let (a, b, below) = (row + s, row + next, segments);
                indices.extend([a, b, b + below, a, b + below, a + below]);
            }
            indices.extend([last + s, last + next, south]);
        }
        let positions = normals.iter().map(|normal| *normal * radius).collect();
        Self { positions, normals, indices, ..Self::default() }
    }

    /// The radius of a sphere becomes r (1 + a y) with y = 3√3 x y z of the direction; its gradient along the sphere
    /// rotates the normals.
    fn lobed(self, a: f64) -> Self {
        let moved = |&n: &DVec3| {
            let (height, slope) = (n.x * n.y * n.z, dvec3(n.y * n.z, n.x * n.z, n.x * n.y));
            let (height, slope) = (27f64.sqrt() * height, 27f64.sqrt() * slope.reject_from_normalized(n));
            (n * a * height, (n - slope * a / (1.0 + a * height)).normalize() - n)
        };
        let (positions, normals): (Vec<DVec3>, Vec<DVec3>) = self.normals.iter().map(moved).unzip();
        let radius = self.positions[0].length();
        Self { morph: Some((positions.iter().map(|p| *p * radius).collect(), normals)), ..self }
    }

    /// A closed tube of `radius` around the closed curve `curve` (parameter 0 to 1), with `along` × `around` quads.
    ///
    /// The cross-sections follow the curve's Frenet frame, so its curvature must not be 0 anywhere.
    fn tube(curve: impl Fn(f64) -> DVec3, radius: f64, along: u32, around: u32) -> Self {
        // Central differences with an error of about 1e-6 rotate the cross-sections slightly; the tube stays closed.
        const H: f64 = 1e-3;
        let mut shape = Self::default();
        for i in 0..along {
            let t = f64::from(i) / f64::from(along);
            let (before, here, after) = (curve(t - H), curve(t), curve(t + H));
            let tangent = (after - before).normalize();
            let inward = (after - 2.0 * here + before).reject_from_normalized(tangent).normalize();
            let binormal = tangent.cross(inward);
            for j in 0..around {
                let (sin, cos) = (TAU * f64::from(j) / f64::from(around)).sin_cos();
                let normal = inward * cos + binormal * sin;
                shape.positions.push(here + normal * radius);
                shape.normals.push(normal);
                let (next_i, next_j) = ((i + 1) % along, (j + 1) % around);
                let [a, b] = [i * around + j, i * around + next_j];
                let [c, d] = [next_i * around + next_j, next_i * around + j];
                shape.indices.extend([a, b, c, a, c, d]);
            }
        }
        shape
    }

    fn moved(mut self, angle: f64, by: DVec3) -> Self {
        let turn = glam::DQuat::from_rotation_y(angle);
        self.positions.iter_mut().for_each(|p| *p = turn * *p + by);
        self.normals.iter_mut().for_each(|n| *n = turn * *n);
        self
    }

    fn append(&mut self, other: &Self) {
        let base = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.normals.extend(&other.normals);
        self.uvs.extend(&other.uvs);
        self.indices.extend(other.indices.iter().map(|i| base + i));
    }
}
