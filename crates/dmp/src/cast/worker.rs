use std::collections::HashMap;

use dmp_cast::{Answer, CastBuffers, Caster, Query};
use dmp_map::{TileId, TileTable};
use dmp_reduce::{
    Basis, DepthResidual, FrameSums, Layout, Reducer, Residuals, RunSums, Scales, SurfaceGroup,
};
use dmp_sensor::{DepthNoise, Isometry3, Ray, ReturnCounts, Scan, depth_per_range};

use super::{CastPass, TileSums};
use crate::config::Run;
use crate::error::EvaluateError;
use crate::frames::{PlannedFrame, Worker};
use crate::pose::{Poser, RunPoses};
use crate::watch::{ScoredReturns, Watch};

/// What a thread does with a scan: casts its rays and adds up what they leave.
pub(super) struct CastWorker<'a> {
    poser: Poser<'a>,
    poses: &'a [RunPoses<'a>],
    own_from_world: &'a [Isometry3<f64>],
    runs: &'a [Run],
    casters: &'a [Caster],
    watch: &'a dyn Watch,
    bases: &'a [Basis],
    /// Of a depth camera.
    depth_noise: Option<DepthNoise>,
    queries: Vec<Query>,
    answers: Vec<Vec<Answer>>,
    buffers: CastBuffers,
    /// Of the returns at hand, for every run.
    residuals: Vec<Vec<Residuals>>,
    /// Of one return, for every run.
    of_return: Vec<Residuals>,
    /// For every run, the tiles of its own frame.
    own_tiles: Vec<OwnTiles>,
    /// Of the frame's returns, for every run.
    frame_tiles: Vec<TileTable<RunSums>>,
    frame: FrameSums,
    pub(super) reducer: Reducer,
    pub(super) tiles: TileSums,
    pub(super) counts: ReturnCounts,
}

impl Worker for CastWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let Self {
            poser,
            poses,
            runs,
            casters,
            watch,
            bases,
            queries,
            answers,
            buffers,
            residuals,
            of_return,
            own_tiles,
            frame_tiles,
            own_from_world,
            ..
        } = self;
        let (depth_noise, scales) = (self.depth_noise.as_ref(), self.frame.scales());
        self.frame.clear();
        let sums = &mut self.frame;
        let own_from_sensor = |(poses, own_from_world): (&RunPoses<'_>, &Isometry3<f64>)| {
            Some(own_from_world * poses.of_frame(frame)?)
        };
        let own_from_sensor: Vec<_> =
            poses.iter().zip(own_from_world.iter()).filter_map(own_from_sensor).collect();
        let mut first = 0;
        let counts = poser.blocks_with_returns(frame, scan, |rays, returns| {
            for (run, caster) in casters.iter().enumerate() {
                let segment = (bases[run] == Basis::CrossValidated).then_some(frame.segment);
                queries.clear();
                queries.extend(rays[run].iter().map(|ray| query_of(ray, segment)));
                caster
                    .cast(queries, &mut answers[run], buffers)
                    .map_err(EvaluateError::map_of(&runs[run].name))?;
            }
            for (run, rays) in rays.iter().enumerate() {
                let of_answer = |(ray, answer): (&Ray, &Answer)| residuals_of(ray, answer, scales);
                residuals[run].clear();
                residuals[run].extend(rays.iter().zip(&answers[run]).map(of_answer));
                if let Some(noise) = depth_noise {
                    for ((residuals, ray), point) in
                        residuals[run].iter_mut().zip(rays).zip(returns.points_in_sensor_m)
                    {
                        residuals.depth =
                            residuals.first_m.map(|m| depth_residual(m, ray.range_m, *point, noise));
                    }
                }
                for (ray, residuals) in rays.iter().zip(&residuals[run]) {
                    let of_tile = frame_tiles[run].entry(own_tiles[run].of(ray.endpoint_in_world()));
                    if of_tile.returns() == 0 {
                        *of_tile = RunSums::new(scales);
                    }
                    of_tile.add(residuals);
                }
            }
            for index in 0..rays[0].len() {
                of_return.clear();
                of_return.extend(residuals.iter().map(|of_run| of_run[index]));
                sums.add_return(of_return);
            }
            let (own_from_sensor, own_from_world) = (&own_from_sensor[..], &**own_from_world);
            let frame = frame.number;
            let offsets_ns = returns.offsets_ns;
            let scored =
                ScoredReturns { frame, first, offsets_ns, own_from_sensor, own_from_world, rays, residuals };
            watch.returns_scored(&scored);
            first += offsets_ns.len();
            Ok::<(), EvaluateError>(())
        })?;
        for (run, of_run) in self.frame_tiles.iter_mut().enumerate() {
            for (tile, of_tile) in of_run.drain() {
                self.tiles.entry((run, tile)).or_default().merge(&of_tile);
            }
        }
        self.reducer.add_frame(ordinal as u64, &self.frame)?;
        self.watch.frame_scored(frame.number, &self.frame);
        self.counts.merge(&counts);
        self.watch.advance(counts.total());
        Ok(())
    }
}

