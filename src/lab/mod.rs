//! The laboratory: the common parts of all experiments. An experiment is a list of rows that are measured one by one,
//! and a page that shows them: `chart`, `study`, `stability`, `plan`, `profile --growth` and `ledger`. `src/cli/lab.rs`
//! runs them.

pub mod ledger;
pub mod merge;
pub mod page;
pub mod specimen;
pub mod store;
pub mod table;
