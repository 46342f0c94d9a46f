//! The driver's description of the programs that it made from pipelines: registers, spills, local memory and similar
//! statistics (`VK_KHR_pipeline_executable_properties`).

use super::context::Context;
use crate::Result;
use ash::vk;
use serde::Serialize;
use std::ffi::c_char;

/// A program that the driver made from a pipeline, for one or several of its stages.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Executable {
    /// The label of the pipeline.
    pub pipeline: String,
    /// The driver's name for the program.
    pub name: String,
    /// The number of invocations that run together.
    pub subgroup_size: u32,
    /// Statistics in the driver's order.
    pub statistics: Vec<Statistic>,
}

/// A number that a driver reports about a program, with the driver's own name and unit.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Statistic {
    pub name: String,
    pub description: String,
    pub value: StatisticValue,
}

/// A number in the driver's format.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum StatisticValue {
    Bool(bool),
    Signed(i64),
    Unsigned(u64),
    Float(f64),
}

impl std::fmt::Display for StatisticValue {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Bool(value) => value.fmt(f),
            Self::Signed(value) => value.fmt(f),
            Self::Unsigned(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
        }
    }
}

impl Executable {
    fn of_reported(
        pipeline: &str,
        properties: &vk::PipelineExecutablePropertiesKHR<'_>,
        statistics: &[vk::PipelineExecutableStatisticKHR<'_>],
    ) -> Self {
        Self {
            pipeline: pipeline.to_owned(),
            name: text(&properties.name),
            subgroup_size: properties.subgroup_size,
            statistics: statistics.iter().filter_map(Statistic::of_reported).collect(),
        }
    }
}

impl Statistic {
    /// A reported statistic; `None` for a number format that the extension does not define.
    fn of_reported(told: &vk::PipelineExecutableStatisticKHR<'_>) -> Option<Self> {
        use vk::PipelineExecutableStatisticFormatKHR as Format;
        // SAFETY: the format says which field of the union the driver has written.
        let value = unsafe {
            match told.format {
                Format::BOOL32 => StatisticValue::Bool(told.value.b32 != vk::FALSE),
                Format::INT64 => StatisticValue::Signed(told.value.i64),
                Format::UINT64 => StatisticValue::Unsigned(told.value.u64),
                Format::FLOAT64 => StatisticValue::Float(told.value.f64),
                _ => return None,
            }
        };
        Some(Self { name: text(&told.name), description: text(&told.description), value })
    }
}

/// The text before the first zero, or all of it.
fn text(chars: &[c_char]) -> String {
    let bytes: Vec<u8> = chars.iter().map(|&c| c as u8).take_while(|&byte| byte != 0).collect();
    String::from_utf8_lossy(&bytes).into_owned()
}

impl Context {
    /// The programs of all pipelines of the context, after waiting for them; `None` unless the context is from
    /// [`Context::describing`] and the driver describes programs.
    ///
    /// # Errors
    /// The driver could not compile a pipeline, or ran out of memory.
    pub fn executables(&self) -> Result<Option<Vec<Executable>>> {
        let Some(functions) = &self.executable_properties else { return Ok(None) };
        self.wait_for_pipelines()?;
        let mut found = Vec::new();
        for (label, pipeline) in self.pipelines.labelled() {
            let error = |result| self.error(&format!("describing the pipeline {label}"), result);
            let pipeline = pipeline.map_err(error)?;
            let of = vk::PipelineInfoKHR::default().pipeline(pipeline);
            // SAFETY: the pipeline is alive, the feature is enabled, and the pipeline was made to capture statistics.
            let programs = unsafe { functions.get_pipeline_executable_properties(&of) }.map_err(error)?;
            for (index, properties) in programs.iter().enumerate() {
                let of = vk::PipelineExecutableInfoKHR::default().pipeline(pipeline).executable_index(index as u32);
                // SAFETY: as above, and the index is below the number of programs.
                let statistics = unsafe { functions.get_pipeline_executable_statistics(&of) }.map_err(error)?;
                found.push(Executable::of_reported(&label, properties, &statistics));
            }
        }
        Ok(Some(found))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use vk::{PipelineExecutableStatisticFormatKHR as Format, PipelineExecutableStatisticValueKHR as Value};

    /// The text followed by zeros, as far as the array has room.
    fn chars<const N: usize>(text: &str) -> [c_char; N] {
        let mut chars = [0; N];
        chars.iter_mut().zip(text.bytes()).for_each(|(to, byte)| *to = byte as c_char);
        chars
    }

    fn told(name: &str, format: Format, value: Value) -> vk::PipelineExecutableStatisticKHR<'static> {
        let mut told = vk::PipelineExecutableStatisticKHR::default();
        (told.name, told.description) = (chars(name), chars(&format!("of {name}")));
        (told.format, told.value) = (format, value);
        told
    }

    #[test]
    fn numbers_are_read_in_the_form_in_which_a_driver_states_them() {
        let mut properties = vk::PipelineExecutablePropertiesKHR::default();
        (properties.name, properties.subgroup_size) = (chars("Compute Shader"), 32);
        let statistics = [
            told("SIMD32", Format::BOOL32, Value { b32: vk::TRUE }),
            told("Bank", Format::BOOL32, Value { b32: vk::FALSE }),
            told("Balance", Format::INT64, Value { i64: -7 }),
            told("Registers", Format::UINT64, Value { u64: u64::MAX }),
            told("unheard of", Format::from_raw(99), Value { u64: 1 }),
            told("Occupancy", Format::FLOAT64, Value { f64: 0.625 }),
        ];
        let program = Executable::of_reported("gather", &properties, &statistics);
        assert_eq!((&*program.pipeline, &*program.name, program.subgroup_size), ("gather", "Compute Shader", 32));
        let rows: Vec<_> = program.statistics.iter().map(|s| (&*s.name, &*s.description, s.value)).collect();
        assert_eq!(
            rows,
            [
                ("SIMD32", "of SIMD32", StatisticValue::Bool(true)),
                ("Bank", "of Bank", StatisticValue::Bool(false)),
                ("Balance", "of Balance", StatisticValue::Signed(-7)),
                ("Registers", "of Registers", StatisticValue::Unsigned(u64::MAX)),
                ("Occupancy", "of Occupancy", StatisticValue::Float(0.625)),
            ]
        );
    }

    #[test]
    fn names_end_at_a_zero_or_with_the_array() {
        assert_eq!(text(&chars::<4>("ab")), "ab");
        assert_eq!(text(&chars::<4>("abcdef")), "abcd");
        assert_eq!(text(&chars::<4>("")), "");
        assert_eq!(text(&chars::<8>("µs")), "µs", "bytes above 127 are negative as characters of C");
    }
}
