//! Casters on the same work files, as processes that stay and cast on request: the project's own, and `bench/peers/`.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context as _, bail, ensure};

use super::files::Files;
use super::records::{RECORD_BYTES, numbers};
use crate::workspace::root;

/// Which caster.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum PeerKind {
    /// Embree's oriented discs: `cast` of `bench/peers/embree`, on one thread, with these options of its.
    Embree { options: Vec<String> },
    /// `Open3D` on octagons, with a Python that has it.
    Open3d { python: PathBuf },
    /// The project's own: this program again.
    Own,
}

impl PeerKind {
    /// Embree with the options of a line; an empty line is Embree as it comes.
    pub(crate) fn embree(options: &str) -> Self {
        Self::Embree { options: options.split_whitespace().map(str::to_owned).collect() }
    }

    pub(crate) fn name(&self) -> String {
        match self {
            Self::Embree { options } => {
                ["embree"].into_iter().chain(options.iter().map(String::as_str)).collect::<Vec<_>>().join(" ")
            }
            Self::Open3d { .. } => "open3d".to_owned(),
            Self::Own => "dmp".to_owned(),
        }
    }

    /// Program and arguments in front of the surfels and rays, and behind them.
    fn command(&self, files: &Files) -> anyhow::Result<(Vec<String>, Vec<String>)> {
        let serve = "--serve".to_owned();
        match self {
            Self::Embree { options } => {
                let cast = embree_folder()?.join("cast").display().to_string();
                Ok((vec![cast], options.iter().cloned().chain([serve]).collect()))
            }
            Self::Open3d { python } => {
                let has_it = Command::new(python).args(["-c", "import open3d"]).output();
                let has_it = has_it.with_context(|| format!("{}: cannot start", python.display()))?;
                ensure!(has_it.status.success(), "{} has no open3d", python.display());
                let script = root().join("bench/peers/open3d/cast.py").display().to_string();
                Ok((vec![python.display().to_string(), script], vec![serve]))
            }
            Self::Own => {
                let program = std::env::current_exe()?.display().to_string();
                let segments = files.segments.iter().flatten().map(|path| path.display().to_string());
                Ok((vec![program, "bench".to_owned(), "cast-serve".to_owned()], segments.collect()))
            }
        }
    }
}

