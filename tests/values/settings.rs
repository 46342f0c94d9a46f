//! The settings tree: its table, its presets, and how they are read, merged and written.

use std::collections::BTreeSet;

use proptest::prelude::*;
use twobounce::settings::{Center, PRESETS, Preset, Settings, keys, markdown};

fn leaves(prefix: &str, value: &toml::Value, names: &mut BTreeSet<String>) {
    match value {
        toml::Value::Table(table) => {
            for (name, inner) in table {
                leaves(&format!("{prefix}{}{name}", if prefix.is_empty() { "" } else { "." }), inner, names);
            }
        }
        _ => {
            names.insert(prefix.to_owned());
        }
    }
}

#[test]
fn every_key_has_a_row_and_every_row_a_key() {
    let mut serialised = BTreeSet::new();
    leaves("", &toml::Value::try_from(Settings::default()).unwrap(), &mut serialised);
    let rows: BTreeSet<String> = keys().iter().map(|k| k.name.to_owned()).collect();
    assert_eq!(serialised, rows);
    assert_eq!(rows.len(), keys().len(), "a row is there twice");
    for key in keys() {
        assert!(
            !key.unit.is_empty() && !key.meaning.is_empty() && !key.cost.is_empty(),
            "{} is not explained",
            key.name
        );
    }
}

#[test]
fn the_settings_page_is_current() {
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/settings.md")).unwrap();
    assert!(page == markdown(), "docs/settings.md is stale: twobounce settings --markdown > docs/settings.md");
}

#[test]
fn every_preset_is_in_range_and_survives_toml() {
    for Preset { name, settings, .. } in PRESETS {
        let preset = settings();
        assert_eq!(Settings::preset(name).unwrap(), preset);
        let mut read = Settings { voxels: 16, ..Settings::printed() };
        read.merge_toml(&preset.to_toml()).unwrap();
        assert!(read.means_same(&preset), "{name} changes on its way through TOML");
    }
}

#[test]
fn groups_and_dotted_keys_mean_the_same() {
    let (mut dotted, mut grouped) = (Settings::default(), Settings::default());
    dotted.merge_toml("cones.start.shadow_end = 3\ngrid.center = [1, 2.5, -3]\ncones.set = 16").unwrap();
    let text = "[cones]\nset = \"16\"\n[cones.start]\nshadow_end = 3.0\n[grid]\ncenter = [1.0, 2.5, -3.0]";
    grouped.merge_toml(text).unwrap();
    assert_eq!(dotted, grouped);
    assert_eq!(dotted.grid.center, Center::Point([1.0, 2.5, -3.0]));
    dotted.merge_toml("[grid]\n[cones.start]").unwrap();
    assert_eq!(dotted, grouped, "groups without keys");
    assert!(dotted.merge_toml("[grit]").unwrap_err().to_string().contains("no setting \"grit\""));
    dotted.set("grid.center=auto").unwrap();
    assert_eq!(dotted.grid.center, Center::Scene);
}

#[test]
fn what_another_method_would_do_has_no_effect() {
    let (mut a, b) = (Settings::default(), Settings::default());
    a.set("cones.step=2").unwrap();
    assert!(a != b && a.means_same(&b) && a.to_toml() == b.to_toml());
    a.set("method=cones").unwrap();
    assert!(!a.means_same(&b) && a.to_toml().contains("cones.step = 2.0"));
}

#[test]
fn a_person_can_hold_the_common_settings_in_mind() {
    let common = keys().iter().filter(|key| !key.rare).count();
    assert!(common <= 25, "{common} settings are shown without --all");
}

#[test]
fn later_assignments_win_and_the_rest_stays() {
    let mut settings = Settings::printed();
    settings.set("voxels=32").unwrap();
    settings.set(" voxels = 64 ").unwrap();
    settings.set("grid.center=1,-2,3e2").unwrap();
    assert_eq!(settings.voxels, 64);
    assert_eq!(settings.grid.center, Center::Point([1.0, -2.0, 300.0]));
    assert_eq!(settings.of.cones.ledger, Settings::printed().of.cones.ledger);
}

