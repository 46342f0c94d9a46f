//! Reflection of compiled shaders: stages, bindings, push block, struct layouts.

use super::constants::Value;
use ash::vk;
use serde::Serialize;
use spirq::ReflectConfig;
use spirq::entry_point::{EntryPoint, ExecutionModel};
use spirq::ty::{AccessType, DescriptorType, Type};
use spirq::var::Variable;
use std::collections::{BTreeMap, HashMap};

/// The stage for which a module was compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum ShaderStage {
    Vertex,
    Geometry,
    Fragment,
    Compute,
}

impl ShaderStage {
    pub(in crate::vk) fn flag(self) -> vk::ShaderStageFlags {
        match self {
            Self::Vertex => vk::ShaderStageFlags::VERTEX,
            Self::Geometry => vk::ShaderStageFlags::GEOMETRY,
            Self::Fragment => vk::ShaderStageFlags::FRAGMENT,
            Self::Compute => vk::ShaderStageFlags::COMPUTE,
        }
    }
}

/// One stage of a pipeline, from its SPIR-V.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct StageInfo {
    pub stage: ShaderStage,
    /// Path below `glsl/`.
    pub shader: &'static str,
    /// Number of output locations: colour outputs of a fragment shader.
    pub outputs: usize,
}

/// The kind of resource of a binding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BindingKind {
    Storage,
    Uniform,
    /// A combined image sampler.
    Sampled,
    StorageImage,
    /// An acceleration structure.
    Structure,
}

impl BindingKind {
    pub(in crate::vk) fn descriptor_type(self) -> vk::DescriptorType {
        match self {
            Self::Storage => vk::DescriptorType::STORAGE_BUFFER,
            Self::Uniform => vk::DescriptorType::UNIFORM_BUFFER,
            Self::Sampled => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            Self::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
            Self::Structure => vk::DescriptorType::ACCELERATION_STRUCTURE_KHR,
        }
    }
}

/// One binding of set 0, merged over a pipeline's stages.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Binding {
    /// The number in the pipeline, in the order of names.
    pub binding: u32,
    /// The GLSL instance name; for a block without one, the name of its first member.
    pub name: String,
    pub kind: BindingKind,
    /// Elements of an array of resources, else 1.
    pub count: u32,
    /// The stages that use it, in pipeline order.
    pub stages: Vec<ShaderStage>,
    /// Whether no stage may write it.
    pub read_only: bool,
}

/// A member of a struct in the compiler's layout.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Member {
    pub name: String,
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// Bytes; 0 for a run-time array.
    pub bytes: usize,
}

/// A struct in the compiler's layout.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StructLayout {
    pub members: Vec<Member>,
    /// Bytes from one element of an array of the struct to the next, if there is such an array.
    pub stride: Option<usize>,
}

/// The name and the words of a shader, which live as long as the program.
pub(in crate::vk) type Shader = (&'static str, &'static [u32]);

/// A reflected module.
pub(in crate::vk) struct Module {
    pub(in crate::vk) info: StageInfo,
    pub(in crate::vk) bindings: Vec<Binding>,
    /// Size of the push block in bytes, 0 without one.
    pub(in crate::vk) push_bytes: u32,
}

/// Reflects one module. Panics if it uses features that pipelines do not support, which is a mistake in its GLSL.
pub(in crate::vk) fn module((name, words): Shader) -> Module {
    let entry = entry_point((name, words));
    let stage = match entry.exec_model {
        ExecutionModel::Vertex => ShaderStage::Vertex,
        ExecutionModel::Geometry => ShaderStage::Geometry,
        ExecutionModel::Fragment => ShaderStage::Fragment,
        ExecutionModel::GLCompute => ShaderStage::Compute,
        other => panic!("{name}: stage {other:?} is not used here"),
    };
    let (mut bindings, mut push_bytes, mut outputs) = (Vec::new(), 0, 0);
    for variable in &entry.vars {
        match variable {
            Variable::Descriptor { .. } => bindings.push(binding(name, stage, variable)),
            Variable::PushConstant { ty, .. } => {
                // The offset behind the last byte that it uses, without padding.
                let members = ty.as_struct().map_or(&[][..], |block| &block.members);
                let end = members.iter().map(|m| m.offset.unwrap_or(0) + m.ty.nbyte().unwrap_or(0)).max();
                push_bytes = end.unwrap_or(0) as u32;
            }
            Variable::Output { .. } => outputs += 1,
            Variable::Input { .. } | Variable::SpecConstant { .. } => {}
        }
    }
    Module { info: StageInfo { stage, shader: name, outputs }, bindings, push_bytes }
}

