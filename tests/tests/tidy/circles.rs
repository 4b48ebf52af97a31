//! Modules of a crate that import each other in a loop, by the paths among the tokens of their sources.
//!
//! A name counts for the module that it is imported from, not for the file that defines it. Modules that stand side by side are
//! compared with all that is in them, and a parent by its own code. Methods are not seen, nor names that are used without a
//! path and an import. Test code is left out, and imports of `*` are for it.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{Delimiter, TokenStream, TokenTree};

use crate::sources::{crate_folders, rust_files, workspace};

/// The text of each file of a package, by its path.
type Sources = BTreeMap<PathBuf, String>;
/// The names that a module (first) takes from another (second). They stand side by side, or one is the parent of the other.
type Imports = BTreeMap<(String, String), BTreeSet<String>>;
/// The segments of a path, as it is written.
type Segments = Vec<String>;

#[derive(Default)]
struct Module {
    /// Its path from the root of the crate; the root has the name of the package.
    name: String,
    file: PathBuf,
    parent: Option<usize>,
    children: BTreeMap<String, usize>,
    /// Names as they are known here, what they stand for, and whether others can take them from here.
    imports: Vec<(String, Segments, bool)>,
    /// Every path of several segments that its code names, but for those of imports.
    mentions: BTreeSet<Segments>,
}

/// The modules below a root file; the first is the root.
struct Tree<'a> {
    sources: &'a Sources,
    modules: Vec<Module>,
}

/// What follows an attribute: up to its `;` or the group in braces that ends it.
fn skip_item(rest: &[TokenTree]) -> usize {
    let is = |token: &TokenTree, word: &str| token.to_string() == word;
    let ends_in_semicolon = rest
        .iter()
        .take(3)
        .any(|token| ["use", "const", "static", "type"].iter().any(|word| is(token, word)));
    let ends = |token: &TokenTree| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace && !ends_in_semicolon,
        token => is(token, ";"),
    };
    rest.iter().position(ends).map_or(rest.len(), |end| end + 1)
}

fn is_test(attribute: &TokenTree) -> bool {
    ["[test]", "[cfg(test)]"].contains(&attribute.to_string().replace(' ', "").as_str())
}

impl<'a> Tree<'a> {
    fn of(sources: &'a Sources, root: &Path) -> Self {
        let mut tree = Self { sources, modules: Vec::new() };
        tree.read_file(root, root.parent().unwrap(), None, "crate".to_owned());
        tree
    }

    /// Reads a module that fills a file. The files of its children lie in `folder`.
    fn read_file(&mut self, file: &Path, folder: &Path, parent: Option<usize>, name: String) -> usize {
        let tokens = self.sources[file].parse().unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.read_module((name, file), folder, parent, tokens)
    }

    fn read_module(
        &mut self,
        (name, file): (String, &Path),
        folder: &Path,
        parent: Option<usize>,
        tokens: TokenStream,
    ) -> usize {
        let id = self.modules.len();
        self.modules.push(Module { name, file: file.to_path_buf(), parent, ..Module::default() });
        self.read(id, folder, tokens, true);
        id
    }

