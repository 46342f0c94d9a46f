//! A second picture with other settings: its settings, and the display of both pictures.

use rayon::prelude::*;
use twobounce::gi::Method;
use twobounce::layers::{Aov, Layers};
use twobounce::output::display::Display;
use twobounce::settings::{Bounces, PRESETS, Settings};

use super::job::ShownFrame;
use super::layer::Layer;
use super::maker::encode;
use super::screen::Picture;

/// The settings of the second picture.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Other {
    #[default]
    None,
    /// One bounce fewer: the difference is the last bounce, or all bounces beyond the second.
    FewerBounces,
    /// The index of a preset.
    Preset(usize),
}

/// The display of both pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Mix {
    /// The first picture to the left of a line, the other one to the right.
    #[default]
    Split,
    /// Both pictures in turns.
    Flicker,
    /// The absolute difference in linear light, with the exposure of the picture.
    Difference,
}

impl Other {
    pub fn all() -> impl Iterator<Item = Self> {
        [Self::None, Self::FewerBounces].into_iter().chain((0..PRESETS.len()).map(Self::Preset))
    }

    pub fn name(self) -> &'static str {
        match self {
            Self::None => "nothing",
            Self::FewerBounces => "one bounce fewer",
            Self::Preset(at) => PRESETS[at].name,
        }
    }

    /// The settings of the second picture if the first one has `own`. Presets get its grid, so that both are compared
    /// on the same one.
    pub fn settings(self, own: &Settings) -> Option<Settings> {
        match self {
            Self::None => None,
            Self::FewerBounces => {
                let mut fewer = own.clone();
                match own.bounces {
                    Bounces::All => fewer.bounces = Bounces::Two,
                    Bounces::Two => fewer.bounces = Bounces::One,
                    Bounces::One => fewer.method = Method::None,
                }
                Some(fewer)
            }
            Self::Preset(at) => Some(Settings { voxels: own.voxels, ..(PRESETS[at].settings)() }),
        }
    }
}

impl Mix {
    pub const ALL: [(Self, &str); 3] =
        [(Self::Split, "split"), (Self::Flicker, "flicker"), (Self::Difference, "difference")];
}

/// The state of the display of both pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Mixing {
    pub mix: Mix,
    /// The position of the line, from 0 to 1.
    pub split: f32,
    /// Whether the second picture is shown now.
    pub other: bool,
}

/// The combination of both pictures.
pub fn picture(frame: &ShownFrame, layer: Layer, mixing: Mixing) -> Option<Picture> {
    let Mixing { mix, split, other } = mixing;
    let beside = frame.beside.as_ref()?;
    let size = frame.picture.size;
    let rgba = match (mix, layer) {
        (Mix::Flicker, _) => (if other { &beside.picture } else { &frame.picture }).rgba.clone(),
        (Mix::Difference, Layer::Image(layer)) => difference(&frame.image, &beside.image, layer, frame.display),
        _ => {
            let line = (f64::from(split) * f64::from(size.0)).round() as usize;
            let pairs = frame.picture.rgba.chunks_exact(4).zip(beside.picture.rgba.chunks_exact(4));
            let mixed = pairs.enumerate().flat_map(|(at, (left, right))| {
                let x = at % size.0 as usize;
                match x {
                    // The line, if there is one.
                    _ if x == line && line > 0 => [255; 4],
                    _ if x < line => [left[0], left[1], left[2], left[3]],
                    _ => [right[0], right[1], right[2], right[3]],
                }
            });
            mixed.collect()
        }
    };
    Some(Picture { size, rgba })
}

fn difference(own: &Layers, other: &Layers, layer: Aov, display: Display) -> Vec<u8> {
    let of = |image: &'_ Layers| image.get(layer).unwrap_or(image.beauty()).to_vec();
    let (a, b) = (of(own), of(other));
    // Depths of the sky are infinite and equal.
    let apart = |a: f32, b: f32| if a == b { 0.0 } else { (a - b).abs() };
    let pixels = a.par_iter().zip(&b).map(|(a, b)| std::array::from_fn(|k| apart(a[k], b[k]))).collect();
    let image = Layers { width: own.width, height: own.height, layers: vec![(Aov::Beauty, pixels)] };
    encode(&image, Aov::Beauty, display)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_bounce_fewer_ends_at_direct_light() {
        let mut settings = Settings::fast();
        settings.set("bounces=all").unwrap();
        for wanted in [("2", "rays"), ("1", "rays"), ("1", "none")] {
            settings = Other::FewerBounces.settings(&settings).unwrap();
            assert_eq!((settings.bounces.name(), settings.method.name()), wanted);
        }
        assert!(Other::None.settings(&settings).is_none());
    }
}
