//! The memory that a file's content will need, added up from headers and counts before it is allocated.
//!
//! The sums are upper estimates for loading and for the copies of rendering. Small files can describe scenes that no
//! machine holds, and the system kills a program that runs out of memory without a message.

use gltf::json;
use gltf::json::mesh::{Mode, Primitive, Semantic};
use gltf::json::validation::Checked::Valid;

use super::accessor::Problem;
use super::document::{Document, Node, size};
use super::{deform, draco, instancing};
use crate::memory::{Limit, apart};

/// The kind of content that takes memory.
#[derive(Clone, Copy)]
pub enum Kind {
    Bytes,
    Objects,
    Instances,
    Vertices,
    Triangles,
    Texels,
    Numbers,
}

/// The name of a [`Kind`], and a way to reduce it.
const KINDS: [(&str, &str); 7] = [
    ("bytes in its files", "split it into smaller ones"),
    ("objects and list entries in its JSON", "split it into smaller files"),
    ("instances of meshes", "use fewer instances"),
    ("vertices", "use fewer triangles"),
    ("triangles over all instances", "use fewer triangles or instances"),
    ("texels in its textures", "use smaller textures or --max-texture TEXELS"),
    ("numbers of animations and skins", "use fewer keys or joints"),
];

/// The maximum number of triangles over all instances: three indices of each are counted in 32 bits.
const TRIANGLES_MAX: u64 = 1 << 30;

/// Bytes while a vertex is read, for all its attributes and their first copies.
const VERTEX_READ: u64 = 104;
/// Bytes while a vertex with joints is read, with a blended transform, joints and weights.
const VERTEX_SKINNED: u64 = VERTEX_READ + 136;
/// Bytes of an element of one attribute and its copy that the file's size does not limit. They are added up to bound
/// the time.
const UNBACKED: u64 = 32;
/// The number of copies of each value in a Draco decoder: quantised, whole, and converted for the accessor.
const PACKED_COPIES: u64 = 3;
/// Bytes of the Draco decoder's tables per corner of a triangle: 38 were measured with four attributes.
const PACKED_CORNER: u64 = 64;
/// Bytes of a vertex that is kept: in the scene, packed, and on a device that shares the machine's memory.
const VERTEX_KEPT: u64 = 72 + 64 + 64;
/// Bytes of a vertex that a skin moves: undeformed, with joints and weights, in the scene, packed and on the device.
const VERTEX_DEFORMED: u64 = 3 * (40 + 8 * 4);
/// Bytes of a vertex's difference in a morph target, and of four more joints of a vertex, in these three places.
const VERTEX_TARGET: u64 = 3 * 36;
const VERTEX_JOINTS: u64 = 3 * 8 * 4;
/// Bytes of an index in the same three places.
const INDEX_KEPT: u64 = 12;
/// Bytes of a triangle of an instance for blending, sampling of lamps and tracing.
const TRIANGLE_POSED: u64 = 64;
/// Bytes of an instance: its transforms and its draw.
const INSTANCE: u64 = 512;
/// Bytes of a node of the scene with its transforms and its description in the document.
const NODE: u64 = 768;
/// Bytes of a texel, in the scene and again for every colour space in which it is used: its mip chain during
/// generation, and its place on the device.
const TEXEL: u64 = 4;
const TEXEL_CHAIN: u64 = 12;

/// Bytes of an entry of a list of plain values, which extensions may keep as JSON.
const ENTRY: u64 = 3 * size_of::<serde_json::Value>() as u64;

/// Sums for each [`Kind`]: a count and bytes.
pub struct Need {
    limit: Limit,
    sums: [(u64, u64); KINDS.len()],
    /// Instances whose places are not in the file.
    unbacked: u64,
}

impl Need {
    pub fn within(limit: Limit) -> Self {
        Self { limit, sums: Default::default(), unbacked: 0 }
    }

    pub fn add(&mut self, kind: Kind, count: u64, bytes_each: u64) {
        let sum = &mut self.sums[kind as usize].0;
        *sum = sum.saturating_add(count);
        self.add_bytes(kind, count.saturating_mul(bytes_each));
    }

    pub fn add_bytes(&mut self, kind: Kind, bytes: u64) {
        let sum = &mut self.sums[kind as usize].1;
        *sum = sum.saturating_add(bytes);
    }

