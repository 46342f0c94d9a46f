//! Loads glTF 2.0, `.gltf` and `.glb`, into a [`Scene`].
//!
//! One file per kind of object: `container` (bytes), `document` (JSON), `meshopt` (compressed bytes), `accessor`
//! (numbers), `nodes` (tree, cameras, lights), `instancing`, `animations`, `materials` with `finish` and
//! `specular_glossiness`, `images` with `ktx2` and `webp`, `mesh` with `draco`, `tangents` and `deform`. No damaged
//! file makes the loader panic: every index and offset is checked before use.

mod accessor;
mod animations;
mod check;
mod container;
mod deform;
mod document;
mod draco;
mod finish;
mod images;
mod instancing;
mod ktx2;
mod materials;
mod mesh;
mod meshopt;
mod need;
mod nodes;
mod specular_glossiness;
mod tangents;
mod webp;

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::PoisonError;

use glam::DAffine3;

use self::accessor::{Data, Problem, missing};
pub(super) use self::container::list;
use self::container::{Container, Folders};
use self::document::Document;
use self::need::{Kind, Need};
use super::animation::World;
use super::deform::Deformer;
use super::{Instance, Material, Scene};
use crate::Error;
use crate::memory::Limit;
use crate::output::file::is_standard;

/// The part of a file to load, and limits.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// The name or index of a scene; `None` is the file's default scene.
    pub scene: Option<String>,
    /// One more folder from which the scene may read files: buffers and textures that scenes share.
    pub assets: Option<PathBuf>,
    /// Whether to refuse a file if a texture or a required extension would be left out.
    pub strict: bool,
    /// Memory of the machine that loading and rendering may use; `None` for half of the free memory.
    pub memory: Option<Limit>,
    /// Memory of the device that textures may use, if there is a device.
    pub texture_memory: Option<Limit>,
    /// The maximum side in texels of an image on the device, which holds a texture above its mips, and the reason for
    /// this limit.
    pub texture_side: Option<(u32, String)>,
    /// The maximum number of triangles over all instances on the device, and the reason for this limit.
    pub triangles: Option<(u64, String)>,
    /// Larger textures are halved until they have at most this many texels a side.
    pub max_texture: Option<u32>,
}

/// The supported extensions. A file that requires another one is refused, unless it only changes looks. A file that
/// only uses another one gets a warning.
const KNOWN_EXTENSIONS: [&str; 23] = [
    instancing::NAME,
    meshopt::NAMES[0],
    "EXT_texture_webp",
    draco::NAME,
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_diffuse_transmission",
    "KHR_materials_dispersion",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_iridescence",
    specular_glossiness::NAME,
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    meshopt::NAMES[1],
    nodes::VISIBILITY,
    "KHR_texture_basisu",
    "KHR_texture_transform",
];

/// Limit of coordinates in metres and of scale factors: areas and squared distances still fit into f32.
const COORDINATE_MAX: f64 = 1e15;

impl Scene {
    /// Loads a glTF 2.0 file as [`Scene::load`] does by default.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::load(path.as_ref(), &LoadOptions::default())
    }

    /// Loads the glTF 2.0 file at `path`, `-` for standard input: buffers, images, the chosen scene, every animation.
    ///
    /// `docs/usage.md` lists the supported extensions. Points, lines and unreadable textures are left out; with
    /// `options.strict`, unreadable textures are errors. Each simplification adds one of [`Scene::warnings`].
    ///
    /// # Errors
    /// [`Error::File`] in one sentence, for missing or damaged files, glTF 1.0, unsupported required extensions, and
    /// scenes that need more memory than `options` allow. These are refused from their headers, before memory is
    /// allocated.
    pub fn load(path: &Path, options: &LoadOptions) -> Result<Self, Error> {
        let mut need = Need::within(options.memory.clone().unwrap_or_else(Limit::host));
        let file = container::read(path, &mut need)?;
        Self::of_file(path, file, need, options)
    }

    /// Loads a .glb that is in memory and refers to no other file. Errors and notes call it `name`.
    ///
    /// # Errors
    /// As for [`Scene::load`].
    pub fn load_glb(name: &str, bytes: Vec<u8>, options: &LoadOptions) -> Result<Self, Error> {
        let mut need = Need::within(options.memory.clone().unwrap_or_else(Limit::host));
        let file = container::held(Path::new(name), bytes, &mut need)?;
        Self::of_file(Path::new(name), file, need, options)
    }

    fn of_file(path: &Path, file: Container, mut need: Need, options: &LoadOptions) -> Result<Self, Error> {
        need.add_json(&file.json);
        need.check().map_err(|problem| Error::file(path, problem))?;
        let document = parse(path, file.json)?;
        let mut hash = blake3::Hasher::new();
        hash_part(&mut hash, &document.source);
        let load = || -> Result<Self, Problem> {
            let document = &document;
            check_extensions(document, options.strict)?;
            let folder = path.parent().unwrap_or(Path::new(""));
            let folders = Folders { scene: folder, assets: options.assets.as_deref() };
            let buffers = load_buffers(document, folders, file.binary, &mut need)?;
            buffers.iter().flatten().for_each(|bytes| hash_part(&mut hash, bytes));
            let decoded = meshopt::decode(document, &buffers, &mut need)?;
            let data =
                &Data { document, buffers: &buffers, decoded: &decoded, unpacked: None, uv_sets: &[], picked: None };
            check::document(data)?;
            let tree = nodes::NodeOrder::new(document)?;
            let shown = tree.reachable(document, &nodes::choose_roots(document, options.scene.as_deref())?)?;
            let mut scene = Self { nodes: tree.nodes(document)?, ..Self::default() };
            let mut used = images::Used::new(options.strict, options.max_texture);
            let uv_sets;
            (scene.materials, uv_sets) = materials::load(document, &mut used)?;
            let data = &Data { uv_sets: &uv_sets, ..*data };
            nodes::load_cameras(document, &tree, &shown, &mut scene)?;
            let shown = tree.visible(document, &shown);
            nodes::load_lights(document, &tree, &shown, &mut scene)?;
            // All sizes are known before large memory is allocated.
            need.add_meshes(document, &shown);
            need.add_animations(document);
            need.check()?;
            if let Some((most, words)) = &options.triangles {
                need.check_triangles(*most, words)?;
            }
            let images = images::open(data, folders, used, &mut need)?;
            images.check(&scene.materials, &mut need)?;
            let drawn: Vec<&Material> =
                materials::drawn(document, &shown).map(|index| &scene.materials[index]).collect();
            images.check_device(&drawn, options)?;
            images.decode(document, &mut scene, &mut hash)?;
            load_meshes(data, &tree, &shown, &mut scene)?;
            animations::load(data, &tree, &mut scene)?;
            Ok(scene)
        };
        let scene = load().map_err(|problem| Error::file(path, problem))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        Ok(Self {
            name: if is_standard(path) { "stdin".into() } else { name.into_owned() },
            hash: hash.finalize().to_hex().to_string(),
            warnings: document.warnings.into_inner().unwrap_or_else(PoisonError::into_inner),
            ..scene
        })
    }
}

