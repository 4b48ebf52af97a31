//! Reads the saved returns of several results in parallel.

use dmp_lengths::thousands;
use dmp_log::{KeptPart, KeptReader};
use dmp_reduce::{Basis, FrameSums, KeptReturn, Layout, ReduceError, Reducer, Residuals};

use super::error::JoinError;
use crate::report::Report;

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

/// A scan in parts, each with the returns of every compared run.
#[derive(Debug, Default)]
pub(super) struct KeptScan {
    ordinal: u64,
    scan: u64,
    mark: u64,
    returns: u64,
    parts: Vec<Vec<Vec<[u8; KeptReturn::BYTES]>>>,
}

/// Reads all results in step.
pub(super) struct Rows<'a> {
    results: Vec<Kept<'a>>,
    columns: usize,
    part: KeptPart,
    /// The first part of the next scan, already read.
    ahead: Option<KeptScan>,
    pub(super) scans: u64,
    pub(super) returns: u64,
}

impl<'a> Rows<'a> {
    pub(super) fn new(results: Vec<Kept<'a>>, columns: usize) -> Self {
        Self { results, columns, part: KeptPart::default(), ahead: None, scans: 0, returns: 0 }
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
            self.returns += scan.returns;
            returns += scan.returns as usize * self.columns.max(1) + OF_SCAN;
            batch.push(scan);
        }
        self.check_totals(batch.is_empty())?;
        Ok(batch)
    }

    /// A scan with all its parts.
    fn next_scan(&mut self) -> Result<Option<KeptScan>, JoinError> {
        let first = match self.ahead.take() {
            Some(scan) => Some(scan),
            None => self.next_row(None)?,
        };
        let Some(mut scan) = first else { return Ok(None) };
        while let Some(row) = self.next_row(Some(&scan))? {
            if row.ordinal != scan.ordinal {
                self.ahead = Some(row);
                break;
            }
            scan.returns += row.returns;
            scan.parts.extend(row.parts);
            self.check_returns(self.returns + scan.returns)?;
        }
        Ok(Some(scan))
    }

    /// One part of a scan, of all runs of all results; `scan` is the scan it may continue.
    fn next_row(&mut self, scan: Option<&KeptScan>) -> Result<Option<KeptScan>, JoinError> {
        let mut row: Option<KeptScan> = None;
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
                let returns = part.returns.len() as u64;
                let begun = scan.filter(|scan| scan.ordinal == part.ordinal).map_or(0, |scan| scan.returns);
                if part.first != begun {
                    let (scan, first) = (part.scan, part.first);
                    return problem(format!(
                        "scan {scan} continues with return {first} after {begun} returns"
                    ));
                }
                let row = row.get_or_insert_with(|| KeptScan {
                    ordinal: part.ordinal,
                    scan: part.scan,
                    mark: part.mark,
                    returns,
                    parts: vec![vec![Vec::new(); *columns]],
                });
                let (here, there) =
                    ((part.ordinal, part.scan, returns), (row.ordinal, row.scan, row.returns));
                if here != there {
                    let named = |(place, scan, returns)| {
                        format!("{} returns of scan {scan}, the {}. of all,", thousands(returns), place + 1)
                    };
                    let (here, there) = (named(here), named(there));
                    return problem(format!("holds {here} where others hold {there} from return {begun} on"));
                }
                if part.mark != row.mark {
                    return problem(format!(
                        "its returns of scan {} differ from the other results",
                        part.scan
                    ));
                }
                if let Some(column) = column {
                    row.parts[0][*column] = std::mem::take(&mut part.returns);
                }
            }
        }
        match (ended, row) {
            (Some(short), Some(scan)) => Err(JoinError::Returns {
                report: results[short].file.to_owned(),
                problem: format!("ends before scan {}, which others hold", scan.scan),
            }),
            (_, row) => Ok(row),
        }
    }

    /// Rejects files with more returns than their results state, before they are loaded into memory.
    fn check_returns(&self, returns: u64) -> Result<(), JoinError> {
        let short = self.results.iter().find(|kept| returns > kept.report.inputs.returns_used);
        short.map_or(Ok(()), |kept| self.other_totals(kept, returns))
    }

    fn other_totals(&self, kept: &Kept<'_>, returns: u64) -> Result<(), JoinError> {
        let Kept { file, report, .. } = kept;
        let problem = format!(
            "holds {} returns of {} scans, its result has {} of {}",
            thousands(returns),
            thousands(self.scans),
            thousands(report.inputs.returns_used),
            thousands(report.sampling.frames_scored)
        );
        Err(JoinError::Returns { report: (*file).to_owned(), problem })
    }

    /// Rejects files whose returns differ from those their results state; at the `end` also if there are
    /// fewer.
    fn check_totals(&self, end: bool) -> Result<(), JoinError> {
        self.check_returns(self.returns)?;
        for kept in &self.results {
            let Kept { file, report, reader, .. } = kept;
            let problem = |problem| Err(JoinError::Returns { report: (*file).to_owned(), problem });
            // Scans without returns are only in the result.
            if self.scans > report.sampling.frames_scored || end && self.returns != report.inputs.returns_used
            {
                return self.other_totals(kept, self.returns);
            }
            if end && !reader.runs().iter().eq(report.runs.iter().map(|run| &run.name)) {
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
                frame.add_return(&*of_return);
            }
        }
        reducer.add_frame(scan.ordinal, frame)
    }
}

impl KeptScan {
    /// Its ordinal among the scans that could be scored, and its number in the log.
    pub(super) fn numbers(&self) -> (u64, u64) {
        (self.ordinal, self.scan)
    }

    /// Its number of returns.
    pub(super) fn returns(&self) -> u64 {
        self.returns
    }
}
