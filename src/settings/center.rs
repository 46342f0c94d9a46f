//! The place of the grid.

use super::auto::Either;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The centre of the grid: in files a point, `"auto"` or `"camera"`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Center {
    /// The centre of the scene's bounds.
    #[default]
    Scene,
    /// The smallest voxels follow the camera.
    Camera,
    /// A point in metres in the world.
    Point([f64; 3]),
}

impl Serialize for Center {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let written = match self {
            Self::Scene => Either::Word("auto".into()),
            Self::Camera => Either::Word("camera".into()),
            Self::Point(point) => Either::Value(*point),
        };
        written.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Center {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match Either::deserialize(from)? {
            Either::Value(point) => Ok(Self::Point(point)),
            Either::Word(word) if word == "auto" => Ok(Self::Scene),
            Either::Word(word) if word == "camera" => Ok(Self::Camera),
            Either::Word(word) => {
                Err(D::Error::custom(format!("{word:?} is neither a point nor \"auto\" nor \"camera\"")))
            }
        }
    }
}
