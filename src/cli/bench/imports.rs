//! Images of other programs in a chart: the flags that name them, and what is checked across them.

use std::path::PathBuf;

use clap::Args;
use twobounce::chart::import::{Import, Named};
use twobounce::chart::subject::Subject;
use twobounce::{Error, Result};

use super::Seen;

/// Images of other programs.
#[derive(Args, Debug)]
pub struct ImportArgs {
    /// Judge an image of another program beside the settings: linear radiance of the chart's size and camera, with the
    /// time that it took as you give it. Add ,exact-direct where its direct light is exact, and its indirect light is
    /// judged too. May be given several times
    #[arg(long = "import", value_name = "NAME=IMAGE.exr,MS")]
    pub imports: Vec<String>,
    /// Judge the images that this TOML file lists, with notes on who gives them: docs/usage.md has its keys
    #[arg(long = "imports", value_name = "FILE.toml")]
    pub lists: Option<PathBuf>,
}

impl ImportArgs {
    /// Reads and checks the images; none has the name of another one or of one of `others`.
    ///
    /// # Errors
    /// A sentence about the first that is unfit.
    pub fn open(&self, size: (u32, u32), others: &[Subject]) -> Result<Vec<Subject>> {
        let typed = self.imports.iter().map(|text| Named::parse(text));
        let listed = self.lists.iter().map(|path| Named::read(path)).collect::<Result<Vec<_>>>()?;
        let mut imports: Vec<Import> = Vec::new();
        for named in typed.chain(listed.into_iter().flatten().map(Ok)) {
            let named = named?;
            let same = |import: &&Import| {
                import.name == named.name
                    && (import.scene == named.scene || import.scene.is_none() || named.scene.is_none())
            };
            let name = &named.name;
            if imports.iter().find(same).is_some() {
                return Err(Error::Usage(format!(
                    "--import: two images have the name {name:?}; name each of them apart"
                )));
            }
            if others.iter().any(|other| other.name() == *name) {
                let text =
                    format!("--import: a row of the chart has the name {name:?} already; name the image otherwise");
                return Err(Error::Usage(text));
            }
            imports.push(named.open(size)?);
        }
        Ok(imports.into_iter().map(Subject::Import).collect())
    }
}

/// Whether every import is of one of the scenes, as the chart looks at it.
pub(super) fn check(subjects: &[Subject], scenes: &[Seen]) -> Result<()> {
    let imports =
        subjects.iter().filter_map(|subject| if let Subject::Import(import) = subject { Some(import) } else { None });
    for import in imports {
        let names: Vec<&str> = scenes.iter().map(|seen| seen.scene.name.as_str()).collect();
        let (name, names_of_all) = (&import.name, names.join(", "));
        let seen = match &import.scene {
            None if scenes.len() > 1 => {
                return Err(Error::Usage(format!(
                    "--import: {name} does not say which scene it shows, and the chart has several ({names_of_all}); list it in a file for \
                     --imports with the key scene"
                )));
            }
            None => scenes.first(),
            Some(scene) => scenes.iter().find(|seen| seen.scene.name == *scene),
        };
        let Some(seen) = seen else {
            let scene = import.scene.as_deref().unwrap_or_default();
            return Err(Error::Usage(format!(
                "--import: {name} shows the scene {scene:?}, which the chart does not have; name one of {names_of_all}"
            )));
        };
        import.check_view(&seen.header)?;
    }
    Ok(())
}
