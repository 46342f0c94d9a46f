//! Optional material extensions ([`Finish`]) on the device: rows of four words after the texture levels, so that scenes
//! without them take no memory, and no further binding is needed. `glsl/ground/finish.glsl` is the twin.

use std::collections::BTreeSet;

use super::layout::{Material, TextureLevel, TextureSlot};
use crate::scene::finish::Finish;
use crate::scene::{Scene, sheen};

/// `MATERIAL_FINISH_SHIFT` of the twin.
const FLAGS_SHIFT: u32 = 4;

/// Packed extensions of one material. The layers of slots are numbers of chains until these are placed.
#[derive(Clone, Debug)]
pub struct PackedFinish {
    /// Index of the material.
    pub material: usize,
    /// Five rows; the last word is the start of the sheen's table.
    factors: [f32; 20],
    pub slots: [TextureSlot; 10],
}

impl PackedFinish {
    pub fn new(material: usize, f: &Finish, slots: [TextureSlot; 10]) -> Self {
        let bump = if f.clearcoat.normal_texture.is_some() { f.clearcoat.normal_scale } else { 0.0 };
        let [thin, thick] = f.iridescence.thickness_nm;
        let (sin, cos) = f.anisotropy.rotation.sin_cos();
        let (sheen, through) = (f.sheen.color, f.diffuse_transmission.color);
        let factors = [
            [f.clearcoat.factor, f.clearcoat.roughness, bump, f.anisotropy.strength],
            [sheen.x, sheen.y, sheen.z, f.sheen.roughness],
            [cos, sin, f.dispersion, f.iridescence.factor],
            [f.iridescence.ior, thin, thick, f.diffuse_transmission.factor],
            [through.x, through.y, through.z, 0.0],
        ];
        Self { material, factors: std::array::from_fn(|i| factors[i / 4][i % 4]), slots }
    }

    fn packed(&self, sheen_table: u32) -> Vec<u32> {
        let mut words: Vec<u32> = self.factors.iter().map(|x| x.to_bits()).collect();
        words[19] = sheen_table;
        for s in &self.slots {
            words.extend([s.layer, s.first_level, s.level_count, s.flags, s.uv_set]);
            words.extend(s.linear.iter().chain(&s.offset).map(|x| x.to_bits()));
            words.push(0);
        }
        words
    }
}

/// Appends the rows to `levels`, and sets their start in the materials.
pub fn append(finishes: &[PackedFinish], materials: &mut [Material], levels: &mut Vec<TextureLevel>) {
    if finishes.is_empty() {
        return;
    }
    let mut push = |words: &[u32]| {
        // Row 0 means that there are none.
        if levels.is_empty() {
            levels.push(bytemuck::Zeroable::zeroed());
        }
        let first = levels.len() as u32;
        for row in words.chunks(4) {
            let word = |i: usize| row.get(i).copied().unwrap_or_default();
            levels.push(TextureLevel { x: word(0), y: word(1), width: word(2), height: word(3) });
        }
        first
    };
    let has_sheen = finishes.iter().any(|finish| finish.factors[4..7].iter().any(|&x| x > 0.0));
    let table: Vec<u32> = match has_sheen {
        true => sheen::ALBEDO.iter().chain(sheen::TAKEN.iter()).flatten().map(|x| x.to_bits()).collect(),
        false => Vec::new(),
    };
    let table = push(&table);
    for finish in finishes {
        materials[finish.material].flags |= push(&finish.packed(table)) << FLAGS_SHIFT;
    }
}

/// One sentence for each approximation that the renderer makes for the scene's materials. `docs/materials.md` has their
/// errors.
pub fn approximated(scene: &Scene) -> Vec<String> {
    type Has = fn(&Finish) -> bool;
    let kinds: [(&str, &str, Has); 6] = [
        ("a clearcoat", "indirect light reaches it by one further specular cone or lobe of rays", |f| {
            f.clearcoat.factor > 0.0
        }),
        ("sheen", "indirect light is taken to come evenly from all sides", |f| f.sheen.color != glam::Vec3::ZERO),
        ("anisotropy", "methods other than rays reflect indirect light along one bent direction", |f| {
            f.anisotropy.strength > 0.0
        }),
        ("iridescence", "indirect light is reflected by one colour per pixel", |f| f.iridescence.factor > 0.0),
        ("diffuse transmission", "a volume is as thick as stated everywhere", |f| f.diffuse_transmission.factor > 0.0),
        ("dispersion", "the renderer refracts all colours alike", |f| f.dispersion > 0.0),
    ];
    let used: BTreeSet<usize> = scene.meshes.iter().map(|mesh| mesh.material).collect();
    let mut notes = Vec::new();
    for (what, how, has) in kinds {
        let found = |index: &usize| scene.materials[*index].finish.as_deref().is_some_and(has);
        let first = used.iter().copied().find(found);
        // Messages count without glTF's default material, which is the scene's first.
        notes
            .extend(first.map(|index| format!("material {} has {what}, approximated: {how}", index.saturating_sub(1))));
    }
    notes
}
