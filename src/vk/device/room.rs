//! Memory and threads that a driver needs. A driver that lacks them ends the process or never returns, so the program
//! asks it for less, or does not load it. The numbers are those of llvmpipe, which needs most, measured on two cores
//! with an allowance for more.

use crate::memory::{self, Limit, mib};
use crate::{Error, Result};
use std::sync::RwLock;
use std::thread;

/// Bytes of memory from loading the driver until passes are compiled.
const DRIVER: u64 = 512 << 20;
const COMPILER: u64 = 384 << 20;
/// Bytes of address space for the same, if threads share a heap.
const DRIVER_ADDRESSES: u64 = 1536 << 20;
const COMPILER_ADDRESSES: u64 = 768 << 20;

/// The driver starts two threads per core, for at most this number of cores, and a few more.
const MOST_CORES: usize = 32;
const MORE_THREADS: usize = 4;

/// Free memory of the machine minus the needs of the driver's compiler; `None` if the system does not report it.
#[cfg_attr(not(internals), doc(hidden))]
pub fn beside_compiler() -> Option<Limit> {
    let left = [(memory::free(), COMPILER), (memory::addresses(), COMPILER_ADDRESSES)];
    let bytes = left.into_iter().filter_map(|(left, taken)| Some(left?.saturating_sub(taken))).min()?;
    Some(Limit { bytes, words: "the memory that is free beside what the driver takes,".into() })
}

/// Refuses to load a driver that would lack memory or threads.
///
/// # Errors
/// [`Error::Memory`], or [`Error::Device`] if there are too few threads.
pub(in crate::vk) fn check() -> Result<()> {
    let lacks = |left: Option<u64>, taken: u64| {
        left.filter(|left| *left < taken).map(|left| [left, taken].map(|bytes| format!("{:.0} MiB", mib(bytes))))
    };
    if let Some([left, taken]) = lacks(memory::free(), DRIVER) {
        return Err(Error::Memory(format!(
            "{left} of memory are free, and a Vulkan driver takes up to {taken}: end other programs, or allow the container more"
        )));
    }
    if let Some([left, taken]) = lacks(memory::addresses(), DRIVER_ADDRESSES) {
        return Err(Error::Memory(format!(
            "the limits of this process leave {left} of address space, and a Vulkan driver takes up to {taken}: raise ulimit -v or -d"
        )));
    }
    let cores = thread::available_parallelism().map_or(1, usize::from).min(MOST_CORES);
    let (wanted, started) = (2 * cores + MORE_THREADS, threads(2 * cores + MORE_THREADS));
    if started < wanted {
        return Err(Error::Device(format!(
            "the system allows {started} more threads, and a Vulkan driver starts up to {wanted}: raise the limit on processes \
             (ulimit -u, or the pids of a container)"
        )));
    }
    Ok(())
}

/// The number of threads that the system can start at once, at most `wanted`.
fn threads(wanted: usize) -> usize {
    let gate = RwLock::new(());
    thread::scope(|scope| {
        let closed = gate.write();
        let start = |_| thread::Builder::new().spawn_scoped(scope, || drop(gate.read())).ok();
        let threads: Vec<_> = (0..wanted).map_while(start).collect();
        drop(closed);
        let started = threads.len();
        // The next thread may need their resources.
        threads.into_iter().for_each(|thread| thread.join().expect("it does nothing"));
        started
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_that_wait_for_each_other_end() {
        assert_eq!(threads(40), 40);
    }
}
