//! Sets a shader's specialisation constants before the driver sees it, removes the branches that they decide, and
//! numbers its bindings for the pipeline. Drivers would inline every function first and find unreachable code
//! afterwards: on llvmpipe that is more than half of the time for a pipeline.

use super::constants::Constant;
use super::early::load_early;
use super::operations::{Known, value_of};
use super::used::keep_used;
use rspirv::binary::Assemble;
use rspirv::dr::{Block, Function, Instruction, Module, Operand, load_words};
use rspirv::spirv::{Capability, Decoration, Op, Word};
use std::collections::{HashMap, HashSet};

/// Inputs of the specialisation for a pipeline.
#[derive(Clone, Copy, Default)]
pub(in crate::vk) struct Choices<'a> {
    /// Constants. Those that are not given keep their default values.
    pub(in crate::vk) constants: &'a [Constant],
    /// Names of bindings as the build wrote them, and numbers. A binding that is not given keeps its number.
    pub(in crate::vk) bindings: &'a [(String, u32)],
    /// Whether the driver loses descriptors in loops: see [`load_early`].
    pub(in crate::vk) loads_early: bool,
}

/// The module `words`, valid SPIR-V from the build, specialised for a pipeline.
pub(in crate::vk) fn specialize(words: &[u32], choices: &Choices) -> Vec<u32> {
    specialized(words, choices).assemble()
}

/// Names of the variables, including bindings, that remain in a module with these constants.
pub(in crate::vk) fn names_used(words: &[u32], constants: &[Constant]) -> HashSet<String> {
    let module = specialized(words, &Choices { constants, ..Choices::default() });
    names(&module).into_values().collect()
}

fn specialized(words: &[u32], choices: &Choices) -> Module {
    let mut module = load_words(words).expect("the build writes SPIR-V");
    let names = names(&module);
    number_bindings(&mut module, &names, choices.bindings);
    let scalars = scalar_types(&module);
    let known = set_constants(&mut module, &scalars, &names, choices.constants);
    let mut results = Known::new();
    for place in callees_first(&module.functions) {
        let function = &mut module.functions[place];
        let walk = Walk::new(function, &scalars, &known, &results);
        if let (Some(result), Some(id)) = (walk.result(function), function.def_id()) {
            results.insert(id, result);
        }
        walk.cut(function);
    }
    keep_used(&mut module);
    keep_asked(&mut module);
    if choices.loads_early {
        load_early(&mut module);
    }
    module
}

/// Removes the capability and extension of ray queries if no query is left, because most devices lack them.
fn keep_asked(module: &mut Module) {
    let queries = |i: &Instruction| matches!(i.class.opcode, Op::TypeRayQueryKHR | Op::TypeAccelerationStructureKHR);
    if module.types_global_values.iter().any(queries) {
        return;
    }
    let extension = Operand::LiteralString("SPV_KHR_ray_query".to_owned());
    module.capabilities.retain(|i| i.operands[0] != Operand::Capability(Capability::RayQueryKHR));
    module.extensions.retain(|i| i.operands[0] != extension);
}

/// Names of objects outside of functions, by id.
type Names = HashMap<Word, String>;

fn names(module: &Module) -> Names {
    let name = |i: &Instruction| match &i.operands[..] {
        [Operand::IdRef(id), Operand::LiteralString(name)] => Some((*id, name.clone())),
        _ => None,
    };
    module.debug_names.iter().filter_map(name).collect()
}

/// Sets the bindings' numbers to those of the pipeline.
fn number_bindings(module: &mut Module, names: &Names, bindings: &[(String, u32)]) {
    for i in &mut module.annotations {
        if let [Operand::IdRef(id), Operand::Decoration(Decoration::Binding), Operand::LiteralBit32(number)] =
            &mut i.operands[..]
            && let Some(binding) = names.get(id).and_then(|name| bindings.iter().find(|(known, _)| known == name))
        {
            *number = binding.1;
        }
    }
}