    /// Reads code of a module, which stands directly in it or deeper.
    fn read(&mut self, id: usize, folder: &Path, tokens: TokenStream, is_top: bool) {
        let tokens: Vec<TokenTree> = tokens.into_iter().collect();
        let word = |k: usize| tokens.get(k).map(ToString::to_string).unwrap_or_default();
        let (mut k, mut path, mut colons, mut is_public) = (0, Segments::new(), 0, false);
        while k < tokens.len() {
            let (here, next) = (word(k), word(k + 1));
            k += 1;
            if here == ":" {
                colons += 1;
                continue;
            }
            let is_word = matches!(tokens[k - 1], TokenTree::Ident(_));
            if !is_word || colons != 2 {
                self.mention(id, std::mem::take(&mut path));
            }
            match &tokens[k - 1] {
                TokenTree::Punct(_) if here == "#" && k < tokens.len() && is_test(&tokens[k]) => {
                    k += 1 + skip_item(&tokens[k + 1..]);
                }
                TokenTree::Ident(_) if here == "pub" => {
                    // `pub(in crate::a)` imports nothing.
                    is_public = true;
                    k += usize::from(next.starts_with('('));
                    continue;
                }
                TokenTree::Ident(_) if here == "use" && next != "<" => {
                    let end = k + tokens[k..].iter().position(|token| token.to_string() == ";").unwrap();
                    self.import(id, &tokens[k..end], Segments::new(), is_public);
                    k = end;
                }
                TokenTree::Ident(_) if here == "mod" && is_top => {
                    let inner = folder.join(&next);
                    let places = [inner.with_extension("rs"), inner.join("mod.rs")];
                    let name = format!("{}::{next}", self.modules[id].name);
                    let child = if let Some(TokenTree::Group(group)) = tokens.get(k + 1) {
                        let file = self.modules[id].file.clone();
                        Some(self.read_module((name, &file), &inner, Some(id), group.stream()))
                    } else {
                        // One that lies elsewhere, by its `#[path]`, is no file of the package.
                        let file = places.into_iter().find(|file| self.sources.contains_key(file));
                        file.map(|file| self.read_file(&file, &inner, Some(id), name))
                    };
                    self.modules[id].children.extend(child.map(|child| (next, child)));
                    k += 2;
                }
                TokenTree::Ident(_) if colons == 2 && path.is_empty() => path.push(String::new()),
                TokenTree::Ident(_) => path.push(here),
                TokenTree::Group(group) => self.read(id, folder, group.stream(), false),
                // Attributes of serde name functions in strings.
                TokenTree::Literal(_) => {
                    self.mention(id, here.trim_matches('"').split("::").map(str::to_owned).collect());
                }
                TokenTree::Punct(_) => {}
            }
            (colons, is_public) = (0, false);
        }
        self.mention(id, path);
    }

    /// A path that begins with no name is one of another crate.
    fn mention(&mut self, id: usize, path: Segments) {
        if path.len() > 1 && !path[0].is_empty() {
            self.modules[id].mentions.insert(path);
        }
    }

    /// The names of the tree of a `use`.
    fn import(&mut self, id: usize, tree: &[TokenTree], mut path: Segments, is_public: bool) {
        let words: Vec<String> = tree.iter().map(ToString::to_string).collect();
        if words.first().is_some_and(|word| word == ":") && path.is_empty() {
            return;
        }
        for (k, token) in tree.iter().enumerate() {
            match token {
                TokenTree::Group(group) => {
                    let inner: Vec<TokenTree> = group.stream().into_iter().collect();
                    for one in inner.split(|token| token.to_string() == ",").filter(|one| !one.is_empty()) {
                        self.import(id, one, path.clone(), is_public);
                    }
                    return;
                }
                TokenTree::Ident(_) if words[k] == "as" => break,
                TokenTree::Ident(_) if words[k] == "self" && k > 0 => {}
                TokenTree::Ident(_) => path.push(words[k].clone()),
                _ => {}
            }
        }
        if path.len() > 1 && path.last().is_some_and(|last| last == "self") {
            path.pop();
        }
        let renamed = words.len() > 2 && words[words.len() - 2] == "as";
        let name = if renamed { words.last() } else { path.last() }.unwrap().clone();
        self.modules[id].imports.push((name, path, is_public));
    }

    /// The module that a path names, as it is written, and the name that it takes from there; `None` for what is local.
    /// `open` holds the names that are being looked up, so that imports in a loop end.
    fn resolve(&self, at: usize, path: &[String], open: &mut Vec<String>) -> Option<(usize, Option<String>)> {
        let (first, rest) = path.split_first()?;
        let mut module = match first.as_str() {
            "crate" => 0,
            "self" => at,
            "super" => self.modules[at].parent?,
            name => self.module_named(at, name, open)?,
        };
        for name in rest {
            module = match (name.as_str(), self.modules[module].children.get(name)) {
                ("super", _) => self.modules[module].parent?,
                (_, Some(child)) => *child,
                (name, None) => return Some((module, Some(name.to_owned()))),
            };
        }
        Some((module, None))
    }

