//! Runs a command under limits of time and memory.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{Read as _, Seek as _};
use std::os::unix::process::ExitStatusExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use anyhow::Context as _;
use rustix::process::{Pid, Resource, Rlimit, prlimit};

/// What a command may take.
pub(crate) const MOST_SECONDS: u64 = 60;
pub(crate) const MOST_RESIDENT_BYTES: u64 = 1 << 30;
/// Memory that is asked for but not used; maps of files count too. Beyond it a command is refused memory, and aborts.
const MOST_ADDRESS_BYTES: u64 = 16 << 30;
/// What a command writes into one file; beyond it the system ends it with [`TOO_LONG_A_FILE`].
const MOST_FILE_BYTES: u64 = 1 << 30;
pub(crate) const TOO_LONG_A_FILE: i32 = 25;
/// More of what a command prints is not read.
const MOST_PRINTED_BYTES: u64 = 16 << 20;

/// How a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum End {
    Exit(i32),
    Signal(i32),
    /// It was ended after [`MOST_SECONDS`].
    TooLong,
    /// It was ended, or had ended, with more than [`MOST_RESIDENT_BYTES`].
    TooLarge,
}

/// How a command ended, and what it printed.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) end: End,
    pub(crate) stdout: Vec<u8>,
    pub(crate) stderr: Vec<u8>,
}

/// Runs `dmp` in a folder; its temporary files belong below `temporary`. `surroundings` are variables of its environment.
pub(crate) fn run(
    dmp: &Path,
    words: &[String],
    folder: &Path,
    temporary: &Path,
    surroundings: &[(&str, OsString)],
) -> anyhow::Result<Ended> {
    let (mut stdout, mut stderr) = (tempfile::tempfile_in(temporary)?, tempfile::tempfile_in(temporary)?);
    let mut command = Command::new(dmp);
    command.args(words).current_dir(folder).env("TMPDIR", temporary).stdin(Stdio::null());
    command.envs(surroundings.iter().map(|(name, value)| (name, value)));
    command.stdout(stdout.try_clone()?).stderr(stderr.try_clone()?);
    let start = Instant::now();
    let mut child = command.spawn().with_context(|| format!("{}: cannot start", dmp.display()))?;
    let end = watch(&mut child, start)?;
    Ok(Ended { end, stdout: all_of(&mut stdout)?, stderr: all_of(&mut stderr)? })
}

fn watch(child: &mut Child, start: Instant) -> anyhow::Result<End> {
    if let Some(pid) = Pid::from_raw(child.id() as i32) {
        for (resource, most) in [(Resource::As, MOST_ADDRESS_BYTES), (Resource::Fsize, MOST_FILE_BYTES)] {
            // It fails where the command has ended already.
            let _ = prlimit(Some(pid), resource, Rlimit { current: Some(most), maximum: Some(most) });
        }
    }
    let mut pause = Duration::from_micros(500);
    let too_much = loop {
        // The most it ever held, known until it has ended.
        if held(child) > MOST_RESIDENT_BYTES {
            break End::TooLarge;
        }
        if let Some(status) = child.try_wait()? {
            return Ok(status.code().map_or_else(|| End::Signal(status.signal().unwrap_or(0)), End::Exit));
        }
        if start.elapsed().as_secs() >= MOST_SECONDS {
            break End::TooLong;
        }
        std::thread::sleep(pause);
        pause = (pause * 2).min(Duration::from_millis(4));
    };
    // It may have ended meanwhile.
    let _ = child.kill();
    child.wait()?;
    Ok(too_much)
}

/// The largest resident memory of a process so far, bytes; 0 where the system does not say.
fn held(child: &Child) -> u64 {
    let status = |of: &str| fs::read_to_string(format!("/proc/{of}/status")).unwrap_or_default();
    let child = status(&child.id().to_string());
    let field = |text: &str, name: &str| -> Option<String> {
        Some(text.lines().find_map(|line| line.strip_prefix(name))?.split_whitespace().next()?.to_owned())
    };
    // Before the command begins, its process is this one's double, with as much memory.
    if field(&child, "Name:") == field(&status("self"), "Name:") {
        return 0;
    }
    field(&child, "VmHWM:").and_then(|kib| kib.parse::<u64>().ok()).unwrap_or(0) * 1024
}

fn all_of(file: &mut File) -> std::io::Result<Vec<u8>> {
    file.rewind()?;
    let mut bytes = Vec::new();
    file.take(MOST_PRINTED_BYTES).read_to_end(&mut bytes)?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sh(line: &str) -> Ended {
        let folder = tempfile::tempdir().unwrap();
        run(Path::new("/bin/sh"), &["-c".into(), line.into()], folder.path(), folder.path(), &[]).unwrap()
    }

    #[test]
    fn ends_differ() {
        let ended = sh("echo out; echo err >&2; exit 3");
        assert_eq!((ended.end, ended.stdout, ended.stderr), (End::Exit(3), b"out\n".into(), b"err\n".into()));
        assert_eq!(sh("kill -6 $$").end, End::Signal(6));
    }
}
