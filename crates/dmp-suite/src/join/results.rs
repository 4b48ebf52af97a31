//! Joins saved results with their individual returns.

use std::collections::BTreeMap;

use dmp_lengths::thousands;
use dmp_log::KeptReader;
use dmp_reduce::{Basis, Comparisons, FrameSums, Layout, MissPrice, Reducer};
use dmp_report::{PairFacts, PairReport, Report, RunReport, Withheld};
use dmp_revisit::apart::Ruler;
use rayon::prelude::*;

use super::error::JoinError;
use super::follow::Follow;
use super::kept::{Kept, KeptScan, PosedScan, Rows, Summed, apart_of, back_of};
use super::named::NamedReport;
use super::reports::{JoinedReport, join_reports, pairs_of};

/// Limit for the sums of all threads, bytes, if there is more than one thread.
const WORKERS_BYTES: usize = 1 << 30;
/// Upper limit for the scans of a log: a hundred days at ten per second.
const MOST_SCANS: u64 = 1 << 27;

/// A saved result.
#[derive(Debug)]
pub struct SavedResult {
    /// Its report.
    pub named: NamedReport,
    /// Its returns, if saved.
    pub returns: Option<KeptReader>,
}

/// As [`join_reports`], but also compares all runs with saved returns as if scored together. Each pair is
/// judged on the returns that both runs predict; all these pairs share one error rate, for each score. Saved
/// residuals are rounded, see [`KeptReturn`](dmp_reduce::KeptReturn), so numbers of pairs differ slightly
/// from those of a common score.
///
/// A pair of one fused and one given map needs `R_near`, which is not saved for the fused one: such a pair
/// exists only if a report has it.
///
/// Needs some hundred megabytes of memory for any size of results: very many runs use fewer threads. The
/// outcome does not depend on `threads`.
///
/// # Errors
/// As [`join_reports`], and when a file cannot be read, its returns are not those of its result, or the
/// watcher stopped it.
pub fn join_results(
    results: &mut [SavedResult],
    threads: usize,
    progress: &dyn Follow,
) -> Result<JoinedReport, JoinError> {
    let reports: Vec<NamedReport> = results.iter().map(|result| result.named.clone()).collect();
    let mut joined = join_reports(&reports)?;
    // Verdicts by both scores share the error rate.
    let families = [Basis::CrossValidated, Basis::Near];
    let judged = |basis| {
        let kept = reports.iter().zip(results.iter()).filter(|(_, result)| result.returns.is_some());
        kept.filter(|(named, _)| basis_of(&named.report) == Some(basis)).count() > 1
    };
    let looks = families.iter().filter(|&&basis| judged(basis)).count().max(1) as u32;
    let mut judged_runs: Vec<Vec<String>> = Vec::new();
    for basis in families {
        let readers = results.iter_mut().map(|result| result.returns.as_mut());
        let (kept, runs) = kept_of(&reports, readers, &joined, basis);
        if kept.len() > 1 && runs.len() > 1 {
            judge(&mut joined, (kept, &runs), (basis, looks), (threads, progress))?;
            judged_runs.push(runs);
        }
    }
    if !judged_runs.is_empty() {
        let of_all = |pair: &PairReport| {
            judged_runs.iter().any(|runs| runs.contains(&pair.a) && runs.contains(&pair.b))
        };
        joined.report.promise.of_each_result = !joined.report.pairs.iter().all(of_all);
    }
    Ok(joined)
}

