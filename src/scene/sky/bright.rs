//! Converts the bright part of a map, which random directions rarely find, to lights: a sun becomes one light, a glow
//! or softboxes a few.

use std::f64::consts::PI;

use glam::{DMat3, DVec3, Vec3};

use super::{Texels, middle};

/// Texels brighter than this multiple of the mean of the rest are bright.
const BRIGHT: f64 = 8.0;
/// A bright part that sends less than this share of all light stays in the map.
const LEAST_SHARE: f64 = 0.01;
/// The maximum number of lights, because each costs shadow rays at every lit point.
const MOST_LIGHTS: usize = 8;
/// A light is not split further if its share of the bright part, times 1 − the cosine of its half angle, is below this:
/// 2.6° for a light with all of it.
const EVEN: f64 = 1e-3;
/// Bins per factor of two in the histogram of brightness.
const BINS: f64 = 16.0;

/// A disc that represents a part of the sky's bright texels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkyLight {
    /// Unit direction from the scene.
    pub towards: DVec3,
    /// Irradiance on a surface that faces the disc.
    pub irradiance: Vec3,
    /// Tangent of the half angle of the disc.
    pub radius: f32,
}

/// The largest channel of the remaining map (infinite without bright texels) and the lights, both in the scale of the
/// texels.
pub fn part(texels: &Texels) -> (f32, Vec<SkyLight>) {
    let most = brightest_of_rest(texels);
    let mut bright = Vec::new();
    for y in 0..texels.height {
        let solid_angle = texels.solid_angle(y);
        for x in 0..texels.width {
            let (texel, rest) = (texels.get(x, y), texels.dimmed(x, y, most));
            if texel != rest {
                let towards = middle(x, y, [texels.width, texels.height]);
                bright.push(Bright { towards, flux: (texel - rest).as_dvec3() * solid_angle, solid_angle });
            }
        }
    }
    let sent: DVec3 = bright.iter().map(|b| b.flux).sum();
    let all = 4.0 * PI * texels.mean(f32::INFINITY);
    if sent.max_element() < LEAST_SHARE * all.max_element() {
        return (f32::INFINITY, Vec::new());
    }
    let mut parts = vec![Cluster::new(bright)];
    while parts.len() < MOST_LIGHTS {
        let power = |part: &Cluster| part.power / sent.element_sum() * (1.0 - part.cosine);
        let (widest, spread) = parts.iter().map(power).enumerate().fold((0, 0.0), |a, b| if b.1 > a.1 { b } else { a });
        if spread < EVEN || parts[widest].texels.len() < 2 {
            break;
        }
        let [low, high] = parts.swap_remove(widest).halves();
        parts.extend([low, high]);
    }
    (most, parts.iter().map(Cluster::light).collect())
}

/// The highest brightness that is [`BRIGHT`] times the mean of all texels below it. Without such a threshold the bright
/// parts are so wide that random directions find them.
fn brightest_of_rest(texels: &Texels) -> f32 {
    let bins = 64 * BINS as usize;
    let mut counted = vec![(0.0, 0.0); bins];
    for y in 0..texels.height {
        let solid_angle = texels.solid_angle(y);
        for x in 0..texels.width {
            let bright = f64::from(texels.get(x, y).max_element());
            let bin = ((bright.max(1e-12).log2() + 40.0) * BINS) as usize;
            let bin = &mut counted[bin.min(bins - 1)];
            *bin = (bin.0 + solid_angle, bin.1 + solid_angle * bright);
        }
    }
    let mean = |most: f64| {
        let below = |(solid_angle, sum): &(f64, f64)| sum.min(most * solid_angle);
        counted.iter().map(below).sum::<f64>() / (4.0 * PI)
    };
    let mut most = BRIGHT * mean(f64::INFINITY);
    for _ in 0..1000 {
        let next = BRIGHT * mean(most);
        if next > most * (1.0 - 1e-6) {
            break;
        }
        most = next;
    }
    most as f32
}

/// Light of a bright texel above the part that stays in the map.
#[derive(Clone, Copy)]
struct Bright {
    towards: DVec3,
    /// Radiance × solid angle.
    flux: DVec3,
    solid_angle: f64,
}

impl Bright {
    fn power(&self) -> f64 {
        self.flux.element_sum()
    }
}

