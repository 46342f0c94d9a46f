//! The memory that a frame will need, before anything is allocated: each resource's bytes, the total, and the largest
//! grid that fits.

use crate::memory::{Limit, apart, mib};
use crate::{Error, Result};

/// A resource and its bytes.
pub type MemoryRow = (&'static str, u64);

/// The bytes of every resource, in the order of allocation. Buffers and images have exactly these sizes.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MemoryPlan {
    pub rows: Vec<MemoryRow>,
}

impl MemoryPlan {
    pub fn total(&self) -> u64 {
        self.rows.iter().map(|r| r.1).sum()
    }

    /// # Panics
    /// There is no such row, which is a mistake in the program.
    pub fn bytes(&self, name: &str) -> u64 {
        bytes_of(&self.rows, name)
    }
}

/// # Panics
/// There is no such row, which is a mistake in the program.
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

/// Refuses a grid of `voxels` if its resources exceed `limit`; `rows_at` returns the resources of a grid by its edge.
/// The message names the largest grid that fits, or the resource that takes the memory. Returns the resources.
///
/// # Errors
/// [`Error::Memory`]
pub fn check(voxels: u32, limit: &Limit, rows_at: impl Fn(u32) -> Vec<MemoryRow>) -> Result<Vec<MemoryRow>> {
    let total = |rows: &[MemoryRow]| rows.iter().map(|row| row.1).sum::<u64>();
    let rows = rows_at(voxels);
    let all = total(&rows);
    if all <= limit.bytes {
        return Ok(rows);
    }
    let fits = (4..=8).rev().map(|log| 1 << log).find(|&edge| edge < voxels && total(&rows_at(edge)) <= limit.bytes);
    let remedy = match fits {
        Some(edge) => format!("the largest grid that fits is --set voxels={edge}"),
        None => {
            let (bytes, what, less) = most(&rows_at(16));
            format!("not even a grid of 16 voxels fits, for which the {what} need {:.1} MiB: {less}", mib(bytes))
        }
    };
    let ([all, bytes], words) = (apart([all, limit.bytes]), &limit.words);
    Err(Error::Memory(format!("voxels = {voxels} needs {all}, more than {words} of {bytes}: {remedy}")))
}

/// Refuses a row that is larger than the device's largest buffer binding.
///
/// # Errors
/// [`Error::Memory`]
pub fn check_buffers(rows: &[MemoryRow], limit: &Limit) -> Result<()> {
    let too_large =
        |&(name, bytes): &MemoryRow| bound(name).filter(|_| bytes > limit.bytes).map(|of| (name, bytes, of));
    let Some((name, bytes, (what, remedy))) = rows.iter().find_map(too_large) else { return Ok(()) };
    let ([bytes, most], words) = (apart([bytes, limit.bytes]), &limit.words);
    Err(Error::Memory(format!(
        "the scene has too many {what}: the buffer \"{name}\" needs {bytes}, more than {words} of {most}: use a scene of fewer{remedy}"
    )))
}

/// For a row that is one buffer and grows with the scene: its content, and a way to reduce it.
fn bound(name: &str) -> Option<(&'static str, &'static str)> {
    Some(match name {
        "record draws" => ("instances", ""),
        "materials" => ("materials", ""),
        "texture levels" => ("textures", ""),
        "lights" => ("lights", ""),
        // No shader binds it.
        _ if name.starts_with("acceleration") => return None,
        _ if of_items(name) => ("triangles for this grid", " or a smaller --set voxels"),
        _ if of_triangles(name) => ("triangles", ""),
        _ => return None,
    })
}

/// Whether the row grows with the number of list items and occupied voxels.
fn of_items(name: &str) -> bool {
    ["list ", "item"].iter().any(|part| name.contains(part))
}

/// Whether a row grows with the scene's triangles.
fn of_triangles(name: &str) -> bool {
    let parts = ["scene ", "deform ", "triangles", "lamp", "tree ", "query ", "acceleration", "slots", "record draws"];
    of_items(name) || parts.iter().any(|part| name.contains(part))
}

/// The group of `rows` that takes most memory: its bytes, its name, and a way to reduce it.
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
        // Textures are not a buffer.
        let rows = [("textures", 90 << 20), ("scene vertices", 9 << 20), ("list items", 11 << 20)];
        let said = |rows: &[MemoryRow]| check_buffers(rows, &limit).unwrap_err().to_string();
        let items = said(&rows);
        assert!(items.contains("triangles for this grid: the buffer \"list items\" needs 11 MiB"), "{items}");
        assert!(items.contains("more than the limit of 10 MiB") && items.ends_with("fewer or a smaller --set voxels"));
        assert!(check_buffers(&rows[..2], &limit).is_ok());
        for (name, what) in [("record draws", "instances"), ("materials", "materials"), ("tree links", "triangles")] {
            let said = said(&[(name, 11 << 20)]);
            assert!(said.contains(&format!("too many {what}: ")) && said.ends_with("use a scene of fewer"), "{said}");
        }
        let grid = check(64, &limit, |edge| vec![("voxels", u64::from(edge).pow(3) * 64)]).unwrap_err().to_string();
        assert!(grid.contains("needs 16 MiB, more than the limit of 10 MiB") && grid.contains("voxels=32"), "{grid}");
        assert!(check(32, &limit, |edge| vec![("voxels", u64::from(edge).pow(3) * 64)]).is_ok());
    }
}
