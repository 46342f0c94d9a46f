//! `twobounce settings`: lists every key, or prints the settings from `--preset`, `--config` and `--set`.

use std::process::ExitCode;

use clap::Args;
use twobounce::output::read;
use twobounce::settings::{PRESETS, Settings, markdown};
use twobounce::{Error, Result};

use super::args::SettingsArgs;
use crate::say;

#[derive(Args, Debug)]
pub struct SettingsCommandArgs {
    #[command(flatten)]
    pub settings: SettingsArgs,
    /// Show every setting, including the ledger and the talk's variants
    #[arg(long)]
    pub all: bool,
    /// Print the list as a Markdown page
    #[arg(long, conflicts_with = "toml")]
    pub markdown: bool,
    /// Print the settings of the flags as a file for --config
    #[arg(long)]
    pub toml: bool,
}

impl SettingsArgs {
    /// The settings from the preset, the file, the method and single keys, in this order.
    pub fn effective(&self) -> Result<Settings> {
        self.effective_with("--preset")
    }

    /// As [`Self::effective`]; `flag` is the flag with which the user named the preset.
    pub fn effective_with(&self, flag: &str) -> Result<Settings> {
        let named = |flag: &str, e: Error| Error::Usage(format!("{flag}: {e}"));
        let mut settings = Settings::preset(&self.preset).map_err(|e| named(flag, e))?;
        if let Some(path) = &self.config {
            let text = read::text(path, "file of settings")?;
            settings.merge_toml(&text).map_err(|e| Error::file(path, e.to_string()))?;
        }
        if let Some(method) = &self.method {
            settings.set(&format!("method={method}"))?;
        }
        for set in &self.sets {
            settings.set(set).map_err(|e| named("--set", e))?;
        }
        Ok(settings)
    }
}

/// Prints the list in the requested form.
pub fn run(args: &SettingsCommandArgs) -> anyhow::Result<ExitCode> {
    let settings = args.settings.effective()?;
    if args.markdown {
        super::out::write(&markdown());
    } else if args.toml {
        super::out::write(&settings.to_toml());
    } else {
        list(&settings, args.all);
    }
    Ok(ExitCode::SUCCESS)
}

fn list(settings: &Settings, all: bool) {
    say!("presets (--preset NAME; the default is {}):", PRESETS[0].name);
    for preset in PRESETS {
        say!("  {:<10} {}", preset.name, preset.meaning);
    }
    say!("\nsettings (--set key=value; a * marks what differs from the default):");
    let defaults = (PRESETS[0].settings)().entries();
    let mut hidden = 0;
    for ((key, value), (_, default)) in settings.entries().iter().zip(&defaults) {
        let differs = value != default;
        if key.rare && !all && !differs {
            hidden += 1;
            continue;
        }
        let mark = if differs { '*' } else { ' ' };
        let was = if differs { format!(", default {default}") } else { String::new() };
        say!("{mark} {} = {value}   [{}{was}]", key.name, key.unit);
        say!("      {}", key.meaning);
        say!("      takes {}; cost: {}", key.range, key.cost);
    }
    if hidden > 0 {
        say!("\n{hidden} more: twobounce settings --all");
    }
}