impl<'a> CastWorker<'a> {
    /// A worker of the pass that has seen nothing.
    pub(super) fn new(pass: &CastPass<'a>, layout: &Layout) -> Self {
        Self {
            poser: Poser::new(&pass.plan.poses, &pass.plan.filter),
            poses: &pass.plan.poses,
            runs: pass.runs,
            casters: &pass.casters.of_runs,
            watch: pass.watch,
            bases: &pass.casters.bases,
            depth_noise: pass.log.summary().camera.map(|_| pass.config.depth_noise()),
            queries: Vec::new(),
            answers: vec![Vec::new(); pass.runs.len()],
            buffers: CastBuffers::default(),
            residuals: vec![Vec::new(); pass.runs.len()],
            of_return: Vec::new(),
            own_tiles: pass
                .plan
                .own_from_world
                .iter()
                .zip(&pass.casters.of_runs)
                .map(|(own_from_world, caster)| {
                    OwnTiles::new(own_from_world, caster.map().lattice().tile_edge_m())
                })
                .collect(),
            own_from_world: &pass.plan.own_from_world,
            frame_tiles: pass.runs.iter().map(|_| TileTable::default()).collect(),
            frame: FrameSums::on_scales(&pass.casters.bases, layout.scales()),
            reducer: Reducer::new(layout.clone()),
            tiles: HashMap::new(),
            counts: ReturnCounts::default(),
        }
    }
}

pub(crate) fn query_of(ray: &Ray, segment: Option<i32>) -> Query {
    Query {
        origin_in_world_m: ray.origin_in_world,
        direction_in_world: ray.direction_in_world,
        measured_m: ray.range_m,
        segment,
    }
}

/// Where a place of the world lies among the tiles of a run's own frame, by which its sums are told.
struct OwnTiles {
    rows: [[f64; 3]; 2],
    origin: [f64; 2],
    per_edge: f64,
}

impl OwnTiles {
    fn new(own_from_world: &Isometry3<f64>, edge_m: f64) -> Self {
        let rotation = own_from_world.rotation.to_rotation_matrix();
        let rows = [0, 1].map(|k| std::array::from_fn(|l| rotation[(k, l)]));
        let origin = [0, 1].map(|k| own_from_world.translation.vector[k]);
        Self { rows, origin, per_edge: 1.0 / edge_m }
    }

    #[inline]
    fn of(&self, [x, y, z]: [f64; 3]) -> TileId {
        let [x, y] = [0, 1].map(|k| {
            let [a, b, c] = self.rows[k];
            ((a * x + b * y + c * z + self.origin[k]) * self.per_edge).floor() as i32
        });
        TileId { x, y }
    }
}

/// Zhang & Chen 2021, eq. 7: z − z', for each of the three z'; and the pieces of surface on which predictions lie.
fn residuals_of(ray: &Ray, answer: &Answer, scales: Scales) -> Residuals {
    let range_m = ray.range_m;
    let residual = |predicted_m: Option<f64>| predicted_m.map(|z| range_m - z);
    let surface = |predicted_m: Option<f64>| {
        let predicted_m = predicted_m.unwrap_or(range_m);
        let place_m = [0, 1, 2].map(|k| ray.origin_in_world[k] + predicted_m * ray.direction_in_world[k]);
        SurfaceGroup::of_place(place_m, scales)
    };
    Residuals {
        first_m: residual(answer.first_m),
        nearest_m: residual(answer.nearest_m),
        independent_m: residual(answer.independent_m),
        revisited: answer.revisited,
        depth: None,
        surfaces: [surface(answer.independent_m), surface(answer.nearest_m.or(answer.first_m))],
    }
}

/// What z − z' is where z is a depth: both lie on one ray.
fn depth_residual(
    first_m: f64,
    range_m: f64,
    point_in_camera_m: [f32; 3],
    noise: &DepthNoise,
) -> DepthResidual {
    let per_range = depth_per_range(point_in_camera_m);
    let off_m = per_range * first_m;
    DepthResidual { first_m: off_m, first_sigmas: off_m / noise.sigma_m(per_range * range_m) }
}
