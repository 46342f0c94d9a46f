//! The list of settings as a page.

use super::{Key, PRESETS, Settings, keys};
use crate::gi::Method;

/// `docs/settings.md`: every key with its value in each preset, unit, range and cost.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Settings\n\n\
         Made by `twobounce settings --markdown`; a test checks that it is current.\n\n\
         `--preset NAME`, then `--config FILE.toml`, then every `--set key=value`: later ones win. In a file, keys stand\n\
         as here (`image.samples = 1`) or in tables (`[image]`). Lengths in voxels do not change when a scene is\n\
         scaled. Factors of time were measured on two CPU cores.\n\n## Presets\n\n\
         The first is the default.\n\n",
    );
    for preset in PRESETS {
        page += &format!("- `{}`: {}\n", preset.name, preset.meaning);
    }
    page += "\n## Keys\n\nThe first table of each part has what people turn, the second what `--all` adds.\n";
    let parts = std::iter::once(None).chain(Method::ALL.iter().copied().map(Some));
    for part in parts {
        let of_part = |key: &&Key| key.method() == part;
        if !keys().iter().any(|key| of_part(&key)) {
            continue;
        }
        page += &part.map_or("\n### All methods\n".to_owned(), |method| format!("\n### Method `{method}`\n"));
        for rare in [false, true] {
            page += &table(keys().iter().filter(of_part).filter(|key| key.rare == rare));
        }
    }
    page
}

/// The keys with their values in every preset.
fn table<'a>(rows: impl Iterator<Item = &'a Key>) -> String {
    let presets: Vec<_> = PRESETS.iter().map(|preset| (preset.settings)()).collect();
    let entries: Vec<_> = presets.iter().map(Settings::entries).collect();
    let mut lines = String::new();
    for key in rows {
        let value = |(settings, entries): (&Settings, &Vec<(&Key, String)>)| {
            let used = key.method().is_none_or(|method| method == settings.method);
            let value = entries.iter().find(|entry| entry.0.name == key.name).map_or("", |entry| &entry.1);
            if used { format!("{value} | ") } else { "– | ".to_owned() }
        };
        let values: String = presets.iter().zip(&entries).map(value).collect();
        let escaped = |text: &str| text.replace('|', "\\|");
        lines += &format!(
            "| `{}` | {} | {values}{} | {} | {} |\n",
            key.name,
            escaped(key.meaning),
            key.unit,
            key.range,
            key.cost
        );
    }
    if lines.is_empty() {
        return lines;
    }
    let names: String = PRESETS.iter().map(|preset| format!("`{}` | ", preset.name)).collect();
    let dashes = "---|".repeat(PRESETS.len());
    format!("\n| key | what | {names}unit | range | what more of it costs |\n|---|---|{dashes}---|---|---|\n{lines}")
}
