//! The list of settings as a page.

use super::{Key, Method, PRESETS, Settings, keys};

/// `docs/settings.md`: every key with its values in the presets, range and cost.
pub fn markdown() -> String {
    let mut page = String::from(
        "# Settings\n\n\
         This page lists every setting of twobounce, for readers who tune an image or a frame time.\n\
         `twobounce settings --markdown` writes it, and a test compares it with the program.\n\n\
         `--preset NAME` applies first, then `--config FILE.toml`, then each `--set key=value`; later values win. A TOML\n\
         file holds keys as below (`image.samples = 1`) or in tables (`[image]`). Lengths in voxels do not depend on the\n\
         scale of a scene. Factors of time were measured on two CPU cores.\n\n## Presets\n\n\
         `balanced` is the default.\n\n",
    );
    for preset in PRESETS {
        page += &format!("- `{}`: {}\n", preset.name, preset.meaning);
    }
    page += "\n## Keys\n\n\
         The column *value* begins with the value in the first preset that uses the key (`balanced` for common keys).\n\
         Presets with other values follow; *others* are the remaining ones that use it. A range ends with its unit in\n\
         brackets. Each part begins with the common settings; `twobounce settings --all` adds the next ones.\n";
    for part in std::iter::once(None).chain(Method::ALL.iter().copied().map(Some)) {
        let keys: Vec<&Key> = keys().iter().filter(|key| key.method() == part).collect();
        if !keys.is_empty() {
            page += &part.map_or("\n### All methods\n".to_owned(), |method| format!("\n### Method `{method}`\n"));
            let (forms, keys): (Vec<&Key>, Vec<&Key>) = keys.into_iter().partition(|key| key.name.contains(".ledger."));
            let (rare, common): (Vec<&Key>, _) = keys.into_iter().partition(|key| key.rare);
            page += &(table(&common) + &table(&rare) + &switches(&forms));
        }
    }
    page
}

/// The keys with their values in the presets; nothing without keys.
fn table(keys: &[&Key]) -> String {
    if keys.is_empty() {
        return String::new();
    }
    let mut page = "\n| key | meaning | value | range | cost of more |\n|---|---|---|---|---|\n".to_owned();
    let presets: Vec<(&str, Settings)> = PRESETS.iter().map(|preset| (preset.name, (preset.settings)())).collect();
    for key in keys {
        let Key { name, unit, range, cost, .. } = key;
        let meaning = key.meaning.replace('|', "\\|");
        let whole = range.to_string().replace("a whole number, ", "");
        let range = if ["choice", "switch", "method"].contains(unit) { whole } else { format!("{whole} ({unit})") };
        page += &format!("| `{name}` | {meaning} | {} | {range} | {cost} |\n", values(key, &presets));
    }
    page
}

/// The switches of a ledger, which all have the same values; nothing without keys.
fn switches(keys: &[&Key]) -> String {
    let Some(first) = keys.first() else { return String::new() };
    let presets: Vec<(&str, Settings)> = PRESETS.iter().map(|preset| (preset.name, (preset.settings)())).collect();
    let same = values(first, &presets);
    let mut page = format!(
        "\nEach of these switches takes {}. Their value is {same}. To compare costs, {}.\n\n| switch | subject |\n|---|---|\n",
        first.range, first.cost
    );
    for key in keys {
        let own = values(key, &presets);
        let own = if own == same { String::new() } else { format!(" ({own})") };
        page += &format!("| `{}` | {}{own} |\n", key.name, key.meaning.replace('|', "\\|"));
    }
    page
}

/// The value of a key in the first preset that uses it, then the presets with each other value.
fn values(key: &Key, presets: &[(&str, Settings)]) -> String {
    let mut found: Vec<(String, Vec<String>)> = vec![];
    for (name, settings) in presets.iter().filter(|(_, settings)| key.has_effect(settings.method)) {
        let entry = settings.entries().into_iter().find(|entry| entry.0.name == key.name);
        let Some((_, value)) = entry else { continue };
        match found.iter_mut().find(|(known, _)| *known == value) {
            Some((_, names)) => names.push(format!("`{name}`")),
            None => found.push((value, vec![format!("`{name}`")])),
        }
    }
    // The largest group of at least three comes last, under one name.
    let largest = (1..found.len()).max_by_key(|i| found[*i].1.len()).filter(|i| found[*i].1.len() >= 3);
    let named = (1..found.len()).filter(|i| Some(*i) != largest);
    let others = named.map(|i| format!("; {}: {}", found[i].1.join(", "), found[i].0)).collect::<String>();
    let rest = largest.map_or(String::new(), |i| format!("; others: {}", found[i].0));
    found.first().map_or(String::new(), |(value, _)| value.clone()) + &others + &rest
}
