//! The memory that a frame will need, before anything is allocated: each resource's bytes, the total, and the largest
//! grid that fits.

use crate::memory::{Limit, apart, mib};
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
        bytes_of(&self.rows, name)
    }
}

/// # Panics
/// When there is no such row: a mistake in the program.
pub fn bytes_of(rows: &[MemoryRow], name: &str) -> u64 {
    rows.iter().find(|row| row.0 == name).unwrap_or_else(|| panic!("no resource named {name} in the plan")).1
}

impl std::fmt::Display for MemoryPlan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (name, bytes) in &self.rows {
            writeln!(f, "  {name:<24} {:>10.2} MiB", mib(*bytes))?;
        }
        write!(f, "  {:<24} {:>10.2} MiB", "total", mib(self.total()))
    }
}

/// Refuses a grid of `voxels` whose resources, `rows_at` a grid's edge, exceed `limit`; names the largest grid that would fit,
/// or what else takes the memory.
///
/// # Errors
/// [`Error::Memory`]
pub fn check(voxels: u32, limit: &Limit, rows_at: impl Fn(u32) -> Vec<MemoryRow>) -> Result<()> {
    let total_at = |edge: u32| rows_at(edge).iter().map(|row| row.1).sum();
    let total: u64 = total_at(voxels);
    if total <= limit.bytes {
        return Ok(());
    }
    let fits = (4..=8).rev().map(|log| 1 << log).find(|&edge| edge < voxels && total_at(edge) <= limit.bytes);
    let remedy = match fits {
        Some(edge) => format!("the largest grid that fits is --set voxels={edge}"),
        None => {
            let (bytes, what, less) = most(&rows_at(16));
            format!("not even a grid of 16 voxels fits, for which the {what} need {:.1} MiB: {less}", mib(bytes))
        }
    };
    let ([total, bytes], words) = (apart([total, limit.bytes]), &limit.words);
    Err(Error::Memory(format!("voxels = {voxels} needs {total}, more than {words} of {bytes}: {remedy}")))
}

/// Refuses rows of triangles that are larger than a device binds as one buffer; of these, every row is one.
///
/// # Errors
/// [`Error::Memory`]
pub fn check_buffers(rows: &[MemoryRow], triangles: u64, limit: &Limit) -> Result<()> {
    let Some((name, bytes)) =
        rows.iter().find(|(name, bytes)| of_triangles(name) && !name.starts_with("scene ") && *bytes > limit.bytes)
    else {
        return Ok(());
    };
    let ([bytes, most], words) = (apart([*bytes, limit.bytes]), &limit.words);
    Err(Error::Memory(format!(
        "the scene has {triangles} triangles, too many for this grid: the buffer \"{name}\" needs {bytes}, more than {words} of {most}: use a scene of fewer or a smaller --set voxels"
    )))
}

/// Whether a row grows with the scene's triangles.
fn of_triangles(name: &str) -> bool {
    ["scene ", "deform ", "triangles", "lamp", "list ", "item"].iter().any(|part| name.contains(part))
}

/// The group of `rows` that takes the most: its bytes, its name, and how to need less.
fn most(rows: &[MemoryRow]) -> (u64, &'static str, &'static str) {
    let sum = |belongs: &dyn Fn(&str) -> bool| rows.iter().filter(|row| belongs(row.0)).map(|row| row.1).sum();
    let groups: [(u64, _, _); 3] = [
        (sum(&|name| name == "textures"), "textures", "use smaller or fewer ones or --max-texture TEXELS"),
        (sum(&of_triangles), "triangles", "use a scene of fewer"),
        (sum(&|name| name != "textures" && !of_triangles(name)), "image and its buffers", "choose a smaller --size"),
    ];
    groups.into_iter().max_by_key(|group| group.0).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_does_not_fit_is_named_with_a_remedy() {
        let limit = Limit { bytes: 10 << 20, words: "the limit".into() };
        let said = |rows: &[MemoryRow]| check(64, &limit, |_| rows.to_vec()).unwrap_err().to_string();
        let small = ("globals", 1 << 10);
        assert!(
            said(&[("textures", 11 << 20), small])
                .ends_with("the textures need 11.0 MiB: use smaller or fewer ones or --max-texture TEXELS")
        );
        assert!(
            said(&[("scene vertices", 6 << 20), ("triangles", 6 << 20), ("textures", 7 << 20)])
                .contains("the triangles need 12.0")
        );
        assert!(said(&[("gathered light", 11 << 20), small]).contains("--size"));
        assert!(
            said(&[("textures", 10 << 20), small])
                .contains("needs 10486784 bytes, more than the limit of 10485760 bytes")
        );
        // Textures are no buffer, and vertices are not bound as one that shaders read.
        let rows = [("textures", 90 << 20), ("scene vertices", 90 << 20), ("list items", 11 << 20)];
        let said = check_buffers(&rows, 1234, &limit).unwrap_err().to_string();
        assert!(said.contains("1234 triangles") && said.contains("\"list items\" needs 11 MiB"), "{said}");
        assert!(said.contains("more than the limit of 10 MiB") && said.contains("fewer"), "{said}");
        assert!(check_buffers(&rows[..2], 1234, &limit).is_ok());
        let grid = check(64, &limit, |edge| vec![("voxels", u64::from(edge).pow(3) * 64)]).unwrap_err().to_string();
        assert!(grid.contains("needs 16 MiB, more than the limit of 10 MiB") && grid.contains("voxels=32"), "{grid}");
        assert!(check(32, &limit, |edge| vec![("voxels", u64::from(edge).pow(3) * 64)]).is_ok());
    }
}
