//! What can be wrong with a pose graph.

/// What makes an edge unusable.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EdgeFault {
    /// It leads to a vertex that the graph has not got.
    #[error("there is no vertex {id}")]
    UnknownVertex {
        /// The vertex.
        id: i64,
    },
    /// It leads from a vertex to the same.
    #[error("it leads from the vertex {id} to itself")]
    SameVertex {
        /// The vertex.
        id: i64,
    },
    /// A number of its measurement or its information is NaN or infinite.
    #[error("a number of it is not finite")]
    NotFinite,
    /// Its information differs from its transpose.
    #[error("its information is not symmetric")]
    NotSymmetric,
    /// In some direction it says nothing, or less than nothing.
    #[error("its information is not positive definite{}", smallest(*.least))]
    NotPositiveDefinite {
        /// The smallest eigenvalue of the information, where it could be found.
        least: Option<f64>,
    },
}

fn smallest(least: Option<f64>) -> String {
    least.map_or(String::new(), |least| format!(": its smallest eigenvalue is {least:.3e}"))
}

/// What makes vertices and edges no [`PoseGraph`](super::PoseGraph).
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PoseGraphError {
    /// There is no vertex at all.
    #[error("the graph has no vertices")]
    Empty,
    /// A number of a pose is NaN or infinite.
    #[error("the pose of the vertex {id} is not finite")]
    NotFinite {
        /// The vertex.
        id: i64,
    },
    /// A vertex is to be held that the graph has not got.
    #[error("the vertex {id} is to be fixed, and there is no such vertex")]
    UnknownFixed {
        /// The vertex.
        id: i64,
    },
    /// An edge is unusable.
    #[error("the edge from {from} to {to}: {fault}")]
    Edge {
        /// Its place among the edges, from 0.
        index: usize,
        /// The vertex that it starts from.
        from: i64,
        /// The vertex that it leads to.
        to: i64,
        /// What is wrong with it.
        fault: EdgeFault,
    },
    /// Poses that are not one a vertex.
    #[error("{poses} poses for {vertices} vertices")]
    OtherCount {
        /// Poses that were given.
        poses: usize,
        /// Vertices of the graph.
        vertices: usize,
    },
}
