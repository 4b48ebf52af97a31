//! How thick the surfaces are that several scans see, and how that changes with what is looked for.
//!
//! The scans of a block are put together and cut into cells. In a cell with returns of several scans on a plane, the least
//! eigenvalue of the covariance is the mean square distance to that plane, whatever the plane: its place and slope are
//! eliminated (variable projection). Scans put together wrongly make planes thick. A plane that one scan alone sees says
//! nothing, and has no vote.

use dmp_map::smallest_eigenvector;
use dmp_reduce::floor;
use dmp_sensor::Vector3;

use crate::calibrate::axis::{AXES, Matrix, Vector};
use crate::calibrate::knots::Knots;
use crate::calibrate::mount::{Moment, Trial};
use crate::calibrate::sample::Block;

/// Fewest returns of a plane, and of scans that see it.
const RETURNS: usize = 8;
const SCANS: usize = 2;
/// A plane has extent in two directions: the middle eigenvalue is at least this share of the square of a cell's edge, and
/// the least at most this share of the middle one.
const EXTENT: f64 = 0.01;
const FLATNESS: f64 = 0.15;

/// How closely it is looked: the edge of cells, the thickness at which a plane weighs a quarter, and every how many-th return
/// takes part.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Level {
    pub(crate) edge_m: f64,
    pub(crate) thick_m: f64,
    pub(crate) every: usize,
    /// Whether the changes with what is looked for are summed, too.
    pub(crate) derives: bool,
}

/// The sums over the planes of a block: Σ w J Jᵀ and Σ w J r over their returns, r the distance to the plane, J its change
/// with a unit of each axis while the plane goes along; and Σ w r², Σ w.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Equations {
    pub(crate) hessian: Matrix,
    pub(crate) gradient: Vector,
    pub(crate) squares_m2: f64,
    pub(crate) weight: f64,
}

impl Default for Equations {
    fn default() -> Self {
        Self { hessian: Matrix::zeros(), gradient: Vector::zeros(), squares_m2: 0.0, weight: 0.0 }
    }
}

impl Equations {
    pub(crate) fn add(&mut self, other: &Self) {
        self.hessian += other.hessian;
        self.gradient += other.gradient;
        self.squares_m2 += other.squares_m2;
        self.weight += other.weight;
    }
}

/// A return in the world, relative to the first one.
#[derive(Debug, Clone, Copy)]
struct Placed {
    place_m: Vector3<f64>,
    in_sensor_m: Vector3<f64>,
    after_ns: i64,
    scan: u32,
    /// The knot of the scan next to its time.
    knot: u32,
}

/// What [`equations`] needs beside the sums, kept from block to block.
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// By scan.
    moments: Vec<Knots<Moment>>,
    placed: Vec<Placed>,
    /// What was placed, by its cell: numbers are sorted, since they are small.
    order: Vec<u64>,
    in_cell: Vec<Placed>,
}

/// The sums over the planes of one block.
pub(crate) fn equations(
    block: &Block,
    trial: &Trial<'_>,
    level: Level,
    metre_m: f64,
    buffers: &mut Buffers,
) -> Equations {
    let Buffers { moments, placed, order, in_cell } = buffers;
    moments.clear();
    placed.clear();
    order.clear();
    let (mut cursors, mut origin_m) = (trial.cursors(), None);
    for snapshot in &block.scans {
        let Some(stamp_ns) = trial.mount.stamp_ns(snapshot) else { continue };
        let returns = || snapshot.returns.iter().step_by(level.every);
        let known = Knots::of(returns().map(|one| one.after_ns), |after_ns| {
            trial.at(&mut cursors, stamp_ns, after_ns)
        });
        for one in returns() {
            let Some(between) = known.between(one.after_ns) else { continue };
            let place_m = between.place(|moment| moment.place(&one.in_sensor_m));
            let place_m = place_m - *origin_m.get_or_insert(place_m);
            let cell = [place_m.x, place_m.y, place_m.z].map(|c| floor(c / level.edge_m));
            let Some(key) = key_of(cell, placed.len()) else { continue };
            order.push(key);
            placed.push(Placed {
                place_m,
                in_sensor_m: one.in_sensor_m,
                after_ns: one.after_ns,
                scan: moments.len() as u32,
                knot: between.nearer,
            });
        }
        moments.push(known);
    }
    order.sort_unstable();
    let mut sums = Equations::default();
    for cell in order.chunk_by(|a, b| a >> INDEX_BITS == b >> INDEX_BITS).filter(|cell| cell.len() >= RETURNS)
    {
        in_cell.clear();
        in_cell.extend(cell.iter().map(|&key| placed[(key & ((1 << INDEX_BITS) - 1)) as usize]));
        add_plane(in_cell, moments, level, metre_m, &mut sums);
    }
    sums
}

