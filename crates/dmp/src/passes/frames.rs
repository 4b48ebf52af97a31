//! Reads the planned frames of a log and distributes them to threads.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use crossbeam_channel::bounded;
use dmp_log::ScanLog;
use dmp_reduce::FrameSet;
use dmp_runs::{EvaluateError, FrameOrder, PlannedFrame, Progress};
use dmp_sensor::Scan;

use crate::drawn::{DrawnScans, ScanFacts};
use crate::means::peak;

/// The work of a thread on its frames.
pub(crate) trait Worker: Send {
    /// Processes one frame; `ordinal` counts the planned frames in order of time.
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError>;

    /// The same where `scan` holds the drawn returns of a scan, of which `facts` are known.
    fn drawn_frame(
        &mut self,
        ordinal: usize,
        frame: &PlannedFrame,
        scan: &Scan,
        _facts: &ScanFacts,
    ) -> Result<(), EvaluateError> {
        self.frame(ordinal, frame, scan)
    }
}

/// One reading of a log.
#[derive(Clone, Copy)]
pub(crate) struct Reading<'a> {
    pub(crate) log: &'a dyn ScanLog,
    /// Where only drawn returns are wanted: those that were kept. Other scans are read from the log, whole.
    pub(crate) drawn: Option<&'a DrawnScans>,
    pub(crate) frames: &'a [PlannedFrame],
    pub(crate) order: FrameOrder,
    pub(crate) progress: &'a dyn Progress,
}

/// Stores the workers' state, given the frames that they have done.
type Keep<'a, W> = dyn FnMut(&[W], &FrameSet) -> Result<(), EvaluateError> + 'a;

/// Pauses of all workers, in which their state is stored.
pub(crate) struct Pauses<'a, W> {
    /// Time between pauses; `None`: never.
    pub(crate) every: Option<Duration>,
    /// Frames that are already done.
    pub(crate) done: FrameSet,
    /// Called in each pause.
    pub(crate) keep: &'a mut Keep<'a, W>,
    /// Called with the number of every job before it is handed out.
    pub(crate) ahead: &'a dyn Fn(usize),
}

/// Reads the planned frames once and hands each to one of the workers, with a thread per worker.
///
/// Frames that are cheapest read together go to the same thread. The workers are returned in arbitrary order:
/// their sums must not depend on the distribution.
pub(crate) fn each_frame<W: Worker>(reading: Reading<'_>, workers: Vec<W>) -> Result<Vec<W>, EvaluateError> {
    each_frame_of(reading, |_| true, workers)
}

/// The same for the `wanted` frames.
pub(crate) fn each_frame_of<W: Worker>(
    reading: Reading<'_>,
    wanted: impl Fn(usize) -> bool,
    workers: Vec<W>,
) -> Result<Vec<W>, EvaluateError> {
    each_frame_of_jobs(reading, jobs_of(reading, wanted), workers)
}

/// The same for the frames of some jobs.
pub(crate) fn each_frame_of_jobs<W: Worker>(
    reading: Reading<'_>,
    jobs: Vec<Vec<usize>>,
    workers: Vec<W>,
) -> Result<Vec<W>, EvaluateError> {
    let pauses = Pauses { every: None, done: FrameSet::default(), keep: &mut |_, _| Ok(()), ahead: &|_| () };
    each_frame_in_parts(reading, jobs, workers, pauses).map(|(workers, _)| workers)
}

/// The same for some frames, with pauses, but none at the end. Returns the workers and all frames done.
pub(crate) fn each_frame_in_parts<W: Worker>(
    reading: Reading<'_>,
    jobs: Vec<Vec<usize>>,
    mut workers: Vec<W>,
    pauses: Pauses<'_, W>,
) -> Result<(Vec<W>, FrameSet), EvaluateError> {
    let Pauses { every, mut done, keep, ahead } = pauses;
    let mut jobs = jobs.into_iter().enumerate().peekable();
    loop {
        let until = every.map(|every| Instant::now() + every);
        let mut begun = false;
        let mut part = std::iter::from_fn(|| {
            // At least one job is done between pauses, however short.
            let go_on =
                !std::mem::replace(&mut begun, true) || until.is_none_or(|until| Instant::now() < until);
            let (number, job) = jobs.next_if(|_| go_on)?;
            ahead(number);
            done.extend(job.iter().copied());
            Some(job)
        });
        workers = in_threads(reading, &mut part, workers)?;
        if jobs.peek().is_none() {
            return Ok((workers, done));
        }
        keep(&workers, &done)?;
    }
}

