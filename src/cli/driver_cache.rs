//! A workaround for a fault of Mesa's software driver, in 22.3.6 and in the sources of later versions: the key of its
//! disk cache contains the processor, but not the width of vectors from `LP_NATIVE_VECTOR_WIDTH`. Cached code for
//! vectors of 256 bits then runs in a process whose driver allocates memory for 128 bits, and writes beyond it.

use std::env;
use std::fs;
use std::path::PathBuf;

/// Gives the driver a separate cache for the width of vectors in the environment, if there is one. It must be called
/// before the process has a second thread.
pub fn separate_widths() {
    let Some(width) = env::var("LP_NATIVE_VECTOR_WIDTH").ok().and_then(|text| text.parse::<u32>().ok()) else { return };
    let own = folder().map(|folder| folder.join(format!("mesa-vectors-{width}")));
    let (name, value) = match own.filter(|own| fs::create_dir_all(own).is_ok()) {
        Some(own) => ("MESA_SHADER_CACHE_DIR", own.into_os_string()),
        // Without a cache everything is compiled, which is slow and correct.
        None => ("MESA_SHADER_CACHE_DISABLE", "true".into()),
    };
    // SAFETY: no other thread reads the environment, because there is none.
    unsafe { env::set_var(name, value) };
}

/// The folder of Mesa's cache.
fn folder() -> Option<PathBuf> {
    let given = |name| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = || Some(given("HOME")?.join(".cache"));
    given("MESA_SHADER_CACHE_DIR").or_else(|| given("XDG_CACHE_HOME")).or_else(home)
}
