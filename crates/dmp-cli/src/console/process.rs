//! What the process sets up once: memory, interrupts.

use std::io::{self, IsTerminal as _, Write as _};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use dmp::Note;

use super::exit::{Exit, option_of};
use super::say;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
/// How long work has to end in order.
const IN_ORDER: Duration = Duration::from_millis(150);
/// How long a process that ends at once waits for its last lines to be taken.
const LAST_LINES: Duration = Duration::from_millis(100);

/// Makes the C library give memory back. By itself it learns to keep what large lists leave, in ever more pieces, until a
/// third more is held than is in use. It reads how from the environment when a process begins; so this one begins
/// again, once, as the same process with the same arguments.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
pub(crate) fn begin_again_with_memory_given_back() {
    use std::os::unix::process::CommandExt as _;

    // Lists from this size have pages of their own, which go back to the system with them; bytes. What is smaller comes
    // from one heap: with one for every thread, each keeps what passes that are over have left in it.
    const SETTINGS: [(&str, &str); 3] = [
        ("MALLOC_MMAP_THRESHOLD_", "262144"),
        ("MALLOC_TRIM_THRESHOLD_", "1048576"),
        ("MALLOC_ARENA_MAX", "1"),
    ];
    // What somebody has set stays as it is. All together keep memory small: each is set even if another is.
    let missing: Vec<_> = SETTINGS.into_iter().filter(|(name, _)| std::env::var_os(name).is_none()).collect();
    if missing.is_empty() {
        return;
    }
    let (Ok(program), mut arguments) = (std::env::current_exe(), std::env::args_os()) else { return };
    let Some(name) = arguments.next() else { return };
    // It returns only where that fails; then memory is held as usual.
    let _ = std::process::Command::new(program).arg0(name).args(arguments).envs(missing).exec();
}

/// Only the GNU C library is known to need it.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
pub(crate) fn begin_again_with_memory_given_back() {}

/// Prepares this process for Ctrl-C and requests to end. The first is noted, and work that looks whether it was ends in order;
/// what has not ended soon, wherever it is, and what is asked a second time, ends at once. Nothing unfinished is left behind.
pub(crate) fn prepare() {
    leave_full_files_to_their_writers();
    // Without a handler an interrupt ends the process as it always did; that is no reason not to work.
    let _ = ctrlc::set_handler(|| {
        let again = INTERRUPTED.swap(true, Ordering::SeqCst);
        let soon = || {
            thread::sleep(IN_ORDER);
            end_at_once();
        };
        if again || thread::Builder::new().spawn(soon).is_err() {
            end_at_once();
        }
    });
}

/// A limit on the size of files (`ulimit -f`) ends a process by a signal, in silence. With a handler the write fails, as on a
/// full disk.
#[cfg(unix)]
fn leave_full_files_to_their_writers() {
    let _ = signal_hook::flag::register(signal_hook::consts::SIGXFSZ, std::sync::Arc::default());
}

#[cfg(not(unix))]
fn leave_full_files_to_their_writers() {}

fn end_at_once() {
    let kept = dmp_disk::remove_unfinished();
    let mut lines: Vec<String> = kept
        .into_iter()
        .map(|folder| format!("note: {}", Note::WorkKept { folder }.message_with(&option_of)))
        .collect();
    lines.push("error: stopped before the end".into());
    say_last(lines);
    std::process::exit(Exit::Interrupted as i32);
}

/// Says lines where somebody takes them soon: at a pipe that is full, whoever writes waits for ever.
fn say_last(lines: Vec<String>) {
    let (said, is_said) = mpsc::channel();
    let say = move || {
        if io::stderr().is_terminal() {
            // Where progress was drawn.
            let _ = write!(io::stderr(), "\r\x1b[2K");
        }
        lines.iter().for_each(|line| say::line(format_args!("{line}")));
        // Nobody waits any more where it took too long.
        let _ = said.send(());
    };
    if thread::Builder::new().spawn(say).is_ok() {
        let _ = is_said.recv_timeout(LAST_LINES);
    }
}

/// Whether the process was asked to stop.
pub(crate) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::SeqCst)
}