const HEADER_WORDS: usize = 5;

/// The instructions of a module: an opcode, and its operands.
fn instructions(words: &[u32]) -> impl Iterator<Item = (u32, &[u32])> {
    let mut rest = &words[HEADER_WORDS..];
    std::iter::from_fn(move || {
        let first = *rest.first()?;
        let (instruction, after) = rest.split_at(((first >> 16) as usize).max(1));
        rest = after;
        Some((first & 0xffff, &instruction[1..]))
    })
}

/// The specialisation constants that the module uses, by name, with their default values. The build has removed all
/// others.
pub(in crate::vk) fn constants(words: &[u32]) -> Vec<(String, Value)> {
    const NAME: u32 = 5;
    const TYPE_FLOAT: u32 = 22;
    const SPEC_CONSTANT_TRUE: u32 = 48;
    const SPEC_CONSTANT_FALSE: u32 = 49;
    const SPEC_CONSTANT: u32 = 50;
    let (mut names, mut floats, mut found) = (HashMap::new(), Vec::new(), Vec::new());
    for (opcode, operands) in instructions(words) {
        let (id, value) = match (opcode, operands) {
            (SPEC_CONSTANT_TRUE | SPEC_CONSTANT_FALSE, [_, id]) => (id, Value::Bool(opcode == SPEC_CONSTANT_TRUE)),
            (SPEC_CONSTANT, [ty, id, bits]) if floats.contains(ty) => (id, Value::Float(f32::from_bits(*bits))),
            (SPEC_CONSTANT, [_, id, bits]) => (id, Value::Uint(*bits)),
            (NAME, [id, name @ ..]) => {
                names.insert(*id, name);
                continue;
            }
            (TYPE_FLOAT, [id, ..]) => {
                floats.push(*id);
                continue;
            }
            _ => continue,
        };
        let bytes = names.get(id).into_iter().flat_map(|name| name.iter().flat_map(|word| word.to_le_bytes()));
        let name: Vec<u8> = bytes.take_while(|&byte| byte != 0).collect();
        found.push((String::from_utf8_lossy(&name).into_owned(), value));
    }
    found
}

/// The module with every expression of specialisation constants replaced by a constant of its type. The crate spirq
/// evaluates all expressions, knows few operators, and fails on others; no layout here depends on one.
fn without_constant_expressions(words: &[u32]) -> Vec<u32> {
    const TYPE_BOOL: u32 = 20;
    const CONSTANT_TRUE: u32 = 41;
    const CONSTANT: u32 = 43;
    const SPEC_CONSTANT_OP: u32 = 52;
    let mut simple = words[..HEADER_WORDS].to_vec();
    let mut write = |opcode: u32, operands: &[u32]| {
        simple.push((operands.len() as u32 + 1) << 16 | opcode);
        simple.extend(operands);
    };
    let mut bools = Vec::new();
    for (opcode, operands) in instructions(words) {
        match (opcode, operands) {
            (SPEC_CONSTANT_OP, [ty, id, ..]) if bools.contains(ty) => write(CONSTANT_TRUE, &[*ty, *id]),
            (SPEC_CONSTANT_OP, [ty, id, ..]) => write(CONSTANT, &[*ty, *id, 1]),
            _ => write(opcode, operands),
        }
        if opcode == TYPE_BOOL {
            bools.push(operands[0]);
        }
    }
    simple
}

fn entry_point((name, words): Shader) -> EntryPoint {
    let mut config = ReflectConfig::new();
    config.spv(without_constant_expressions(words)).ref_all_rscs(true);
    let entries = config.reflect().unwrap_or_else(|error| panic!("{name}: reflection failed: {error}"));
    entries.into_iter().next().unwrap_or_else(|| panic!("{name}: no entry point"))
}

