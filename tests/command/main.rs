//! The program as its users run it: flags, files, output, exit codes. Every test starts `twobounce` as a process. The
//! tests use shells, signals and X servers, which Windows lacks.
#![cfg(unix)]

mod cli_common;
#[path = "../common/more.rs"]
mod more;

mod arguments;
mod bombs;
mod chart;
mod chart_others;
mod chart_rounds;
mod demo;
mod driver_cache;
mod host_example;
#[cfg(target_os = "linux")]
mod library;
#[cfg(target_os = "linux")]
mod limits;
mod machines;
mod new_method;
mod outputs;
mod plan;
mod profile;
mod reference_cli;
mod refine;
mod render;
mod same_bits;
mod shell;
mod sky;
mod stability;
mod study;
mod suite;
mod tonemap;
mod view;
mod vk_missing;
