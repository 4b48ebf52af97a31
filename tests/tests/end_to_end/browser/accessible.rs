//! The page as a screen reader has it.

use serde_json::{Value, json};

use super::Page;

impl Page<'_> {
    /// The parts that are not ignored, each with its role and its name, in the order of the page. Roles are Chromium's words:
    /// `RootWebArea` (its name is the page's title), `region` (a section with a name), `heading`, `columnheader`, `image`,
    /// `StaticText` and so on; a name is computed from labels, captions or text.
    pub(crate) fn accessible(&self) -> Vec<(String, String)> {
        let answer = self.call("Accessibility.getFullAXTree", &json!({}));
        let nodes = answer["nodes"].as_array().unwrap().iter().filter(|node| node["ignored"] != true);
        let text = |value: &Value| value["value"].as_str().unwrap_or_default().to_owned();
        nodes.map(|node| (text(&node["role"]), text(&node["name"]))).collect()
    }

    /// Whether a part with this role has this text in its name.
    pub(crate) fn has(&self, role: &str, name: &str) -> bool {
        self.accessible().iter().any(|part| part.0 == role && part.1.contains(name))
    }
}