/// Hands jobs to the workers, a thread for each, until none is left.
fn in_threads<W: Worker>(
    reading: Reading<'_>,
    jobs: &mut dyn Iterator<Item = Vec<usize>>,
    workers: Vec<W>,
) -> Result<Vec<W>, EvaluateError> {
    let stopped = AtomicBool::new(false);
    let failure: Mutex<Option<EvaluateError>> = Mutex::new(None);
    let (sender, receiver) = bounded::<Vec<usize>>(2 * workers.len());

    let done = std::thread::scope(|scope| {
        let threads: Vec<_> = workers
            .into_iter()
            .map(|mut worker| {
                let (receiver, stopped, failure) = (receiver.clone(), &stopped, &failure);
                scope.spawn(move || {
                    if let Err(error) = work(reading, &receiver, stopped, &mut worker) {
                        stopped.store(true, Ordering::Relaxed);
                        let mut failure = failure.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                        failure.get_or_insert(error);
                    }
                    worker
                })
            })
            .collect();
        drop(receiver);
        for job in jobs {
            // The channel is closed once every worker has stopped on an error.
            if sender.send(job).is_err() {
                break;
            }
        }
        drop(sender);
        let resume = |panic| std::panic::resume_unwind(panic);
        threads.into_iter().map(|thread| thread.join().unwrap_or_else(resume)).collect()
    });
    match failure.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner) {
        Some(error) => Err(error),
        None => Ok(done),
    }
}

fn work<W: Worker>(
    Reading { log, drawn, frames, progress, .. }: Reading<'_>,
    jobs: &crossbeam_channel::Receiver<Vec<usize>>,
    stopped: &AtomicBool,
    worker: &mut W,
) -> Result<(), EvaluateError> {
    let mut reader = log.reader()?;
    let mut scan = Scan::default();
    for job in jobs {
        for ordinal in job {
            if stopped.load(Ordering::Relaxed) {
                return Ok(());
            }
            if progress.cancelled() {
                return Err(EvaluateError::Cancelled);
            }
            let frame = &frames[ordinal];
            let kept = drawn.map(|drawn| drawn.read(ordinal, &mut scan)).transpose()?.flatten();
            if let Some(facts) = kept {
                worker.drawn_frame(ordinal, frame, &scan, &facts)?;
            } else {
                reader.read(frame.frame, &mut scan)?;
                worker.frame(ordinal, frame, &scan)?;
            }
        }
        peak::look();
    }
    Ok(())
}

/// Ordinals of the `wanted` frames, grouped by the log's groups.
pub(crate) fn jobs_of(
    Reading { log, frames, order, .. }: Reading<'_>,
    wanted: impl Fn(usize) -> bool,
) -> Vec<Vec<usize>> {
    let mut ordinal_of: Vec<Option<usize>> = vec![None; log.frames().len()];
    for (ordinal, frame) in frames.iter().enumerate().filter(|(ordinal, _)| wanted(*ordinal)) {
        ordinal_of[frame.frame] = Some(ordinal);
    }
    let mut jobs: Vec<Vec<usize>> =
        log.groups().into_iter().map(|group| group.filter_map(|frame| ordinal_of[frame]).collect()).collect();
    jobs.retain(|job: &Vec<usize>| !job.is_empty());
    if let FrameOrder::Shuffled(seed) = order {
        let mut singles: Vec<Vec<usize>> = jobs.into_iter().flatten().map(|ordinal| vec![ordinal]).collect();
        shuffle(&mut singles, seed);
        jobs = singles;
    }
    jobs
}

/// Fisher–Yates with a 64-bit linear congruential generator: its quality is irrelevant here.
fn shuffle<T>(items: &mut [T], seed: u64) {
    let mut state = seed;
    for k in (1..items.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        items.swap(k, ((state >> 33) as usize) % (k + 1));
    }
}
