//! Parts as processes, several at a time.

use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Instant;

/// What a part took.
#[derive(Debug, Clone, Default)]
pub(super) struct Process {
    /// User and system, seconds.
    pub(super) on_cores_s: f64,
    /// Share of the log's bytes that it read.
    pub(super) share_read: Option<f64>,
}

/// Does all parts, so many at a time, in order; what each took, and how long it took in all.
pub(super) fn in_workers(
    workers: usize,
    parts: u32,
    command: impl Fn(u32) -> Command + Sync,
) -> anyhow::Result<(Vec<Process>, f64)> {
    let (next, start) = (AtomicU32::new(1), Instant::now());
    let done: Mutex<Vec<(u32, anyhow::Result<Process>)>> = Mutex::default();
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                loop {
                    let part = next.fetch_add(1, Ordering::Relaxed);
                    if part > parts {
                        break;
                    }
                    let process = run(&mut command(part));
                    done.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push((part, process));
                }
            });
        }
    });
    let wall_s = start.elapsed().as_secs_f64();
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(part, _)| *part);
    Ok((done.into_iter().map(|(_, process)| process).collect::<anyhow::Result<_>>()?, wall_s))
}

/// Runs a command to its end under the shell's clock, which knows what a process took on cores.
fn run(command: &mut Command) -> anyhow::Result<Process> {
    let mut timed = Command::new("bash");
    timed.args(["-c", "TIMEFORMAT='%U %S'; time \"$0\" \"$@\""]).arg(command.get_program());
    let output = timed.args(command.get_args()).stdin(Stdio::null()).output()?;
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    anyhow::ensure!(output.status.success(), "{command:?}: {}: {said}", output.status);
    let times = said.lines().last().unwrap_or_default().split(' ').map(str::parse::<f64>);
    let on_cores_s = times.collect::<Result<Vec<_>, _>>()?.iter().sum();
    // `fuse 1/8 is done: 1234 of the log's 5678 bytes were read`
    let line = said.lines().find(|line| line.contains(" is done: "));
    let share_read = line.and_then(|line| {
        let numbers: Vec<f64> = line.split(' ').filter_map(|word| word.parse().ok()).collect();
        Some(numbers.first()? / numbers.get(1)?)
    });
    Ok(Process { on_cores_s, share_read })
}
