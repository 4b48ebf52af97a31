//! The modules of a crate as its sources declare them: what each defines, imports and names. Test code is left out.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::visit::{self, Visit};

use super::Sources;

/// The segments of a path, as it is written.
pub(super) type Segments = Vec<String>;

#[derive(Debug, Default)]
pub(super) struct Module {
    pub(super) file: PathBuf,
    pub(super) parent: Option<usize>,
    pub(super) children: BTreeMap<String, usize>,
    /// Names of the functions, types, constants, traits and macros that it defines.
    pub(super) items: BTreeSet<String>,
    pub(super) imports: Vec<Import>,
    /// Every path that its code names, but for those of imports.
    pub(super) mentions: BTreeSet<Segments>,
}

/// One name of a `use`.
#[derive(Debug)]
pub(super) struct Import {
    /// As it is known here; `*` for all names of a module.
    pub(super) name: String,
    pub(super) path: Segments,
    /// It has a visibility, so that others can take the name from here.
    pub(super) is_reexport: bool,
}

/// The modules below a root file; the first is the root.
pub(super) fn modules(sources: &Sources, root: &Path) -> Vec<Module> {
    let mut reader = Reader { sources, modules: Vec::new(), at: 0, serde: false };
    let folder = root.parent().unwrap();
    reader.read_file(root, folder, None);
    reader.modules
}

struct Reader<'a> {
    sources: &'a Sources,
    modules: Vec<Module>,
    /// The module that is being read.
    at: usize,
    /// Within an attribute of serde, which names functions in strings.
    serde: bool,
}

impl Reader<'_> {
    /// Reads a module that fills a file. The files of its children lie in `folder`.
    fn read_file(&mut self, file: &Path, folder: &Path, parent: Option<usize>) -> usize {
        let text = &self.sources[file];
        let parsed = syn::parse_file(text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        self.read_items(file, folder, parent, &parsed.items)
    }

    fn read_items(
        &mut self,
        file: &Path,
        folder: &Path,
        parent: Option<usize>,
        items: &[syn::Item],
    ) -> usize {
        let id = self.modules.len();
        self.modules.push(Module { file: file.to_path_buf(), parent, ..Module::default() });
        for item in items.iter().filter(|item| !is_test(attributes(item))) {
            if let syn::Item::Mod(module) = item {
                let name = module.ident.to_string();
                let inner = folder.join(&name);
                let child = if let Some((_, items)) = &module.content {
                    self.read_items(file, &inner, Some(id), items)
                } else {
                    let candidates = [inner.with_extension("rs"), inner.join("mod.rs")];
                    let file = candidates.into_iter().find(|file| self.sources.contains_key(file));
                    let file = file.unwrap_or_else(|| panic!("no file of module {}", inner.display()));
                    self.read_file(&file, &inner, Some(id))
                };
                self.modules[id].children.insert(name, child);
            } else {
                self.at = id;
                self.modules[id].items.extend(name_of(item));
                self.visit_item(item);
            }
        }
        id
    }

    fn import(&mut self, tree: &syn::UseTree, mut path: Segments, is_reexport: bool) {
        let name = match tree {
            syn::UseTree::Path(step) => {
                path.push(step.ident.to_string());
                return self.import(&step.tree, path, is_reexport);
            }
            syn::UseTree::Group(group) => {
                return group.items.iter().for_each(|tree| self.import(tree, path.clone(), is_reexport));
            }
            syn::UseTree::Name(leaf) if leaf.ident == "self" => path.last().unwrap().clone(),
            syn::UseTree::Name(leaf) => {
                path.push(leaf.ident.to_string());
                leaf.ident.to_string()
            }
            syn::UseTree::Rename(leaf) => {
                if leaf.ident != "self" {
                    path.push(leaf.ident.to_string());
                }
                leaf.rename.to_string()
            }
            syn::UseTree::Glob(_) => "*".to_owned(),
        };
        self.modules[self.at].imports.push(Import { name, path, is_reexport });
    }

    /// The paths among the tokens of a macro or an attribute.
    fn read_tokens(&mut self, tokens: TokenStream) {
        let mut path = Segments::new();
        let mut colons = 0;
        for token in tokens {
            match &token {
                TokenTree::Punct(punct) if punct.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                TokenTree::Ident(ident) => {
                    if colons != 2 {
                        self.modules[self.at].mentions.insert(std::mem::take(&mut path));
                    }
                    path.push(ident.to_string());
                }
                TokenTree::Group(group) => self.read_tokens(group.stream()),
                TokenTree::Literal(literal) if self.serde => {
                    let text = literal.to_string();
                    if let Ok(path) = syn::parse_str::<syn::Path>(text.trim_matches('"')) {
                        self.visit_path(&path);
                    }
                }
                _ => {}
            }
            if !matches!(token, TokenTree::Ident(_)) {
                self.modules[self.at].mentions.insert(std::mem::take(&mut path));
            }
            colons = 0;
        }
        self.modules[self.at].mentions.insert(path);
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        if !is_test(attributes(item)) {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        if !is_test(&function.attrs) {
            visit::visit_impl_item_fn(self, function);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        // `::name` is another crate.
        if item.leading_colon.is_none() {
            self.import(&item.tree, Segments::new(), !matches!(item.vis, syn::Visibility::Inherited));
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        if path.leading_colon.is_none() {
            let segments = path.segments.iter().map(|segment| segment.ident.to_string()).collect();
            self.modules[self.at].mentions.insert(segments);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.visit_path(&call.path);
        self.read_tokens(call.tokens.clone());
    }

    fn visit_attribute(&mut self, attribute: &'ast syn::Attribute) {
        if let syn::Meta::List(list) = &attribute.meta {
            self.serde = list.path.is_ident("serde");
            self.read_tokens(list.tokens.clone());
            self.serde = false;
        }
    }

    /// `pub(in crate::a)` imports nothing.
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
}

/// `#[test]` or `#[cfg(test)]` stands above it.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let of_cfg = |list: &syn::MetaList| list.path.is_ident("cfg") && list.tokens.to_string() == "test";
        attribute.path().is_ident("test") || attribute.meta.require_list().is_ok_and(of_cfg)
    })
}

fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    match item {
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Enum(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Macro(item) => &item.attrs,
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Static(item) => &item.attrs,
        syn::Item::Struct(item) => &item.attrs,
        syn::Item::Trait(item) => &item.attrs,
        syn::Item::Type(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

fn name_of(item: &syn::Item) -> Option<String> {
    let ident = match item {
        syn::Item::Const(item) => &item.ident,
        syn::Item::Enum(item) => &item.ident,
        syn::Item::Fn(item) => &item.sig.ident,
        syn::Item::Macro(item) => item.ident.as_ref()?,
        syn::Item::Static(item) => &item.ident,
        syn::Item::Struct(item) => &item.ident,
        syn::Item::Trait(item) => &item.ident,
        syn::Item::Type(item) => &item.ident,
        syn::Item::Union(item) => &item.ident,
        _ => return None,
    };
    Some(ident.to_string())
}
