//! Memory of the machine: how much is free, how much may be used, and sizes as text.

use std::fs;
use std::path::Path;

/// Bytes that a scene may use on systems that do not report free memory.
const UNKNOWN: u64 = 4 << 30;

/// A number of bytes that may be used, and the reason for this limit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limit {
    pub bytes: u64,
    /// The reason as the end of a phrase such as "more than …".
    pub words: String,
}

impl Limit {
    /// Half of the free memory: the other half is for later work and for other programs.
    pub fn host() -> Self {
        match available() {
            Some(free) => {
                let words = format!("half of the {:.0} MiB of memory that are free", mib(free));
                Self { bytes: free / 2, words }
            }
            None => Self { bytes: UNKNOWN, words: format!("the {:.0} MiB that a scene may take", mib(UNKNOWN)) },
        }
    }
}

/// Bytes of memory that this process can still get, where the system reports it: limited by the machine, by a container
/// or service, and by the process's own limits.
pub fn available() -> Option<u64> {
    free().into_iter().chain(addresses()).min()
}

/// Free memory of the machine, or of the container or service within it.
pub fn free() -> Option<u64> {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| kib(&text, "MemAvailable:"));
    let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    machine.into_iter().chain(left_in_groups(&groups, Path::new("/sys/fs/cgroup"))).min()
}

/// Bytes of address space that the process's own limits still allow; `None` without a limit.
pub fn addresses() -> Option<u64> {
    let [limits, status] = ["limits", "status"].map(|name| fs::read_to_string(format!("/proc/self/{name}")));
    left_of_limits(&limits.ok()?, &status.ok()?)
}

/// The result of [`addresses`], computed from the texts of `/proc/self/limits` and `/proc/self/status`.
fn left_of_limits(limits: &str, status: &str) -> Option<u64> {
    let left = |(limit, taken)| {
        let limit = limits.lines().find_map(|line| line.strip_prefix(limit))?.split_whitespace().next()?;
        Some(limit.parse::<u64>().ok()?.saturating_sub(kib(status, taken)?))
    };
    [("Max address space", "VmSize:"), ("Max data size", "VmData:")].into_iter().filter_map(left).min()
}

/// Bytes stated in KiB by the line `name` of such a text.
fn kib(text: &str, name: &str) -> Option<u64> {
    let number = text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?;
    number.parse::<u64>().ok().map(|kib| kib << 10)
}

/// Bytes that the control groups of `/proc/self/cgroup` and their parents still allow, in versions 1 and 2. `root` is
/// the folder of their files.
fn left_in_groups(groups: &str, root: &Path) -> Option<u64> {
    let left = |line: &str| {
        let (controllers, path) = line.split_once(':')?.1.split_once(':')?;
        let version_1 = controllers.split(',').any(|controller| controller == "memory");
        if !version_1 && !controllers.is_empty() {
            return None;
        }
        let root = if version_1 { root.join("memory") } else { root.to_owned() };
        let names = if version_1 {
            ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"]
        } else {
            ["memory.max", "memory.current", "inactive_file"]
        };
        // Inside a container the path may be one of the machine. Then the mounted folder is the container's own group.
        let inside = Path::new(path.trim_start_matches('/'));
        inside.ancestors().filter_map(|group| left_in_group(&root.join(group), names)).min()
    };
    groups.lines().filter_map(left).min()
}

/// The limit minus used memory, without cached files, which the system can drop.
fn left_in_group(folder: &Path, [limit, taken, cached]: [&str; 3]) -> Option<u64> {
    let number = |name: &str| fs::read_to_string(folder.join(name)).ok()?.trim().parse::<u64>().ok();
    let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
    let statistic = |line: &str| line.strip_prefix(cached)?.trim().parse::<u64>().ok();
    let cached = statistics.lines().find_map(statistic).unwrap_or(0);
    Some(number(limit)?.saturating_sub(number(taken)?.saturating_sub(cached)))
}

pub fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// Two sizes as text with units, with enough digits to tell them apart.
pub fn apart(sizes: [u64; 2]) -> [String; 2] {
    let texts = |digits: usize| sizes.map(|bytes| format!("{:.digits$} MiB", mib(bytes)));
    let differ = |texts: &[String; 2]| texts[0] != texts[1];
    (0..=2).map(texts).find(differ).unwrap_or_else(|| sizes.map(|bytes| format!("{bytes} bytes")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_that_any_control_group_allows_counts() {
        let folder = tempfile::tempdir().unwrap();
        let write = |path: &str, text: &str| {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        };
        let left = |groups: &str| left_in_groups(groups, folder.path());
        assert_eq!(left("0::/a/b\n"), None, "no limits");
        write("a/b/memory.max", "max\n");
        write("a/b/memory.current", "50\n");
        assert_eq!(left("0::/a/b\n"), None, "`max` is no limit");
        write("a/memory.max", "1000\n");
        write("a/memory.current", "700\n");
        write("a/memory.stat", "anon 400\ninactive_file 300\nactive_file 9\n");
        assert_eq!(left("0::/a/b\n"), Some(600), "the group around it, without what is cached");
        write("memory/c/memory.limit_in_bytes", "500\n");
        write("memory/c/memory.usage_in_bytes", "100\n");
        assert_eq!(left("12:cpu:/x\n4:hugetlb,memory:/c\n0::/a/b\n"), Some(400), "both versions at once");
        write("memory.max", "90\n");
        write("memory.current", "100\n");
        assert_eq!(left("0::/../elsewhere\n"), Some(0), "a container's own group is what is mounted");
    }

    #[test]
    fn the_least_that_any_limit_of_the_process_leaves_counts() {
        let status = "VmPeak:\t  900 kB\nVmSize:\t  300 kB\nVmData:\t  100 kB\n";
        let left = |addresses: &str, data: &str| {
            let limits = format!(
                "Limit  Soft  Hard  Units\nMax data size  {data}  unlimited  bytes\nMax address space  {addresses}  unlimited  bytes\n"
            );
            left_of_limits(&limits, status)
        };
        assert_eq!(left("unlimited", "unlimited"), None);
        assert_eq!(left("1024000", "unlimited"), Some(1024000 - 300 * 1024));
        assert_eq!(left("1024000", "102401"), Some(1));
        assert_eq!(left("1024", "unlimited"), Some(0), "a limit that was lowered");
    }

    #[test]
    fn sizes_that_differ_read_differently() {
        assert_eq!(apart([40 << 20, 10 << 20]), ["40 MiB", "10 MiB"]);
        assert_eq!(apart([(10 << 20) + 300_000, 10 << 20]), ["10.3 MiB", "10.0 MiB"]);
        assert_eq!(apart([(10 << 20) + 1, 10 << 20]), ["10485761 bytes", "10485760 bytes"]);
    }
}