/// Results of runs that are judged by `basis` and have saved returns, and the names of these runs, each once.
fn kept_of<'a>(
    reports: &'a [NamedReport],
    readers: impl Iterator<Item = Option<&'a mut KeptReader>>,
    joined: &JoinedReport,
    basis: Basis,
) -> (Vec<Kept<'a>>, Vec<String>) {
    let mut runs: Vec<String> = Vec::new();
    let mut kept = Vec::new();
    for ((named, reader), names) in reports.iter().zip(readers).zip(&joined.runs_of) {
        let Some(reader) = reader.filter(|_| basis_of(&named.report) == Some(basis)) else { continue };
        let mut column = |name: &String| {
            let is_new = !runs.contains(name);
            is_new.then(|| {
                runs.push(name.clone());
                runs.len() - 1
            })
        };
        let columns = names.iter().map(&mut column).collect();
        kept.push(Kept { file: &named.file, report: &named.report, reader, columns });
    }
    (kept, runs)
}

/// The common basis of all runs of a report.
fn basis_of(report: &Report) -> Option<Basis> {
    let is_given =
        |run: &RunReport| run.r_cv_withheld == Some(Withheld::Known(dmp_reduce::Withheld::MapGiven));
    let basis = |run| if is_given(run) { Basis::Near } else { Basis::CrossValidated };
    let mut bases = report.runs.iter().map(basis);
    let first = bases.next()?;
    bases.all(|other| other == first).then_some(first)
}