    /// Refuses content that exceeds the limit; the sentence names the kind that takes most.
    pub fn check(&self) -> Result<(), Problem> {
        let total = self.sums.iter().fold(0u64, |sum, (_, bytes)| sum.saturating_add(*bytes));
        let most = (0..KINDS.len()).max_by_key(|&kind| self.sums[kind].1).unwrap_or_default();
        let (count, (name, remedy)) = (count_in_words(self.sums[most].0), KINDS[most]);
        if total > self.limit.bytes {
            let [total, _] = apart([total, self.limit.bytes]);
            let limit = &self.limit.words;
            return Err(format!(
                "needs about {total} of memory, most of it for {count} {name}, more than {limit}: {remedy}"
            ));
        }
        if self.unbacked > instancing::UNBACKED_MAX {
            let (count, most) = (count_in_words(self.unbacked), instancing::UNBACKED_MAX);
            return Err(format!(
                "has {count} instances of meshes without data, which all stand at one place, more than the {most} that are read: export it again"
            ));
        }
        let triangles = self.sums[Kind::Triangles as usize].0;
        if triangles > TRIANGLES_MAX {
            let (count, limit) = (count_in_words(triangles), count_in_words(TRIANGLES_MAX));
            let (name, remedy) = KINDS[Kind::Triangles as usize];
            return Err(format!("has {count} {name}, more than the {limit} that can be counted: {remedy}"));
        }
        Ok(())
    }

    /// Refuses more triangles than a device can hold.
    pub fn check_triangles(&self, most: u64, limit: &str) -> Result<(), Problem> {
        let triangles = self.sums[Kind::Triangles as usize].0;
        if triangles <= most {
            return Ok(());
        }
        let ([count, most], (name, remedy)) = ([triangles, most].map(count_in_words), KINDS[Kind::Triangles as usize]);
        Err(format!("has {count} {name}, more than the {most} that fit into {limit}: {remedy}"))
    }

    /// Bytes that are still available.
    pub fn room(&self) -> u64 {
        self.sums.iter().fold(self.limit.bytes, |left, (_, bytes)| left.saturating_sub(*bytes))
    }

    /// The reason for the limit, in words.
    pub fn limit(&self) -> &str {
        &self.limit.words
    }

    /// Adds the memory for parsing a document's text.
    pub fn add_json(&mut self, text: &[u8]) {
        // A growing list takes three times its content while it is moved.
        let sizes = [
            size_of::<Node>(),
            size_of::<json::Mesh>(),
            size_of::<Primitive>(),
            size_of::<json::Material>(),
            size_of::<json::Accessor>(),
            size_of::<json::Image>(),
            size_of::<json::Texture>(),
            size_of::<json::Skin>(),
            size_of::<json::Camera>(),
            size_of::<json::buffer::View>(),
            size_of::<json::Buffer>(),
        ];
        let largest = sizes.into_iter().max();
        // These bytes do not count within strings, where they are rare.
        let count = |byte: u8| text.iter().filter(|b| **b == byte).count() as u64;
        self.add(Kind::Objects, count(b'{'), 3 * largest.unwrap_or_default() as u64);
        self.add(Kind::Objects, count(b','), ENTRY);
    }

    /// Adds the meshes of the nodes `shown`, which are loaded once, or once for each node that deforms them.
    pub fn add_meshes(&mut self, document: &Document, shown: &[usize]) {
        let sizes: Vec<MeshSize> = document.meshes.iter().map(|mesh| MeshSize::new(document, mesh)).collect();
        let mut loaded = vec![false; sizes.len()];
        let (mut read, mut packed) = (0, 0);
        let morphed = deform::morphed(document);
        for (index, node) in shown.iter().map(|&index| (index, &document.nodes[index])) {
            let Some((mesh, size)) = node.mesh.and_then(|mesh| Some((mesh, sizes.get(mesh)?))) else { continue };
            let times = instancing::count(document, node);
            self.unbacked = self.unbacked.saturating_add(instancing::unbacked(document, node));
            self.add(Kind::Triangles, (size.corners / 3).saturating_mul(times), TRIANGLE_POSED);
            self.add(Kind::Instances, size.primitives.saturating_mul(times), INSTANCE);
            self.add_bytes(Kind::Instances, times.saturating_mul(NODE));
            let skin = node.skin.and_then(|skin| document.skins.get(skin));
            let morphs = morphed.contains(&index);
            if skin.is_some() || morphs {
                self.add_bytes(Kind::Vertices, size.kept.saturating_mul(VERTEX_DEFORMED));
            }
            if skin.is_some() {
                self.add_bytes(Kind::Vertices, size.joints.saturating_mul(VERTEX_JOINTS));
            }
            if morphs {
                self.add_bytes(Kind::Vertices, size.targets.saturating_mul(VERTEX_TARGET));
            }
            if skin.is_some() || morphs || node.weights.is_some() || !loaded[mesh] {
                self.add(Kind::Vertices, size.kept, VERTEX_KEPT);
                self.add_bytes(Kind::Vertices, size.unbacked.saturating_mul(UNBACKED));
                self.add_bytes(Kind::Triangles, size.corners.saturating_mul(INDEX_KEPT));
                read = read.max(size.largest.saturating_mul(if skin.is_some() { VERTEX_SKINNED } else { VERTEX_READ }));
            }
            loaded[mesh] = true;
            packed = packed.max(size.packed);
            if let Some(skin) = skin {
                let matrices = skin.inverse_bind_matrices.map_or(0, |accessor| elements(document, accessor.value()));
                self.add(Kind::Numbers, 16 * (skin.joints.len() as u64).saturating_add(matrices), 12);
            }
        }
        self.add_bytes(Kind::Vertices, read);
        self.add_bytes(Kind::Vertices, packed);
    }

