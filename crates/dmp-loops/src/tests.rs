//! What several tests need: a small drive with its log, its graph and loop candidates.

use std::sync::LazyLock;

use dmp::Config;
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, MemoryLog, ScanLog as _, outline_log};
use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use dmp_sim::{
    LidarOptions, LoopGraph, LoopGraphOptions, LoopKind, Recording, RecordingOptions, Route, SimulatedLoop,
};

use crate::{Keyframes, LoopMap, MapOptions, OptimiseOptions, optimised};

/// A drive twice round a block, with some scans for every keyframe.
#[derive(Debug)]
pub(crate) struct Drive {
    pub(crate) log: MemoryLog,
    pub(crate) keyframes: Keyframes,
    /// Odometry without loops, optimised.
    pub(crate) graph: PoseGraph,
    pub(crate) candidates: Vec<SimulatedLoop>,
    pub(crate) config: Config,
}

pub(crate) static DRIVE: LazyLock<Drive> = LazyLock::new(|| {
    let lidar = LidarOptions { azimuth_steps: 60, rate_hz: 4.0, ..LidarOptions::with_beams(16) };
    let options =
        RecordingOptions { seed: 3, scans: 240, route: Route::TwoLaps, speed_m_s: 6.0, traffic: 0, lidar };
    let town = options.town().unwrap();
    let recording = Recording::new(&town, &options).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("drive.mcap");
    let mut writer = McapScanWriter::create(&path, &McapWriterOptions::default()).unwrap();
    recording.scans().for_each(|scan| writer.write_scan(&scan).unwrap());
    writer.finish().unwrap();
    let all: Vec<usize> = (0..recording.len()).collect();
    let log = outline_log(&path, &LogOptions::default()).unwrap().load(&all).unwrap();

    let instants_ns = log.frames().iter().map(|frame| frame.stamp_ns.unwrap()).collect();
    let options = LoopGraphOptions {
        spacing_m: 2.5,
        instants_ns: Some(instants_ns),
        true_loops: 4,
        false_loops: 4,
        near_loops: 2,
        ..LoopGraphOptions::default()
    };
    let truth = recording.drive().trajectory(20.0).unwrap();
    let LoopGraph { graph, truth, candidates } = LoopGraph::new(&truth, &options).unwrap();
    let (graph, _) = optimised(&graph, &OptimiseOptions::default()).unwrap();
    let keyframes = Keyframes::of(&graph, truth.stamps_ns(), &log, 0).unwrap();
    // Places that do not see each other.
    let config = Config {
        threads: 2,
        max_range_m: Some(30.0),
        work_folder: std::env::temp_dir(),
        ..Config::default()
    };
    Drive { log, keyframes, graph, candidates, config }
});

impl Drive {
    /// The map of the graph at these poses.
    pub(crate) fn map_at(&self, world_from_body: &[Isometry3<f64>], options: MapOptions) -> LoopMap {
        LoopMap::new(&self.log, &self.keyframes, world_from_body, &self.config, options, &()).unwrap()
    }

    /// The first candidate of a kind.
    pub(crate) fn first(&self, kind: LoopKind) -> &PoseEdge {
        &self.candidates.iter().find(|candidate| candidate.kind == kind).unwrap().edge
    }

    pub(crate) fn edges(&self) -> Vec<PoseEdge> {
        self.candidates.iter().map(|candidate| candidate.edge.clone()).collect()
    }
}

/// Vertices of these poses with the ids 0, 1, 2, … and exact steps from each to the next with this information.
pub(crate) fn chain(world_from_body: &[Isometry3<f64>], information: &dmp_sensor::Matrix6<f64>) -> PoseGraph {
    let steps = world_from_body.windows(2).enumerate().map(|(k, pair)| PoseEdge {
        from: k as i64,
        to: k as i64 + 1,
        from_from_to: pair[0].inv_mul(&pair[1]),
        information: *information,
    });
    let vertices = (0..).zip(world_from_body.iter().copied()).collect();
    PoseGraph::new(vertices, steps.collect(), std::collections::BTreeSet::new()).unwrap()
}