/// Bits of a cell along each axis, and of an index.
const CELL_BITS: u32 = 14;
const INDEX_BITS: u32 = 64 - 3 * CELL_BITS;

/// Orders by cell, and in a cell by index. `None` more than 8192 cells from the first return, where no surface of the same block
/// is, or from 4 million returns on.
fn key_of(cell: [i32; 3], index: usize) -> Option<u64> {
    let mut key = 0;
    for c in cell {
        let c = c.checked_add(1 << (CELL_BITS - 1)).filter(|c| (0..1 << CELL_BITS).contains(c))?;
        key = key << CELL_BITS | c as u64;
    }
    (index < 1 << INDEX_BITS).then_some(key << INDEX_BITS | index as u64)
}

fn add_plane(cell: &[Placed], moments: &[Knots<Moment>], level: Level, metre_m: f64, sums: &mut Equations) {
    // Within a cell the returns of a scan follow each other.
    let scans = 1 + cell.windows(2).filter(|pair| pair[0].scan != pair[1].scan).count();
    if scans < SCANS {
        return;
    }
    let count = cell.len() as f64;
    let mean_m = cell.iter().map(|one| one.place_m).sum::<Vector3<f64>>() / count;
    let mut moment = [0.0; 6];
    for one in cell {
        let d = one.place_m - mean_m;
        let products = [d.x * d.x, d.x * d.y, d.x * d.z, d.y * d.y, d.y * d.z, d.z * d.z];
        for (sum, product) in moment.iter_mut().zip(products) {
            *sum += product / count;
        }
    }
    let (normal, [least, middle, _]) = smallest_eigenvector(moment);
    if middle < EXTENT * level.edge_m * level.edge_m || least > FLATNESS * middle {
        return;
    }
    // Geman–McClure on the thickness: thick planes are no planes.
    let thin = 1.0 + least.max(0.0) / (level.thick_m * level.thick_m);
    let weight = 1.0 / (thin * thin);
    sums.squares_m2 += least.max(0.0) * count * weight;
    sums.weight += count * weight;
    if !level.derives {
        return;
    }
    let normal = Vector3::from(normal);
    let along = normal.cross(&if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() }).normalize();
    let across = normal.cross(&along);
    // [1, u, v], against which distances and their changes are taken: the plane goes along.
    let mut gram = nalgebra::Matrix3::<f64>::zeros();
    let mut with_plane = nalgebra::SMatrix::<f64, 3, AXES>::zeros();
    let (mut hessian, mut gradient) = (Matrix::zeros(), Vector::zeros());
    for one in cell {
        let d = one.place_m - mean_m;
        let on_plane = Vector3::new(1.0, along.dot(&d) / level.edge_m, across.dot(&d) / level.edge_m);
        let Some(moment) = moments[one.scan as usize].get(one.knot) else { continue };
        let change = Vector::from(moment.gradient(&one.in_sensor_m, one.after_ns, &normal, metre_m));
        gram += on_plane * on_plane.transpose();
        with_plane += on_plane * change.transpose();
        hessian += change * change.transpose();
        gradient += change * normal.dot(&d);
    }
    let Some(inverse) = gram.try_inverse() else { return };
    hessian -= with_plane.transpose() * inverse * with_plane;
    sums.hessian += hessian * weight;
    sums.gradient += gradient * weight;
}