/// Errors must name the mistake, the key, and its allowed values or the nearest name.
#[test]
fn mistakes_name_the_key_and_the_remedy() {
    for (assignment, parts) in [
        ("voxel=64", ["\"voxel\"", "did you mean \"voxels\""]),
        ("cones.start.difuse_along=1", ["cones.start.difuse_along", "did you mean \"cones.start.diffuse_along\""]),
        ("diffuse_along=1", ["diffuse_along", "did you mean \"cones.start.diffuse_along\""]),
        ("cones.ledger.d3=right", ["cones.ledger.d3", "did you mean \"cones.ledger.d"]),
        ("xyzzy=1", ["xyzzy", "twobounce settings"]),
        ("cones.start=1", ["group", "cones.start.diffuse_normal"]),
        ("voxels", ["no value", "key=value"]),
        ("voxels=65", ["voxels", "power of two, 16 to 256"]),
        ("voxels=512", ["voxels", "power of two, 16 to 256"]),
        ("voxels=-64", ["voxels", "power of two, 16 to 256"]),
        ("voxels=6.5e1", ["voxels", "power of two, 16 to 256"]),
        ("cones.set=6", ["cones.set", "6a, 6b"]),
        ("bounces=3", ["bounces", "1, 2 or all"]),
        ("image.samples=2", ["image.samples", "1 or 4"]),
        ("cones.jitter=1", ["cones.jitter", "true or false"]),
        ("cones.fill=covrage", ["cones.fill", "did you mean \"coverage\""]),
        ("cones.start.shadow_end=-1", ["cones.start.shadow_end", "0 to 64"]),
        ("cones.start.shadow_end=inf", ["cones.start.shadow_end", "0 to 64"]),
        ("cones.start.shadow_end=NaN", ["cones.start.shadow_end", "0 to 64"]),
        ("grid.side=0", ["grid.side", "or auto"]),
        ("grid.center=1,2", ["grid.center", "x,y,z"]),
        ("grid.center=1,2,nan", ["grid.center", "x,y,z"]),
    ] {
        let mut settings = Settings::default();
        let message = settings.set(assignment).unwrap_err().to_string();
        assert!(parts.iter().all(|p| message.contains(p)), "{assignment}: {message}");
        assert_eq!(settings, Settings::default(), "{assignment} left a trace");
    }
    for (text, part) in [
        ("voxels = 64\ncones.fil = 1", "did you mean \"cones.fill\""),
        ("[cones.start]\nshadow_ned = 1", "did you mean \"cones.start.shadow_end\""),
        ("[starts]\nx = 1", "\"starts.x\""),
        ("voxels = 64\nvoxels 32", "line 2"),
        ("voxels = \"64\"", "power of two"),
        ("voxels = [64]", "power of two"),
        ("cones.jitter = \"true\"", "true or false"),
    ] {
        let message = Settings::default().merge_toml(text).unwrap_err().to_string();
        assert!(message.contains(part), "{text}: {message}");
        assert!(!message.contains('\n'), "{text}: more than one line: {message}");
    }
    assert!(Settings::preset("printd").unwrap_err().to_string().contains("did you mean \"printed\""));
}

#[test]
fn values_out_of_range_do_not_survive_toml() {
    let problem = |wrong: Settings| Settings::default().merge_toml(&wrong.to_toml()).unwrap_err().to_string();
    let mut settings = Settings::cones();
    settings.of.cones.start.diffuse_along = f32::NAN;
    assert!(problem(settings).contains("start.diffuse_along"));
    assert!(problem(Settings { voxels: 100, ..Settings::default() }).contains("voxels"));
}

proptest! {
    /// Every f32 and f64 is read back bit for bit, and no text causes a panic.
    #[test]
    fn numbers_survive_toml(start in 0.0_f32..64.0, side in 1e-6_f64..1e9, center in -1e9_f64..1e9) {
        let mut settings = Settings { method: twobounce::gi::Method::Cones, ..Settings::default() };
        settings.of.cones.start.shadow_end = start;
        settings.grid.side = Some(side);
        settings.grid.center = Center::Point([center, -center, 0.1]);
        let mut read = Settings::default();
        read.merge_toml(&settings.to_toml()).unwrap();
        prop_assert_eq!(read, settings);
    }

    #[test]
    fn no_text_panics(text in "[a-z.=\\[\\]0-9\"\n ]{0,40}") {
        let mut settings = Settings::default();
        let _ = settings.merge_toml(&text);
        let _ = settings.set(&text);
        prop_assert!(Settings::default().merge_toml(&settings.to_toml()).is_ok());
    }
}
