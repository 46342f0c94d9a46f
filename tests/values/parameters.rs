//! No function takes several arguments as one tuple. A tuple is one argument where its elements are of one type and
//! belong together, such as the width and height of an image. Clippy counts the arguments themselves (`clippy.toml`).

use std::fs;
use std::path::{Path, PathBuf};

fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let mut found: Vec<PathBuf> =
        entries.flat_map(|path| if path.is_dir() { sources(&path) } else { vec![path] }).collect();
    found.retain(|path| path.extension().is_some_and(|extension| extension == "rs"));
    found
}

/// The parts of `list` between commas outside of brackets.
fn parts(list: &str) -> Vec<&str> {
    let (mut depth, mut start, mut found) = (0, 0, Vec::new());
    let mut before = ' ';
    for (at, c) in list.char_indices() {
        match c {
            '(' | '[' | '{' | '<' => depth += 1,
            '>' if before == '-' || before == '=' => {}
            ')' | ']' | '}' | '>' => depth -= 1,
            ',' if depth == 0 => {
                found.push(list[start..at].trim());
                start = at + 1;
            }
            _ => {}
        }
        before = c;
    }
    found.push(list[start..].trim());
    found.retain(|part| !part.is_empty());
    found
}

/// The text within the bracket at the start of `text`.
fn within(text: &str) -> &str {
    let mut depth = 0;
    for (at, c) in text.char_indices() {
        match c {
            '(' => depth += 1,
            ')' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return &text[1..at];
        }
    }
    panic!("a bracket is not closed: {:.80}", text)
}

/// The parameters of all functions in a file, without comments.
fn parameters(text: &str) -> Vec<Vec<String>> {
    let code: String = text.lines().map(|line| line.split("//").next().unwrap().to_owned() + "\n").collect();
    let mut found = Vec::new();
    for (at, _) in code.match_indices("fn ") {
        let is_word = code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '"');
        let rest = &code[at + 3..];
        let name = rest.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(0);
        if is_word || name == 0 {
            continue;
        }
        // Bounds of type parameters may hold brackets of their own.
        let mut depth = 0;
        let mut before = ' ';
        let open = rest[name..].char_indices().find(|(_, c)| {
            depth += i32::from(*c == '<') - i32::from(*c == '>' && before != '-');
            before = *c;
            *c == '(' && depth == 0
        });
        let Some((open, _)) = open else { continue };
        found.push(parts(within(&rest[name + open..])).into_iter().map(str::to_owned).collect());
    }
    found
}

/// Whether a parameter is a tuple of arguments: destructured in the signature, with elements of several types.
fn hides_arguments(parameter: &str) -> bool {
    if !parameter.starts_with('(') {
        return false;
    }
    let Some((_, kind)) = parameter.rsplit_once("):") else { return false };
    let kind = kind.trim().trim_start_matches('&');
    if !kind.starts_with('(') {
        return false;
    }
    let types = parts(within(kind));
    types.iter().any(|other| *other != types[0])
}

#[test]
fn no_function_hides_arguments_in_a_tuple() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut functions = 0;
    for path in sources(&root.join("src")) {
        let all = parameters(&fs::read_to_string(&path).unwrap());
        functions += all.len();
        let hiding: Vec<_> = all.iter().flatten().filter(|parameter| hides_arguments(parameter)).collect();
        let name = path.strip_prefix(root).unwrap().to_str().unwrap().replace('\\', "/");
        assert!(hiding.is_empty(), "{name}: {hiding:?}; give each argument a parameter, or make a struct of them");
    }
    assert!(functions > 2000, "only {functions} functions were found");
}

#[test]
fn a_tuple_of_arguments_is_found() {
    let hides = |text: &str| parameters(text).iter().flatten().filter(|parameter| hides_arguments(parameter)).count();
    assert_eq!(hides("fn f((a, b): (u32, &str), c: u32) {}"), 1);
    assert_eq!(hides("fn f<T: Fn(u32) -> u32>(\n    &self,\n    (a, b): &(u32, Vec<(u8, u8)>),\n) {}"), 1);
    assert_eq!(hides("fn f((width, height): (u32, u32)) {}"), 0, "a size is one argument");
    assert_eq!(hides("fn f(pair: (u32, f32)) {}"), 0, "a value that is handed on whole");
    assert_eq!(hides("// fn f((a, b): (u32, &str))\nfn g(a: u32, b: &str) {}"), 0);
}
