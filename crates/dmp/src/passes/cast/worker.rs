//! Work of a thread on a scan: casts its rays and sums the residuals.

use std::collections::HashMap;

use dmp_cast::{Answer, CastBuffers, Query};
use dmp_map::{TileId, TileTable};
use dmp_reduce::{
    Basis, DepthResidual, FrameSums, Layout, NarrowSums, Reducer, Residuals, RunSums, Scales, Squares,
    SurfaceGroup, floor,
};
use dmp_runs::{Block, Drawn, EvaluateError, PlannedFrame, PosedRun, Poser, ScoredReturns, ScoredRun, posed};
use dmp_sensor::{DepthNoise, Isometry3, Ray, ReturnCounts, Scan, depth_per_range};

use super::casters::{RunCaster, bases};
use crate::drawn::{ScanFacts, ScanShape};
use crate::passes::evaluation::Evaluation;
use crate::passes::frames::Worker;

/// Sums of the returns that lie in a tile of the frame of the run's trajectory (not of its map), for each run and tile. There are none
/// without `per_tile`, and none in parts.
pub(crate) type OwnTileSums = HashMap<(usize, TileId), RunSums>;

/// A thread's sums, and its buffers.
pub(super) struct CastWorker<'e> {
    evaluation: &'e Evaluation<'e, RunCaster>,
    poser: Poser<'e>,
    runs: Vec<CastRun<'e>>,
    /// For a depth camera.
    depth_noise: Option<DepthNoise>,
    queries: Vec<Query>,
    buffers: CastBuffers,
    /// For the current returns, for every run.
    residuals: Vec<Vec<Residuals>>,
    frame: FrameSums,
    pub(super) reducer: Reducer,
    pub(super) tiles: OwnTileSums,
    pub(super) counts: ReturnCounts,
    /// For the scans seen without a checksum: their places in the plan, and their shapes.
    pub(super) shapes: Vec<(u64, ScanShape)>,
    /// For the scans seen: their places in the plan, and the hash of their returns.
    pub(super) marks: Vec<(u64, u64)>,
}

/// One run, with the results of its rays.
struct CastRun<'e> {
    run: &'e PosedRun<'e, RunCaster>,
    /// Whether its surfels have the segments that observed them.
    is_cross_validated: bool,
    /// Which scores to compute: `[R_cv, R_near]`.
    bases: [bool; 2],
    /// The tiles of its own frame.
    own_tiles: OwnTiles,
    /// For the current returns.
    answers: Vec<Answer>,
    is_left_out: Vec<bool>,
    /// For the frame's returns.
    frame_tiles: TileTable<NarrowSums>,
}

impl<'e> CastWorker<'e> {
    /// A new worker of the pass.
    pub(super) fn new(evaluation: &'e Evaluation<'e, RunCaster>, layout: &Layout) -> Self {
        let Evaluation { log, settings, plan, runs, .. } = evaluation;
        Self {
            evaluation,
            poser: Poser::new(posed(runs), &plan.filter).drawing(plan.draw),
            runs: runs.iter().map(|run| CastRun::new(run, &bases(runs))).collect(),
            depth_noise: log.summary().camera.map(|_| settings.depth_noise()),
            queries: Vec::new(),
            buffers: CastBuffers::default(),
            residuals: vec![Vec::new(); runs.len()],
            frame: FrameSums::on_scales(&bases(runs), layout.scales()),
            reducer: Reducer::new(layout.clone()),
            tiles: HashMap::new(),
            counts: ReturnCounts::default(),
            shapes: Vec::new(),
            marks: Vec::new(),
        }
    }
}

impl Worker for CastWorker<'_> {
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError> {
        let facts = ScanFacts::of(scan, self.evaluation.log.summary().has_checksums);
        self.cast((ordinal, frame), Drawn::Of(scan), &facts)
    }

    fn drawn_frame(
        &mut self,
        ordinal: usize,
        frame: &PlannedFrame,
        scan: &Scan,
        facts: &ScanFacts,
    ) -> Result<(), EvaluateError> {
        self.cast((ordinal, frame), Drawn::Already { scan, of: facts.returns }, facts)
    }
}