fn binding(shader: &str, stage: ShaderStage, variable: &Variable) -> Binding {
    let Variable::Descriptor { name, desc_bind, desc_ty, nbind, .. } = variable else {
        unreachable!("called for descriptors only")
    };
    let name = name.clone().unwrap_or_default();
    assert_eq!(desc_bind.set(), 0, "{shader}: {name} is in set {}, only set 0 is used", desc_bind.set());
    let (kind, read_only) = match desc_ty {
        DescriptorType::StorageBuffer(access) => (BindingKind::Storage, *access == AccessType::ReadOnly),
        DescriptorType::UniformBuffer() => (BindingKind::Uniform, true),
        DescriptorType::CombinedImageSampler() => (BindingKind::Sampled, true),
        DescriptorType::StorageImage(access) => (BindingKind::StorageImage, *access == AccessType::ReadOnly),
        DescriptorType::AccelStruct() => (BindingKind::Structure, true),
        other => panic!("{shader}: {name} is a {other:?}, which the pipelines do not offer"),
    };
    assert!(*nbind > 0, "{shader}: {name} is an array without a size");
    Binding { binding: desc_bind.bind(), name, kind, count: *nbind, stages: vec![stage], read_only }
}

/// Merges the bindings of several stages by name, and numbers them. Panics if two stages disagree on one.
pub(in crate::vk) fn merge(label: &str, modules: &[Module]) -> Vec<Binding> {
    let mut merged: BTreeMap<&str, Binding> = BTreeMap::new();
    for found in modules.iter().flat_map(|module| &module.bindings) {
        let Some(known) = merged.get_mut(found.name.as_str()) else {
            merged.insert(&found.name, found.clone());
            continue;
        };
        let same = known.kind == found.kind && known.count == found.count;
        assert!(same, "{label}: a binding is both {known:?} and {found:?}");
        known.stages.extend(&found.stages);
        known.read_only &= found.read_only;
    }
    merged.into_values().zip(0..).map(|(binding, number)| Binding { binding: number, ..binding }).collect()
}

/// Whether a pipeline can use `new` in place of `own`. It may omit resources.
///
/// # Errors
/// `new` uses a resource that `own` does not; the error names it.
#[cfg(feature = "hot-reload")]
pub(in crate::vk) fn check_same_interface(own: Shader, new: Shader) -> crate::Result<()> {
    let refuse = |what: String| Err(crate::Error::Usage(format!("glsl/{}: {what}: build the program anew", new.0)));
    let (before, after) = (module(own), module(new));
    let known = |b: &&Binding| before.bindings.iter().any(|a| (&a.name, a.kind, a.count) == (&b.name, b.kind, b.count));
    if let Some(other) = after.bindings.iter().find(|b| !known(b)) {
        return refuse(format!("it takes {}, which it did not", other.name));
    }
    let before_constants = constants(own.1);
    if let Some((name, _)) = constants(new.1).iter().find(|(name, _)| before_constants.iter().all(|(a, _)| a != name)) {
        return refuse(format!("it depends on the constant {name}, which it did not"));
    }
    if after.push_bytes != 0 && after.push_bytes != before.push_bytes || after.info.outputs != before.info.outputs {
        return refuse("its push block or its outputs are others".to_owned());
    }
    let before = structs(own);
    match structs(new).iter().find(|(name, layout)| before.get(*name).is_some_and(|own| own != *layout)) {
        Some((name, _)) => refuse(format!("the struct {name} is another one")),
        None => Ok(()),
    }
}

/// All named structs in the descriptors and the push block.
pub(in crate::vk) fn structs(shader: Shader) -> BTreeMap<String, StructLayout> {
    let mut found = BTreeMap::new();
    for variable in &entry_point(shader).vars {
        if matches!(variable, Variable::Descriptor { .. } | Variable::PushConstant { .. }) {
            collect_structs(variable.ty(), None, &mut found);
        }
    }
    found
}

fn collect_structs(ty: &Type, stride: Option<usize>, found: &mut BTreeMap<String, StructLayout>) {
    match ty {
        Type::Array(array) => collect_structs(&array.element_ty, array.stride, found),
        Type::Struct(block) => {
            let member = |m: &spirq::ty::StructMember| Member {
                name: m.name.clone().unwrap_or_default(),
                offset: m.offset.unwrap_or(0),
                bytes: m.ty.nbyte().unwrap_or(0),
            };
            if let Some(name) = block.name() {
                let members = block.members.iter().map(member).collect();
                let layout = found.entry(name.to_owned()).or_insert(StructLayout { members, stride });
                layout.stride = layout.stride.or(stride);
            }
            for member in &block.members {
                collect_structs(&member.ty, None, found);
            }
        }
        _ => {}
    }
}
