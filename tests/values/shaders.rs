//! All shaders, without a device: the program gives every constant that they depend on, and every module that a preset
//! specialises is valid SPIR-V.

use std::collections::{BTreeMap, HashSet};
use std::io::Write as _;
use std::process::{Command, Stdio};
use std::sync::Mutex;

use twobounce::gi::{Method, cones, lpv, paths, photons, probes, rays};
use twobounce::ground::constants::{
    DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ, Features, LIT_EACH, LIT_GROUPED, constants, with,
};
use twobounce::renderer::method_of;
use twobounce::settings::{PRESETS, Settings};
use twobounce::vk::{BindingKind, Constant, shader};

/// All constants that the method's header declares.
fn of_method(settings: &Settings) -> Vec<Constant> {
    match settings.method {
        Method::None => vec![],
        Method::Cones => cones::constants::constants(&settings.of.cones).to_vec(),
        Method::Rays => rays::look_up_constants(settings, 0).to_vec(),
        Method::Lpv => lpv::constants(&settings.of.lpv),
        Method::Paths => paths::constants(settings).to_vec(),
        Method::Photons => photons::constants::constants(&settings.of.photons),
        Method::Probes => probes::constants::constants(settings),
    }
}

/// Constants that single passes give beside the ground's and the method's, in one of three ways, and those of test
/// shaders.
fn of_passes(way: u32) -> Vec<Constant> {
    let mut added = vec![
        ("DIRECT", [DIRECT_FOUND, DIRECT_KEPT, DIRECT_READ][way as usize].into()),
        ("LIT", [LIT_EACH, LIT_GROUPED, LIT_GROUPED][way as usize].into()),
        ("BOXES", way.into()),
        ("BLENDED", (way % 2).into()),
        ("PARTS", [7u32, 1, 6][way as usize].into()),
        ("SAMPLES", [1u32, 4, 8][way as usize].into()),
        ("HARDWARE", (way % 2).into()),
        ("COUNTING", (way == 2).into()),
        ("FIRST_STEP", (way == 1).into()),
        ("FUNCTION", way.into()),
        ("SHADOW", (way % 2).into()),
        ("SCALE", way.into()),
    ];
    added.extend(["local_size_x", "local_size_y", "local_size_z"].map(|size| (size, (4 + way).into())));
    added
}

/// Settings of every preset, and of every method.
fn all_settings() -> Vec<Settings> {
    let presets = PRESETS.iter().map(|preset| (preset.settings)());
    let none = Settings { method: Method::None, ..Settings::fast() };
    presets.chain([none]).collect()
}

/// The program gives every constant that a shader depends on, with the type that the shader declares.
#[test]
fn constants_of_all_shaders_are_known() {
    for name in shader::names() {
        let method = method_of(name).unwrap_or(Method::Cones);
        let settings = all_settings().into_iter().find(|settings| settings.method == method).expect("a preset of it");
        let given = with(with(constants(&settings, Features::default()), &of_method(&settings)), &of_passes(0));
        for (constant, default) in shader::constants(name) {
            let (_, value) = given
                .iter()
                .find(|(known, _)| *known == constant)
                .unwrap_or_else(|| panic!("glsl/{name} depends on the constant {constant:?}, which nothing gives it"));
            let same = std::mem::discriminant(value) == std::mem::discriminant(&default);
            assert!(same, "glsl/{name} declares {constant} like {default:?}, and gets {value:?}");
        }
    }
}

/// The program gives exactly the constants that the headers declare.
#[test]
fn headers_declare_what_the_program_gives() {
    let declared = |header: &str| -> Vec<String> {
        let text = std::fs::read_to_string(header).unwrap_or_else(|e| panic!("{header}: {e}"));
        let lines = text.lines().filter_map(|line| line.strip_prefix("layout(constant_id) const "));
        let mut names: Vec<_> = lines.map(|line| line.split(' ').nth(1).expect("a name").to_owned()).collect();
        names.sort();
        names
    };
    let sorted = |given: Vec<Constant>| -> Vec<&str> {
        let mut names: Vec<_> = given.into_iter().map(|(name, _)| name).collect();
        names.sort();
        names
    };
    let of_ground = sorted(constants(&Settings::default(), Features::default()));
    assert_eq!(of_ground, declared("glsl/ground/constants.glsl"));
    for settings in all_settings().iter().filter(|settings| settings.method != Method::None) {
        // A method may replace constants of the ground.
        let own = of_method(settings).into_iter().filter(|(name, _)| !of_ground.contains(name)).collect();
        assert_eq!(sorted(own), declared(&format!("glsl/gi/{}/constants.glsl", settings.method.name())));
    }
}

