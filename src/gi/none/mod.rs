//! Direct light only: the smallest method, and a starting point for another one.

use super::{IndirectMethod, Maker, PassUnit, Update, Wants};
use crate::Result;
use crate::ground::Ground;
use crate::ground::memory_plan::MemoryRow;
use crate::settings::Settings;
use crate::vk::{Bind, Constant, Recorder};

pub const PASS_UNITS: &[(&str, PassUnit)] = &[];

pub struct Lighting;

impl IndirectMethod for Lighting {
    fn wants(_: &Settings) -> Wants {
        Wants::default()
    }

    fn plan(_: &Settings) -> Vec<MemoryRow> {
        Vec::new()
    }

    fn new(_: &Maker) -> Result<Self> {
        Ok(Self)
    }

    fn update(&self, _: &mut Recorder, _: &Ground, _: &Update) {}

    fn constants(&self) -> &[Constant] {
        &[]
    }

    fn binds<'a>(&'a self, _ground: &'a Ground) -> Vec<Bind<'a>> {
        Vec::new()
    }
}
