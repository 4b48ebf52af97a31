//! Writing pose graphs and edges.

use super::record::{EDGE, FIX, VERTEX};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use std::io::{self, Write};

/// Writes a pose graph in g2o's text format, with all digits: [`parse_pose_graph`](super::parse_pose_graph)
/// gives the same bits back where quaternions are of length 1 but for rounding.
///
/// # Errors
/// As `out` does.
pub fn write_pose_graph(out: &mut impl Write, graph: &PoseGraph) -> io::Result<()> {
    for (id, pose) in graph.ids().iter().zip(graph.poses()) {
        write!(out, "{VERTEX} {id}")?;
        write_pose(out, pose)?;
        writeln!(out)?;
    }
    for id in graph.fixed() {
        writeln!(out, "{FIX} {id}")?;
    }
    write_pose_edges(out, graph.edges())
}

/// Writes edges as [`write_pose_graph`]: a file of loop candidates.
///
/// # Errors
/// As `out` does.
pub fn write_pose_edges(out: &mut impl Write, edges: &[PoseEdge]) -> io::Result<()> {
    for edge in edges {
        write!(out, "{EDGE} {} {}", edge.from, edge.to)?;
        write_pose(out, &edge.from_from_to)?;
        for (row, column) in (0..6).flat_map(|row| (row..6).map(move |column| (row, column))) {
            write!(out, " {}", edge.information[(row, column)])?;
        }
        writeln!(out)?;
    }
    Ok(())
}

fn write_pose(out: &mut impl Write, pose: &Isometry3<f64>) -> io::Result<()> {
    let [x, y, z] = pose.translation.vector.into();
    let [qx, qy, qz, qw]: [f64; 4] = pose.rotation.coords.into();
    write!(out, " {x} {y} {z} {qx} {qy} {qz} {qw}")
}
