//! Where the grid stands.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// In files a point, `"auto"` or `"camera"`.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Center {
    /// About the scene's bounds.
    #[default]
    Scene,
    /// Its smallest voxels go with the camera.
    Camera,
    /// World metres.
    Point([f64; 3]),
}

#[derive(Serialize, Deserialize)]
#[serde(untagged)]
enum Written {
    Point([f64; 3]),
    Word(String),
}

impl Serialize for Center {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let written = match self {
            Self::Scene => Written::Word("auto".into()),
            Self::Camera => Written::Word("camera".into()),
            Self::Point(point) => Written::Point(*point),
        };
        written.serialize(to)
    }
}

impl<'de> Deserialize<'de> for Center {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        match Written::deserialize(from)? {
            Written::Point(point) => Ok(Self::Point(point)),
            Written::Word(word) if word == "auto" => Ok(Self::Scene),
            Written::Word(word) if word == "camera" => Ok(Self::Camera),
            Written::Word(word) => {
                Err(D::Error::custom(format!("{word:?} is neither a point nor \"auto\" nor \"camera\"")))
            }
        }
    }
}