/// Adds a part and its length, so that the boundary between two parts counts too.
fn hash_part(hash: &mut blake3::Hasher, bytes: &[u8]) {
    hash.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
}

/// Parses the text. If that fails, only its version is parsed, because a glTF 1.0 document has another structure.
fn parse(path: &Path, json: Vec<u8>) -> Result<Document, Error> {
    #[derive(serde::Deserialize)]
    struct Head {
        asset: Option<document::Asset>,
    }
    let broken = |e: serde_json::Error| {
        let (what, line, column) = (container::shorten(&e.to_string()), e.line(), e.column());
        Error::file(path, format!("is not valid glTF at line {line}, column {column} ({what}); export the file again"))
    };
    match serde_json::from_slice::<Document>(&json) {
        Ok(mut document) => {
            document.source = json;
            check_version(path, document.asset.as_ref())?;
            Ok(document)
        }
        Err(_) => {
            let head: Head = serde_json::from_slice(&json).map_err(broken)?;
            check_version(path, head.asset.as_ref())?;
            Document::parse_plain(json).map_err(broken)
        }
    }
}

fn check_version(path: &Path, asset: Option<&document::Asset>) -> Result<(), Error> {
    let version = asset.map_or("", |asset| asset.min_version.as_deref().unwrap_or(&asset.version));
    match version.split('.').next() {
        Some("2") if version == "2.0" || asset.is_some_and(|asset| asset.min_version.is_none()) => Ok(()),
        Some("") | None => {
            Err(Error::file(path, "states no asset.version, so it is not glTF 2.0; export the scene as glTF 2.0"))
        }
        Some(_) => {
            let version = container::shorten(version);
            Err(Error::file(path, format!("is glTF {version}, only 2.0 can be read; convert it to glTF 2.0")))
        }
    }
}

fn check_extensions(document: &Document, strict: bool) -> Result<(), Problem> {
    let unknown = |name: &&String| !KNOWN_EXTENSIONS.contains(&name.as_str());
    let required: Vec<_> = document.extensions_required.iter().filter(unknown).collect();
    for full_name in &required {
        let name = container::shorten(full_name);
        if !changes_looks_alone(full_name) {
            return Err(format!("requires the extension {name}, which is not supported; export the scene without it"));
        }
        if strict {
            return Err(format!(
                "requires the extension {name}, which is not supported; export the scene without it or leave out --strict"
            ));
        }
        let hint = hint(full_name);
        document
            .warn(format!("the extension {name} is required, but not supported: what uses it looks different{hint}"));
    }
    let required: BTreeSet<_> = required.into_iter().collect();
    for name in document.extensions_used.iter().filter(unknown).filter(|name| !required.contains(name)) {
        let (hint, name) = (hint(name), container::shorten(name));
        document.warn(format!("the extension {name} is not supported and was ignored{hint}"));
    }
    Ok(())
}

