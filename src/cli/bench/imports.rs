//! Images of other programs in a chart: their flags, and checks over all of them.

use std::path::PathBuf;

use clap::Args;
use twobounce::chart::import::Named;
use twobounce::chart::measure::ChartScene;
use twobounce::chart::row::{Row, Source};
use twobounce::{Error, Result};

/// Images of other programs.
#[derive(Args, Debug)]
pub struct ImportArgs {
    /// Compare an image of another program with the settings: linear radiance with the size and camera of the chart,
    /// and the time of a frame as you measured it. Add ,exact-direct if its direct light is exact, so that its indirect
    /// light is compared too. May be given several times
    #[arg(long = "import", value_name = "NAME=IMAGE.exr,MS")]
    pub imports: Vec<String>,
    /// Compare the images in this TOML file, which can name their makers: docs/usage.md has its keys
    #[arg(long = "imports", value_name = "FILE.toml")]
    pub lists: Option<PathBuf>,
}

impl ImportArgs {
    /// The images of all flags, before they are read.
    pub fn named(&self) -> Result<Vec<Named>> {
        let typed = self.imports.iter().map(|text| Named::parse(text)).collect::<Result<Vec<_>>>()?;
        let listed = self.lists.iter().map(|path| Named::read(path)).collect::<Result<Vec<_>>>()?;
        Ok(typed.into_iter().chain(listed.into_iter().flatten()).collect())
    }

    /// Reads and checks the images. All names differ, also from those of `others`.
    pub fn open(&self, size: (u32, u32), others: &[Row]) -> Result<Vec<Row>> {
        let mut imports: Vec<Row> = Vec::new();
        for named in self.named()? {
            let scene = named.scene.as_deref().unwrap_or_default();
            let same_scene = |row: &Row| row.scene == scene || row.scene.is_empty() || scene.is_empty();
            let name = &named.name;
            let taken = match imports.iter().any(|row| row.name == *name && same_scene(row)) {
                true => Some((format!("two images have the name {name:?}"), "name each of them apart")),
                false if others.iter().any(|other| other.name == *name) => {
                    Some((format!("a row of the chart has the name {name:?} already"), "name the image otherwise"))
                }
                false => None,
            };
            if let Some((problem, remedy)) = taken {
                return Err(Error::Usage(format!("--import: {problem}; {remedy}")));
            }
            imports.push(named.open(size)?);
        }
        Ok(imports)
    }
}

/// Checks that every import belongs to one of the scenes and its view.
pub(super) fn check(rows: &[Row], scenes: &[ChartScene]) -> Result<()> {
    let names: Vec<&str> = scenes.iter().map(|scene| scene.name.as_str()).collect();
    let names = names.join(", ");
    for Row { name, scene, source, .. } in rows {
        let Source::Import(claim) = source else { continue };
        if scene.is_empty() && scenes.len() > 1 {
            return Err(Error::Usage(format!(
                "--import: {name} does not say which scene it shows, and the chart has several ({names}); list it in a file for \
                 --imports with the key scene"
            )));
        }
        let Some(seen) = scenes.iter().find(|seen| scene.is_empty() || seen.name == *scene) else {
            return Err(Error::Usage(format!(
                "--import: {name} shows the scene {scene:?}, which the chart does not have; name one of {names}"
            )));
        };
        claim.check_view(&seen.header)?;
    }
    Ok(())
}
