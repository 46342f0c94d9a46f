//! What a frame will need, before anything is allocated: each resource's bytes, the total, and the largest grid that fits.

use crate::{Error, Result};

/// A resource and its bytes.
pub type MemoryRow = (&'static str, u64);

/// Bytes of every resource, in the order of allocation. Buffers and images are made with exactly these sizes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MemoryPlan {
    pub rows: Vec<MemoryRow>,
}

impl MemoryPlan {
    pub fn total(&self) -> u64 {
        self.rows.iter().map(|r| r.1).sum()
    }

    /// # Panics
    /// When there is no such row: a mistake in the program.
    pub fn bytes(&self, name: &str) -> u64 {
        self.rows.iter().find(|r| r.0 == name).unwrap_or_else(|| panic!("no resource named {name} in the plan")).1
    }
}

impl std::fmt::Display for MemoryPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (name, bytes) in &self.rows {
            writeln!(f, "  {name:<24} {:>10.2} MiB", mib(*bytes))?;
        }
        write!(f, "  {:<24} {:>10.2} MiB", "total", mib(self.total()))
    }
}

pub fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// Refuses a grid of `voxels` whose bytes, `total_at` a grid's edge, exceed `limit`; names the largest grid that would fit.
///
/// # Errors
/// [`Error::Memory`]
pub fn check(voxels: u32, limit: u64, limit_name: &str, total_at: impl Fn(u32) -> u64) -> Result<()> {
    let total = total_at(voxels);
    if total <= limit {
        return Ok(());
    }
    let fits = (4..=8).rev().map(|log| 1 << log).find(|&edge| edge < voxels && total_at(edge) <= limit);
    let remedy = match fits {
        Some(edge) => format!("the largest grid that fits is --set voxels={edge}"),
        None => "not even a grid of 16 voxels fits: make the image or the scene smaller".into(),
    };
    Err(Error::Memory(format!(
        "voxels = {voxels} needs {:.0} MiB, more than {limit_name} of {:.0} MiB: {remedy}",
        mib(total),
        mib(limit)
    )))
}
