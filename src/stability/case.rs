//! Cases: a scene, a number with an ideal value, and a limit of its distance.

use glam::{DAffine3, DVec3};
use serde::{Deserialize, Serialize};

use super::row::NOT_FINITE;

/// A case: a scene that is rendered at several places, and a number for each; an entry of `src/stability/cases.toml`.
/// `rows.json` has the same keys except `quick`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Case {
    pub name: String,
    /// The scene and the number that is measured, in a sentence.
    pub meaning: String,
    /// A sentence of advice to the user.
    pub advice: String,
    pub unit: Unit,
    pub ideal: f64,
    /// The allowed distance from the ideal for presets of the method `rays`, at every place of the scene. Other methods
    /// have no limit.
    pub limit: f64,
    /// Whether it is part of `--quick`.
    #[serde(default, skip_serializing)]
    pub quick: bool,
}

impl Case {
    /// The smallest or the largest number, whichever is farther from the ideal.
    pub fn farther(&self, min: f64, max: f64) -> f64 {
        if (max - self.ideal).abs() >= (min - self.ideal).abs() { max } else { min }
    }

    /// The median over places and, in brackets if it reads differently, the number that is farthest from the ideal.
    pub fn numbers_in_words(&self, median: f64, min: f64, max: f64) -> String {
        let (median, worst) = (self.unit.value_in_words(median), self.unit.value_in_words(self.farther(min, max)));
        if median == worst { median } else { format!("{median} ({worst})") }
    }
}

/// The format of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Unit {
    /// A part of something, shown in percent.
    Share,
    /// One quantity over another, ideally 1.
    Ratio,
    Frames,
}

impl Unit {
    /// A number as text.
    pub fn value_in_words(self, value: f64) -> String {
        match self {
            // This includes a median between a finite and a non-finite number.
            _ if !value.is_finite() || value.abs() >= 0.1 * NOT_FINITE => "not finite".to_owned(),
            Self::Share if value == 0.0 => "0".to_owned(),
            Self::Share if value.abs() < 5e-6 => format!("{:.0e} %", 100.0 * value),
            Self::Share if value.abs() < 0.1 => format!("{:.3} %", 100.0 * value),
            Self::Share => format!("{:.1} %", 100.0 * value),
            Self::Ratio => format!("{value:.3}"),
            Self::Frames => format!("{value:.0}"),
        }
    }
}

/// Radiance of an image with sides of [`super::SIZE`] pixels.
pub type Pixels = Vec<[f32; 3]>;

/// The result of a case at one place.
#[derive(Clone, Debug, Default)]
pub struct Sample {
    /// The place in words.
    pub place: String,
    pub number: f64,
    /// Further numbers, by name.
    pub more: Vec<(&'static str, f64)>,
    /// An image that shows it.
    pub image: Pixels,
    /// The correct image, if it is known.
    pub truth: Option<Pixels>,
}

impl Sample {
    pub fn new(place: impl ToString, number: f64, image: &[[f32; 3]]) -> Self {
        Self { place: place.to_string(), number, image: image.to_vec(), ..Self::default() }
    }

    pub fn with(self, more: Vec<(&'static str, f64)>) -> Self {
        Self { more, ..self }
    }

    pub fn beside(self, truth: &[[f32; 3]]) -> Self {
        Self { truth: Some(truth.to_vec()), ..self }
    }
}

/// The place of a scene in the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// The offset in voxels, each component from 0 to 1.
    pub offset: DVec3,
    /// The rotation about the vertical axis.
    pub degrees: f64,
}

impl Place {
    /// The first place is that of the grid. Further ones have offsets that cover the voxel evenly (the R3 sequence),
    /// and three angles in turn if `turned`.
    pub fn all(count: usize, turned: bool) -> Vec<Self> {
        // The steps are the negative powers 1, 2 and 3 of the root of x⁴ = x + 1.
        const STEP: DVec3 = DVec3::new(0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_970_3);
        let degrees = |i: usize| if turned { [0.0, 15.0, 45.0][i % 3] } else { 0.0 };
        (0..count).map(|i| Self { offset: (STEP * i as f64).fract(), degrees: degrees(i) }).collect()
    }

    /// The transform of the scene to this place in a grid with such voxels.
    pub fn world(&self, voxel_m: f64) -> DAffine3 {
        DAffine3::from_translation(self.offset * voxel_m) * DAffine3::from_rotation_y(self.degrees.to_radians())
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let DVec3 { x, y, z } = self.offset;
        write!(f, "{x:.2}, {y:.2}, {z:.2} voxels")?;
        if self.degrees == 0.0 { Ok(()) } else { write!(f, ", {}°", self.degrees) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_fill_the_voxel() {
        let places = Place::all(9, true);
        assert_eq!(places[0], Place { offset: DVec3::ZERO, degrees: 0.0 });
        for axis in 0..3 {
            let mut at: Vec<f64> = places.iter().map(|place| place.offset[axis]).collect();
            at.sort_by(f64::total_cmp);
            assert!(at.windows(2).all(|w| w[1] - w[0] < 1.0 / 3.0), "{at:?}");
        }
        assert_eq!(places.iter().filter(|place| place.degrees == 45.0).count(), 3);
    }

    #[test]
    fn numbers_are_written_for_readers() {
        let words = [0.0, 1e-7, 0.00123, 0.25, f64::NAN, 5e8].map(|value| Unit::Share.value_in_words(value));
        assert_eq!(words, ["0", "1e-5 %", "0.123 %", "25.0 %", "not finite", "not finite"]);
        assert_eq!(Unit::Ratio.value_in_words(1.0), "1.000");
    }
}
