//! The names of settings before methods had their own tables, for a message that gives the new name.

/// (old name, what to write instead)
const RENAMED: &[(&str, &str)] = &[
    ("gather", "method = \"rays\" or \"cones\""),
    ("specular", "method = \"rays\" or \"cones\""),
    ("refraction", "method = \"rays\" or \"cones\""),
    ("cones", "cones.set, or rays.diffuse for a number of rays"),
    ("fill", "cones.fill"),
    ("weights", "cones.weights"),
    ("blend", "cones.blend"),
    ("step", "cones.step"),
    ("aperture", "cones.aperture"),
    ("exit_margin", "cones.exit_margin"),
    ("roughness_fit", "cones.roughness_fit"),
    ("first_bounce_shadows", "cones.first_bounce_shadows"),
    ("jitter", "cones.jitter, and cones.shadow_jitter"),
    ("lists", "cones.passes"),
    ("shading", "cones.passes"),
    ("mips", "cones.passes"),
    ("reuse", "nothing: what did not change is always kept"),
    ("shadows", "lights.shadows"),
    ("emitters", "lights.lamps"),
    ("emitter_samples", "lights.lamp_points"),
    ("specular_rays", "rays.glossy"),
    ("shade.gather", "nothing: voxels gather as the method does"),
    ("shade.cones", "rays.bounce"),
    ("shade.emitter_samples", "lights.voxel_lamp_points"),
    ("shade.direct", "nothing: direct light is always kept where both bounces have the same"),
    ("shade.items", "nothing: the method rays always lights alike triangles as one"),
    ("interleave", "image.interleave"),
    ("gather_resolution", "image.gather_resolution"),
    ("shadow.rays", "lights.shadow_rays"),
    ("shadow.step", "cones.shadow_step"),
    ("shadow.half_angle", "cones.shadow_half_angle"),
    ("ledger.d24", "nothing: no image shows the row's difference"),
];

/// The sentence about the setting that was once called `name`.
pub fn sentence(name: &str) -> Option<String> {
    let moved = [("volume.", "grid."), ("start.", "cones.start."), ("ledger.", "cones.ledger.")];
    let listed = RENAMED.iter().find(|(old, _)| *old == name).map(|(_, new)| (*new).to_owned());
    let table = || {
        let (old, new) = moved.iter().find(|(old, _)| name.starts_with(old))?;
        let new = format!("{new}{}", &name[old.len()..]);
        super::Key::named(&new).is_some().then_some(new)
    };
    let new = listed.or_else(table)?;
    Some(match new.strip_prefix("nothing: ") {
        Some(why) => format!("the setting {name:?} is gone, {why}; take it out"),
        None => format!("the setting {name:?} is now {new}"),
    })
}