    /// The module that a name stands for in another: its child, or one that it imports.
    fn module_named(&self, at: usize, name: &str, open: &mut Vec<String>) -> Option<usize> {
        if let Some(child) = self.modules[at].children.get(name) {
            return Some(*child);
        }
        if open.iter().any(|open| open == name) {
            return None;
        }
        let (_, path, _) = self.modules[at].imports.iter().find(|import| import.0 == name)?;
        open.push(name.to_owned());
        let found = self.resolve(at, path, open);
        open.pop();
        found.filter(|found| found.1.is_none()).map(|(module, _)| module)
    }

    /// A module and those that it lies in, the root first.
    fn line(&self, module: usize) -> Vec<usize> {
        let mut line: Vec<usize> =
            std::iter::successors(Some(module), |&at| self.modules[at].parent).collect();
        line.reverse();
        line
    }

    /// What one module takes from another, as said of the two in their lines that stand side by side. The code of a module that
    /// others lie in stands for itself.
    fn side_by_side(&self, user: usize, used: usize) -> (usize, usize) {
        let lines = [user, used].map(|module| self.line(module));
        let common = lines[0].iter().zip(&lines[1]).take_while(|(a, b)| a == b).count();
        let [user, used] = lines.map(|line| line.get(common).copied().unwrap_or(line[common - 1]));
        (user, used)
    }
}

/// What the modules of a package take from each other.
fn imports(sources: &Sources) -> Imports {
    let mut all = Imports::new();
    let roots = sources.keys().filter(|file| file.ends_with("src/lib.rs") || file.ends_with("src/main.rs"));
    for tree in roots.map(|root| Tree::of(sources, root)) {
        for (id, module) in tree.modules.iter().enumerate() {
            let imports = module.imports.iter().map(|(_, path, is_public)| (path, *is_public));
            for (path, is_public) in imports.chain(module.mentions.iter().map(|path| (path, false))) {
                let Some((from, name)) = tree.resolve(id, path, &mut Vec::new()) else { continue };
                let (user, used) = tree.side_by_side(id, from);
                // A parent that only hands on the names of its children uses none of them.
                let hands_on = is_public && user == id && tree.line(used).contains(&id);
                if user != used && !hands_on {
                    let names = [user, used].map(|module| tree.modules[module].name.clone());
                    let name = name.unwrap_or_else(|| path[path.len() - 1].clone());
                    all.entry(names.into()).or_default().insert(name);
                }
            }
        }
    }
    all
}

/// The modules that can be reached from a module.
fn reached<'a>(used_by: &BTreeMap<&String, Vec<&'a String>>, from: &String) -> BTreeSet<&'a String> {
    let mut found = BTreeSet::new();
    let mut open = used_by[from].clone();
    while let Some(module) = open.pop() {
        if found.insert(module) {
            open.extend(used_by.get(module).into_iter().flatten());
        }
    }
    found
}

/// Every largest set of modules each of which reaches every other: a line for each import in it.
fn circles(imports: &Imports) -> Vec<Vec<String>> {
    let mut used_by: BTreeMap<&String, Vec<&String>> = BTreeMap::new();
    imports.keys().for_each(|(user, used)| used_by.entry(user).or_default().push(used));
    let reach: BTreeMap<&String, _> = used_by.keys().map(|user| (*user, reached(&used_by, user))).collect();
    let mut circles = Vec::new();
    for (module, ahead) in &reach {
        let back = |other: &&&String| reach.get(**other).is_some_and(|back| back.contains(*module));
        let circle: BTreeSet<&String> = ahead.iter().filter(back).copied().collect();
        // Once, at the first of its modules.
        if circle.first() == Some(module) {
            let inside =
                imports.iter().filter(|((user, used), _)| circle.contains(user) && circle.contains(used));
            let line = |((user, used), names): (&(String, String), &BTreeSet<String>)| {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                format!("{user} -> {used}: {}", names.join(", "))
            };
            circles.push(inside.map(line).collect());
        }
    }
    circles
}

