//! Long sweeps: `make test` takes a part of their cases, `make test-more`, which sets `TWOBOUNCE_TEST_MORE`, all of
//! them.
#![allow(dead_code)]

/// Whether every case is to be run.
pub fn all() -> bool {
    std::env::var_os("TWOBOUNCE_TEST_MORE").is_some()
}

/// Every `n`-th of the cases. Where the cases are the combinations of several lists, an `n` without a common divisor
/// with the lengths of the lists meets each of their elements.
pub fn every<T>(n: usize, cases: impl IntoIterator<Item = T>) -> impl Iterator<Item = T> {
    cases.into_iter().step_by(if all() { 1 } else { n })
}
