//! Casters on the same files, as processes that cast on request: the project's own, and those of `bench/peers/`.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use anyhow::{Context as _, bail, ensure};

use super::files::{Files, numbers};
use crate::workspace::root;

/// Which caster.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum PeerKind {
    /// Embree's oriented discs: `cast` of `bench/peers/embree`, with these options.
    Embree(String),
    /// `Open3D` on octagons, with a Python that has it.
    Open3d(PathBuf),
    /// The project's own: this program.
    Own,
}

impl PeerKind {
    pub(super) fn name(&self) -> String {
        match self {
            Self::Embree(options) => format!("embree {options}").trim().to_owned(),
            Self::Open3d(_) => "open3d".to_owned(),
            Self::Own => "dmp".to_owned(),
        }
    }

    /// Program and arguments.
    fn words(&self, files: &Files) -> anyhow::Result<Vec<String>> {
        let paths = [&files.surfels, &files.rays, &files.support, &files.segments];
        let [surfels, rays, support, segments] = paths.map(|path| path.display().to_string());
        let mut words = match self {
            Self::Embree(_) => vec![embree_folder()?.join("cast").display().to_string()],
            Self::Open3d(python) => {
                let has_it = Command::new(python).args(["-c", "import open3d"]).output();
                let has_it = has_it.with_context(|| format!("{}: cannot start", python.display()))?;
                ensure!(has_it.status.success(), "{} has no open3d", python.display());
                let script = root().join("bench/peers/open3d/cast.py").display().to_string();
                vec![python.display().to_string(), script]
            }
            Self::Own => {
                let program = std::env::current_exe()?.display().to_string();
                vec![program, "bench".to_owned(), "cast-serve".to_owned()]
            }
        };
        words.extend([surfels, rays]);
        match self {
            Self::Embree(options) => words.extend(options.split_whitespace().map(str::to_owned)),
            Self::Open3d(_) => {}
            Self::Own => words.extend([support, segments]),
        }
        Ok(words)
    }
}

/// A caster that has read its work and waits for requests. It ends with this.
#[derive(Debug)]
pub(super) struct Peer {
    pub(super) name: String,
    /// Its first line: sizes, and the time to build.
    pub(super) ready: String,
    child: Child,
    requests: Option<ChildStdin>,
    answers: BufReader<ChildStdout>,
}

impl Peer {
    /// Builds the caster where that is needed, starts it and waits until it is ready. It runs on `core` alone, where the
    /// machine has `taskset`.
    ///
    /// # Errors
    /// In one line, why the machine has no such caster.
    pub(super) fn start(kind: &PeerKind, files: &Files, core: usize) -> anyhow::Result<Self> {
        let mut words = kind.words(files)?;
        if can_pin(core) {
            words.splice(0..0, ["taskset".to_owned(), "-c".to_owned(), core.to_string()]);
        }
        let (program, arguments) = words.split_first().context("no command")?;
        let mut command = Command::new(program);
        let child = command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
        let mut child = child.with_context(|| format!("{program}: cannot start"))?;
        let requests = child.stdin.take();
        let answers = BufReader::new(child.stdout.take().context("a pipe was asked for")?);
        let mut peer = Self { name: kind.name(), ready: String::new(), child, requests, answers };
        let line = peer.answer()?;
        let ready = line.strip_prefix("ready ");
        peer.ready = ready.with_context(|| format!("{}: {line:?} instead of ready", peer.name))?.to_owned();
        Ok(peer)
    }

    /// Casts all rays once; seconds of the casting alone.
    pub(super) fn cast_s(&mut self, mode: &str) -> anyhow::Result<f64> {
        let answer = self.ask(&format!("go {mode}"))?;
        answer.parse().with_context(|| format!("{}: {answer:?} instead of seconds", self.name))
    }

    /// Casts all rays once, each alone; a range for each, metres, NaN for a miss. The project's own has no such request.
    pub(super) fn ranges(&mut self) -> anyhow::Result<Vec<f64>> {
        let folder = tempfile::tempdir()?;
        let path = folder.path().join("ranges");
        let answer = self.ask(&format!("ranges single {}", path.display()))?;
        ensure!(answer == "ok", "{}: {answer:?} instead of ok", self.name);
        numbers(&path, |bytes| f64::from(f32::from_le_bytes(bytes)))
    }

    fn ask(&mut self, request: &str) -> anyhow::Result<String> {
        let requests = self.requests.as_mut().context("no pipe to ask through")?;
        // Where the caster has ended, its status says more than a broken pipe.
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

/// Builds the Embree programs in a folder.
pub(super) fn embree_folder() -> anyhow::Result<PathBuf> {
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), PathBuf::from);
    let folder = target.join("peers").join("embree");
    let source = root().join("bench/peers/embree");
    succeed(Command::new("cmake").arg("-S").arg(source).arg("-B").arg(&folder))
        .context("building needs CMake, a C++ compiler and Embree 3 (libembree-dev)")?;
    succeed(Command::new("cmake").arg("--build").arg(&folder))?;
    Ok(folder)
}

/// Runs a command to its end. The error is its first line with that word.
pub(super) fn succeed(command: &mut Command) -> anyhow::Result<()> {
    let program = Path::new(command.get_program()).display().to_string();
    let output = command.stdin(Stdio::null()).output().with_context(|| format!("{program}: cannot start"))?;
    let text = String::from_utf8_lossy(&output.stderr);
    let line = text.lines().find(|line| line.to_lowercase().contains("error")).unwrap_or_default();
    ensure!(output.status.success(), "{program}: {}: {line}", output.status);
    Ok(())
}

fn can_pin(core: usize) -> bool {
    let pinned = Command::new("taskset").args(["-c", &core.to_string(), "true"]).output();
    pinned.is_ok_and(|output| output.status.success())
}