/// The types of 32-bit integers and booleans, and whether they are booleans.
type Scalars = HashMap<Word, bool>;

fn scalar_types(module: &Module) -> Scalars {
    let scalar = |i: &Instruction| match (i.class.opcode, i.operands.first()) {
        (Op::TypeBool, _) => Some((i.result_id?, true)),
        (Op::TypeInt, Some(Operand::LiteralBit32(32))) => Some((i.result_id?, false)),
        _ => None,
    };
    module.types_global_values.iter().filter_map(scalar).collect()
}

/// Turns specialisation constants and expressions of them into constants. Returns all known constants.
fn set_constants(module: &mut Module, scalars: &Scalars, names: &Names, constants: &[Constant]) -> Known {
    let is_number = |i: &Instruction| i.operands.get(1) == Some(&Operand::Decoration(Decoration::SpecId));
    let value = |i: &Instruction| {
        let (id, name) = (target(&i.operands[0]), names.get(&target(&i.operands[0]))?);
        constants.iter().find(|(known, _)| known == name).map(|(_, value)| (id, value.bits()))
    };
    let set: HashMap<Word, u32> = module.annotations.iter().filter(|i| is_number(i)).filter_map(value).collect();
    module.annotations.retain(|i| !is_number(i));

    let mut known = Known::new();
    for i in &mut module.types_global_values {
        let (Some(id), Some(kind)) = (i.result_id, i.result_type) else { continue };
        let literal = match i.operands[..] {
            [Operand::LiteralBit32(value)] => Some(value),
            _ => None,
        };
        let value = match i.class.opcode {
            Op::Constant => literal,
            Op::SpecConstant => set.get(&id).copied().or(literal),
            Op::ConstantTrue => Some(1),
            Op::ConstantFalse => Some(0),
            Op::SpecConstantTrue => Some(set.get(&id).copied().unwrap_or(1)),
            Op::SpecConstantFalse => Some(set.get(&id).copied().unwrap_or(0)),
            Op::SpecConstantOp if scalars.contains_key(&kind) => match &i.operands[..] {
                [Operand::LiteralSpecConstantOpInteger(op), of @ ..] => value_of(*op, of, &known),
                _ => None,
            },
            _ => None,
        };
        let Some(value) = value else { continue };
        *i = if scalars.get(&kind) == Some(&true) {
            let op = if value == 0 { Op::ConstantFalse } else { Op::ConstantTrue };
            Instruction::new(op, Some(kind), Some(id), vec![])
        } else {
            Instruction::new(Op::Constant, Some(kind), Some(id), vec![Operand::LiteralBit32(value)])
        };
        if scalars.contains_key(&kind) {
            known.insert(id, value);
        }
    }
    known
}

/// Indices of functions, each after those that it calls.
fn callees_first(functions: &[Function]) -> Vec<usize> {
    let places: HashMap<Word, usize> =
        functions.iter().enumerate().filter_map(|(k, f)| Some((f.def_id()?, k))).collect();
    fn visit(
        place: usize,
        functions: &[Function],
        places: &HashMap<Word, usize>,
        seen: &mut [bool],
        order: &mut Vec<usize>,
    ) {
        if std::mem::replace(&mut seen[place], true) {
            return;
        }
        for call in functions[place].all_inst_iter().filter(|i| i.class.opcode == Op::FunctionCall) {
            visit(places[&call.operands[0].unwrap_id_ref()], functions, places, seen, order);
        }
        order.push(place);
    }
    let mut order = Vec::new();
    let mut seen = vec![false; functions.len()];
    for place in 0..functions.len() {
        visit(place, functions, &places, &mut seen, &mut order);
    }
    order
}

fn label(block: &Block) -> Word {
    block.label_id().expect("a loaded block has a label")
}

fn target(operand: &Operand) -> Word {
    operand.unwrap_id_ref()
}

/// Reachable blocks of a function, and known values in it.
struct Walk {
    reached: HashSet<Word>,
    /// Known values: constants, and expressions of them inside the function.
    known: Known,
}

