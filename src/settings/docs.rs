//! The list of settings as a page.

use super::{Key, Method, PRESETS, Settings, keys};

/// `docs/settings.md`: every key with its value in each preset, unit, range and cost.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Settings\n\n\
         Made by `twobounce settings --markdown`; a test checks that it is up to date.\n\n\
         `--preset NAME`, then `--config FILE.toml`, then every `--set key=value`: later ones win. In a file, keys stand\n\
         as here (`image.samples = 1`) or in tables (`[image]`). Lengths in voxels do not change when a scene is\n\
         scaled. Factors of time were measured on two CPU cores.\n\n## Presets\n\n\
         The first is the default.\n\n",
    );
    for preset in PRESETS {
        page += &format!("- `{}`: {}\n", preset.name, preset.meaning);
    }
    page += "\n## Keys\n\nThe first table of each part has the common settings, the second those that `--all` adds.\n";
    for part in std::iter::once(None).chain(Method::ALL.iter().copied().map(Some)) {
        let keys: Vec<&Key> = keys().iter().filter(|key| key.method() == part).collect();
        if !keys.is_empty() {
            page += &part.map_or("\n### All methods\n".to_owned(), |method| format!("\n### Method `{method}`\n"));
            let (rare, common): (Vec<&Key>, _) = keys.into_iter().partition(|key| key.rare);
            page += &(table(&common) + &table(&rare));
        }
    }
    page
}

/// The keys with their values in every preset; nothing without keys.
fn table(keys: &[&Key]) -> String {
    if keys.is_empty() {
        return String::new();
    }
    let names: String = PRESETS.iter().map(|preset| format!("`{}` | ", preset.name)).collect();
    let dashes = "---|".repeat(PRESETS.len());
    let mut page = format!("\n| key | what | {names}unit | range | cost of more |\n|---|---|{dashes}---|---|---|\n");
    let presets: Vec<Settings> = PRESETS.iter().map(|preset| (preset.settings)()).collect();
    for key in keys {
        let value = |settings: &Settings| {
            let is_it = |entry: &(&Key, String)| key.has_effect(settings.method) && entry.0.name == key.name;
            let entry = settings.entries().into_iter().find(is_it);
            entry.map_or("–".to_owned(), |entry| entry.1) + " | "
        };
        let values: String = presets.iter().map(value).collect();
        let Key { name, unit, range, cost, .. } = key;
        let meaning = key.meaning.replace('|', "\\|");
        page += &format!("| `{name}` | {meaning} | {values}{unit} | {range} | {cost} |\n");
    }
    page
}
