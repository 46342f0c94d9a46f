//! Results of SPIR-V operations on scalars, as far as known operands determine them.

use rspirv::dr::Operand;
use rspirv::spirv::{Op, Word};
use std::collections::HashMap;

/// Known values of 32-bit integers and booleans (0, 1), by their ids.
pub(super) type Known = HashMap<Word, u32>;

/// The value of an operation, if the known operands determine it.
pub(super) fn value_of(op: Op, operands: &[Operand], known: &Known) -> Option<u32> {
    let at = |place: usize| known.get(&operands.get(place)?.id_ref_any()?).copied();
    let truth = |value: bool| Some(u32::from(value));
    let (a, b) = (at(0), at(1));
    match (op, a, b) {
        (Op::LogicalAnd | Op::BitwiseAnd, Some(0), _) | (Op::LogicalAnd | Op::BitwiseAnd, _, Some(0)) => {
            return Some(0);
        }
        (Op::LogicalOr, Some(1), _) | (Op::LogicalOr, _, Some(1)) => return Some(1),
        (Op::ULessThan, _, Some(0)) => return Some(0), // so that a loop without iterations is recognised
        (Op::Select, Some(condition), _) => return at(if condition != 0 { 1 } else { 2 }),
        _ => {}
    }
    let a = a?;
    match op {
        Op::LogicalNot => return truth(a == 0),
        Op::Not => return Some(!a),
        _ => {}
    }
    let b = b?;
    match op {
        Op::LogicalAnd | Op::BitwiseAnd => Some(a & b),
        Op::LogicalOr | Op::BitwiseOr => Some(a | b),
        Op::BitwiseXor => Some(a ^ b),
        Op::IAdd => Some(a.wrapping_add(b)),
        Op::ISub => Some(a.wrapping_sub(b)),
        Op::IMul => Some(a.wrapping_mul(b)),
        Op::UDiv => a.checked_div(b),
        Op::UMod => a.checked_rem(b),
        Op::ShiftLeftLogical => a.checked_shl(b),
        Op::ShiftRightLogical => a.checked_shr(b),
        Op::LogicalEqual | Op::IEqual => truth(a == b),
        Op::LogicalNotEqual | Op::INotEqual => truth(a != b),
        Op::ULessThan => truth(a < b),
        Op::ULessThanEqual => truth(a <= b),
        Op::UGreaterThan => truth(a > b),
        Op::UGreaterThanEqual => truth(a >= b),
        Op::SLessThan => truth((a as i32) < b as i32),
        Op::SLessThanEqual => truth(a as i32 <= b as i32),
        Op::SGreaterThan => truth(a as i32 > b as i32),
        Op::SGreaterThanEqual => truth(a as i32 >= b as i32),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_have_the_values_that_the_specification_gives() {
        let known = Known::from([(1, 0), (2, 1), (3, 7), (4, !0)]);
        let value =
            |op, ids: &[u32]| value_of(op, &ids.iter().map(|id| Operand::IdRef(*id)).collect::<Vec<_>>(), &known);
        const UNKNOWN: u32 = 9;
        assert_eq!(value(Op::LogicalAnd, &[1, UNKNOWN]), Some(0));
        assert_eq!(value(Op::LogicalAnd, &[2, UNKNOWN]), None);
        assert_eq!(value(Op::LogicalOr, &[UNKNOWN, 2]), Some(1));
        assert_eq!(value(Op::Select, &[2, 3, UNKNOWN]), Some(7));
        assert_eq!(value(Op::Select, &[UNKNOWN, 3, 3]), None);
        assert_eq!(value(Op::ULessThan, &[UNKNOWN, 1]), Some(0));
        assert_eq!(value(Op::SLessThan, &[4, 1]), Some(1));
        assert_eq!(value(Op::UGreaterThan, &[4, 1]), Some(1));
        assert_eq!(value(Op::ISub, &[1, 2]), Some(!0));
        assert_eq!(value(Op::UDiv, &[3, 1]), None);
        assert_eq!(value(Op::ShiftLeftLogical, &[2, 4]), None);
    }
}
