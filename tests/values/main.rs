//! Tests that need no device of their own: scenes, settings, the path tracer, closed forms, and the pages of `docs/`.

#[path = "../../examples/pages/devices.rs"]
mod device_tables;
#[path = "../../examples/pages/frontier_tables.rs"]
mod frontier_tables;
#[path = "../common/nonsense.rs"]
mod nonsense;
#[path = "../../examples/pages/pictures.rs"]
mod pictures;
#[path = "../fuzz/random.rs"]
mod random;
#[path = "../../examples/pages/tables.rs"]
mod tables;
#[path = "../common/traced.rs"]
mod traced;
#[path = "../twins/mod.rs"]
mod twins;
#[path = "../common/valid.rs"]
mod valid;

mod assets;
mod ci_recipe;
mod compiler;
mod devices;
mod docs;
mod faults_listed;
mod gltf;
mod ledger_formulas;
mod ledger_pages;
mod ledger_sets;
mod made_scenes;
mod maps;
mod materials;
mod metrics_faults;
mod nonsense_traced;
mod packaging;
mod parameters;
mod reference_analytic;
mod reference_determinism;
mod reference_materials;
mod reference_noise;
mod reference_truth;
mod rooms;
mod scene_values;
mod settings;
mod shaders;
mod strengths;
mod suite;
mod talk;
mod twins_values;
