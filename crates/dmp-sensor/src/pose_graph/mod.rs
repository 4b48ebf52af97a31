//! Pose graphs: where the body was at some instants, and what was measured between them.

mod components;
mod error;
#[cfg(test)]
mod tests;

pub use components::{Component, Disconnected};
pub use error::{EdgeFault, PoseGraphError};

use nalgebra::{Isometry3, Matrix6, SymmetricEigen};
use std::collections::{BTreeMap, BTreeSet};

/// A measurement between two vertices of a [`PoseGraph`].
#[derive(Debug, Clone, PartialEq)]
pub struct PoseEdge {
    /// The vertex in whose frame the other one was measured.
    pub from: i64,
    /// The vertex that was measured.
    pub to: i64,
    /// The pose of `to` in the frame of `from`, metres.
    pub from_from_to: Isometry3<f64>,
    /// The inverse covariance of the measurement error, in the order of g2o: x, y, z in metres, then x, y, z of the
    /// unit quaternion, which for small angles are half of them in radians.
    pub information: Matrix6<f64>,
}

impl AsRef<[PoseEdge]> for PoseEdge {
    fn as_ref(&self) -> &[Self] {
        std::slice::from_ref(self)
    }
}

/// Vertices with poses, edges between them, and which vertices are held where they are.
///
/// Every edge leads between two different vertices that are there and has a symmetric positive definite
/// information; every number is finite. Two vertices may have several edges. Nothing is said of connections:
/// see [`PoseGraph::components`].
#[derive(Debug, Clone, PartialEq)]
pub struct PoseGraph {
    ids: Vec<i64>,
    world_from_body: Vec<Isometry3<f64>>,
    edges: Vec<PoseEdge>,
    fixed: Vec<i64>,
}

impl PoseGraph {
    /// The information of a measurement of which nothing is known: standard deviations of one metre and one radian.
    pub fn unit_information() -> Matrix6<f64> {
        Self::information_of(1.0, 1.0)
    }

    /// The information of a measurement with these standard deviations along and about each axis, metres and radians.
    pub fn information_of(place_m: f64, turn_rad: f64) -> Matrix6<f64> {
        // What is small of a quaternion is half an angle. Squared last, so that 0.1 m is 100 and not a little less.
        let (root, root_of_turn) = (1.0 / place_m, 2.0 / turn_rad);
        let (place, turn) = (root * root, root_of_turn * root_of_turn);
        Matrix6::from_diagonal(&[place, place, place, turn, turn, turn].into())
    }

    /// A graph of poses `world_from_body` by id, edges, and the ids of the vertices that are held.
    ///
    /// # Errors
    /// When there is no vertex, a pose is not finite, an edge has an [`EdgeFault`], or a vertex to hold is not there.
    pub fn new(
        vertices: BTreeMap<i64, Isometry3<f64>>,
        edges: Vec<PoseEdge>,
        fixed: BTreeSet<i64>,
    ) -> Result<Self, PoseGraphError> {
        if vertices.is_empty() {
            return Err(PoseGraphError::Empty);
        }
        if let Some(id) = fixed.iter().find(|id| !vertices.contains_key(id)) {
            return Err(PoseGraphError::UnknownFixed { id: *id });
        }
        let (ids, world_from_body): (Vec<_>, Vec<_>) = vertices.into_iter().unzip();
        check_finite(&ids, &world_from_body)?;
        let fixed = fixed.into_iter().collect();
        let graph = Self { ids, world_from_body, edges: Vec::new(), fixed };
        for (index, edge) in edges.iter().enumerate() {
            graph.check_edge(edge).map_err(|fault| PoseGraphError::Edge {
                index,
                from: edge.from,
                to: edge.to,
                fault,
            })?;
        }
        Ok(Self { edges, ..graph })
    }

    /// The same graph with other poses, one a vertex in the order of the ids.
    ///
    /// # Errors
    /// When there are more or fewer poses than vertices, or one is not finite.
    pub fn with_poses(&self, world_from_body: Vec<Isometry3<f64>>) -> Result<Self, PoseGraphError> {
        if world_from_body.len() != self.ids.len() {
            let (poses, vertices) = (world_from_body.len(), self.ids.len());
            return Err(PoseGraphError::OtherCount { poses, vertices });
        }
        check_finite(&self.ids, &world_from_body)?;
        Ok(Self { world_from_body, ..self.clone() })
    }

    /// The same graph with another edge, behind the others.
    ///
    /// # Errors
    /// When it is none that the graph can have.
    pub fn with_edge(&self, edge: PoseEdge) -> Result<Self, PoseGraphError> {
        let (index, from, to) = (self.edges.len(), edge.from, edge.to);
        self.check_edge(&edge).map_err(|fault| PoseGraphError::Edge { index, from, to, fault })?;
        let mut graph = self.clone();
        graph.edges.push(edge);
        Ok(graph)
    }

    /// The ids of the vertices, increasing; at least one.
    pub fn ids(&self) -> &[i64] {
        &self.ids
    }

    /// The poses of the vertices, `world_from_body`, in the order of the ids.
    pub fn poses(&self) -> &[Isometry3<f64>] {
        &self.world_from_body
    }

    /// The edges, in the order in which they were given.
    pub fn edges(&self) -> &[PoseEdge] {
        &self.edges
    }

    /// The ids of the vertices that are held where they are, increasing; there may be none.
    pub fn fixed(&self) -> &[i64] {
        &self.fixed
    }

    /// Where a vertex stands in the order of the ids.
    pub fn index_of(&self, id: i64) -> Option<usize> {
        self.ids.binary_search(&id).ok()
    }

    /// Whether the edge could be one of this graph.
    ///
    /// # Errors
    /// With what is wrong with the edge.
    pub fn check_edge(&self, edge: &PoseEdge) -> Result<(), EdgeFault> {
        if let Some(id) = [edge.from, edge.to].into_iter().find(|id| self.index_of(*id).is_none()) {
            return Err(EdgeFault::UnknownVertex { id });
        }
        if edge.from == edge.to {
            return Err(EdgeFault::SameVertex { id: edge.from });
        }
        if !is_finite(&edge.from_from_to) {
            return Err(EdgeFault::NotFinite);
        }
        check_information(&edge.information)
    }
}

fn check_finite(ids: &[i64], poses: &[Isometry3<f64>]) -> Result<(), PoseGraphError> {
    match ids.iter().zip(poses).find(|(_, pose)| !is_finite(pose)) {
        None => Ok(()),
        Some((id, _)) => Err(PoseGraphError::NotFinite { id: *id }),
    }
}

fn is_finite(pose: &Isometry3<f64>) -> bool {
    pose.translation.vector.iter().chain(pose.rotation.coords.iter()).all(|c| c.is_finite())
}

fn check_information(information: &Matrix6<f64>) -> Result<(), EdgeFault> {
    if !information.iter().all(|c| c.is_finite()) {
        return Err(EdgeFault::NotFinite);
    }
    if *information != information.transpose() {
        return Err(EdgeFault::NotSymmetric);
    }
    if information.cholesky().is_none() {
        // A symmetric matrix of six rows takes some ten sweeps.
        let eigen = SymmetricEigen::try_new(*information, f64::EPSILON, 1000);
        return Err(EdgeFault::NotPositiveDefinite { least: eigen.map(|eigen| eigen.eigenvalues.min()) });
    }
    Ok(())
}
