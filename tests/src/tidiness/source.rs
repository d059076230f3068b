//! Reading Rust just well enough to look for names: literals and comments blanked, test code left out.
//!
//! Blanking keeps every byte's place, so what is found can be looked up in the original.

use super::tree;

/// The source with comments and the insides of literals replaced by spaces.
pub(super) fn blank_literals(source: &str) -> String {
    let bytes = source.as_bytes();
    let mut out = bytes.to_vec();
    let mut at = 0;
    while at < bytes.len() {
        let end = literal_end(bytes, at);
        for byte in &mut out[at..end] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        at = end.max(at + 1);
    }
    String::from_utf8(out).unwrap()
}

/// Where the comment or literal that begins at `at` ends; `at` itself if none begins there.
fn literal_end(bytes: &[u8], at: usize) -> usize {
    let rest = &bytes[at..];
    let after_name = at > 0 && is_name(bytes[at - 1]);
    if rest.starts_with(b"//") {
        return at + rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
    }
    if rest.starts_with(b"/*") {
        return at + comment_length(rest);
    }
    let raw = rest.strip_prefix(b"b").unwrap_or(rest);
    if let Some(hashed) = raw.strip_prefix(b"r").filter(|_| !after_name) {
        let hashes = hashed.iter().take_while(|b| **b == b'#').count();
        if hashed.get(hashes) == Some(&b'"') {
            let close: Vec<u8> = std::iter::once(b'"').chain(std::iter::repeat_n(b'#', hashes)).collect();
            let from = bytes.len() - hashed.len() + hashes + 1;
            let length = bytes[from..].windows(close.len()).position(|w| w == close);
            return length.map_or(bytes.len(), |l| from + l + close.len());
        }
    }
    match rest {
        [b'"', ..] => at + quoted_length(rest, b'"'),
        // A character, not a lifetime: '\...' or one character (of up to four bytes) and a quote.
        [b'\'', b'\\', ..] => at + quoted_length(rest, b'\''),
        [b'\'', ..] if (2..=5).any(|n| rest.get(n) == Some(&b'\'') && is_one_character(&rest[1..n])) => {
            at + quoted_length(rest, b'\'')
        }
        _ => at,
    }
}

fn is_one_character(bytes: &[u8]) -> bool {
    std::str::from_utf8(bytes).is_ok_and(|s| s.chars().count() == 1)
}

fn comment_length(rest: &[u8]) -> usize {
    let (mut depth, mut at) = (0, 0);
    while at < rest.len() {
        if rest[at..].starts_with(b"/*") {
            (depth, at) = (depth + 1, at + 2);
        } else if rest[at..].starts_with(b"*/") {
            (depth, at) = (depth - 1, at + 2);
            if depth == 0 {
                return at;
            }
        } else {
            at += 1;
        }
    }
    rest.len()
}

fn quoted_length(rest: &[u8], quote: u8) -> usize {
    let mut at = 1;
    while at < rest.len() && rest[at] != quote {
        at += if rest[at] == b'\\' { 2 } else { 1 };
    }
    (at + 1).min(rest.len())
}

fn is_name(byte: u8) -> bool {
    byte.is_ascii_alphanumeric() || byte == b'_'
}

/// Blanked code without the items under `#[cfg(test)]`.
pub(super) fn without_tests(blanked: &str) -> String {
    let mut code = blanked.to_owned();
    while let Some(from) = code.find("#[cfg(test)]") {
        let end = item_end(&code, from);
        let blank: String = code[from..end].chars().map(|c| if c == '\n' { c } else { ' ' }).collect();
        code.replace_range(from..end, &blank);
    }
    code
}

/// Where the item that begins at `from` ends: at its closing brace, or at a semicolon before any brace.
fn item_end(code: &str, from: usize) -> usize {
    let mut depth = 0_i32;
    for (at, c) in code[from..].char_indices() {
        match c {
            '{' | '(' | '[' => depth += 1,
            '}' | ')' | ']' => depth -= 1,
            _ => {}
        }
        if depth == 0 && (c == '}' || c == ';') {
            return from + at + c.len_utf8();
        }
    }
    code.len()
}

/// Code that is built when tests are not: (path, code without literals and tests) of the crate in
/// `directory`, found by following `mod` from its `lib.rs`.
pub(super) fn production_code(directory: &str) -> Vec<(String, String)> {
    let mut found = Vec::new();
    let mut pending = vec![format!("{directory}/src/lib.rs")];
    while let Some(path) = pending.pop() {
        let source = tree::text(&path).unwrap();
        let code = without_tests(&blank_literals(&source));
        pending.extend(declared_modules(&code, &path).into_iter().map(|module| module.1));
        found.push((path, code));
    }
    found.sort();
    found
}

/// (name, file) of each module that the code of the file `parent` declares without a body.
pub(super) fn declared_modules(code: &str, parent: &str) -> Vec<(String, String)> {
    modules(code).into_iter().map(|name| (name.clone(), module_file(parent, &name))).collect()
}