/// Bright texels that one light represents.
struct Cluster {
    texels: Vec<Bright>,
    power: f64,
    /// Sum of power × direction.
    sum: DVec3,
    /// Cosine of the half angle of a disc with the same spread.
    cosine: f64,
}

impl Cluster {
    fn new(texels: Vec<Bright>) -> Self {
        let power: f64 = texels.iter().map(Bright::power).sum();
        let sum: DVec3 = texels.iter().map(|b| b.towards * b.power()).sum();
        // Directions spread evenly over a disc have a mean of length (1 + cos)/2; a texel is itself a small disc.
        let own = texels.iter().map(|b| b.solid_angle * b.power()).sum::<f64>() / power;
        let length = sum.length() / power * (1.0 - own / (4.0 * PI));
        Self { power, sum, cosine: (2.0 * length - 1.0).clamp(0.0, 1.0), texels }
    }

    /// Splits the texels through their mean, across the direction of their largest extent.
    fn halves(self) -> [Self; 2] {
        let middle = self.sum / self.power;
        let mut spread = DMat3::ZERO;
        for b in &self.texels {
            let off = b.towards - middle;
            spread += DMat3::from_cols(off * off.x, off * off.y, off * off.z) * b.power();
        }
        // The power method suffices, because the axis need not be exact.
        let mut axis = DVec3::new(0.6, 0.5, 0.62);
        for _ in 0..50 {
            axis = (spread * axis).normalize_or(axis);
        }
        let (low, high): (Vec<_>, Vec<_>) =
            self.texels.iter().copied().partition(|b| (b.towards - middle).dot(axis) < 0.0);
        if low.is_empty() || high.is_empty() {
            let (low, high) = self.texels.split_at(self.texels.len() / 2);
            return [low, high].map(|half| Self::new(half.to_vec()));
        }
        [Self::new(low), Self::new(high)]
    }

    fn light(&self) -> SkyLight {
        let towards = self.sum.normalize_or(DVec3::Y);
        let irradiance: DVec3 = self.texels.iter().map(|b| b.flux * b.towards.dot(towards)).sum();
        let radius = (1.0 / (self.cosine * self.cosine).max(1e-4) - 1.0).sqrt() as f32;
        SkyLight { towards, irradiance: irradiance.max(DVec3::ZERO).as_vec3(), radius }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::sky::SkyMap;
    use crate::scene::sky::tests::sky_of;

    fn lights_of(radiance: impl Fn(DVec3) -> Vec3) -> SkyMap {
        sky_of(256, 128, radiance)
    }

    /// A disc of half angle a has the irradiance π sin² a times its radiance; the part that stays in the map is small
    /// here.
    #[test]
    fn suns_are_discs_of_their_size_apart() {
        let suns = [
            (DVec3::new(0.3, 0.8, 0.5).normalize(), 0.1, 3000.0),
            (DVec3::new(-0.9, 0.2, 0.1).normalize(), 0.06, 1000.0),
        ];
        let map = lights_of(|d| {
            let inside = |sun: &&(DVec3, f64, f32)| d.dot(sun.0) > sun.1.cos();
            Vec3::splat(suns.iter().find(inside).map_or(1.0, |sun| sun.2))
        });
        for (towards, angle, radiance) in suns {
            let near = map.lights.iter().filter(|light| light.towards.dot(towards) > (1.5 * angle).cos());
            let irradiance: f32 = near.map(|light| light.irradiance.x).sum();
            let expected = radiance * (PI * angle.sin().powi(2)) as f32;
            // The outline in texels of 1.4°: the smaller disc is nine texels wide.
            assert!((irradiance / expected - 1.0).abs() < 0.05, "{towards}: {irradiance} of {expected}");
        }
        assert!(map.lights.len() <= MOST_LIGHTS);
        assert!(map.brightest_of_rest() < 10.0, "{}", map.brightest_of_rest());
    }

    #[test]
    fn wide_and_even_skies_have_no_bright_part() {
        assert_eq!(lights_of(|d| Vec3::splat(if d.y > 0.2 { 30.0 } else { 0.1 })).lights, []);
        assert_eq!(lights_of(|d| Vec3::splat((1.0 + d.x) as f32)).lights, []);
    }
}
