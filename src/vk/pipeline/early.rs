//! Adds loads from every storage buffer at the start of a shader, for a driver that loses descriptors in loops.
//!
//! llvmpipe of Mesa 25.2 to 26.1 computes the address of a descriptor at its first use. If that is in a loop and the
//! address is also used after the loop, it is kept in a register per lane, which is empty until the lane has been
//! there. Inner loops run even if no lane is active: the driver then reads address 0 and crashes. An address that is
//! computed before any loop needs no such register.

use rspirv::dr::{Block, Instruction, Module, Operand};
use rspirv::spirv::{Decoration, Op, StorageClass, Word};
use std::collections::{HashMap, HashSet};

/// Makes the entry point load a word of each storage buffer that it reads, before anything else. To keep compilers from
/// removing the loads, a number that is computed from them and is always 0 is added to the integers that the shader
/// loads before its first branch or loop, or to the floats if it loads no integers there. Compilers remove the loads all
/// the same if the shader uses none of these numbers.
pub(in crate::vk) fn load_early(module: &mut Module) {
    let mut early = Early::new(module);
    let words = early.load_words(module);
    if let (Some(zero), Some(mut blocks)) = (early.zero_of(&words), early.first_blocks(module)) {
        let first = blocks[0].instructions.iter().position(|i| i.class.opcode != Op::Variable).unwrap_or(0);
        let loads = std::mem::take(&mut early.code);
        let whole =
            blocks.iter().flat_map(|block| &block.instructions).any(|i| early.loads(i).is_some_and(|n| n.whole));
        for block in &mut blocks {
            let code = std::mem::take(&mut block.instructions);
            block.instructions = early.add_to_loads(code, zero, whole);
        }
        blocks[0].instructions.splice(first..first, loads);
        module.types_global_values.append(&mut early.globals);
        if let Some(header) = &mut module.header {
            header.bound = early.bound;
        }
    }
}

fn id_at(i: &Instruction, place: usize) -> Word {
    i.operands[place].unwrap_id_ref()
}

/// The blocks from the start of a function to its first branch or loop, in their order: those before it end in a jump to
/// the next, as where a branch on a constant was cut.
fn straight(blocks: &[Block]) -> Vec<usize> {
    let mut always = vec![0];
    while let [.., Instruction { class, operands, .. }] = &blocks[always[always.len() - 1]].instructions[..]
        && class.opcode == Op::Branch
    {
        let next = blocks.iter().position(|block| block.label_id() == operands[0].id_ref_any());
        let is_loop = |k: usize| blocks[k].instructions.iter().any(|i| i.class.opcode == Op::LoopMerge);
        match next {
            Some(next) if !is_loop(next) && !always.contains(&next) => always.push(next),
            _ => break,
        }
    }
    always
}

/// Additions to a module.
struct Early {
    /// The next id.
    bound: Word,
    /// Types, constants and variables outside of functions, by their ids.
    known: HashMap<Word, Instruction>,
    /// Types and constants that the module lacks.
    globals: Vec<Instruction>,
    /// Instructions for the start of the entry point.
    code: Vec<Instruction>,
}

impl Early {
    fn new(module: &Module) -> Self {
        Self {
            bound: module.header.as_ref().map_or(0, |header| header.bound),
            known: module.types_global_values.iter().filter_map(|i| Some((i.result_id?, i.clone()))).collect(),
            globals: Vec::new(),
            code: Vec::new(),
        }
    }

    fn id(&mut self) -> Word {
        self.bound += 1;
        self.bound - 1
    }

    /// The type or constant with these operands: an existing one, or a new one.
    fn global(&mut self, op: Op, kind: Option<Word>, operands: Vec<Operand>) -> Word {
        let same = |i: &&Instruction| i.class.opcode == op && i.result_type == kind && i.operands == operands;
        if let Some(id) = self.known.values().chain(&self.globals).find(same).and_then(|i| i.result_id) {
            return id;
        }
        let id = self.id();
        self.globals.push(Instruction::new(op, kind, Some(id), operands));
        id
    }

    fn uint(&mut self) -> Word {
        self.global(Op::TypeInt, None, vec![Operand::LiteralBit32(32), Operand::LiteralBit32(0)])
    }

    fn constant(&mut self, value: u32) -> Word {
        let uint = self.uint();
        self.global(Op::Constant, Some(uint), vec![Operand::LiteralBit32(value)])
    }

    /// Emits the computation of a value of type `kind`.
    fn compute(&mut self, op: Op, kind: Word, of: &[Word]) -> Word {
        let id = self.id();
        self.code.push(Instruction::new(op, Some(kind), Some(id), of.iter().copied().map(Operand::IdRef).collect()));
        id
    }

    /// Emits loads of the first word of each storage buffer that is not write-only.
    fn load_words(&mut self, module: &Module) -> Vec<Word> {
        let written: HashSet<Word> = module.annotations.iter().filter_map(only_written).collect();
        let uint = self.uint();
        let mut words = Vec::new();
        for variable in module.types_global_values.iter().filter(|i| i.class.opcode == Op::Variable) {
            let [Operand::StorageClass(StorageClass::StorageBuffer), ..] = variable.operands[..] else { continue };
            let (Some(id), Some(pointer)) = (variable.result_id, variable.result_type) else { continue };
            let Some((scalar, depth)) = self.first_word(id_at(&self.known[&pointer], 1), &written) else { continue };
            let of_scalar = vec![Operand::StorageClass(StorageClass::StorageBuffer), Operand::IdRef(scalar)];
            let pointer = self.global(Op::TypePointer, None, of_scalar);
            let zero = self.constant(0);
            let path: Vec<Word> = std::iter::once(id).chain(std::iter::repeat_n(zero, depth)).collect();
            let place = self.compute(Op::AccessChain, pointer, &path);
            let value = self.compute(Op::Load, scalar, &[place]);
            words.push(if scalar == uint { value } else { self.compute(Op::Bitcast, uint, &[value]) });
        }
        words
    }

