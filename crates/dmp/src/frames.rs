use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::bounded;
use dmp_log::ScanLog;
use dmp_sensor::Scan;

use crate::config::FrameOrder;
use crate::error::EvaluateError;
use crate::memory;
use crate::watch::Watch;

/// A scan to be scored.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct PlannedFrame {
    /// Its index in the log.
    pub(crate) frame: usize,
    /// Its stamp with the time offset, nanoseconds; `None` where the log has none.
    pub(crate) stamp_ns: Option<i64>,
    /// Returns in it, used or not.
    pub(crate) returns: u64,
    /// Segment of the drive.
    pub(crate) segment: i32,
}

/// What a thread does with the frames it is given.
pub(crate) trait Worker: Send {
    /// Takes one frame; `ordinal` counts the planned frames in order of time.
    fn frame(&mut self, ordinal: usize, frame: &PlannedFrame, scan: &Scan) -> Result<(), EvaluateError>;
}

/// Reads the planned frames once and hands each to one of the workers, a thread for each of them.
///
/// Frames that are cheapest read together go to the same thread. The workers come back, in no order
/// that means anything: what they hold must add up to the same, whoever held what.
pub(crate) fn each_frame<W: Worker>(
    log: &dyn ScanLog,
    frames: &[PlannedFrame],
    order: FrameOrder,
    watch: &dyn Watch,
    workers: Vec<W>,
) -> Result<Vec<W>, EvaluateError> {
    let jobs = jobs_of(log, frames, order);
    let stopped = AtomicBool::new(false);
    let failure: Mutex<Option<EvaluateError>> = Mutex::new(None);
    let (sender, receiver) = bounded::<Vec<usize>>(2 * workers.len());

    let done = std::thread::scope(|scope| {
        let threads: Vec<_> = workers
            .into_iter()
            .map(|mut worker| {
                let (receiver, stopped, failure) = (receiver.clone(), &stopped, &failure);
                scope.spawn(move || {
                    if let Err(error) = work(log, frames, &receiver, stopped, watch, &mut worker) {
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
            // Nobody listens any more once every worker has stopped on an error.
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
    log: &dyn ScanLog,
    frames: &[PlannedFrame],
    jobs: &crossbeam_channel::Receiver<Vec<usize>>,
    stopped: &AtomicBool,
    watch: &dyn Watch,
    worker: &mut W,
) -> Result<(), EvaluateError> {
    let mut reader = log.reader()?;
    let mut scan = Scan::default();
    for job in jobs {
        for ordinal in job {
            if stopped.load(Ordering::Relaxed) {
                return Ok(());
            }
            if watch.cancelled() {
                return Err(EvaluateError::Cancelled);
            }
            let frame = &frames[ordinal];
            reader.read(frame.frame, &mut scan)?;
            worker.frame(ordinal, frame, &scan)?;
        }
        memory::look();
    }
    Ok(())
}

/// Ordinals of the planned frames, gathered by the log's groups.
fn jobs_of(log: &dyn ScanLog, frames: &[PlannedFrame], order: FrameOrder) -> Vec<Vec<usize>> {
    let mut ordinal_of: Vec<Option<usize>> = vec![None; log.frames().len()];
    for (ordinal, frame) in frames.iter().enumerate() {
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

/// Fisher–Yates with a 64-bit linear congruential generator: any order will do.
fn shuffle<T>(items: &mut [T], seed: u64) {
    let mut state = seed;
    for k in (1..items.len()).rev() {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        items.swap(k, ((state >> 33) as usize) % (k + 1));
    }
}