    /// Adds the keys of all animations.
    pub fn add_animations(&mut self, document: &Document) {
        for animation in &document.animations {
            for sampler in animation.channels.iter().filter_map(|c| animation.samplers.get(c.sampler)) {
                self.add(Kind::Numbers, elements(document, sampler.input.value()), 8);
                self.add(Kind::Numbers, elements(document, sampler.output.value()).saturating_mul(4), 8);
            }
        }
    }

    /// Adds an image that is used in `spaces` colour spaces.
    pub fn add_image(&mut self, (width, height): (u32, u32), spaces: u64) {
        self.add(Kind::Texels, u64::from(width) * u64::from(height), TEXEL + spaces * TEXEL_CHAIN);
    }
}

/// Sizes of all triangle primitives of a mesh.
#[derive(Default)]
struct MeshSize {
    primitives: u64,
    /// Three per triangle.
    corners: u64,
    /// Vertices that loading keeps.
    kept: u64,
    /// Elements without data in the file, in attributes and used morph targets, whose number the file's size does not
    /// limit; and sparse data, which is read completely for each primitive.
    unbacked: u64,
    /// Vertices times morph targets, and vertices times sets of joints.
    targets: u64,
    joints: u64,
    /// Vertices of the largest primitive, including unused ones, which loading drops.
    largest: u64,
    /// Bytes while the largest compressed primitive is decoded.
    packed: u64,
}

impl MeshSize {
    fn new(document: &Document, mesh: &json::Mesh) -> Self {
        let mut sum = Self::default();
        for primitive in &mesh.primitives {
            let Some(position) = primitive.attributes.get(&Valid(Semantic::Positions)) else { continue };
            let vertices = elements(document, position.value());
            let drawn = primitive.indices.map_or(vertices, |indices| elements(document, indices.value()));
            let corners = match primitive.mode {
                Valid(Mode::Triangles) => drawn,
                Valid(Mode::TriangleStrip | Mode::TriangleFan) => drawn.saturating_mul(3),
                _ => continue,
            };
            let welded = primitive.attributes.contains_key(&Valid(Semantic::Normals));
            let differences =
                primitive.targets.iter().flatten().flat_map(|t| [t.positions, t.normals, t.tangents]).flatten();
            let unbacked = primitive.attributes.values().copied().chain(differences).map(|a| a.value());
            let unbacked = unbacked
                .filter(|&a| document.accessors.get(a).is_some_and(|a| a.buffer_view.is_none() || a.sparse.is_some()));
            let unbacked = unbacked.fold(0u64, |sum, a| sum.saturating_add(elements(document, a)));
            sum.primitives += 1;
            sum.corners = sum.corners.saturating_add(corners);
            let kept = if welded { corners.min(vertices) } else { corners };
            let sets = primitive.attributes.keys().filter(|key| matches!(key, Valid(Semantic::Joints(_)))).count();
            let targets = primitive.targets.as_ref().map_or(0, Vec::len);
            sum.kept = sum.kept.saturating_add(kept);
            sum.targets = sum.targets.saturating_add(kept.saturating_mul(targets as u64));
            sum.joints = sum.joints.saturating_add(kept.saturating_mul(sets as u64));
            sum.unbacked = sum.unbacked.saturating_add(unbacked);
            sum.largest = sum.largest.max(vertices);
            if draco::is_packed(primitive) {
                let attributes = draco::bytes(document, primitive).saturating_mul(PACKED_COPIES);
                sum.packed = sum.packed.max(attributes.saturating_add(corners.saturating_mul(PACKED_CORNER)));
            }
        }
        sum
    }
}

fn elements(document: &Document, accessor: usize) -> u64 {
    document.accessors.get(accessor).map_or(0, |accessor| size(accessor.count) as u64)
}

/// A count in words, with at most five digits.
fn count_in_words(count: u64) -> String {
    match count {
        0..100_000 => count.to_string(),
        100_000..100_000_000_000 => format!("{:.1} million", count as f64 / 1e6),
        _ => format!("{:.1e}", count as f64),
    }
}