impl CastWorker<'_> {
    /// Casts the drawn returns of a scan.
    fn cast(
        &mut self,
        (ordinal, frame): (usize, &PlannedFrame),
        drawn: Drawn<'_>,
        facts: &ScanFacts,
    ) -> Result<(), EvaluateError> {
        let Self { evaluation, poser, runs, queries, buffers, residuals, .. } = self;
        let (depth_noise, scales) = (self.depth_noise.as_ref(), self.frame.scales());
        let per_tile = evaluation.means.per_tile;
        self.frame.clear();
        self.shapes.extend(facts.shape.map(|shape| (ordinal as u64, shape)));
        self.marks.extend(facts.mark.map(|mark| (ordinal as u64, mark)));
        let sums = &mut self.frame;
        let mut first = 0;
        let counts = poser.blocks_of((ordinal, frame), drawn, |block| {
            let mut reposed = false;
            for (number, (run, residuals)) in runs.iter_mut().zip(residuals.iter_mut()).enumerate() {
                residuals.clear();
                if let Some(segment) = run.run.path.segment(ordinal) {
                    run.cast(block.rays(number), segment, reposed, queries, buffers)?;
                    run.leave_residuals((&block, ordinal), number, scales, depth_noise, residuals);
                    reposed = true;
                }
            }
            for index in 0..block.returns() {
                let of_runs = residuals
                    .iter()
                    .enumerate()
                    .map(|(number, of_run)| of_run.get(index).filter(|_| block.is_posed(number)[index]));
                sums.add_return_to(of_runs, |number, squares| {
                    if per_tile {
                        runs[number].add_to_tile(&block.rays(number)[index], squares, scales);
                    }
                });
            }
            let scored = runs.iter().zip(residuals.iter()).enumerate();
            let scored: Vec<Option<ScoredRun<'_>>> = scored
                .map(|(number, (run, residuals))| run.scored(frame, (&block, number), residuals))
                .collect();
            let (frame, offsets_ns, runs) = (frame.number, block.offsets_ns, scored.as_slice());
            evaluation.sink.returns_scored(&ScoredReturns { frame, ordinal, first, offsets_ns, runs });
            first += offsets_ns.len();
            Ok::<(), EvaluateError>(())
        })?;
        for (number, run) in self.runs.iter_mut().enumerate() {
            for (tile, of_tile) in run.frame_tiles.drain() {
                self.tiles.entry((number, tile)).or_default().merge(&of_tile.sums());
            }
        }
        self.reducer.add_frame(ordinal as u64, &self.frame)?;
        self.evaluation.sink.frame_scored(frame.number, &self.frame);
        self.counts.merge(&counts);
        self.evaluation.progress.advance(counts.total());
        Ok(())
    }
}

impl<'e> CastRun<'e> {
    fn new(run: &'e PosedRun<'e, RunCaster>, all: &[Basis]) -> Self {
        let own = run.map.basis();
        let judged_by = |basis| all.iter().any(|&other| own == basis || own.of_pair(other) == basis);
        let edge_m = run.map.caster.map().lattice().tile_edge_m();
        Self {
            run,
            is_cross_validated: own == Basis::CrossValidated,
            bases: [Basis::CrossValidated, Basis::Near].map(judged_by),
            own_tiles: OwnTiles::new(&run.own_from_world, edge_m),
            answers: Vec::new(),
            is_left_out: Vec::new(),
            frame_tiles: TileTable::default(),
        }
    }

    /// Casts rays that were measured in a segment; `reposed`: the same returns as for the previous run.
    fn cast(
        &mut self,
        rays: &[Ray],
        segment: i32,
        reposed: bool,
        queries: &mut Vec<Query>,
        buffers: &mut CastBuffers,
    ) -> Result<(), EvaluateError> {
        let segment = self.is_cross_validated.then_some(segment);
        queries.clear();
        queries.extend(rays.iter().map(|&ray| Query { ray, segment }));
        let (caster, answers) = (&self.run.map.caster, &mut self.answers);
        let cast = if reposed {
            caster.cast_reposed(queries, answers, buffers)
        } else {
            caster.cast(queries, answers, buffers)
        };
        let (map, left_out) = (caster.map(), &self.run.map.left_out);
        let ends = rays.iter().map(Ray::endpoint_in_world);
        cast.and_then(|()| left_out.find(map, ends, &mut self.is_left_out))
            .map_err(EvaluateError::map_of(self.run.name()))
    }

