//! Which file of a crate names items of which other file, found by resolving every path in the source.

use std::collections::{BTreeMap, BTreeSet};

use super::source::{blank_literals, declared_modules, name_at, without_tests, words};
use super::tree;

/// A path of names, such as `["crate", "session", "client"]`.
type Path = Vec<String>;

/// What one `use` declaration brings into a file.
struct Use {
    path: Path,
    /// The name it has here; `*` for everything.
    name: String,
    /// Whether other files can take it from here.
    is_public: bool,
}

struct Module {
    file: String,
    /// Without literals, comments, tests and `use` declarations.
    code: String,
    children: Vec<String>,
    uses: Vec<Use>,
}

/// The modules of one crate, by their path from the root, which is empty.
pub(super) struct Crate {
    modules: BTreeMap<Path, Module>,
}

/// Where a path leads.
enum Target {
    Module(Path),
    /// The module that defines the item.
    Item(Path),
}

/// An item of the file `to` that the file `from` names.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Import {
    pub(super) from: String,
    pub(super) to: String,
    pub(super) path: String,
}

impl Crate {
    /// Reads all files that are built when tests are not, from the root file on.
    pub(super) fn read(root: &str) -> Self {
        let mut modules = BTreeMap::new();
        let mut pending = vec![(Path::new(), root.to_owned())];
        while let Some((path, file)) = pending.pop() {
            let code = without_tests(&blank_literals(&tree::text(&file).unwrap()));
            let children = declared_modules(&code, &file);
            for (name, child) in &children {
                pending.push(([path.as_slice(), std::slice::from_ref(name)].concat(), child.clone()));
            }
            let children = children.into_iter().map(|child| child.0).collect();
            let (code, uses) = split_uses(&code);
            modules.insert(path, Module { file, code, children, uses });
        }
        Self { modules }
    }

    /// Every import from one file of this crate into another.
    pub(super) fn imports(&self) -> BTreeSet<Import> {
        let mut found = BTreeSet::new();
        for (at, module) in &self.modules {
            let used = module.uses.iter().filter(|u| !self.only_passes_on(at, module, u)).map(|u| &u.path);
            for path in used.chain(&paths(&module.code)) {
                if let Some(Target::Item(to)) = self.resolve(at, path, 0)
                    && to != *at
                {
                    let (from, to) = (module.file.clone(), self.modules[&to].file.clone());
                    found.insert(Import { from, to, path: path.join("::") });
                }
            }
        }
        found
    }

    /// Whether a file only offers an item of its own child to others.
    fn only_passes_on(&self, at: &Path, module: &Module, import: &Use) -> bool {
        let is_named =
            || words(&module.code).windows(2).any(|pair| pair[1].1 == import.name && pair[0].1 != "mod");
        let below = |to: &Path| to.len() > at.len() && to.starts_with(at);
        let of_child = matches!(self.resolve(at, &import.path, 0), Some(Target::Item(to)) if below(&to));
        import.is_public && of_child && !is_named()
    }

    /// Where `path`, written in the module `at`, leads inside this crate.
    fn resolve(&self, at: &Path, path: &[String], depth: usize) -> Option<Target> {
        // Two files that pass on everything of each other.
        if depth > 16 {
            return None;
        }
        let (first, rest) = path.split_first()?;
        let parent = || at[..at.len().saturating_sub(1)].to_vec();
        match first.as_str() {
            "crate" => self.walk(Path::new(), rest, depth),
            "self" => self.walk(at.clone(), rest, depth),
            "super" if rest.first().is_some_and(|next| next == "super") => {
                self.resolve(&parent(), rest, depth + 1)
            }
            "super" => self.walk(parent(), rest, depth),
            _ => {
                let module = &self.modules[at];
                let known = module.children.contains(first) || module.uses.iter().any(|u| u.name == *first);
                known.then(|| self.walk(at.clone(), path, depth))?
            }
        }
    }

    /// Follows `names` from the module `at`, through what it takes from elsewhere.
    fn walk(&self, mut at: Path, names: &[String], depth: usize) -> Option<Target> {
        for (index, name) in names.iter().enumerate() {
            let module = self.modules.get(&at)?;
            match name.as_str() {
                "self" => continue,
                "*" => return Some(Target::Item(at)),
                _ => {}
            }
            if module.children.contains(name) {
                at.push(name.clone());
                continue;
            }
            let taken = module.uses.iter().find(|u| u.name == *name && u.path.first() != Some(name));
            if let Some(taken) = taken {
                let path = [&taken.path, &names[index + 1..]].concat();
                return self.resolve(&at, &path, depth + 1);
            }
            let everything = module.uses.iter().filter(|u| u.name == "*").find_map(|u| {
                let from = self.resolve(&at, &u.path[..u.path.len() - 1], depth + 1)?;
                let Target::Module(from) = from else { return None };
                self.defines(&from, name).then_some(from)
            });
            return Some(Target::Item(everything.unwrap_or(at)));
        }
        Some(Target::Module(at))
    }

    fn defines(&self, at: &Path, name: &str) -> bool {
        const KINDS: [&str; 8] = ["const", "enum", "fn", "static", "struct", "trait", "type", "union"];
        let code = &self.modules[at].code;
        words(code).windows(2).any(|pair| KINDS.contains(&pair[0].1) && pair[1].1 == name)
    }
}

