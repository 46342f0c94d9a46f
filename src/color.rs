//! The encoding of colours in 8-bit images, and colour spaces of other primaries.

use glam::{DMat3, DVec2, DVec3};

/// sRGB to linear, both in [0, 1] (IEC 61966-2-1).
pub fn linear_from_srgb(encoded: f32) -> f32 {
    if encoded <= 0.04045 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) }
}

/// Linear to sRGB, both in [0, 1] (IEC 61966-2-1).
pub fn srgb_from_linear(linear: f32) -> f32 {
    if linear <= 0.003_130_8 { linear * 12.92 } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 }
}

/// The primaries of a colour space and its white point, in the CIE's x and y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chromaticities {
    pub primaries: [DVec2; 3],
    pub white: DVec2,
}

/// Rec. 709, with the white point D65.
pub const REC_709: Chromaticities = Chromaticities {
    primaries: [DVec2::new(0.64, 0.33), DVec2::new(0.3, 0.6), DVec2::new(0.15, 0.06)],
    white: DVec2::new(0.3127, 0.329),
};

/// Stated chromaticities within this distance of [`REC_709`] count as Rec. 709: some writers round to three digits.
const ROUNDING: f64 = 0.001;

impl Chromaticities {
    /// The matrix from a linear colour to XYZ. The white (1, 1, 1) has luminance 1. `None` if the primaries span no
    /// plane or a luminance is 0.
    pub fn xyz_from_rgb(&self) -> Option<DMat3> {
        let xyz = |c: DVec2| DVec3::new(c.x, c.y, 1.0 - c.x - c.y) / c.y;
        let primaries = DMat3::from_cols_array_2d(&self.primaries.map(|c| xyz(c).to_array()));
        let shares = primaries.inverse() * xyz(self.white);
        let usable = primaries.determinant().abs() > 1e-9 && shares.is_finite() && shares.abs().min_element() > 0.0;
        usable.then(|| primaries * DMat3::from_diagonal(shares))
    }

    /// The matrix from a linear colour to linear Rec. 709. Bradford's transform maps its white to that of Rec. 709. The
    /// result is the identity for Rec. 709 itself, and `None` as for [`Self::xyz_from_rgb`].
    pub fn rec_709_from_rgb(&self) -> Option<DMat3> {
        let near = |a: DVec2, b: DVec2| (a - b).abs().max_element() <= ROUNDING;
        if (0..3).all(|i| near(self.primaries[i], REC_709.primaries[i])) && near(self.white, REC_709.white) {
            return Some(DMat3::IDENTITY);
        }
        Some(rec_709_from_xyz(self.white)? * self.xyz_from_rgb()?)
    }
}

/// The matrix from XYZ to linear Rec. 709 for a white with the chromaticities `white`; `None` if that has no luminance.
pub fn rec_709_from_xyz(white: DVec2) -> Option<DMat3> {
    // Responses of the eye's cones in Bradford's transform (Lam 1985).
    let cones = DMat3::from_cols_array(&[0.8951, -0.7502, 0.0389, 0.2664, 1.7135, -0.0685, -0.1614, 0.0367, 1.0296]);
    let response = |c: DVec2| cones * (DVec3::new(c.x, c.y, 1.0 - c.x - c.y) / c.y);
    let adapted = cones.inverse() * DMat3::from_diagonal(response(REC_709.white) / response(white)) * cones;
    let rec_709 = REC_709.xyz_from_rgb()?.inverse() * adapted;
    rec_709.is_finite().then_some(rec_709)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(a: DVec3, b: DVec3, most: f64) {
        assert!((a - b).abs().max_element() < most, "{a} is not {b}");
    }

    /// The expected numbers are from IEC 61966-2-1 for the matrix of Rec. 709 and from ITU-R BT.2087 for Rec. 2020.
    #[test]
    fn matrices_are_those_of_the_standards() {
        let green = REC_709.xyz_from_rgb().unwrap().y_axis;
        assert_near(green, DVec3::new(0.3576, 0.7152, 0.1192), 1e-4);
        assert_eq!(REC_709.rec_709_from_rgb(), Some(DMat3::IDENTITY));
        let primaries = [DVec2::new(0.708, 0.292), DVec2::new(0.17, 0.797), DVec2::new(0.131, 0.046)];
        let rec_2020 = Chromaticities { primaries, ..REC_709 };
        let from_2020 = rec_2020.rec_709_from_rgb().unwrap();
        assert_near(from_2020.x_axis, DVec3::new(1.6605, -0.1246, -0.0182), 1e-4);
        assert_near(from_2020.y_axis, DVec3::new(-0.5876, 1.1329, -0.1006), 1e-4);
    }

    #[test]
    fn white_stays_white_and_what_is_no_space_is_none() {
        let even = DVec2::splat(1.0 / 3.0);
        let other = Chromaticities { white: even, ..REC_709 };
        assert_near(other.rec_709_from_rgb().unwrap() * DVec3::ONE, DVec3::ONE, 1e-9);
        assert_near(rec_709_from_xyz(even).unwrap() * DVec3::ONE, DVec3::ONE, 1e-9);
        for none in [[even; 3], [DVec2::ZERO; 3], [DVec2::NAN; 3], [even, DVec2::new(0.3, 0.0), even]] {
            assert_eq!(Chromaticities { primaries: none, ..REC_709 }.rec_709_from_rgb(), None, "{none:?}");
        }
        assert_eq!(Chromaticities { white: DVec2::ZERO, ..REC_709 }.rec_709_from_rgb(), None);
    }
}
