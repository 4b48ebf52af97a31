//! Every crate can be published: what registries ask for is there, and says the same everywhere.

use toml::Table;

use crate::sources::{crate_folders, workspace};

fn manifest(path: &std::path::Path) -> Table {
    std::fs::read_to_string(path).unwrap().parse().unwrap()
}

#[test]
fn every_crate_has_what_a_registry_asks_for() {
    let root = manifest(&workspace().join("Cargo.toml"));
    let shared = root["workspace"]["package"].as_table().unwrap();
    for key in ["version", "license", "keywords", "categories", "rust-version", "edition"] {
        assert!(shared.contains_key(key), "{key}");
    }
    let dependencies = root["workspace"]["dependencies"].as_table().unwrap();
    for folder in crate_folders() {
        let package = manifest(&folder.join("Cargo.toml"))["package"].as_table().unwrap().clone();
        let name = package["name"].as_str().unwrap();
        for key in ["version", "license", "keywords", "categories", "rust-version", "edition"] {
            assert!(package[key]["workspace"].as_bool().unwrap(), "{name}: {key}");
        }
        assert!(!package.contains_key("publish"), "{name}");
        let description = package["description"].as_str().unwrap();
        let page = std::fs::read_to_string(folder.join(package["readme"].as_str().unwrap())).unwrap();
        assert!(
            page.starts_with(&format!("# {name}\n\n{description}.\n")),
            "{name}: its README says something else"
        );
        // Others ask for this version of it.
        let path = folder.strip_prefix(workspace()).unwrap().to_str().unwrap();
        let asked =
            dependencies.values().find(|asked| asked.get("path").and_then(|p| p.as_str()) == Some(path));
        assert_eq!(asked.unwrap()["version"], shared["version"], "{name}");
    }
}