impl Walk {
    fn new(function: &Function, scalars: &Scalars, constants: &Known, results: &Known) -> Self {
        let mut walk = Self { reached: function.blocks.first().map(label).into_iter().collect(), known: Known::new() };
        // The walk repeats whenever it reached a new block, because a block may precede one that leads to it.
        loop {
            let before = walk.reached.len();
            let mut passed = HashSet::new();
            walk.known.clone_from(constants);
            for block in &function.blocks {
                if walk.reached.contains(&label(block)) {
                    walk.through(block, scalars, results, &passed);
                }
                passed.insert(label(block));
            }
            if walk.reached.len() == before {
                return walk;
            }
        }
    }

    fn through(&mut self, block: &Block, scalars: &Scalars, results: &Known, passed: &HashSet<Word>) {
        for i in &block.instructions {
            let value = match i.class.opcode {
                Op::Phi => self.phi(i, passed),
                Op::FunctionCall => results.get(&target(&i.operands[0])).copied(),
                op => value_of(op, &i.operands, &self.known),
            };
            if let (Some(value), Some(id), Some(kind)) = (value, i.result_id, i.result_type)
                && scalars.contains_key(&kind)
            {
                self.known.insert(id, value);
            }
        }
        let Some(last) = block.instructions.last() else { return };
        let next: Vec<Word> = match self.decided(last) {
            Some(next) => vec![next],
            None => last.operands.iter().filter_map(Operand::id_ref_any).collect(),
        };
        let leads_on = matches!(last.class.opcode, Op::Branch | Op::BranchConditional | Op::Switch);
        self.reached.extend(next.into_iter().filter(|_| leads_on));
    }

    /// The value of a phi if it is the same from all sources. A back edge is not known yet.
    fn phi(&self, phi: &Instruction, passed: &HashSet<Word>) -> Option<u32> {
        let mut values = Vec::new();
        for pair in phi.operands.chunks(2) {
            let from = target(&pair[1]);
            if !passed.contains(&from) {
                return None;
            }
            if self.reached.contains(&from) {
                values.push(self.known.get(&target(&pair[0])).copied()?);
            }
        }
        values.dedup();
        match values[..] {
            [value] => Some(value),
            _ => None,
        }
    }

    /// The target of a conditional branch with a known condition.
    fn decided(&self, last: &Instruction) -> Option<Word> {
        if last.class.opcode != Op::BranchConditional {
            return None;
        }
        let condition = *self.known.get(&target(&last.operands[0]))?;
        Some(target(&last.operands[if condition != 0 { 1 } else { 2 }]))
    }

    /// The value that the function returns, if it is always the same.
    fn result(&self, function: &Function) -> Option<u32> {
        let lasts = function.blocks.iter().filter(|block| self.reached.contains(&label(block)));
        let returned =
            lasts.filter_map(|block| block.instructions.last()).filter(|i| i.class.opcode == Op::ReturnValue);
        let mut values: Vec<Option<u32>> = returned.map(|i| self.known.get(&target(&i.operands[0])).copied()).collect();
        values.dedup();
        match values[..] {
            [value] => value,
            _ => None,
        }
    }

    /// Removes unreachable blocks.
    fn cut(&self, function: &mut Function) {
        function.blocks.iter_mut().for_each(|block| self.lead_on(block));
        // A merge or continue block stays, but empty, because other blocks refer to it.
        let (mut merges, mut continues) = (HashSet::new(), HashMap::new());
        for block in function.blocks.iter().filter(|block| self.reached.contains(&label(block))) {
            for i in &block.instructions {
                match i.class.opcode {
                    Op::SelectionMerge => {
                        merges.insert(target(&i.operands[0]));
                    }
                    Op::LoopMerge => {
                        merges.insert(target(&i.operands[0]));
                        continues.insert(target(&i.operands[1]), label(block));
                    }
                    _ => {}
                }
            }
        }
        function.blocks.retain_mut(|block| {
            let name = label(block);
            if self.reached.contains(&name) {
                return true;
            }
            let end = match continues.get(&name) {
                Some(head) => Instruction::new(Op::Branch, None, None, vec![Operand::IdRef(*head)]),
                None => Instruction::new(Op::Unreachable, None, None, vec![]),
            };
            block.instructions = vec![end];
            continues.contains_key(&name) || merges.contains(&name)
        });
        keep_ways(function);
    }

