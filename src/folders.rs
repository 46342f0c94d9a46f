//! Folders of the user, on every system.

use std::env;
use std::ffi::OsString;
use std::path::PathBuf;

/// The folder for files that this program can create again: `twobounce` in `XDG_CACHE_HOME`, else in `LOCALAPPDATA`
/// (Windows), else in `.cache` of the home folder. `None` if the environment names none of them.
pub fn cache() -> Option<PathBuf> {
    cache_of(|name| env::var_os(name))
}

fn cache_of(variable: impl Fn(&str) -> Option<OsString>) -> Option<PathBuf> {
    let set = |name| variable(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let base = set("XDG_CACHE_HOME").or_else(|| set("LOCALAPPDATA")).or_else(|| Some(set("HOME")?.join(".cache")))?;
    Some(base.join("twobounce"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_system_names_a_folder_in_its_way() {
        let of = |set: &[(&str, &str)]| {
            let find = |name: &str| set.iter().find(|variable| variable.0 == name).map(|variable| variable.1.into());
            cache_of(find)
        };
        let home = ("HOME", "home");
        assert_eq!(of(&[home]), Some(PathBuf::from("home").join(".cache").join("twobounce")));
        assert_eq!(of(&[home, ("XDG_CACHE_HOME", "")]), of(&[home]));
        assert_eq!(of(&[home, ("XDG_CACHE_HOME", "caches")]), Some(PathBuf::from("caches").join("twobounce")));
        assert_eq!(of(&[("LOCALAPPDATA", "local")]), Some(PathBuf::from("local").join("twobounce")));
        assert_eq!(of(&[]), None);
    }
}
