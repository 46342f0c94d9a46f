//! Specialisation constants, which are given by name and checked against the shaders like bindings.

use super::shader;

/// The value of a constant, with the type of its GLSL declaration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    Uint(u32),
    Float(f32),
    Bool(bool),
}

/// The name of a specialisation constant in GLSL, and its value.
pub type Constant = (&'static str, Value);

/// Whether shaders count their reads (`glsl/common/count.glsl`). The device sets it, not a pass.
pub(in crate::vk) const COUNTING: &str = "COUNTING";

impl From<u32> for Value {
    fn from(value: u32) -> Self {
        Self::Uint(value)
    }
}

impl From<f32> for Value {
    fn from(value: f32) -> Self {
        Self::Float(value)
    }
}

impl From<bool> for Value {
    fn from(value: bool) -> Self {
        Self::Bool(value)
    }
}

impl Value {
    pub(in crate::vk) fn bits(self) -> u32 {
        match self {
            Self::Uint(value) => value,
            Self::Float(value) => value.to_bits(),
            Self::Bool(value) => u32::from(value),
        }
    }
}

/// The values of all constants that the shaders of the pass `label` use.
///
/// Panics if a constant that a shader uses is not given or has another type, if a given constant is declared by no
/// header and no shader of the pass, or if one is given twice. A constant of a header may be given to a pass that does
/// not use it, because related passes share a list. A constant of a shader's own file may not.
pub(in crate::vk) fn checked(label: &str, shaders: &[&str], given: &[Constant], counting: bool) -> Vec<Constant> {
    let mut used = Vec::new();
    for shader in shaders {
        for (name, default) in shader::constants(shader) {
            let found = given.iter().copied().chain([(COUNTING, counting.into())]).find(|(known, _)| *known == name);
            let (known, value) = found.unwrap_or_else(|| {
                panic!("pass {label}: glsl/{shader} depends on the constant {name}, which is not given")
            });
            assert!(
                std::mem::discriminant(&value) == std::mem::discriminant(&default),
                "pass {label}: glsl/{shader} declares {name} like {default:?}, but gets {value:?}"
            );
            if !used.contains(&(known, value)) {
                used.push((known, value));
            }
        }
    }
    for (index, (name, _)) in given.iter().enumerate() {
        assert!(
            given[..index].iter().all(|(other, _)| other != name),
            "pass {label}: the constant {name} is given twice"
        );
        let declared = shaders.iter().any(|shader| shader::declares(shader, name));
        assert!(
            declared || shader::are_edited(),
            "pass {label}: no header declares the constant {name}, nor does glsl/{}",
            shaders.join(", glsl/")
        );
    }
    used
}
