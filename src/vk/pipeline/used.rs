//! Removes unused functions, variables and constants from a shader's module. The build includes this file too.

use rspirv::dr::{Function, Instruction, Module, Operand};
use rspirv::spirv::Decoration;
use std::collections::{HashMap, HashSet};

/// Removes functions that are never called, and variables and constants that nothing reads, which would otherwise be
/// bindings and constants of the pipeline.
pub fn keep_used(module: &mut Module) {
    let ids = |i: &Instruction| -> Vec<u32> {
        i.operands.iter().filter_map(Operand::id_ref_any).chain(i.result_type).collect()
    };
    let of_function = |f: &Function| (f.def_id(), f.all_inst_iter().flat_map(ids).collect());
    let of_global = |i: &Instruction| (i.result_id, ids(i));
    let globals = module.types_global_values.iter().map(of_global);
    let reads: HashMap<Option<u32>, Vec<u32>> = module.functions.iter().map(of_function).chain(globals).collect();

    let main = |i: &Instruction| i.operands[1].unwrap_id_ref();
    let mut open: Vec<u32> = module.entry_points.iter().map(main).collect();
    open.extend(module.execution_modes.iter().flat_map(ids));
    // Only its decoration refers to the constant of the workgroup size.
    let built_in = |i: &&Instruction| i.operands.get(1) == Some(&Operand::Decoration(Decoration::BuiltIn));
    open.extend(module.annotations.iter().filter(built_in).flat_map(ids));
    let mut used: HashSet<u32> = HashSet::new();
    while let Some(id) = open.pop() {
        if used.insert(id) {
            open.extend(reads.get(&Some(id)).into_iter().flatten());
        }
    }

    let is_used = |id: u32| used.contains(&id);
    module.functions.retain(|f| f.def_id().is_some_and(is_used));
    module.types_global_values.retain(|i| i.result_id.is_none_or(is_used));
    // Outside of functions, names identify bindings; inside, nothing reads them.
    let of = |i: &Instruction| i.operands.first().and_then(Operand::id_ref_any);
    module.debug_names.retain(|i| of(i).is_none_or(is_used));
    // Decorations of remaining instructions in functions stay too.
    let inner: HashSet<u32> =
        module.functions.iter().flat_map(|f| f.all_inst_iter()).filter_map(|i| i.result_id).collect();
    module.annotations.retain(|i| of(i).is_none_or(|id| is_used(id) || inner.contains(&id)));
    for entry in &mut module.entry_points {
        entry.operands.retain(|operand| operand.id_ref_any().is_none_or(is_used));
    }
}
