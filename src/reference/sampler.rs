//! Random numbers for paths: Sobol points in sets of four dimensions, Owen-scrambled with hashes (Burley 2020,
//! "Practical Hash-based Owen Scrambling").
//!
//! A number depends only on (seed, pixel, sample, dimension), not on threads or the order of work. Even and odd samples
//! come from two independently scrambled sequences, so half the difference of their means estimates the noise.

/// Dimensions per jointly stratified set.
const SET: usize = 4;

/// Direction numbers of the first four Sobol dimensions (Joe and Kuo 2008), by bit of the index.
const DIRECTIONS: [[u32; 32]; SET] =
    [directions(0, 0, [0; 3]), directions(1, 0, [1, 0, 0]), directions(2, 1, [1, 3, 0]), directions(3, 1, [1, 3, 1])];

/// `TABLE[dimension][byte][value]`: the product of the generator matrix and one byte of the index.
static TABLE: [[[u32; 256]; 4]; SET] = table();

/// `degree` and `polynomial` are Joe and Kuo's s and a; `m` their initial values.
const fn directions(degree: usize, polynomial: u32, m: [u32; 3]) -> [u32; 32] {
    let mut v = [0u32; 32];
    let mut i = 0;
    while i < 32 {
        v[i] = if degree == 0 {
            1 << (31 - i)
        } else if i < degree {
            m[i] << (31 - i)
        } else {
            let mut x = v[i - degree] ^ (v[i - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if (polynomial >> (degree - 1 - k)) & 1 == 1 {
                    x ^= v[i - k];
                }
                k += 1;
            }
            x
        };
        i += 1;
    }
    v
}

const fn table() -> [[[u32; 256]; 4]; SET] {
    let mut table = [[[0u32; 256]; 4]; SET];
    let mut i = 0;
    while i < SET * 4 * 256 {
        let (d, byte, value) = (i / 1024, i / 256 % 4, i % 256);
        if value > 0 {
            // Without its lowest bit the value precedes this one.
            let bit = value.trailing_zeros() as usize;
            table[d][byte][value] = table[d][byte][value & (value - 1)] ^ DIRECTIONS[d][byte * 8 + bit];
        }
        i += 1;
    }
    table
}

/// A well-mixed 32-bit hash of `x` (Wellons' lowbias32).
#[inline]
pub fn hash(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

#[inline]
fn combine(a: u32, b: u32) -> u32 {
    hash(a ^ b.wrapping_mul(0x9e37_79b9).wrapping_add(0x85eb_ca6b))
}

/// Owen scrambling: a hash of the bits above flips each bit (Laine and Karras' hash with Vegdahl's constants).
#[inline]
fn owen(x: u32, seed: u32) -> u32 {
    let mut x = x.reverse_bits();
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// A number in [0, 1) from the upper 24 bits.
fn unit(x: u32) -> f32 {
    (x >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// The random numbers of one path.
#[derive(Clone, Copy, Debug)]
pub struct Sampler {
    stream: u32,
    index: u32,
    events: u32,
}

impl Sampler {
    /// The numbers of one sample of a pixel.
    pub fn new(seed: u64, x: u32, y: u32, sample: u32) -> Self {
        let stream = combine(combine(combine(combine(seed as u32, (seed >> 32) as u32), x), y), sample & 1);
        Self { stream, index: sample >> 1, events: 0 }
    }

    /// Four numbers that are jointly stratified over the samples of the pixel. Different sets are independent.
    #[inline]
    pub fn set(&self, set: u32) -> [f32; SET] {
        let seed = combine(self.stream, set);
        let i = owen(self.index, seed).to_le_bytes();
        std::array::from_fn(|d| {
            let t = &TABLE[d];
            let x = t[0][i[0] as usize] ^ t[1][i[1] as usize] ^ t[2][i[2] as usize] ^ t[3][i[3] as usize];
            unit(owen(x, combine(seed, d as u32)))
        })
    }

    /// The next unstratified random number, for an unknown number of decisions.
    pub fn event(&mut self) -> f32 {
        self.events += 1;
        unit(combine(combine(self.stream ^ 0x5bd1_e995, self.index), self.events))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The first 16 samples of each half put one point into each cell of every 4×4 grid over a pair of dimensions (and
    /// into each cell of 1×16 and 2×8 grids for the first pair, whose net has quality 0).
    #[test]
    fn points_are_stratified() {
        for set in 0..8 {
            let points: Vec<_> = (0..16).map(|i| Sampler::new(7, 3, 5, 2 * i).set(set)).collect();
            for (nx, ny) in [(16, 1), (8, 2), (4, 4), (2, 8), (1, 16)] {
                let mut seen = [0; 16];
                for p in &points {
                    seen[(p[0] * nx as f32) as usize + nx * (p[1] * ny as f32) as usize] += 1;
                }
                assert!(seen.iter().all(|&n| n == 1), "set {set}, {nx}×{ny}: {seen:?}");
            }
            for d in 2..SET {
                let mut seen = [0; 16];
                points.iter().for_each(|p| seen[(p[d] * 16.0) as usize] += 1);
                assert!(seen.iter().all(|&n| n == 1), "set {set}, dimension {d}");
            }
        }
    }

    #[test]
    fn sets_and_seeds_are_independent() {
        let n = 4096;
        for (a, b) in [((1, 0), (1, 1)), ((1, 0), (2, 0)), ((1, 3), (9, 3))] {
            let covariance: f32 = (0..n)
                .map(|i| {
                    (Sampler::new(a.0, 0, 0, i).set(a.1)[0] - 0.5) * (Sampler::new(b.0, 0, 0, i).set(b.1)[0] - 0.5)
                })
                .sum::<f32>()
                / n as f32;
            // The standard deviation of the mean of products of two uniform numbers is (1/12)/√n; the tolerance is five
            // of them.
            assert!(covariance.abs() < 5.0 / 12.0 / (n as f32).sqrt(), "{covariance}");
        }
    }
}