    /// The type of the first number within a type, and the number of indices to it. `None` if it is not a word, or may
    /// not be read.
    fn first_word(&self, kind: Word, written: &HashSet<Word>) -> Option<(Word, usize)> {
        let i = &self.known[&kind];
        match i.class.opcode {
            Op::TypeInt | Op::TypeFloat if i.operands[0] == Operand::LiteralBit32(32) => Some((kind, 0)),
            Op::TypeStruct if written.contains(&kind) => None,
            Op::TypeStruct | Op::TypeArray | Op::TypeRuntimeArray | Op::TypeVector | Op::TypeMatrix => {
                let (scalar, depth) = self.first_word(id_at(i, 0), written)?;
                Some((scalar, depth + 1))
            }
            _ => None,
        }
    }

    /// Emits a computation of 0 from words: the lowest bit of w² + w, which is always even. `None` without words.
    fn zero_of(&mut self, words: &[Word]) -> Option<Word> {
        let (uint, one) = (self.uint(), self.constant(1));
        let all = words.iter().copied().reduce(|a, b| self.compute(Op::BitwiseXor, uint, &[a, b]))?;
        let square = self.compute(Op::IMul, uint, &[all, all]);
        let even = self.compute(Op::IAdd, uint, &[square, all]);
        Some(self.compute(Op::BitwiseAnd, uint, &[even, one]))
    }

    /// The blocks at the start of a function that always run, if they load numbers: of the entry point, or else of the
    /// first function that it calls.
    fn first_blocks<'a>(&self, module: &'a mut Module) -> Option<Vec<&'a mut Block>> {
        let mut id = module.entry_points.first().map(|entry| id_at(entry, 1));
        loop {
            let place = module.functions.iter().position(|function| function.def_id() == id)?;
            let blocks = &module.functions[place].blocks;
            let always = straight(blocks);
            if always.iter().any(|&k| blocks[k].instructions.iter().any(|i| self.loads(i).is_some())) {
                let blocks = module.functions[place].blocks.iter_mut().enumerate();
                return Some(blocks.filter(|(k, _)| always.contains(k)).map(|(_, block)| block).collect());
            }
            let call = module.functions[place].all_inst_iter().find(|i| i.class.opcode == Op::FunctionCall)?;
            id = Some(id_at(call, 0));
        }
    }

    /// The type of the numbers that an instruction loads; `None` for other loads.
    fn loads(&self, i: &Instruction) -> Option<Number> {
        let kind = i.result_type.filter(|_| i.class.opcode == Op::Load)?;
        self.number(kind)
    }

    /// Adds `zero` to the integers that a block's instructions load, or to the floats unless `whole`.
    fn add_to_loads(&mut self, block: Vec<Instruction>, zero: Word, whole: bool) -> Vec<Instruction> {
        let mut added = Vec::new();
        let mut sums: HashMap<Word, Word> = HashMap::new();
        for mut i in block {
            for operand in &mut i.operands {
                if let Operand::IdRef(id) = operand {
                    *id = sums.get(id).copied().unwrap_or(*id);
                }
            }
            let number = self.loads(&i).filter(|number| number.whole == whole);
            let loaded = (i.result_type, i.result_id, number);
            added.push(i);
            if let (Some(kind), Some(value), Some(number)) = loaded {
                let sum = self.sum(kind, value, number, zero);
                sums.insert(value, sum);
                added.append(&mut self.code);
            }
        }
        added
    }

    /// Emits the sum of a value of type `kind`, which is a `number`, and the word `zero`.
    fn sum(&mut self, kind: Word, value: Word, number: Number, zero: Word) -> Word {
        let uint = self.uint();
        let (convert, add) = if number.whole { (Op::Bitcast, Op::IAdd) } else { (Op::ConvertUToF, Op::FAdd) };
        let mut zero = if number.scalar == uint { zero } else { self.compute(convert, number.scalar, &[zero]) };
        if number.count > 1 {
            zero = self.compute(Op::CompositeConstruct, kind, &vec![zero; number.count]);
        }
        self.compute(add, kind, &[value, zero])
    }

    /// The parts of a type; `None` unless it is a 32-bit number or a vector of such numbers.
    fn number(&self, kind: Word) -> Option<Number> {
        let i = self.known.get(&kind)?;
        match (i.class.opcode, &i.operands[..]) {
            (op @ (Op::TypeInt | Op::TypeFloat), [Operand::LiteralBit32(32), ..]) => {
                Some(Number { whole: op == Op::TypeInt, scalar: kind, count: 1 })
            }
            (Op::TypeVector, [Operand::IdRef(scalar), Operand::LiteralBit32(count)]) => {
                Some(Number { count: *count as usize, ..self.number(*scalar)? })
            }
            _ => None,
        }
    }
}

/// A 32-bit number or a vector of 32-bit numbers.
struct Number {
    /// Whether it is an integer, not a float.
    whole: bool,
    /// Its type, or that of each component.
    scalar: Word,
    count: usize,
}

/// The structure whose first member a shader only writes.
fn only_written(annotation: &Instruction) -> Option<Word> {
    match annotation.operands[..] {
        [Operand::IdRef(id), Operand::LiteralBit32(0), Operand::Decoration(Decoration::NonReadable)] => Some(id),
        _ => None,
    }
}
