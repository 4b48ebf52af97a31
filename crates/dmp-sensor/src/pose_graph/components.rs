//! The connected parts of a pose graph.

use super::{PoseEdge, PoseGraph};
use std::collections::BTreeMap;
use std::fmt;

/// Components that a message names; of the others it gives the number.
const NAMED: usize = 4;

/// Vertices that edges connect, one with every other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Component {
    /// How many there are.
    pub vertices: usize,
    /// The smallest of their ids.
    pub first: i64,
}

/// A graph whose edges do not connect all of its vertices, so that its parts may move against each other.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct Disconnected {
    /// The parts, the largest first; at least two.
    pub components: Vec<Component>,
}

impl fmt::Display for Disconnected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the graph is in {} parts that no edge connects: ", self.components.len())?;
        for (index, Component { vertices, first }) in self.components.iter().take(NAMED).enumerate() {
            let comma = if index > 0 { ", " } else { "" };
            let noun = if *vertices == 1 { "vertex" } else { "vertices" };
            write!(f, "{comma}{vertices} {noun} with {first}")?;
        }
        match self.components.len().saturating_sub(NAMED) {
            0 => Ok(()),
            more => write!(f, ", and {more} more"),
        }
    }
}

impl PoseGraph {
    /// The connected parts of the graph with these edges beside its own, the largest first, of equal ones that
    /// with the smallest id. Edges to vertices that are not there connect nothing.
    pub fn components(&self, extra: &[PoseEdge]) -> Vec<Component> {
        let mut forest = Forest::new(self.ids.len());
        for edge in self.edges.iter().chain(extra) {
            if let (Some(from), Some(to)) = (self.index_of(edge.from), self.index_of(edge.to)) {
                forest.join(from, to);
            }
        }
        let mut by_root: BTreeMap<usize, Component> = BTreeMap::new();
        for (index, &id) in self.ids.iter().enumerate() {
            // Ids increase, so the first that is seen is the smallest.
            let component = by_root.entry(forest.root(index)).or_insert(Component { vertices: 0, first: id });
            component.vertices += 1;
        }
        let mut components: Vec<Component> = by_root.into_values().collect();
        components.sort_by_key(|component| (usize::MAX - component.vertices, component.first));
        components
    }

    /// Whether the graph with these edges beside its own is in one part.
    ///
    /// # Errors
    /// With the parts, where there are several.
    pub fn check_connected(&self, extra: &[PoseEdge]) -> Result<(), Disconnected> {
        let components = self.components(extra);
        if components.len() == 1 { Ok(()) } else { Err(Disconnected { components }) }
    }
}

/// Disjoint sets as trees: every index leads to another of its set, the root to itself.
struct Forest(Vec<usize>);

impl Forest {
    fn new(count: usize) -> Self {
        Self((0..count).collect())
    }

    fn root(&mut self, mut index: usize) -> usize {
        while self.0[index] != index {
            // Halves the way for those who come after.
            self.0[index] = self.0[self.0[index]];
            index = self.0[index];
        }
        index
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}
