//! Returns of several results side by side.

use dmp_lengths::thousands;
use dmp_log::{KeptPart, KeptReader};
use dmp_reduce::{Basis, FrameSums, KeptReturn, Layout, ReduceError, Reducer, Residuals};

use super::error::JoinError;
use crate::report::Report;

/// Returns that are taken at a time before they are summed, times runs: 64 MiB.
const BATCH_RETURNS: usize = 1 << 24;

/// A result whose returns were kept.
pub(super) struct Kept<'a> {
    pub(super) file: &'a str,
    pub(super) report: &'a Report,
    pub(super) reader: &'a mut KeptReader,
    /// For each of its runs where it stands among those that are compared; `None` where another result has it, too.
    pub(super) columns: Vec<Option<usize>>,
}

/// A scan: its parts, each with the returns of every run that is compared.
#[derive(Debug, Default)]
pub(super) struct KeptScan {
    ordinal: u64,
    scan: u64,
    returns: u64,
    parts: Vec<Vec<Vec<[u8; KeptReturn::BYTES]>>>,
}

/// Reads all results in step.
pub(super) struct Rows<'a> {
    results: Vec<Kept<'a>>,
    columns: usize,
    part: KeptPart,
    /// The first part of the next scan, which has been read already.
    ahead: Option<KeptScan>,
    pub(super) scans: u64,
    pub(super) returns: u64,
}

impl<'a> Rows<'a> {
    pub(super) fn new(results: Vec<Kept<'a>>, columns: usize) -> Self {
        Self { results, columns, part: KeptPart::default(), ahead: None, scans: 0, returns: 0 }
    }

    /// The next scans, some megabytes of them; none behind the last.
    ///
    /// # Errors
    /// When a file cannot be read, or results do not hold the same returns.
    pub(super) fn next_batch(&mut self) -> Result<Vec<KeptScan>, JoinError> {
        let mut batch = Vec::new();
        let mut returns = 0;
        while returns < BATCH_RETURNS {
            let Some(scan) = self.next_scan()? else { break };
            self.scans += 1;
            self.returns += scan.returns;
            returns += scan.returns as usize * self.columns.max(1) + 1;
            batch.push(scan);
        }
        if batch.is_empty() {
            self.check_totals()?;
        }
        Ok(batch)
    }

    /// A scan with all its parts.
    fn next_scan(&mut self) -> Result<Option<KeptScan>, JoinError> {
        let first = match self.ahead.take() {
            Some(scan) => Some(scan),
            None => self.next_row()?,
        };
        let Some(mut scan) = first else { return Ok(None) };
        while let Some(row) = self.next_row()? {
            if row.ordinal != scan.ordinal {
                self.ahead = Some(row);
                break;
            }
            scan.returns += row.returns;
            scan.parts.extend(row.parts);
        }
        Ok(Some(scan))
    }

    /// One part of a scan, of all runs of all results.
    fn next_row(&mut self) -> Result<Option<KeptScan>, JoinError> {
        let mut row: Option<(KeptScan, u64)> = None;
        let mut ended = None;
        let Self { results, columns, part, .. } = self;
        for (k, result) in results.iter_mut().enumerate() {
            for (run, column) in result.columns.iter().enumerate() {
                let of_run = result.reader.next_part(part)?;
                let problem = |problem| Err(JoinError::Returns { report: result.file.to_owned(), problem });
                match of_run {
                    None if run > 0 => return problem("it ends within a scan".to_owned()),
                    None => {
                        ended = Some(k);
                        break;
                    }
                    Some(other) if other != run => return problem("runs are not in order".to_owned()),
                    Some(_) => {}
                }
                let here = (part.ordinal, part.scan, part.first, part.returns.len());
                let (scan, first) = row.get_or_insert_with(|| {
                    let returns = part.returns.len() as u64;
                    let parts = vec![vec![Vec::new(); *columns]];
                    (KeptScan { ordinal: part.ordinal, scan: part.scan, returns, parts }, part.first)
                });
                let there = (scan.ordinal, scan.scan, *first, scan.returns as usize);
                if here != there {
                    let named = |(_, scan, first, returns): (u64, u64, u64, usize)| {
                        format!("{} returns of scan {scan} from return {first} on", thousands(returns as u64))
                    };
                    let (here, there) = (named(here), named(there));
                    return problem(format!("holds {here} where others hold {there}"));
                }
                if let Some(column) = column {
                    scan.parts[0][*column] = std::mem::take(&mut part.returns);
                }
            }
        }
        match (ended, row) {
            (Some(short), Some((scan, _))) => Err(JoinError::Returns {
                report: results[short].file.to_owned(),
                problem: format!("ends before scan {}, which others hold", scan.scan),
            }),
            (_, row) => Ok(row.map(|(scan, _)| scan)),
        }
    }

    /// Refuses files that hold other returns than their results tell of.
    fn check_totals(&self) -> Result<(), JoinError> {
        for Kept { file, report, reader, .. } in &self.results {
            let (scans, returns) = (report.sampling.frames_scored, report.inputs.returns_used);
            let problem = |problem| Err(JoinError::Returns { report: (*file).to_owned(), problem });
            // Scans without returns are in the result alone.
            if self.returns != returns || self.scans > scans {
                return problem(format!(
                    "holds {} returns of {} scans, its result tells of {} of {}",
                    thousands(self.returns),
                    thousands(self.scans),
                    thousands(returns),
                    thousands(scans)
                ));
            }
            if !reader.runs().iter().eq(report.runs.iter().map(|run| &run.name)) {
                return problem(format!("holds returns of {}", reader.runs().join(", ")));
            }
        }
        Ok(())
    }
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

    /// Adds scans without returns, so many, in places that none has: which these are changes no sum.
    pub(super) fn add_empty(&mut self, scans: u64) -> Result<(), ReduceError> {
        self.frame.clear();
        let mut free = (0..self.reducer.layout().frames()).filter(|&ordinal| !self.taken(ordinal));
        let free: Vec<u64> = free.by_ref().take(scans as usize).collect();
        free.into_iter().try_for_each(|ordinal| self.reducer.add_frame(ordinal, &self.frame))
    }

    fn taken(&self, ordinal: u64) -> bool {
        self.reducer.frames().contains(ordinal as usize)
    }

    /// Adds a scan.
    pub(super) fn add(&mut self, scan: &KeptScan) -> Result<(), ReduceError> {
        let Self { frame, of_return, reducer, bases } = self;
        let scales = frame.scales();
        frame.clear();
        for columns in &scan.parts {
            let returns = columns.first().map_or(0, Vec::len);
            for index in 0..returns {
                of_return.clear();
                let of_run = |(column, basis): (&Vec<[u8; KeptReturn::BYTES]>, &Basis)| {
                    KeptReturn::from_bytes(column[index]).residuals(*basis, scales)
                };
                of_return.extend(columns.iter().zip(&*bases).map(of_run));
                frame.add_return(of_return);
            }
        }
        reducer.add_frame(scan.ordinal, frame)
    }
}

impl KeptScan {
    /// Its place among those that could be scored, and its number in the log.
    pub(super) fn numbers(&self) -> (u64, u64) {
        (self.ordinal, self.scan)
    }

    /// How many returns it has.
    pub(super) fn returns(&self) -> u64 {
        self.returns
    }
}
