//! Memory of the machine: how much is free, how much may be taken, and sizes in words.

/// Bytes that a scene may take where the system does not say what is free.
const UNKNOWN: u64 = 4 << 30;

/// Bytes that may be taken, and what sets that limit.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limit {
    pub bytes: u64,
    /// As in "more than …".
    pub words: String,
}

impl Limit {
    /// Half of what is free: the other half is for the work that follows and for other programs.
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

/// Bytes of memory that programs can still get, where the system says.
pub fn available() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|l| l.starts_with("MemAvailable:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib << 10)
}

pub fn mib(bytes: u64) -> f64 {
    bytes as f64 / f64::from(1 << 20)
}

/// Two sizes as text with their unit, with as many digits as tell them apart.
pub fn apart(sizes: [u64; 2]) -> [String; 2] {
    let texts = |digits: usize| sizes.map(|bytes| format!("{:.digits$} MiB", mib(bytes)));
    let differ = |texts: &[String; 2]| texts[0] != texts[1];
    (0..=2).map(texts).find(differ).unwrap_or_else(|| sizes.map(|bytes| format!("{bytes} bytes")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_that_differ_read_differently() {
        assert_eq!(apart([40 << 20, 10 << 20]), ["40 MiB", "10 MiB"]);
        assert_eq!(apart([(10 << 20) + 300_000, 10 << 20]), ["10.3 MiB", "10.0 MiB"]);
        assert_eq!(apart([(10 << 20) + 1, 10 << 20]), ["10485761 bytes", "10485760 bytes"]);
    }
}
