//! The list of settings as a page.

use super::{PRESETS, Settings};

/// `docs/settings.md`: every key with its value in each preset, unit, range and cost.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Settings\n\n\
         Made by `twobounce settings --markdown`; a test checks that it is current.\n\n\
         `--preset NAME`, then `--config FILE.toml`, then every `--set key=value`: later ones win. In a file, keys stand\n\
         as here (`start.diffuse_along = 1.0`) or in groups (`[start]`). Lengths in voxels do not change when a scene is\n\
         scaled. Factors of time were measured on two CPU cores.\n\n## Presets\n\n\
         The first is the default.\n\n",
    );
    for preset in PRESETS {
        page += &format!("- `{}`: {}\n", preset.name, preset.meaning);
    }
    page += "\n## Keys\n\n| key | what | ";
    page += &PRESETS.iter().map(|preset| format!("`{}` | ", preset.name)).collect::<String>();
    page += "unit | range | what more of it costs |\n|---|---|";
    page += &"---|".repeat(PRESETS.len());
    page += "---|---|---|\n";
    let presets: Vec<_> = PRESETS.iter().map(|preset| (preset.settings)().entries()).collect();
    for (i, (key, _)) in Settings::default().entries().iter().enumerate() {
        let values: String = presets.iter().map(|entries| format!("{} | ", entries[i].1)).collect();
        let escaped = |text: &str| text.replace('|', "\\|");
        page += &format!(
            "| `{}` | {} | {values}{} | {} | {} |\n",
            key.name,
            escaped(key.meaning),
            key.unit,
            key.range,
            key.cost
        );
    }
    page
}