    /// Replaces a conditional branch with a known target by a plain branch.
    fn lead_on(&self, block: &mut Block) {
        let Some(next) = block.instructions.last().and_then(|last| self.decided(last)) else { return };
        block.instructions.pop();
        block.instructions.pop_if(|i| i.class.opcode == Op::SelectionMerge);
        block.instructions.push(Instruction::new(Op::Branch, None, None, vec![Operand::IdRef(next)]));
    }
}

/// Removes unreachable predecessors from phi instructions.
fn keep_ways(function: &mut Function) {
    let mut ways: HashSet<(Word, Word)> = HashSet::new();
    for block in &function.blocks {
        for operand in block.instructions.last().into_iter().flat_map(|last| &last.operands) {
            ways.extend(operand.id_ref_any().map(|to| (label(block), to)));
        }
    }
    for block in &mut function.blocks {
        let here = label(block);
        for phi in block.instructions.iter_mut().filter(|i| i.class.opcode == Op::Phi) {
            let pairs = phi.operands.chunks(2).filter(|pair| ways.contains(&(target(&pair[1]), here)));
            phi.operands = pairs.flatten().cloned().collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::pipeline::shader;

    fn with_features(name: &str, features: u32) -> Vec<u32> {
        let constants = [("FEATURES", features.into())];
        specialize(shader::spirv(name), &Choices { constants: &constants, ..Default::default() })
    }

    /// Ids that are used and not defined.
    fn undefined(module: &Module) -> Vec<Word> {
        let defined: HashSet<Word> = module.all_inst_iter().filter_map(|i| i.result_id).collect();
        let read =
            module.all_inst_iter().flat_map(|i| i.operands.iter().filter_map(Operand::id_ref_any).chain(i.result_type));
        read.filter(|id| !defined.contains(id)).collect()
    }

    #[test]
    fn every_shader_stays_whole_whatever_is_cut() {
        for name in shader::names() {
            for features in [0, 0x5555_5555] {
                let words = with_features(name, features);
                let module = load_words(&words).unwrap();
                assert_eq!(undefined(&module), [0; 0], "{name} with {features:#x}");
                assert!(module.types_global_values.iter().all(|i| i.class.opcode != Op::SpecConstant), "{name}");
                let again = specialize(&words, &Choices::default());
                assert_eq!(again.len(), words.len(), "{name}: nothing is left to cut");
            }
        }
    }

    #[test]
    fn what_no_feature_asks_for_is_gone() {
        let functions =
            |features| load_words(with_features("ground/image/image.comp rays", features)).unwrap().functions.len();
        assert!(functions(0) + 20 < functions(!0), "{} of {} functions are left", functions(0), functions(!0));
    }

    #[test]
    fn bindings_get_the_numbers_of_the_pipeline() {
        let bindings = [("target".to_owned(), 7), ("source".to_owned(), 3), ("elsewhere".to_owned(), 5)];
        let words = specialize(shader::spirv("test/copy.comp"), &Choices { bindings: &bindings, ..Default::default() });
        let module = load_words(words).unwrap();
        let number = |i: &Instruction| match i.operands[..] {
            [_, Operand::Decoration(Decoration::Binding), Operand::LiteralBit32(number)] => Some(number),
            _ => None,
        };
        let mut numbers: Vec<u32> = module.annotations.iter().filter_map(number).collect();
        numbers.sort();
        assert_eq!(numbers, [3, 7]);
    }
}
