//! Every struct shared with GLSL has equal names, offsets and sizes on both sides, read from the compiled shaders.
//! Every number that both sides state is equal, read from the source, because compiled numbers have no names.

use std::collections::BTreeMap;

use twobounce::gi::cones::constants::Cones;
use twobounce::gi::lpv::LpvPush;
use twobounce::gi::probes::{self, Probe, ProbeGrid, ProbeRay, ProbesPush};
use twobounce::ground::boxes;
use twobounce::ground::cells;
use twobounce::ground::layout::*;
use twobounce::settings::methods::{cones::choices, lpv, photons};
use twobounce::settings::{LampLight, Shadows};
use twobounce::vk::shader;

#[test]
fn structs_agree_with_the_shaders() {
    let mut found = BTreeMap::new();
    for name in [
        "ground/image/image.comp cones",
        "gi/cones/shade.frag LOOK_UP",
        "ground/record.comp",
        "ground/voxelise.frag",
        "gi/rays/light.comp",
        "ground/item_groups.comp",
        "gi/probes/trace.comp LOOK_UP",
    ] {
        found.extend(shader::structs(name));
    }
    let check = |name: &str, fields: &[(&str, usize)], bytes: usize| {
        let theirs = found.get(name).unwrap_or_else(|| panic!("no shader declares {name}"));
        let names: Vec<_> = theirs.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
        assert_eq!(names, fields, "{name}: (name, offset) in GLSL and in Rust");
        let end = theirs.members.iter().map(|m| m.offset + m.bytes).max().unwrap_or(0);
        assert_eq!(end, bytes, "{name}: bytes in GLSL and in Rust");
        if let Some(stride) = theirs.stride {
            assert_eq!(stride, bytes, "{name}: stride in arrays");
        }
    };
    check("Triangle", Triangle::FIELDS, size_of::<Triangle>());
    check("Globals", Globals::FIELDS, size_of::<Globals>());
    check("ListCount", ListCount::FIELDS, size_of::<ListCount>());
    check("ItemLight", ItemLight::FIELDS, size_of::<ItemLight>());
    check("ItemPart", ItemPart::FIELDS, size_of::<ItemPart>());
    check("ListItem", ListItem::FIELDS, size_of::<ListItem>());
    check("TextureSlot", TextureSlot::FIELDS, size_of::<TextureSlot>());
    check("Material", Material::FIELDS, size_of::<Material>());
    check("Light", Light::FIELDS, size_of::<Light>());
    check("Lamp", Lamp::FIELDS, size_of::<Lamp>());
    check("LampNode", LampNode::FIELDS, size_of::<LampNode>());
    check("Cones", Cones::FIELDS, size_of::<Cones>());
    check("TextureLevel", TextureLevel::FIELDS, size_of::<TextureLevel>());
    check("Frame", Frame::FIELDS, size_of::<Frame>());
    check("GridPush", GridPush::FIELDS, size_of::<GridPush>());
    check("SharesPush", SharesPush::FIELDS, size_of::<SharesPush>());
    check("ProbeGrid", ProbeGrid::FIELDS, size_of::<ProbeGrid>());
    check("Probe", Probe::FIELDS, size_of::<Probe>());
    check("ProbeRay", ProbeRay::FIELDS, size_of::<ProbeRay>());
    check("RecordDraw", RecordDraw::FIELDS, size_of::<RecordDraw>());
}

/// Push blocks all have one name, so the blocks of this method are checked separately.
#[test]
fn the_push_constants_of_lpv_agree() {
    for shader in ["gi/lpv/light.comp", "gi/lpv/inject.comp", "gi/lpv/propagate.comp", "gi/lpv/propagate_beams.comp"] {
        let push = &shader::structs(shader)["Push"];
        let names: Vec<_> = push.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
        assert_eq!(names, LpvPush::FIELDS, "{shader}");
    }
}

