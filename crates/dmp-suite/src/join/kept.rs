//! Reads the saved returns of several results in parallel.

use dmp_lengths::thousands;
use dmp_log::{KeptPart, KeptReader};
use dmp_reduce::{Basis, FrameSums, KeptReturn, Layout, ReduceError, Reducer, Residuals};
use dmp_report::Report;
use dmp_revisit::apart::{Apart, Ruler, share_back};
use dmp_sensor::{Isometry3, Quaternion, Translation3, UnitQuaternion};

use super::error::JoinError;

/// Returns times runs in a batch before they are summed: 64 MiB.
const BATCH_RETURNS: usize = 1 << 24;
/// A scan takes as much memory as this many returns, beside its own.
const OF_SCAN: usize = 64;

/// A result with saved returns.
pub(super) struct Kept<'a> {
    pub(super) file: &'a str,
    pub(super) report: &'a Report,
    pub(super) reader: &'a mut KeptReader,
    /// The column of each of its runs among the compared ones; `None` if another result already has that run.
    pub(super) columns: Vec<Option<usize>>,
}

/// A scan with the returns of every compared run; none of a run without a pose for it.
#[derive(Debug, Default)]
pub(super) struct KeptScan {
    ordinal: u64,
    scan: u64,
    mark: u64,
    returns: usize,
    columns: Vec<Vec<[u8; KeptReturn::BYTES]>>,
    /// The pose of each of them, as [`KeptPart::pose`].
    poses: Vec<[f64; 7]>,
}

/// Reads the scans of one result.
struct Scans<'a> {
    kept: Kept<'a>,
    part: KeptPart,
    /// The next scan, and the first row of the one behind it.
    next: Option<KeptScan>,
    ahead: Option<KeptScan>,
    /// How many scans and returns were read.
    read: [u64; 2],
}

impl<'a> Scans<'a> {
    fn new(kept: Kept<'a>) -> Self {
        Self { kept, part: KeptPart::default(), next: None, ahead: None, read: [0; 2] }
    }

    fn problem(&self, problem: String) -> JoinError {
        JoinError::Returns { report: self.kept.file.to_owned(), problem }
    }

    /// Reads the next scan, unless it was read before. At the end the totals must be those of the result.
    fn fill(&mut self) -> Result<(), JoinError> {
        if self.next.is_some() {
            return Ok(());
        }
        let first = match self.ahead.take() {
            Some(scan) => Some(scan),
            None => self.next_row(None)?,
        };
        let Some(mut scan) = first else { return self.check_totals(true) };
        while let Some(row) = self.next_row(Some(&scan))? {
            if row.ordinal != scan.ordinal {
                self.ahead = Some(row);
                break;
            }
            scan.returns += row.returns;
            scan.columns.iter_mut().zip(row.columns).for_each(|(all, more)| all.extend(more));
            self.check_returns(self.read[1] + scan.returns as u64)?;
        }
        self.read = [self.read[0] + 1, self.read[1] + scan.returns as u64];
        self.next = Some(scan);
        self.check_totals(false)
    }

    /// A row of returns of all runs; `scan` is the scan it may continue.
    fn next_row(&mut self, scan: Option<&KeptScan>) -> Result<Option<KeptScan>, JoinError> {
        let mut row: Option<KeptScan> = None;
        for run in 0..self.kept.columns.len() {
            match self.kept.reader.next_part(&mut self.part)? {
                None if run > 0 => return Err(self.problem("it ends within a scan".to_owned())),
                None => return Ok(None),
                Some(other) if other != run => {
                    return Err(self.problem("runs are not in order".to_owned()));
                }
                Some(_) => {}
            }
            let KeptPart { ordinal, scan: number, mark, first, pose, returns } = &mut self.part;
            let begun = scan.filter(|scan| scan.ordinal == *ordinal).map_or(0, |scan| scan.returns as u64);
            if *first != begun {
                let problem = format!("scan {number} continues with return {first} after {begun} returns");
                return Err(self.problem(problem));
            }
            let row = row.get_or_insert_with(|| KeptScan {
                ordinal: *ordinal,
                scan: *number,
                mark: *mark,
                returns: returns.len(),
                columns: Vec::new(),
                poses: Vec::new(),
            });
            if (row.ordinal, row.scan, row.mark, row.returns) != (*ordinal, *number, *mark, returns.len()) {
                let problem = format!("its runs have other returns of scan {number}");
                return Err(self.problem(problem));
            }
            row.columns.push(std::mem::take(returns));
            row.poses.push(*pose);
        }
        Ok(row)
    }

