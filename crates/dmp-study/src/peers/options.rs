//! The settings of the metrics.

/// The settings of all three metrics. The default is map-metrics' `LidarConfig`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeerOptions {
    /// Points closer than this are neighbours, metres (`KNN_RAD`).
    pub radius_m: f64,
    /// MME and MPV use points with more neighbours than this, themselves included (`MIN_KNN`).
    pub min_neighbours: usize,
    /// MME and MPV look at every n-th point of the cloud, in the order given.
    pub query_step: usize,
    /// A normal comes from at most so many nearest neighbours (`MAX_NN`).
    pub normal_neighbours: usize,
    /// A direction of MOM has more planar points than this (`MIN_CLUST_SIZE`).
    pub min_cluster: usize,
    /// MOM clusters at most so many planar points.
    pub max_clustered: usize,
}

impl Default for PeerOptions {
    fn default() -> Self {
        Self {
            radius_m: 1.0,
            min_neighbours: 5,
            query_step: 1,
            normal_neighbours: 30,
            min_cluster: 5,
            max_clustered: 10_000,
        }
    }
}