/// Compares every two of `runs` by their returns.
fn judge(
    joined: &mut JoinedReport,
    (kept, runs): (Vec<Kept<'_>>, &[String]),
    (basis, looks): (Basis, u32),
    (threads, progress): (usize, &dyn Follow),
) -> Result<(), JoinError> {
    let report = &mut joined.report;
    let file = kept.first().map_or(String::new(), |kept| kept.file.to_owned());
    let problem = |problem: String| JoinError::Returns { report: file.clone(), problem };
    let confidence = report.promise.asked().map_err(problem)?.of_each_look(looks);
    let sampling = &report.sampling;
    if sampling.frames_scored > MOST_SCANS {
        return Err(problem(format!("{} scans cannot be compared", thousands(sampling.frames_scored))));
    }
    let miss_price = report.config.miss_price;
    let price = || problem(format!("config.miss_price is {miss_price}, not a share from 0 to 1"));
    let layout = Layout::new(report.sampling.frames_scored, vec![basis; runs.len()])
        .on_scales(report.config.scales)
        .with_miss_price(MissPrice::new(miss_price).ok_or_else(price)?);
    let (reducer, scans, mut posed) = reduce(kept, &layout, (threads, progress), &problem)?;
    let Comparisons { of_each_interval, pairs } = reducer.comparisons(confidence);
    let scan_of = |ordinal: u64| scan_at(&scans, ordinal);
    let log_likelihood = |run: usize| report.run(&runs[run]).map_or(0.0, |run| run.log_likelihood_raw);
    let facts = PairFacts {
        name: &|run| runs[run].clone(),
        log_likelihood: &log_likelihood,
        scan_of_unit: &scan_of,
        scales: report.config.scales,
    };
    posed.sort_by_key(|(ordinal, _)| *ordinal);
    let posed: Vec<PosedScan> = posed.into_iter().map(|(_, scan)| scan).collect();
    let is_camera = report.runs.iter().any(|run| run.dmp_depth_sum_m2.is_some());
    let ruler = Ruler::of(report.config.scales, is_camera, report.inputs.returns_at);
    let same_within_m = report.promise.same_within_m;
    let judged = pairs.into_iter().map(|pair| {
        let apart = apart_of(&posed, [pair.a, pair.b], &ruler);
        let is_same = apart.is_some_and(|apart| apart.is_same(basis, same_within_m));
        let pair = if is_same {
            pair.of_same()
        } else {
            pair.with_revisits(|run| reducer.sums(run), |run| back_of(&posed, run, &ruler))
        };
        PairReport::of(&pair, facts, apart)
    });
    let mut judged: BTreeMap<[String; 2], PairReport> =
        judged.map(|pair| ([pair.a.clone(), pair.b.clone()], pair)).collect();
    let (mut all, mut from_reports) = (Vec::new(), false);
    let names: Vec<String> = report.runs.iter().map(|run| run.name.clone()).collect();
    for [a, b] in pairs_of(&names) {
        if let Some(pair) = judged.remove(&[a.clone(), b.clone()]) {
            all.push(pair);
        } else if let Some(pair) = report.pair(&a, &b) {
            from_reports = true;
            all.push(pair.clone());
        }
    }
    let sure = &mut report.promise.interval_confidence;
    *sure = if from_reports { sure.min(of_each_interval.level()) } else { of_each_interval.level() };
    report.pairs = all;
    report.rank();
    joined.not_compared = pairs_of(&report.order).filter(|[a, b]| report.pair(a, b).is_none()).collect();
    Ok(())
}

/// The number in the log of a scan, by its ordinal: interpolated between evenly drawn ones, exact for a log
/// without gaps.
fn scan_at(scans: &BTreeMap<u64, u64>, ordinal: u64) -> u64 {
    let (before, after) = (scans.range(..=ordinal).next_back(), scans.range(ordinal..).next());
    match (before, after) {
        (Some((&from, &scan)), Some((&to, &next))) if to > from => {
            let part =
                u128::from(next.saturating_sub(scan)) * u128::from(ordinal - from) / u128::from(to - from);
            scan.saturating_add(part as u64)
        }
        (Some((&from, &scan)), _) => scan.saturating_add(ordinal - from),
        (None, Some((&to, &next))) => next.saturating_sub(to - ordinal),
        (None, None) => ordinal,
    }
}

/// The sums of all returns; the numbers of the scored scans by their ordinals among those that could be scored; and their
/// poses, with the ordinals.
type Reduced = (Reducer, BTreeMap<u64, u64>, Vec<(u64, PosedScan)>);

/// Sums all returns.
fn reduce(
    kept: Vec<Kept<'_>>,
    layout: &Layout,
    (threads, progress): (usize, &dyn Follow),
    problem: &dyn Fn(String) -> JoinError,
) -> Result<Reduced, JoinError> {
    // Sums of pairs grow with the square of the runs.
    let runs = layout.bases().len();
    let most = WORKERS_BYTES / (Reducer::bytes_of(runs) + FrameSums::bytes_of(runs)).max(1);
    let threads = threads.min(most).max(1);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.map_err(|error| problem(format!("cannot start threads: {error}")))?;
    progress.begin(kept.first().map_or(0, |kept| kept.report.inputs.returns_used));
    let scored = kept.first().map_or(0, |kept| kept.report.sampling.frames_scored);
    let mut rows = Rows::new(kept, layout.bases().len());
    let mut workers: Vec<Summed> = (0..threads).map(|_| Summed::new(layout)).collect();
    let (mut scans, mut posed) = (BTreeMap::new(), Vec::new());
    loop {
        if progress.cancelled() {
            return Err(JoinError::Cancelled);
        }
        let batch = rows.next_batch()?;
        if batch.is_empty() {
            break;
        }
        scans.extend(batch.iter().map(KeptScan::numbers));
        posed.extend(batch.iter().map(|scan| (scan.numbers().0, scan.posed())));
        let step = workers.len();
        let added = pool.install(|| {
            workers.par_iter_mut().enumerate().try_for_each(|(first, worker)| {
                batch.iter().skip(first).step_by(step).try_for_each(|scan| {
                    worker.add(scan)?;
                    progress.advance(scan.returns());
                    Ok(())
                })
            })
        });
        added.map_err(|error: dmp_reduce::ReduceError| problem(error.to_string()))?;
    }
    let mut whole = Summed::new(layout);
    let added = workers.iter().try_for_each(|worker| whole.reducer.merge(&worker.reducer));
    let empty = scored.saturating_sub(rows.scans);
    added.and_then(|()| whole.reducer.add_empty_frames(empty)).map_err(|error| problem(error.to_string()))?;
    Ok((whole.reducer, scans, posed))
}
