//! Paths: the path tracer on the device. Of the ground it needs rays alone. Every pass over the image estimates each
//! pixel by random numbers of the pixel and the pass; the mean over the passes converges to the exact image.
//!
//! The shader that shades pixels traces the paths (`glsl/gi/paths/path.glsl`), in place of the ground's own shading.
//! The method stores no light beforehand.

use super::{IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::Settings as AllSettings;
use crate::vk::{Bind, Constant, Recorder};

pub use crate::settings::methods::paths::Settings;

pub const PASS_UNITS: &[(&str, PassUnit)] = &[];

pub struct Lighting {
    constants: [Constant; 2],
}

impl IndirectMethod for Lighting {
    fn wants(_: &AllSettings) -> Wants {
        Wants { rays: true, shades: true, ..Wants::default() }
    }

    fn plan(_: &AllSettings) -> Vec<MemoryRow> {
        Vec::new()
    }

    fn new(maker: &Maker) -> Result<Self> {
        Ok(Self { constants: constants(maker.settings) })
    }

    fn update(&self, _: &mut Recorder, _: &Ground, _: &Update) {}

    fn constants(&self) -> &[Constant] {
        &self.constants
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        Vec::new()
    }
}

/// All constants that the method declares.
pub fn constants(settings: &AllSettings) -> [Constant; 2] {
    [("PATHS", settings.of.paths.paths.into()), ("BOUNCES", settings.bounces.limit().into())]
}