/// A caster that has read its work and waits for requests. It ends with this.
#[derive(Debug)]
pub(crate) struct Peer {
    name: String,
    /// What it said when it was ready: sizes, and how long building took.
    pub(crate) ready: String,
    rays: u64,
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl Peer {
    /// Builds the caster where it must be built, gives it its work, and waits until it is ready.
    ///
    /// With `core`, it runs on that core alone, where the machine has `taskset`.
    ///
    /// # Errors
    /// In one line, why this caster cannot be had on this machine, or what is wrong with the files.
    pub(crate) fn start(kind: &PeerKind, files: &Files, core: Option<usize>) -> anyhow::Result<Self> {
        let name = kind.name();
        let (mut words, behind) = kind.command(files)?;
        words.extend([&files.surfels, &files.rays].map(|path| path.display().to_string()));
        words.extend(behind);
        if let Some(core) = core.filter(|&core| can_pin(core)) {
            words.splice(0..0, ["taskset".to_owned(), "-c".to_owned(), core.to_string()]);
        }
        let (program, arguments) = words.split_first().context("no command")?;
        let mut child = Command::new(program)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("{program}: cannot start"))?;
        let requests = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().context("a pipe was asked for")?);
        let rays = count(&files.rays)?;
        let mut peer = Self { name, ready: String::new(), rays, child, requests, answers };
        let line = peer.answer()?;
        let ready =
            line.strip_prefix("ready ").with_context(|| format!("{}: it says {line:?}", peer.name))?;
        peer.ready = ready.to_owned();
        Ok(peer)
    }

    /// What it is called in tables.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// How many rays it casts.
    pub(crate) fn rays(&self) -> u64 {
        self.rays
    }

    /// Goes over to the rays of another file; the segments of rays are not known then.
    ///
    /// # Errors
    /// When the caster cannot read them; it is gone then.
    pub(crate) fn change_rays(&mut self, rays: &Path) -> anyhow::Result<()> {
        let answer = self.ask(&format!("rays {}", rays.display()))?;
        ensure!(answer == "ok", "{}: it says {answer:?}, not ok", self.name);
        self.rays = count(rays)?;
        Ok(())
    }

    /// Bytes of its own trees over all surfels, after `go build`.
    ///
    /// # Errors
    /// When it is another caster: only the project's own can tell; it is gone then.
    pub(crate) fn bytes(&mut self) -> anyhow::Result<u64> {
        let answer = self.ask("bytes")?;
        answer.parse().with_context(|| format!("{}: it says {answer:?}, not bytes", self.name))
    }

    /// Casts all rays once; seconds that the casting itself took.
    ///
    /// # Errors
    /// When the caster has no such mode; it is gone then.
    pub(crate) fn cast_s(&mut self, mode: &str) -> anyhow::Result<f64> {
        let answer = self.ask(&format!("go {mode}"))?;
        answer.parse().with_context(|| format!("{}: it says {answer:?}, not seconds", self.name))
    }

    /// Casts all rays once; a range for each, metres, NaN for a miss.
    ///
    /// # Errors
    /// As [`Peer::cast_s`].
    pub(crate) fn ranges(&mut self, mode: &str) -> anyhow::Result<Vec<f32>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("ranges");
        let answer = self.ask(&format!("ranges {mode} {}", path.display()))?;
        ensure!(answer == "ok", "{}: it says {answer:?}, not ok", self.name);
        let ranges = numbers(&path, f32::from_le_bytes)?;
        ensure!(
            ranges.len() as u64 == self.rays,
            "{}: {} ranges of {} rays",
            self.name,
            ranges.len(),
            self.rays
        );
        Ok(ranges)
    }

    fn ask(&mut self, request: &str) -> anyhow::Result<String> {
        let requests = self.requests.as_mut().context("no pipe to ask through")?;
        // Where the caster is gone, its status says more than a broken pipe.
        let asked = writeln!(requests, "{request}").and_then(|()| requests.flush());
        let answer = self.answer()?;
        asked.with_context(|| self.name.clone())?;
        Ok(answer)
    }

    fn answer(&mut self) -> anyhow::Result<String> {
        let mut line = String::new();
        if self.answers.read_line(&mut line).with_context(|| self.name.clone())? == 0 {
            bail!("{}: it ended with {}", self.name, self.child.wait()?);
        }
        Ok(line.trim_end().to_owned())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // The end of its input ends it.
        drop(self.requests.take());
        let _ = self.child.wait();
    }
}

/// How many rays a file holds.
fn count(rays: &Path) -> anyhow::Result<u64> {
    Ok(std::fs::metadata(rays).with_context(|| rays.display().to_string())?.len() / RECORD_BYTES)
}

/// Builds the Embree programs and says where they are.
pub(super) fn embree_folder() -> anyhow::Result<PathBuf> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    let folder = target.join("peers").join("embree");
    let source = root().join("bench/peers/embree");
    succeed(Command::new("cmake").arg("-S").arg(source).arg("-B").arg(&folder))
        .context("building needs CMake, a C++ compiler and Embree 3 (libembree-dev)")?;
    succeed(Command::new("cmake").arg("--build").arg(&folder))?;
    Ok(folder)
}

/// Runs a command to its end, which must be a good one; else the first line it has of the error.
pub(super) fn succeed(command: &mut Command) -> anyhow::Result<()> {
    let program = command.get_program().display().to_string();
    let output = command.stdin(Stdio::null()).output().with_context(|| format!("{program}: cannot start"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let line = text.lines().find(|line| line.to_lowercase().contains("error")).unwrap_or_default();
    ensure!(output.status.success(), "{program}: {}: {line}", output.status);
    Ok(())
}

/// Whether programs can be kept on this core.
fn can_pin(core: usize) -> bool {
    let pinned = Command::new("taskset").args(["-c", &core.to_string(), "true"]).output();
    pinned.is_ok_and(|output| output.status.success())
}
