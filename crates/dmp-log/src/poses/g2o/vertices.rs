//! The vertices of a g2o file, gathered by their ids.

use super::Vertex;
use crate::{ParseError, PlaceInFile};
use dmp_sensor::Isometry3;
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

/// The poses of a graph by their ids, and what was odd about the order of the lines.
#[derive(Debug)]
pub(crate) struct Vertices {
    poses: BTreeMap<i64, (PlaceInFile, Isometry3<f64>)>,
    last: i64,
    /// Vertices whose id was smaller than the one before them.
    pub(crate) out_of_order: usize,
    /// Vertices that say again what was said; they were left out.
    pub(crate) repeated: usize,
}

impl Vertices {
    pub(crate) fn new() -> Self {
        Self { poses: BTreeMap::new(), last: i64::MIN, out_of_order: 0, repeated: 0 }
    }

    /// Adds a vertex. It is an error where it is no pose, or its id has another pose already.
    pub(crate) fn push(&mut self, vertex: &Vertex) -> Result<(), ParseError> {
        let (place, id, pose) = (vertex.place, vertex.id, vertex.pose()?);
        match self.poses.entry(id) {
            Entry::Vacant(vacant) => {
                vacant.insert((place, pose));
                self.out_of_order += usize::from(id < self.last);
                self.last = id;
            }
            Entry::Occupied(there) => {
                let (first, other) = there.get();
                let apart_m = (pose.translation.vector - other.translation.vector).norm();
                // The tolerance of stamps that are there twice.
                if apart_m > 1e-3 || pose.rotation.angle_to(&other.rotation) > 1e-3 {
                    let problem =
                        format!("the vertex {id} has another pose than in {first}: {apart_m:.3} m apart");
                    return Err(ParseError::new(place, problem));
                }
                self.repeated += 1;
            }
        }
        Ok(())
    }

    /// The poses by their ids.
    pub(crate) fn into_poses(self) -> BTreeMap<i64, Isometry3<f64>> {
        self.poses.into_iter().map(|(id, (_, pose))| (id, pose)).collect()
    }
}