/// Names of the modules that are declared without a body.
fn modules(code: &str) -> Vec<String> {
    let words = words(code);
    let declared = words.windows(2).filter(|pair| {
        let (at, name) = pair[1];
        pair[0].1 == "mod" && code[at + name.len()..].trim_start().starts_with(';')
    });
    declared.map(|pair| pair[1].1.to_owned()).collect()
}

/// The file of module `name` declared in the file `parent`.
fn module_file(parent: &str, name: &str) -> String {
    let (folder, file) = parent.rsplit_once('/').unwrap();
    let folder = match file {
        "lib.rs" | "main.rs" | "mod.rs" => folder.to_owned(),
        _ => parent.trim_end_matches(".rs").to_owned(),
    };
    let beside = format!("{folder}/{name}.rs");
    if tree::root().join(&beside).is_file() { beside } else { format!("{folder}/{name}/mod.rs") }
}

/// The name or number with which some code begins; empty if it begins with something else.
pub(super) fn name_at(code: &str) -> &str {
    &code[..code.bytes().take_while(|b| is_name(*b)).count()]
}

/// Every name and number of some code, with its place.
pub(super) fn words(code: &str) -> Vec<(usize, &str)> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < code.len() {
        let name = if code.is_char_boundary(at) { name_at(&code[at..]) } else { "" };
        if !name.is_empty() {
            found.push((at, name));
        }
        at += name.len().max(1);
    }
    found
}

/// The line, counted from 1, on which byte `at` is.
pub(super) fn line(code: &str, at: usize) -> usize {
    code[..at].matches('\n').count() + 1
}

/// Paths below `root` that code names, in `use` groups or in full: `std::{fs, time::Instant}` gives `fs` and
/// `time::Instant`. Taking everything (`*`) or renaming the root gives `*`.
pub(super) fn paths_below(code: &str, root: &str) -> Vec<(usize, String)> {
    let mut found = Vec::new();
    for (at, word) in words(code) {
        if word != root {
            continue;
        }
        let rest = code[at + word.len()..].trim_start();
        if let Some(tree) = rest.strip_prefix("::") {
            let mut paths = Vec::new();
            use_tree(tree, "", &mut paths);
            found.extend(paths.into_iter().map(|path| (at, path)));
        } else if rest.starts_with("as ") {
            found.push((at, "*".to_owned()));
        }
    }
    found
}

/// Reads one path or group of paths, adds the whole paths to `paths`, and returns what follows.
fn use_tree<'a>(code: &'a str, prefix: &str, paths: &mut Vec<String>) -> &'a str {
    let code = code.trim_start();
    if let Some(mut rest) = code.strip_prefix('{') {
        loop {
            rest = rest.trim_start();
            match rest.chars().next() {
                Some('}') => return &rest[1..],
                Some(',') => rest = &rest[1..],
                None => return rest,
                Some(_) => {
                    let after = use_tree(rest, prefix, paths);
                    // Whatever a group of names cannot hold ends it.
                    if after.len() == rest.len() {
                        return after;
                    }
                    rest = after.trim_start();
                    if let Some(renamed) = rest.strip_prefix("as ") {
                        let name = renamed.bytes().take_while(|b| is_name(*b)).count();
                        rest = &renamed[name..];
                    }
                }
            }
        }
    }
    let length = if code.starts_with('*') { 1 } else { code.bytes().take_while(|b| is_name(*b)).count() };
    let path =
        if prefix.is_empty() { code[..length].to_owned() } else { format!("{prefix}::{}", &code[..length]) };
    let rest = code[length..].trim_start();
    match rest.strip_prefix("::") {
        Some(below) => use_tree(below, &path, paths),
        None => {
            paths.push(path);
            rest
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_blanked_in_place() {
        let source = "let a = \"x // y\"; // z\nlet c = '\\''; /* /* */ q */ fn f<'a>() {} r#\"\"h\"#;";
        let blanked = blank_literals(source);
        assert_eq!(blanked.len(), source.len());
        let words: Vec<&str> = words(&blanked).into_iter().map(|w| w.1).collect();
        assert_eq!(words, ["let", "a", "let", "c", "fn", "f", "a"]);
    }

    #[test]
    fn test_code_is_left_out_and_what_follows_is_not() {
        let code = "fn a() {}\n#[cfg(test)]\n#[path = \"t.rs\"]\nmod t;\n#[cfg(test)]\nmod u { fn x() {} }\nmod v;\nfn b() {}";
        let left = without_tests(&blank_literals(code));
        assert_eq!(modules(&left), ["v"]);
        assert!(left.contains("fn b()") && !left.contains("fn x()"), "{left}");
    }

    #[test]
    fn groups_are_read_to_the_end() {
        let code =
            "use std::{fs as files, io::{self, Read}, time::*}; let x = std::thread::spawn(f); use std as s;";
        let paths: Vec<String> = paths_below(code, "std").into_iter().map(|p| p.1).collect();
        assert_eq!(paths, ["fs", "io::self", "io::Read", "time::*", "thread::spawn", "*"]);
    }
}
