//! The page as a screen reader has it.

use std::collections::HashMap;

use serde_json::{Value, json};

use super::Page;

/// A part of the page that is told of.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Node {
    /// `RootWebArea` (its name is the page's title), `main`, `region` (a section with a name), `heading`,
    /// `table`, `columnheader`, `rowheader`, `cell`, `figure`, `image`, `link`, `paragraph`, `StaticText`,
    /// `DisclosureTriangle` (a `<summary>`) and so on: Chromium's words.
    pub(crate) role: String,
    /// The name computed from labels, captions or text.
    pub(crate) name: String,
    pub(crate) description: String,
    /// Of a heading: 1 to 6.
    pub(crate) level: Option<u64>,
    /// The place in the list of the part that this one lies in.
    pub(crate) parent: Option<usize>,
}

impl Page<'_> {
    /// All parts that are not ignored, each behind the one that it lies in. Lines of text are left out: their
    /// `StaticText` says the same.
    pub(crate) fn accessible(&self) -> Vec<Node> {
        let answer = self.call("Accessibility.getFullAXTree", &json!({}));
        let raw = answer["nodes"].as_array().unwrap();
        let by_id: HashMap<&Value, &Value> = raw.iter().map(|node| (&node["nodeId"], node)).collect();
        let told = |node: &Value| node["ignored"] != true && node["role"]["value"] != "InlineTextBox";
        let text = |value: &Value| value["value"].as_str().unwrap_or_default().to_owned();
        let mut nodes = Vec::new();
        // Depth first, children in the order of the page.
        let mut waiting = vec![(&raw[0], None)];
        while let Some((node, parent)) = waiting.pop() {
            let mut below = parent;
            if told(node) {
                below = Some(nodes.len());
                let properties = node["properties"].as_array().into_iter().flatten();
                let mut level = properties.filter(|property| property["name"] == "level");
                nodes.push(Node {
                    role: text(&node["role"]),
                    name: text(&node["name"]),
                    description: text(&node["description"]),
                    level: level.find_map(|property| property["value"]["value"].as_u64()),
                    parent,
                });
            }
            let children = node["childIds"].as_array().into_iter().flatten().rev();
            waiting.extend(children.filter_map(|id| Some((*by_id.get(id)?, below))));
        }
        nodes
    }

    /// Those parts that have a role.
    pub(crate) fn all(&self, role: &str) -> Vec<Node> {
        self.accessible().into_iter().filter(|node| node.role == role).collect()
    }

    /// Whether a part with this role has this text in its name.
    pub(crate) fn has(&self, role: &str, text: &str) -> bool {
        self.all(role).iter().any(|node| node.name.contains(text))
    }
}