#[test]
fn the_push_constants_of_probes_agree() {
    for shader in ["place", "feel", "trace", "blend"] {
        let shader = format!("gi/probes/{shader}.comp");
        let push = &shader::structs(&shader)["ProbesPush"];
        let names: Vec<_> = push.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
        assert_eq!(names, ProbesPush::FIELDS, "{shader}");
    }
}

#[test]
fn the_push_constants_of_deform_agree() {
    let push = &shader::structs("ground/deform.comp")["Push"];
    let names: Vec<_> = push.members.iter().map(|m| (m.name.as_str(), m.offset)).collect();
    assert_eq!(names, DeformPush::FIELDS);
}

#[test]
fn numbers_agree_with_the_shaders() {
    let glsl = include_str!("../../glsl/ground/constants.glsl");
    let ours = cells::LIT_COUNTS;
    assert!(glsl.contains(&format!("\nconst uint LIT_COUNTS = {ours}u;")), "GLSL has another than {ours}");
    let (glsl, ours) = (include_str!("../../glsl/gi/probes/feelers.glsl"), probes::FEELERS);
    assert!(glsl.contains(&format!("\nconst uint FEELERS = {ours}u;")), "GLSL has another than {ours}");
    let (glsl, ours) = (include_str!("../../glsl/ground/layout.glsl"), boxes::MOST_BOXES);
    assert!(glsl.contains(&format!("\nconst uint MOST_BOXES = {ours}u;")), "GLSL has another than {ours}");
}

/// The constants of a list of choices that GLSL names have the choices' places: `FILL_FRONT` that of the fill `front`.
#[test]
fn choices_have_the_numbers_of_the_shaders() {
    macro_rules! glsl {
        ($file:literal) => {
            include_str!(concat!("../../glsl/", $file))
        };
    }
    let fills = glsl!("ground/faces/fill_kinds.glsl");
    let (cones, cone) = (glsl!("gi/cones/constants.glsl"), glsl!("gi/cones/cone.glsl"));
    let (of_lpv, of_photons) = (glsl!("gi/lpv/constants.glsl"), glsl!("gi/photons/constants.glsl"));
    let ground = glsl!("ground/constants.glsl");
    let mut named = 0;
    let mut agree = |glsl: &str, prefix: &str, names: &[String]| {
        let found: Vec<&str> = glsl.split(&format!("\nconst uint {prefix}_")).skip(1).collect();
        for text in &found {
            let (name, value) = text.split_once("u;").and_then(|(head, _)| head.split_once(" = ")).expect("a number");
            let name = name.to_lowercase().replace('_', "-");
            let place = names.iter().position(|choice| *choice == name);
            assert_eq!(place.map(|place| place.to_string()).as_deref(), Some(value), "{prefix}: {name} of {names:?}");
        }
        assert!(!found.is_empty(), "GLSL names no {prefix}");
        named += found.len();
    };
    macro_rules! agree {
        ($($glsl:ident $prefix:literal $choice:ty),+ $(,)?) => {$(
            agree($glsl, $prefix, &<$choice>::ALL.iter().map(|choice| choice.name().to_owned()).collect::<Vec<_>>());
        )+};
    }
    agree!(
        fills "FILL" choices::Fill,
        cones "WEIGHTS" choices::Weights,
        cone "BLEND" choices::Blend,
        of_lpv "LOBE" lpv::Lobe,
        of_lpv "OCCLUSION" lpv::Occlusion,
        of_lpv "SUM" lpv::Sum,
        of_lpv "INJECTION" lpv::Injection,
        of_lpv "APPLY" lpv::Apply,
        of_photons "COMPOSITE" photons::Composite,
        of_photons "OPACITY" photons::Opacity,
        of_photons "AO" photons::AoMultiplies,
        ground "SHADOWS" Shadows,
        ground "LAMPS" LampLight,
    );
    assert_eq!(named, 33, "names in GLSL");
}