/// The code without its `use` declarations, and what these say.
fn split_uses(code: &str) -> (String, Vec<Use>) {
    let (mut rest, mut uses) = (code.to_owned(), Vec::new());
    for (at, _) in words(code).into_iter().filter(|word| word.1 == "use") {
        // `use<'a>` bounds what a type captures.
        if code[at + 3..].starts_with('<') {
            continue;
        }
        let end = code[at..].find(';').map_or(code.len(), |length| at + length);
        let before = code[..at].trim_end();
        let is_public = before.ends_with("pub")
            || before.ends_with(')') && {
                let open = before.rfind('(').unwrap_or(0);
                before[..open].ends_with("pub")
            };
        read_tree(&code[at + 3..end], &[], is_public, &mut uses);
        let blank: String = code[at..end].chars().map(|c| if c == '\n' { c } else { ' ' }).collect();
        rest.replace_range(at..end, &blank);
    }
    (rest, uses)
}

/// Reads one tree of a `use` declaration, `a::{b, c as d}`, below `prefix`.
fn read_tree(tree: &str, prefix: &[String], is_public: bool, uses: &mut Vec<Use>) {
    let tree = tree.trim();
    let (path, group) = match tree.split_once('{') {
        Some((path, group)) => (path, group.strip_suffix('}')),
        None => (tree, None),
    };
    let (path, renamed) = path.split_once(" as ").map_or((path, None), |(path, name)| (path, Some(name)));
    let names = path.split("::").map(str::trim).filter(|name| !name.is_empty()).map(str::to_owned);
    let mut path: Path = prefix.iter().cloned().chain(names).collect();
    let Some(group) = group else {
        if path.last().is_some_and(|name| name == "self") && path.len() > 1 {
            path.pop();
        }
        if let Some(last) = path.last() {
            let name = renamed.map_or(last.as_str(), str::trim).to_owned();
            uses.push(Use { path, name, is_public });
        }
        return;
    };
    let (mut depth, mut from) = (0, 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                read_tree(&group[from..at], &path, is_public, uses);
                from = at + 1;
            }
            _ => {}
        }
    }
    read_tree(&group[from..], &path, is_public, uses);
}

/// Every path of two names or more that stands in the code.
fn paths(code: &str) -> Vec<Path> {
    let mut found = Vec::new();
    for (at, word) in words(code) {
        if code[..at].ends_with("::") {
            continue;
        }
        let mut path = vec![word.to_owned()];
        let mut rest = &code[at + word.len()..];
        while let Some(after) = rest.strip_prefix("::") {
            let name = name_at(after);
            if name.is_empty() {
                break;
            }
            path.push(name.to_owned());
            rest = &after[name.len()..];
        }
        if path.len() > 1 {
            found.push(path);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A crate of `(path of the module, its source)`; the root first.
    fn of(sources: &[(&str, &str)]) -> Crate {
        let path = |name: &str| name.split("::").filter(|n| !n.is_empty()).map(str::to_owned).collect();
        let paths: Vec<Path> = sources.iter().map(|s| path(s.0)).collect();
        let module = |(name, source): &(&str, &str)| {
            let at: Path = path(name);
            let (code, uses) = split_uses(&without_tests(&blank_literals(source)));
            let is_child = |p: &&Path| p.len() == at.len() + 1 && p.starts_with(&at);
            let children = paths.iter().filter(is_child).map(|p| p[at.len()].clone()).collect();
            (at, Module { file: (*name).to_owned(), code, children, uses })
        };
        Crate { modules: sources.iter().map(module).collect() }
    }

    fn found(sources: &[(&str, &str)]) -> Vec<(String, String)> {
        of(sources).imports().into_iter().map(|i| (i.from, i.to)).collect()
    }

    fn pair(from: &str, to: &str) -> (String, String) {
        (from.to_owned(), to.to_owned())
    }

    #[test]
    fn declaring_a_child_and_passing_its_items_on_is_no_import() {
        assert_eq!(
            found(&[("", "mod a; pub use a::X; pub(crate) use a::Y;"), ("a", "struct X; struct Y;")]),
            []
        );
    }

    #[test]
    fn an_item_passed_on_and_also_used_is_an_import() {
        let sources = [("", "mod a; pub use a::X; fn f(x: X) {}"), ("a", "pub struct X;")];
        assert_eq!(found(&sources), [pair("", "a")]);
    }

    #[test]
    fn an_import_leads_to_the_file_that_defines_the_item() {
        let sources = [
            ("", "mod a; mod b;"),
            ("a", "mod c; pub use c::X; pub struct Y;"),
            ("a::c", "use super::Y; pub struct X;"),
            ("b", "use crate::a::{X as Z, self}; fn f() { a::c::g(); super::a::h() }"),
        ];
        let expected = [pair("a::c", "a"), pair("b", "a"), pair("b", "a::c")];
        assert_eq!(
            found(&sources).into_iter().collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>(),
            expected
        );
    }

    #[test]
    fn what_only_tests_import_does_not_count() {
        assert_eq!(
            found(&[("", "mod a;\n#[cfg(test)]\nmod t { use crate::a::X; }"), ("a", "pub struct X;")]),
            []
        );
    }
}