    /// Computes the residuals.
    fn leave_residuals(
        &self,
        (block, ordinal): (&Block<'_>, usize),
        number: usize,
        scales: Scales,
        depth_noise: Option<&DepthNoise>,
        residuals: &mut Vec<Residuals>,
    ) {
        let rays = block.rays(number);
        let answered = rays.iter().zip(self.answers.iter().zip(&self.is_left_out));
        let (bases, is_revisit) = (self.bases, self.run.path.is_revisit(ordinal));
        residuals.extend(answered.map(|(ray, (answer, &is_left_out))| {
            if is_left_out {
                Residuals {
                    surfaces: surfaces_of(ray, &Answer::default(), bases, scales),
                    ..Residuals::LEFT_OUT
                }
            } else {
                let of_ray = residuals_of(ray, answer, bases, scales);
                // From far along a street, surfaces are seen on no other visit.
                Residuals { revisited: of_ray.revisited && is_revisit, ..of_ray }
            }
        }));
        if let Some(noise) = depth_noise {
            for ((residuals, ray), point) in residuals.iter_mut().zip(rays).zip(block.points_in_sensor_m) {
                residuals.depth = residuals.first_m.map(|m| depth_residual(m, ray.range_m, *point, noise));
            }
        }
    }

    /// Adds a return to the sums of its tile.
    #[inline]
    fn add_to_tile(&mut self, ray: &Ray, squares: &Squares, scales: Scales) {
        let of_tile = self.frame_tiles.entry(self.own_tiles.of(ray.endpoint_in_world()));
        if of_tile.is_empty() {
            *of_tile = NarrowSums::new(scales);
        }
        of_tile.add(squares);
    }

    /// The current returns, as passed to a sink; `None` without a pose for the scan.
    fn scored<'s>(
        &'s self,
        frame: &PlannedFrame,
        (block, number): (&'s Block<'_>, usize),
        residuals: &'s [Residuals],
    ) -> Option<ScoredRun<'s>> {
        let (rays, is_posed) = (block.rays(number), block.is_posed(number));
        let own_from_world = self.run.own_from_world;
        let own_from_sensor = own_from_world * self.run.poses.of_frame(frame)?;
        (!rays.is_empty()).then_some(ScoredRun { own_from_sensor, own_from_world, rays, residuals, is_posed })
    }
}

/// Maps a place in the world to a tile of the run's own frame, by which its sums are keyed.
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
            floor((a * x + b * y + c * z + self.origin[k]) * self.per_edge)
        });
        TileId { x, y }
    }
}

/// Zhang & Chen 2021, eq. 7: z − z', for each of the three z'; and the surface pieces of those predictions by
/// which the run is judged.
#[inline]
fn residuals_of(ray: &Ray, answer: &Answer, bases: [bool; 2], scales: Scales) -> Residuals {
    let residual = |predicted_m: Option<f64>| predicted_m.map(|z| ray.range_m - z);
    Residuals {
        first_m: residual(answer.first_m),
        nearest_m: residual(answer.nearest_m),
        independent_m: residual(answer.independent_m),
        revisited: answer.revisited,
        is_left_out: false,
        depth: None,
        surfaces: surfaces_of(ray, answer, bases, scales),
    }
}

#[inline]
fn surfaces_of(ray: &Ray, answer: &Answer, bases: [bool; 2], scales: Scales) -> [SurfaceGroup; 2] {
    let surface = |predicted_m: Option<f64>| {
        let predicted_m = predicted_m.unwrap_or(ray.range_m);
        let place_m = [0, 1, 2].map(|k| ray.origin_in_world[k] + predicted_m * ray.direction_in_world[k]);
        SurfaceGroup::of_place(place_m, scales)
    };
    let [of_cv, of_near] = [answer.independent_m, answer.nearest_m.or(answer.first_m)];
    [
        if bases[0] { surface(of_cv) } else { SurfaceGroup::NONE },
        if bases[1] { surface(of_near) } else { SurfaceGroup::NONE },
    ]
}

/// z − z' where z is a depth: both lie on one ray.
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