/// The objection of `spirv-val` to a module for Vulkan 1.2, if it has one.
fn objection(words: &[u32]) -> Option<String> {
    let mut validator = Command::new("spirv-val")
        .args(["--target-env", "vulkan1.2", "--scalar-block-layout", "-"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("spirv-val runs: install spirv-tools, for example by scripts/setup.sh test");
    let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    // A validator that stops reading has an objection.
    let _ = validator.stdin.take().expect("it is piped").write_all(&bytes);
    let output = validator.wait_with_output().expect("spirv-val ends");
    let said = [output.stdout, output.stderr].concat();
    (!output.status.success()).then(|| String::from_utf8_lossy(&said).into_owned())
}

/// Each preset specialises each shader in three ways: for a scene with no feature, with half of them and with all. The
/// ways also differ in the constants of passes, and the last one counts. Every resulting module is validated once.
#[test]
fn presets_make_valid_modules() {
    let mut modules: BTreeMap<Vec<u32>, String> = BTreeMap::new();
    for name in shader::names() {
        let depends: HashSet<String> = shader::constants(name).into_iter().map(|(name, _)| name).collect();
        let mut made = HashSet::new();
        for settings in all_settings().iter().filter(|own| method_of(name).is_none_or(|method| method == own.method)) {
            for (way, features) in [0, 0x5555_5555, !0].into_iter().enumerate() {
                let given = with(constants(settings, Features(features)), &of_method(settings));
                let mut given = with(given, &of_passes(way as u32));
                given.retain(|(name, _)| depends.contains(*name));
                if made.insert(format!("{given:?}")) {
                    modules.entry(shader::specialized(name, &given)).or_insert(format!("{name} with {given:?}"));
                }
            }
        }
    }
    assert!(modules.len() > 300, "only {} modules", modules.len());
    let next = Mutex::new(modules.iter());
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, |count| count.get()) {
            scope.spawn(|| {
                while let Some((words, of)) = { next.lock().expect("no thread panicked").next() } {
                    if let Some(said) = objection(words) {
                        panic!("glsl/{of}: {said}");
                    }
                }
            });
        }
    });
}

/// A driver that loses descriptors in loops gets modules that load a word of each storage buffer first.
#[test]
fn modules_that_load_early_are_valid() {
    for name in shader::names() {
        let words = shader::specialized(name, &[]);
        let early = shader::loading_early(&words);
        let reads = shader::reflected(name).1.iter().any(|binding| binding.kind == BindingKind::Storage);
        // This one only writes its buffer.
        assert_eq!(early != words, reads && name != "test/sample.comp", "{name}");
        assert_eq!(objection(&early), None, "{name}");
    }
}

/// The validator finds an error that a wrong removal of code could leave.
#[test]
fn a_module_with_a_loose_end_is_not_valid() {
    let mut words = shader::specialized("test/copy.comp", &[]);
    assert_eq!(objection(&words), None);
    let first_function = words.iter().position(|&word| word == 5 << 16 | 54).expect("a function");
    words[first_function + 1] += 1; // another type of result
    assert!(objection(&words).is_some());
}

/// All names that a module gives.
fn names_in(words: &[u32]) -> Vec<String> {
    const HEADER_WORDS: usize = 5;
    const NAME: u32 = 5;
    let (mut names, mut at) = (Vec::new(), HEADER_WORDS);
    while at < words.len() {
        let end = at + (words[at] >> 16) as usize;
        if words[at] & 0xffff == NAME {
            let bytes = words[at + 2..end].iter().flat_map(|word| word.to_le_bytes());
            names.push(String::from_utf8(bytes.take_while(|&byte| byte != 0).collect()).expect("a name"));
        }
        at = end;
    }
    names
}

/// A shader that does not count contains nothing of the counters, so frames do not pay for them.
#[test]
fn shaders_that_do_not_count_have_no_counters() {
    let counts = |name: &str, counting: bool| {
        let names = names_in(&shader::specialized(name, &[("COUNTING", counting.into())]));
        names.iter().filter(|name| ["counted", "tally", "add_counts("].contains(&name.as_str())).count()
    };
    let counting: Vec<&str> = shader::names().filter(|name| counts(name, true) == 3).collect();
    assert!(counting.len() > 50, "only {} shaders count", counting.len());
    for name in shader::names() {
        assert_eq!(counts(name, false), 0, "{name}");
    }
}