    /// Rejects a file with more returns than its result states, before they are loaded into memory.
    fn check_returns(&self, returns: u64) -> Result<(), JoinError> {
        if returns > self.kept.report.inputs.returns_used { self.other_totals(returns) } else { Ok(()) }
    }

    fn other_totals(&self, returns: u64) -> Result<(), JoinError> {
        let report = self.kept.report;
        Err(self.problem(format!(
            "holds {} returns of {} scans, its result has {} of {}",
            thousands(returns),
            thousands(self.read[0]),
            thousands(report.inputs.returns_used),
            thousands(report.sampling.frames_scored)
        )))
    }

    /// Rejects a file whose returns differ from those its result states; at the `end` also if there are fewer.
    fn check_totals(&self, end: bool) -> Result<(), JoinError> {
        let Kept { report, reader, .. } = &self.kept;
        let [scans, returns] = self.read;
        self.check_returns(returns)?;
        // Scans without returns are only in the result.
        if scans > report.sampling.frames_scored || end && returns != report.inputs.returns_used {
            return self.other_totals(returns);
        }
        if end && !reader.runs().iter().eq(report.runs.iter().map(|run| &run.name)) {
            return Err(self.problem(format!("holds returns of {}", reader.runs().join(", "))));
        }
        Ok(())
    }
}

/// Reads all results in step. A result lacks the scans that none of its runs has a pose for.
pub(super) struct Rows<'a> {
    results: Vec<Scans<'a>>,
    columns: usize,
    pub(super) scans: u64,
}

impl<'a> Rows<'a> {
    pub(super) fn new(results: Vec<Kept<'a>>, columns: usize) -> Self {
        Self { results: results.into_iter().map(Scans::new).collect(), columns, scans: 0 }
    }

    /// The next batch of scans, some megabytes; empty at the end.
    ///
    /// # Errors
    /// When a file cannot be read, or results have different returns.
    pub(super) fn next_batch(&mut self) -> Result<Vec<KeptScan>, JoinError> {
        let mut batch = Vec::new();
        let mut returns = 0;
        while returns < BATCH_RETURNS {
            let Some(scan) = self.next_scan()? else { break };
            self.scans += 1;
            returns += scan.returns * self.columns.max(1) + OF_SCAN;
            batch.push(scan);
        }
        Ok(batch)
    }

    /// The next scan of any result, with the returns of all.
    fn next_scan(&mut self) -> Result<Option<KeptScan>, JoinError> {
        self.results.iter_mut().try_for_each(Scans::fill)?;
        let ordinals = self.results.iter().filter_map(|result| Some(result.next.as_ref()?.ordinal));
        let Some(ordinal) = ordinals.min() else { return Ok(None) };
        let mut all: Option<KeptScan> = None;
        for result in &mut self.results {
            let Some(scan) = result.next.take_if(|scan| scan.ordinal == ordinal) else { continue };
            let KeptScan { scan: number, mark, returns, columns, poses, .. } = scan;
            let all = all.get_or_insert_with(|| KeptScan {
                ordinal,
                scan: number,
                mark,
                returns,
                columns: vec![Vec::new(); self.columns],
                poses: vec![[f64::NAN; 7]; self.columns],
            });
            if (all.scan, all.returns) != (number, returns) {
                let named = |scan, returns: usize| {
                    format!("{} returns of scan {scan}, the {}. of all,", thousands(returns), ordinal + 1)
                };
                let (here, there) = (named(number, returns), named(all.scan, all.returns));
                return Err(result.problem(format!("holds {here} where others hold {there}")));
            }
            if all.mark != mark {
                let problem = format!("its returns of scan {number} differ from the other results");
                return Err(result.problem(problem));
            }
            for (column, (returns, pose)) in result.kept.columns.iter().zip(columns.into_iter().zip(poses)) {
                if let Some(column) = *column {
                    (all.columns[column], all.poses[column]) = (returns, pose);
                }
            }
        }
        Ok(all)
    }
}

