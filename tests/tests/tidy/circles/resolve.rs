//! Which file defines what another names: through `crate`, `self`, `super`, imports and re-exports.
//!
//! Methods are not seen, nor a macro of a parent that is called without a path.

use std::path::{Path, PathBuf};

use super::Sources;
use super::graph::Imports;
use super::read::{Module, modules};

#[derive(Clone, Debug)]
enum Found {
    Module(usize),
    /// The module that defines a name, and the name.
    Item(usize, String),
}

/// What the files of a package take from each other.
pub(super) fn imports(sources: &Sources) -> Imports {
    let mut imports = Imports::new();
    for root in sources.keys().filter(|file| is_root(file)) {
        let tree = Tree { modules: modules(sources, root) };
        for (id, module) in tree.modules.iter().enumerate() {
            let mut note = |(home, name): (usize, String)| {
                let used = &tree.modules[home].file;
                if *used != module.file {
                    let edge: (PathBuf, PathBuf) = (module.file.clone(), used.clone());
                    imports.entry(edge).or_default().insert(name);
                }
            };
            for import in &module.imports {
                let found = tree.items(id, &import.path).into_iter();
                // A parent that only hands on the names of its children uses none of them.
                found
                    .filter(|(home, _)| !(import.is_reexport && tree.is_below(*home, id)))
                    .for_each(&mut note);
            }
            module.mentions.iter().flat_map(|path| tree.items(id, path)).for_each(&mut note);
        }
    }
    imports
}

fn is_root(file: &Path) -> bool {
    ["src/lib.rs", "src/main.rs"].iter().any(|root| file.ends_with(root))
}

struct Tree {
    modules: Vec<Module>,
}

impl Tree {
    /// The items that a path may mean in a module, each with the module that defines it.
    fn items(&self, module: usize, path: &[String]) -> Vec<(usize, String)> {
        let found = self.resolve(module, path, &mut Vec::new()).into_iter();
        found
            .filter_map(|found| match found {
                Found::Item(home, name) => Some((home, name)),
                Found::Module(_) => None,
            })
            .collect()
    }

    fn is_below(&self, mut module: usize, above: usize) -> bool {
        while let Some(parent) = self.modules[module].parent {
            if parent == above {
                return true;
            }
            module = parent;
        }
        false
    }

    /// What a path may mean in a module. A name may stand for a module and for an item at once; both are followed.
    /// `open` holds the names that are being looked up, so that imports in a loop end.
    fn resolve<'a>(
        &'a self,
        module: usize,
        path: &'a [String],
        open: &mut Vec<(usize, &'a str)>,
    ) -> Vec<Found> {
        let Some((first, rest)) = path.split_first() else { return Vec::new() };
        let mut found = match first.as_str() {
            "crate" => vec![Found::Module(0)],
            "self" => vec![Found::Module(module)],
            "super" => self.modules[module].parent.map(Found::Module).into_iter().collect(),
            name => self.look_up(module, name, open),
        };
        for name in rest {
            // Before `::` stands a module or a type, of which one has a name; a function of that name is not meant.
            if found.iter().any(|found| matches!(found, Found::Module(_))) {
                found.retain(|found| matches!(found, Found::Module(_)));
            }
            found = found
                .into_iter()
                .flat_map(|found| match found {
                    Found::Module(at) if name == "super" => {
                        self.modules[at].parent.map(Found::Module).into_iter().collect()
                    }
                    Found::Module(at) => self.look_up(at, name, open),
                    // A variant or a function of a type: the type is what was named.
                    item @ Found::Item(..) => vec![item],
                })
                .collect();
        }
        found
    }

    /// What a name may mean in a module.
    fn look_up<'a>(&'a self, at: usize, name: &'a str, open: &mut Vec<(usize, &'a str)>) -> Vec<Found> {
        if open.contains(&(at, name)) {
            // The name stands for its own import's first segment: only what is defined here is left.
            return self.modules[at]
                .children
                .get(name)
                .map(|child| Found::Module(*child))
                .into_iter()
                .collect();
        }
        open.push((at, name));
        let module = &self.modules[at];
        let mut found: Vec<Found> =
            module.children.get(name).map(|child| Found::Module(*child)).into_iter().collect();
        if module.items.contains(name) {
            found.push(Found::Item(at, name.to_owned()));
        }
        for import in module.imports.iter().filter(|import| import.name == name) {
            found.extend(self.resolve(at, &import.path, open));
        }
        if found.is_empty() {
            for import in module.imports.iter().filter(|import| import.name == "*") {
                for found_module in self.resolve(at, &import.path, open) {
                    if let Found::Module(of) = found_module {
                        found.extend(self.look_up(of, name, open));
                    }
                }
            }
        }
        open.pop();
        found
    }
}
