//! Twins of the GLSL functions that choose the directions and widths of cones.

use glam::{Mat3, Vec2, Vec3};
use std::f32::consts::{FRAC_1_SQRT_2, PI};

use twobounce::gi::cones::choices::{ConeSet, Form, RoughnessFit};

/// One cone of a diffuse set, in the frame whose z is the normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SetCone {
    /// Unit direction.
    pub direction: Vec3,
    /// Tangent of the half angle.
    pub aperture: f32,
    /// Weights of a set sum to 1, so that the gather is E/π.
    pub weight: f32,
}

/// The talk's sets of diffuse cones ("More different possible diffuse cone configurations").
///
/// D6 printed: set 6a's side cones are written about y instead of z. D26 printed: set 16 has equal weights; right:
/// weights ∝ the cosine with the normal, normalised.
pub fn cone_set(set: ConeSet, d6: Form, d26: Form) -> Vec<SetCone> {
    const H: f32 = FRAC_1_SQRT_2;
    let axis = |aperture, weight| (Vec3::Z, aperture, weight);
    let mut cones: Vec<(Vec3, f32, f32)> = match set {
        ConeSet::One => vec![axis(2.0, 1.0)],
        ConeSet::Five => {
            let side = [(0.0, H), (0.0, -H), (H, 0.0), (-H, 0.0)];
            let side = side.map(|(x, y)| (Vec3::new(x, y, H), 1.0, 0.18));
            [vec![axis(1.0, 0.28)], side.to_vec()].concat()
        }
        ConeSet::SixA => {
            let side = [(-0.794654, 0.0), (0.642889, 0.467086), (0.642889, -0.467086)];
            let side = [side.as_slice(), &[(-0.245562, 0.755761), (-0.245562, -0.755761)]].concat();
            let about_y = side.iter().map(|&(x, z)| Vec3::new(x, 0.607062, z));
            let turned = about_y.map(|d| if d6 == Form::Printed { d } else { Vec3::new(d.x, d.z, d.y) });
            [vec![axis(0.5, 1.0)], turned.map(|d| (d, 0.549092, 0.607)).collect()].concat()
        }
        ConeSet::SixB => {
            let side = [(0.0, 0.866025), (0.823639, 0.267617), (0.509037, -0.700629)];
            let side = [side.as_slice(), &[(-0.509037, -0.700629), (-0.823639, 0.267617)]].concat();
            let tan_30 = 0.577_350_3;
            let side = side.iter().map(|&(x, y)| (Vec3::new(x, y, 0.5), tan_30, 0.15));
            [vec![axis(tan_30, 0.25)], side.collect()].concat()
        }
        ConeSet::Sixteen => sixteen().map(|d| (d, 0.3141595, if d26 == Form::Printed { 1.0 } else { d.z })).to_vec(),
        cosine => sunflower(cosine.cosine_count().expect("every other set is cosine-distributed")),
    };
    let total: f32 = cones.iter().map(|c| c.2).sum();
    cones.iter_mut().for_each(|c| c.2 /= total);
    cones.into_iter().map(|(d, aperture, weight)| SetCone { direction: d.normalize(), aperture, weight }).collect()
}

/// `count` directions, cosine-distributed: a sunflower (Vogel's spiral) on the disc, lifted onto the hemisphere.
fn sunflower(count: u32) -> Vec<(Vec3, f32, f32)> {
    let spread = if count < 64 { 0.6 } else { 0.5 };
    let cone = |i: u32| {
        let u = (i as f32 + 0.5) / count as f32;
        let turn = 2.399_963_2 * i as f32;
        let d = Vec3::new(u.sqrt() * turn.cos(), u.sqrt() * turn.sin(), (1.0 - u).sqrt());
        (d, spread / (count as f32).sqrt(), 1.0)
    };
    (0..count).map(cone).collect()
}

/// The position of each of `side`² neighbours within its share of a cosine-distributed set: Hammersley's points, by
/// their first coordinate. The first component moves a direction off the axis, the second turns it (in turns).
pub fn interleaved_shifts(side: u32) -> Vec<Vec2> {
    let count = side * side;
    let point =
        |k: u32| Vec2::new((k as f32 + 0.5) / count as f32, (f64::from(k.reverse_bits()) / f64::from(u32::MAX)) as f32);
    (0..count).map(point).collect()
}

/// The 16 set's directions: the half of a dodecahedron-like set with z > 0.
fn sixteen() -> [Vec3; 16] {
    const A: f32 = 0.898904;
    const B: f32 = 0.435512;
    const C: f32 = 0.0479745;
    const D: f32 = 0.57735;
    [
        [A, B, C],
        [A, -C, B],
        [-A, -B, C],
        [-A, C, B],
        [C, A, B],
        [-B, A, C],
        [-C, -A, B],
        [B, -A, C],
        [B, C, A],
        [-B, -C, A],
        [C, -B, A],
        [-C, B, A],
        [D, D, D],
        [D, -D, D],
        [-D, D, D],
        [-D, -D, D],
    ]
    .map(Vec3::from_array)
}

/// The matrix with the columns tangent, bitangent, normal; right-handed.
///
/// D22 printed: crosses the normal with y or z, whichever gives the longer vector, so the frame jumps by a quarter turn
/// along |n.y| = |n.z|. Right: the shortest rotation that takes z to the normal (Frisvad 2012,
/// doi:10.1080/2165347X.2012.689606, eq. 6), smooth but for its one singular direction, −z.
pub fn tangent_frame(normal: Vec3, d22: Form) -> Mat3 {
    let n = normal;
    if d22 == Form::Printed {
        let (t0, t1) = (Vec3::Y.cross(n), Vec3::Z.cross(n));
        let tangent = if t0.length() < t1.length() { t1 } else { t0 }.normalize();
        let bitangent = tangent.cross(n).normalize();
        return Mat3::from_cols(bitangent.cross(n), bitangent, n);
    }
    if n.z < -0.999_999 {
        return Mat3::from_cols(Vec3::NEG_Y, Vec3::NEG_X, n);
    }
    let a = 1.0 / (1.0 + n.z);
    let b = -n.x * n.y * a;
    Mat3::from_cols(Vec3::new(1.0 - n.x * n.x * a, b, -n.x), Vec3::new(b, 1.0 - n.y * n.y * a, -n.y), n)
}