#[test]
fn no_modules_of_a_crate_import_each_other_in_a_loop() {
    let (mut found, mut edges) = (Vec::new(), 0);
    for folder in crate_folders().into_iter().chain([workspace().join("xtask")]) {
        let read = |file: PathBuf| {
            let text = std::fs::read_to_string(&file).unwrap();
            (file.strip_prefix(workspace()).unwrap().to_path_buf(), text)
        };
        let sources = rust_files(&folder.join("src")).into_iter().map(read).collect();
        let imports = imports(&sources);
        println!("{}: {} imports", folder.display(), imports.len());
        edges += imports.len();
        let title = |circle: Vec<String>| format!("{}\n  {}", folder.display(), circle.join("\n  "));
        found.extend(circles(&imports).into_iter().map(title));
    }
    assert!(edges > 500, "the imports were to be found: {edges}");
    assert!(found.is_empty(), "modules that import each other in a loop:\n{}", found.join("\n\n"));
}

/// The lines of the circles of a crate of these files, each named below `src`.
fn lines_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
    let sources =
        files.iter().map(|(name, text)| (Path::new("src").join(name), (*text).to_owned())).collect();
    circles(&imports(&sources))
}

#[test]
fn circles_are_found_with_the_names_that_make_them() {
    for (files, lines) in [
        (
            &[
                ("lib.rs", "mod a; mod b; mod apart;"),
                ("a.rs", "use crate::b::{self, B, C}; pub struct A(B, C);"),
                ("b.rs", "use std::fmt; use crate::{a::A as Other}; pub struct B; pub struct C;"),
                ("apart.rs", "use crate::{a::A, b::B};"),
            ][..],
            &["crate::a -> crate::b: B, C, b", "crate::b -> crate::a: A"][..],
        ),
        (
            &[
                ("lib.rs", "mod a;"),
                ("a/mod.rs", "mod child; pub struct Shared; fn f() { child::g(); }"),
                ("a/child.rs", "use super::Shared; pub fn g() {}"),
            ],
            &["crate::a -> crate::a::child: g", "crate::a::child -> crate::a: Shared"],
        ),
        // No file is in a loop, but the rooms are.
        (
            &[
                ("lib.rs", "mod a; mod b;"),
                ("a/mod.rs", "mod low; mod high; pub use low::Low; pub use high::High;"),
                ("a/low.rs", "pub struct Low;"),
                ("a/high.rs", "use crate::b::B; pub struct High(B);"),
                ("b.rs", "use crate::a::Low; pub struct B(Low);"),
            ],
            &["crate::a -> crate::b: B", "crate::b -> crate::a: Low"],
        ),
        // A name that a parent hands on is the parent's.
        (
            &[
                ("lib.rs", "mod a; mod b; pub use a::A; fn f() { b::g() }"),
                ("a.rs", "pub struct A;"),
                ("b.rs", "use crate::A; pub fn g() {}"),
            ],
            &["crate -> crate::b: g", "crate::b -> crate: A"],
        ),
    ] {
        let found = lines_of(files);
        assert_eq!(found.len(), 1, "{found:?}");
        assert_eq!(found[0], lines);
    }
}

#[test]
fn paths_in_code_types_macros_and_attributes_count_and_those_of_tests_do_not() {
    let first = "use crate::b; pub enum A { Variant } pub fn g(_: u8) { b::B; }";
    for (second, count) in [
        ("fn f() { crate::a::g(1) }", 1),
        ("fn f(x: Vec<Option<crate::a::A>>) {}", 1),
        ("fn f() { println!(\"{}\", crate::a::g(1)) }", 1),
        ("use crate::a; fn f() { assert!(matches!(x, [a::A::Variant, ..]), \"no\") }", 1),
        ("#[derive(Serialize)] struct S { #[serde(with = \"crate::a::g\")] field: u8 }", 1),
        ("fn f() { use crate::a::A; }", 1),
        ("impl crate::a::A { fn f() {} }", 1),
        ("pub use crate::a::X;", 1),
        ("#[cfg(test)] mod tests { use crate::a::A; }", 0),
        ("#[cfg(test)] use crate::a::A;", 0),
        ("impl B { #[cfg(test)] fn f(_: crate::a::A) {} }", 0),
        ("pub(in crate::a) struct S;", 0),
        ("use ::a::A; use other::a::A as Other;", 0),
        ("fn f() { a::g() }", 0),
    ] {
        let second = format!("{second} pub struct B;");
        let found =
            lines_of(&[("lib.rs", "mod a; mod b; pub use a::A;"), ("a.rs", first), ("b.rs", &second)]);
        assert_eq!(found.len(), count, "{second}: {found:?}");
    }
}