/// The poses of a scan in every compared run.
pub(super) struct PosedScan {
    scan: u64,
    poses: Vec<Option<Isometry3<f64>>>,
}

/// No place is so far away, metres: a number beyond is none that was kept.
const FARTHEST_M: f64 = 1e9;

/// A pose with the bits that were kept; `None` where there is none.
fn pose_of([x, y, z, i, j, k, w]: &[f64; 7]) -> Option<Isometry3<f64>> {
    let turn = UnitQuaternion::new_unchecked(Quaternion::new(*w, *i, *j, *k));
    let is_pose = [x, y, z].iter().all(|c| c.abs() <= FARTHEST_M) && (turn.norm() - 1.0).abs() < 1e-6;
    is_pose.then(|| Isometry3::from_parts(Translation3::new(*x, *y, *z), turn))
}

/// How far apart runs `a` and `b` are.
pub(super) fn apart_of(scans: &[PosedScan], [a, b]: [usize; 2], ruler: &Ruler) -> Option<Apart> {
    Apart::of_poses(scans.iter().map(|scan| (scan.scan, [scan.poses[a], scan.poses[b]])), ruler)
}

/// The share of the scans with which a run comes back to a place, by its own path.
pub(super) fn back_of(scans: &[PosedScan], run: usize, ruler: &Ruler) -> f64 {
    share_back(scans.iter().filter_map(|scan| scan.poses[run]), ruler)
}

/// Sums of scans.
pub(super) struct Summed {
    frame: FrameSums,
    of_return: Vec<Residuals>,
    pub(super) reducer: Reducer,
    bases: Vec<Basis>,
}

impl Summed {
    pub(super) fn new(layout: &Layout) -> Self {
        Self {
            frame: FrameSums::on_scales(layout.bases(), layout.scales()),
            of_return: Vec::new(),
            reducer: Reducer::new(layout.clone()),
            bases: layout.bases().to_vec(),
        }
    }

    /// Adds a scan.
    pub(super) fn add(&mut self, scan: &KeptScan) -> Result<(), ReduceError> {
        let Self { frame, of_return, reducer, bases } = self;
        let scales = frame.scales();
        frame.clear();
        for index in 0..scan.returns {
            of_return.clear();
            let of_run = |(column, basis): (&Vec<[u8; KeptReturn::BYTES]>, &Basis)| {
                let kept = column.get(index).copied().map_or(KeptReturn::default(), KeptReturn::from_bytes);
                kept.residuals(*basis, scales)
            };
            of_return.extend(scan.columns.iter().zip(&*bases).map(of_run));
            frame.add_return(&*of_return);
        }
        reducer.add_frame(scan.ordinal, frame)
    }
}

impl KeptScan {
    /// Its ordinal among the scans that could be scored, and its number in the log.
    pub(super) fn numbers(&self) -> (u64, u64) {
        (self.ordinal, self.scan)
    }

    /// The pose of each run in it, and its number in the log.
    pub(super) fn posed(&self) -> PosedScan {
        PosedScan { scan: self.scan, poses: self.poses.iter().map(pose_of).collect() }
    }

    /// Its number of returns.
    pub(super) fn returns(&self) -> u64 {
        self.returns as u64
    }
}
