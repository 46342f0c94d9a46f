//! A table of the programs that the driver made from a frame's pipelines.

use crate::vk::{Executable, Statistic};

/// A row per program with all statistics of the driver, or one sentence without statistics.
pub fn table(told: Option<&[Executable]>, device: &str) -> String {
    let Some(programs) = told else {
        return format!(
            "{device} does not tell which registers, spills and local memory its programs take: its driver lacks \
             VK_KHR_pipeline_executable_properties\n"
        );
    };
    let width = |head: &str, of: fn(&Executable) -> &str| {
        programs.iter().map(|program| of(program).chars().count()).fold(head.len(), usize::max)
    };
    let pipelines = width("pipeline", |program| &program.pipeline);
    let names = width("program", |program| &program.name);
    let line = |pipeline: &str, name: &str, subgroup: &str, told: &str| {
        let line = format!("{pipeline:pipelines$}  {name:names$}  {subgroup:>8}  {told}");
        line.trim_end().to_owned() + "\n"
    };
    let mut text = line("pipeline", "program", "subgroup", "as the driver states it");
    for program in programs {
        let told = program.statistics.iter().map(|Statistic { name, value, .. }| format!("{name} {value}"));
        let told = told.collect::<Vec<_>>().join(", ");
        text += &line(&program.pipeline, &program.name, &program.subgroup_size.to_string(), &told);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::vk::StatisticValue;

    #[test]
    fn each_program_has_a_row_with_all_that_is_told() {
        let told = |name: &str, value| Statistic { name: name.into(), description: "words".into(), value };
        let gather = Executable {
            pipeline: "gather".into(),
            name: "Compute Shader".into(),
            subgroup_size: 64,
            statistics: vec![
                told("VGPRs", StatisticValue::Unsigned(96)),
                told("Spills", StatisticValue::Signed(-1)),
                told("Pre-RA", StatisticValue::Bool(false)),
                told("Occupancy", StatisticValue::Float(0.5)),
            ],
        };
        let silent = Executable { pipeline: "voxelise".into(), subgroup_size: 32, ..Executable::default() };
        let text = table(Some(&[gather, silent]), "a device");
        assert_eq!(
            text,
            "pipeline  program         subgroup  as the driver states it\n\
             gather    Compute Shader        64  VGPRs 96, Spills -1, Pre-RA false, Occupancy 0.5\n\
             voxelise                        32\n"
        );
    }

    #[test]
    fn a_driver_that_tells_nothing_is_named_in_one_sentence() {
        let text = table(None, "llvmpipe");
        assert!(text.starts_with("llvmpipe does not tell") && text.lines().count() == 1, "{text}");
    }
}