/// Rotation about a unit axis by `angle` radians (Rodrigues). D7 printed: its transpose, that is by −`angle`.
pub fn rotation(axis: Vec3, angle: f32, d7: Form) -> Mat3 {
    let (sin, cos) = angle.sin_cos();
    let (outer, s) = (1.0 - cos, axis * sin);
    let right = Mat3::from_cols(axis * axis.x * outer, axis * axis.y * outer, axis * axis.z * outer)
        + Mat3::from_cols(Vec3::new(cos, s.z, -s.y), Vec3::new(-s.z, cos, s.x), Vec3::new(s.y, -s.x, cos));
    if d7 == Form::Printed { right.transpose() } else { right }
}

/// The rotation of the cone set about the normal, in radians, for a random number in `[0, 1)`. D8 printed: the number
/// itself, one radian at most; right: a full turn.
pub fn jitter_angle(random: f32, d8: Form) -> f32 {
    if d8 == Form::Printed { random } else { 2.0 * PI * random }
}

/// The talk's three maps from a material's roughness to a specular cone's aperture, the tangent of its half angle
/// (D25), and `ggx`: the cone that spreads light as widely as GGX's lobe.
///
/// The lobe: seen along the normal, visible normals have tan²θ = α²ξ/(1 − ξ) for even ξ; light comes from 2θ, weighed
/// by Smith's G1. The cone: what it reads at distance s through its diameter D = 2as is a box of side D (the mip's
/// mean) under a tent of twice that width (the filter), with a variance of D²/12 + D²/6 = D²/4 along each axis: taken
/// for a Gaussian, half of it lies within √(2 ln 2)·D/2 = 1.177·as. Setting this equal to the angle that holds half of
/// the lobe gives the aperture a, to which 1.70α/(1 + 0.76α²) is fitted: within 2.2 % for all α (a test integrates the
/// lobe).
pub fn roughness_to_aperture(roughness: f32, fit: RoughnessFit) -> f32 {
    let r = roughness.clamp(0.0, 1.0);
    match fit {
        RoughnessFit::Polynomial => (0.000_347_466 + r * (1.333_129 - 0.504_055_3 * r)).tan(),
        RoughnessFit::Power => {
            let power = (2.0 / (r * r).max(1e-4) - 2.0).clamp(4.0, 1024.0 * 16.0);
            0.244f32.powf(1.0 / (power + 1.0)).acos().tan()
        }
        RoughnessFit::Ggx => 1.70 * r * r / (1.0 + 0.76 * r.powi(4)),
        RoughnessFit::Linear => (PI * 0.5 * 0.75 * r).tan().clamp(0.001_745_331, PI),
    }
}

/// A normal of GGX's visible normals for unit `v`, in the frame whose z is the surface's normal, for uniform `u` (Dupuy
/// and Benyoub 2023).
pub fn visible_normal(alpha: f32, v: Vec3, u: Vec2) -> Vec3 {
    let stretched = Vec3::new(alpha * v.x, alpha * v.y, v.z).normalize();
    let (sin, cos) = (2.0 * PI * u.x).sin_cos();
    let z = (1.0 - u.y) * (1.0 + stretched.z) - stretched.z;
    let r = (1.0 - z * z).max(0.0).sqrt();
    let h = Vec3::new(r * cos, r * sin, z) + stretched;
    Vec3::new(alpha * h.x, alpha * h.y, h.z.max(1e-6)).normalize()
}

/// A unit direction refracted at a surface; `incident` and `normal` are unit, `ior` is of the side that the normal
/// points away from.
///
/// D24 printed: refract with 1/ior whatever the side, normalised even where nothing is refracted: NaN. Right: the ratio
/// flips by side, and total reflection reflects.
pub fn refraction_direction(incident: Vec3, normal: Vec3, ior: f32, d24: Form) -> Vec3 {
    if d24 == Form::Printed {
        return refract(incident, normal, 1.0 / ior).normalize();
    }
    let leaving = incident.dot(normal) > 0.0;
    let (normal, eta) = if leaving { (-normal, ior) } else { (normal, 1.0 / ior) };
    match refract(incident, normal, eta) {
        Vec3::ZERO => incident.reflect(normal),
        refracted => refracted.normalize(),
    }
}

/// GLSL's `refract`: zero at total reflection.
fn refract(incident: Vec3, normal: Vec3, eta: f32) -> Vec3 {
    let cosine = normal.dot(incident);
    let k = 1.0 - eta * eta * (1.0 - cosine * cosine);
    if k < 0.0 { Vec3::ZERO } else { eta * incident - (eta * cosine + k.sqrt()) * normal }
}

/// The start of a refraction cone, `voxels` of 1/`edge` off the surface. D23 printed: along the normal, on the side of
/// arrival; right: on the side that `direction` leads to.
pub fn refraction_origin(from: Vec3, normal: Vec3, direction: Vec3, voxels: f32, edge: u32, d23: Form) -> Vec3 {
    let side = if d23 == Form::Right && direction.dot(normal) < 0.0 { -1.0 } else { 1.0 };
    from + normal * (side * voxels / edge as f32)
}