/// An alternative for a file that takes its light from an image of its surroundings.
fn hint(extension: &str) -> &'static str {
    if is_environment(extension) { "; give the image of its surroundings with --sky FILE.hdr" } else { "" }
}

/// Whether an extension lights the scene with an image of the surroundings.
fn is_environment(name: &str) -> bool {
    ["_lights_image_based", "_lights_environment", "_environment_map", "_environments"]
        .iter()
        .any(|part| name.ends_with(part))
}

/// Whether a scene without this extension has the same geometry: extensions of materials and lights, and descriptions.
fn changes_looks_alone(name: &str) -> bool {
    const OTHERS: [&str; 3] = ["EXT_lights_ies", "KHR_xmp", "KHR_xmp_json_ld"];
    name.contains("_materials_") || is_environment(name) || OTHERS.contains(&name)
}

/// Loads all buffers. `None` for a fallback of an extension, and for a buffer without a URI, which may belong to an
/// ignored extension.
fn load_buffers(
    document: &Document,
    folders: Folders,
    mut binary: Option<container::Section>,
    need: &mut Need,
) -> Result<Vec<Option<Vec<u8>>>, Problem> {
    let what = |index: usize| format!("buffer {index}");
    let mut opened = Vec::new();
    for (index, buffer) in document.buffers.iter().enumerate() {
        let source = match &buffer.uri {
            _ if meshopt::is_fallback(buffer) => None,
            Some(uri) => Some(container::find(folders, &what(index), uri)?),
            None if index == 0 => binary.take().map(container::ByteSource::Chunk),
            None => None,
        };
        let (has, states) = (source.as_ref().map(container::ByteSource::bytes), buffer.byte_length.0);
        if let Some(has) = has.filter(|has| *has < states) {
            return Err(format!("{} holds {has} of its {states} bytes; copy or export the file again", what(index)));
        }
        need.add(Kind::Bytes, has.map_or(0, |_| states), 1);
        need.check()?;
        opened.push(source);
    }
    let read = |(index, source): (usize, Option<container::ByteSource>)| {
        let bytes = document.buffers[index].byte_length.0;
        source.map(|source| source.read(&what(index), bytes)).transpose()
    };
    opened.into_iter().enumerate().map(read).collect()
}

/// Checks that a node's coordinates and scale do not overflow.
fn check_near(node: usize, world: &DAffine3) -> Result<(), Problem> {
    // NaN, the product of 0 and an infinite scale, fails this comparison too.
    match world.to_cols_array().iter().all(|x| x.abs() <= COORDINATE_MAX) {
        true => Ok(()),
        false => Err(format!("node {node} is translated or scaled beyond 10¹⁵; scale the scene down")),
    }
}

/// One mesh per primitive, shared by all nodes that use it without deformation.
fn load_meshes(data: &Data, tree: &nodes::NodeOrder, shown: &[usize], scene: &mut Scene) -> Result<(), Problem> {
    let document = data.document;
    let places = shown.iter().filter(|&&index| document.nodes[index].mesh.is_some());
    let places = places.map(|&index| Ok((index, instancing::load(data, tree, index, scene)?)));
    let places = places.collect::<Result<Vec<_>, Problem>>()?;
    let world = World::new(&scene.nodes, &[], document.nodes.len());
    let morphed = deform::morphed(document);
    let mut shared: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for (index, places) in places {
        let node = &document.nodes[index];
        let Some(mesh_index) = node.mesh else { continue };
        places.clone().try_for_each(|place| check_near(index, &world.of_node(place)))?;
        document.meshes.get(mesh_index).ok_or_else(|| missing("mesh", mesh_index))?;
        let morphs = morphed.contains(&index) && deform::targets(data, index) > 0;
        let own = node.skin.is_some() || node.weights.is_some() || morphs;
        let meshes = match shared.get(&mesh_index).filter(|_| !own) {
            Some(meshes) => meshes.clone(),
            None => {
                let weights = deform::weights(data, index)?;
                let joints = deform::joints(data, tree, index)?;
                let mut applied = deform::Applied { weights, deformer: None };
                if morphs || !joints.is_empty() {
                    let mut own_weights = weights.to_vec();
                    own_weights.resize(if morphs { deform::targets(data, index) } else { 0 }, 0.0);
                    let deformer = Deformer { node: tree.slot[index], joints, weights: own_weights };
                    applied.deformer = Some(deform::Applying {
                        index: scene.deformers.len(),
                        joints: (deformer.joints.len() as u32).checked_sub(1),
                        morphs,
                        rest: deformer.pose(&world.inner, deformer.weights.clone()),
                    });
                    scene.deformers.push(deformer);
                }
                let first = scene.meshes.len();
                for number in 0..document.meshes[mesh_index].primitives.len() {
                    scene.meshes.extend(mesh::load(data, [mesh_index, number], &applied, &scene.materials)?);
                }
                (first..scene.meshes.len()).collect()
            }
        };
        for node in places {
            scene.instances.extend(meshes.iter().map(|&mesh| Instance { mesh, node }));
        }
        if !own {
            shared.insert(mesh_index, meshes);
        }
    }
    Ok(())
}
