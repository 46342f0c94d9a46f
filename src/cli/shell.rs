//! Commands to paste into a shell.

/// A word as a POSIX shell takes it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=./,:+%@".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

/// The words that `keep` keeps of a command's flags, those of their values with them; `takes_value` says which have one.
pub fn kept(typed: &[String], keep: &dyn Fn(&str) -> bool, takes_value: &dyn Fn(&str) -> bool) -> Vec<String> {
    let mut words = Vec::new();
    let mut typed = typed.iter();
    while let Some(word) = typed.next() {
        let flag = word.split('=').next().unwrap_or(word);
        let value = if flag == word && takes_value(flag) { typed.next() } else { None };
        if keep(flag) {
            words.extend(std::iter::once(word).chain(value).cloned());
        }
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_go_with_their_values() {
        let typed = ["a.glb", "--max-ms", "40", "--sky=0.5", "--strict", "--budget=9s"].map(str::to_owned);
        let keep = |flag: &str| !["--max-ms", "--budget"].contains(&flag);
        assert_eq!(kept(&typed, &keep, &|flag| flag == "--max-ms"), ["a.glb", "--sky=0.5", "--strict"]);
        assert_eq!(["a b", "it's", "x=1"].map(quoted), ["'a b'", r"'it'\''s'", "x=1"]);
    }
}
