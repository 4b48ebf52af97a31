//! What several tests need: small logs on disk, real data, the command and what it printed.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::{Mutex, OnceLock};
use std::time::Duration;

use dmp::{Config, DriftPairs, Report, Run, evaluate};
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, ScanLog, open_log, write_tum};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{LidarOptions, Noise, Recording, RecordingOptions, Route, SlamErrors};
use serde_json::Value;

/// The path of the command under test.
pub(crate) const PROGRAM: &str = env!("CARGO_BIN_EXE_dmp-under-test");
/// The command of the README, its JSON and its page `report.html`.
pub(crate) const SAMPLE: &str = "score @/town.mcap -t @/truth.tum -t @/drift.tum -t @/noise.tum -t @/collapsed.tum --report report.html --json --quiet";
/// A score of the sample without what takes two thirds of its time: the checks of the runs, and the drift.
pub(crate) const SCORE: &str = "score @/town.mcap --trust --drift=none";
/// The same of two runs.
pub(crate) const TWO: &str = "score @/town.mcap --trust --drift=none -t @/truth.tum -t @/drift.tum";

/// A folder of real recordings, or a line that says what was skipped.
pub(crate) fn real_data(folder: &str) -> Option<PathBuf> {
    let Some(root) = std::env::var_os("DMP_DATA") else {
        println!("skipped: DMP_DATA is not set, so {folder} cannot be read");
        return None;
    };
    let path = Path::new(&root).join(folder);
    // Tests run in their package's folder; a relative path was meant from the workspace's.
    let path = if path.is_relative() { workspace().join(path) } else { path };
    assert!(path.exists(), "DMP_DATA is set, but {} does not exist", path.display());
    Some(path)
}

/// The root of the workspace.
pub(crate) fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_path_buf()
}

/// A file of the samples.
pub(crate) fn sample(name: &str) -> PathBuf {
    workspace().join("data-samples").join(name)
}

pub(crate) fn trajectory(path: &Path) -> Trajectory {
    dmp_log::read_trajectory(path).unwrap().trajectory
}

/// The lines of a sample's trajectory, in columns.
pub(crate) fn sample_rows(name: &str) -> Vec<Vec<f64>> {
    let text = std::fs::read_to_string(sample(name)).unwrap();
    let rows = text.lines().filter(|line| !line.starts_with('#'));
    rows.map(|line| line.split_whitespace().map(|number| number.parse().unwrap()).collect()).collect()
}

/// Rows of numbers as a TUM file.
pub(crate) fn tum(rows: &[Vec<f64>]) -> String {
    let line = |row: &Vec<f64>| {
        let rest: Vec<String> = row[1..].iter().map(f64::to_string).collect();
        format!("{:.9} {}\n", row[0], rest.join(" "))
    };
    rows.iter().map(line).collect()
}

/// A simulated drive with a revisit: its scans and its truth, one pose each 50 ms.
pub(crate) fn small_town(scans: usize, azimuth_steps: usize) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps, rate_hz: 2.0, ..LidarOptions::with_beams(16) };
    recorded(&RecordingOptions { seed: 4, scans, route: Route::Loop, speed_m_s: 6.0, traffic: 2, lidar })
}

/// The scans and the truth of a recording, one pose each 50 ms. Recorded once for all tests.
pub(crate) fn recorded(options: &RecordingOptions) -> (Vec<Scan>, Trajectory) {
    static MADE: Mutex<BTreeMap<String, &OnceLock<(Vec<Scan>, Trajectory)>>> = Mutex::new(BTreeMap::new());
    let cell =
        *MADE.lock().unwrap().entry(format!("{options:?}")).or_insert_with(|| Box::leak(Box::default()));
    let record = || {
        let town = options.town().unwrap();
        let recording = Recording::new(&town, options).unwrap();
        (recording.scans().collect(), recording.drive().trajectory(20.0).unwrap())
    };
    cell.get_or_init(record).clone()
}

pub(crate) fn write_mcap(path: &Path, scans: &[Scan]) {
    write_chunks(path, scans, McapWriterOptions::default().chunk_bytes);
}

/// With chunks of so many bytes. Of small ones every few scans can be kept, since a chunk is read as a whole.
pub(crate) fn write_chunks(path: &Path, scans: &[Scan], chunk_bytes: u64) {
    let options = McapWriterOptions { chunk_bytes, ..McapWriterOptions::default() };
    let mut writer = McapScanWriter::create(path, &options).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
}

pub(crate) const SMALL_CHUNK: u64 = 64 << 10;

pub(crate) fn save_tum(path: &Path, trajectory: &Trajectory) {
    let mut lines = Vec::new();
    write_tum(&mut lines, trajectory).unwrap();
    std::fs::write(path, lines).unwrap();
}

/// A log of a small town in small chunks, `town.mcap`, and two runs, `truth.tum` and `drift.tum`.
pub(crate) fn town_in(folder: &Path) {
    let (scans, truth) = small_town(60, 180);
    write_chunks(&folder.join("town.mcap"), &scans, SMALL_CHUNK);
    for run in runs_of(&truth, &[("drift", drift(1.0))]) {
        save_tum(&folder.join(format!("{}.tum", run.name)), &run.trajectory);
    }
}

pub(crate) fn open(path: &Path) -> Box<dyn ScanLog> {
    open_log(path, &LogOptions::default()).unwrap()
}

pub(crate) fn noise(sigma_m: f64, sigma_deg: f64) -> SlamErrors {
    let noise = Noise { sigma_m, sigma_rad: sigma_deg.to_radians(), interval_ns: 100_000_000 };
    SlamErrors { seed: 1, noise: Some(noise), ..SlamErrors::default() }
}

pub(crate) fn drift(ate_m: f64) -> SlamErrors {
    SlamErrors { seed: 1, drift_ate_m: Some(ate_m), ..SlamErrors::default() }
}

pub(crate) fn collapse(share: f64) -> SlamErrors {
    SlamErrors { seed: 1, collapse_share: Some(share), ..SlamErrors::default() }
}

/// The truth and wrong copies of it.
pub(crate) fn runs_of(truth: &Trajectory, wrong: &[(&str, SlamErrors)]) -> Vec<Run> {
    let mut runs = vec![Run::new("truth", truth.clone())];
    runs.extend(wrong.iter().map(|(name, errors)| Run::new(*name, errors.apply(truth).unwrap())));
    runs
}

/// The settings but for the drift, which takes a third of the time of a score.
pub(crate) fn plain() -> Config {
    Config { drift: DriftPairs::None, ..Config::default() }
}

pub(crate) fn score(log: &Path, runs: &[Run], config: &Config) -> Report {
    evaluate(open(log).as_ref(), runs, config, ()).unwrap()
}

/// A report as JSON without what may differ from run to run.
pub(crate) fn comparable(report: &Report) -> Value {
    without_effort(serde_json::to_value(report).unwrap())
}

/// The JSON that a command printed, without what may differ from run to run.
pub(crate) fn scores(json: &[u8]) -> Value {
    without_effort(serde_json::from_slice(json).unwrap())
}

/// The same without what a score in parts lacks.
pub(crate) fn scores_in_parts(json: &[u8]) -> Value {
    let mut scores = scores(json);
    for run in scores["runs"].as_array_mut().unwrap() {
        run["surfels_contradicted"] = Value::Null;
        run["thickness"] = Value::Null;
    }
    scores
}

fn without_effort(mut json: Value) -> Value {
    let object = json.as_object_mut().unwrap();
    assert!(object.remove("timing").is_some() && object.remove("memory").is_some());
    json
}

/// Runs the command with arguments separated by blanks, `@` standing for the samples' folder.
pub(crate) fn dmp(folder: &Path, arguments: &str) -> Output {
    dmp_command(folder, arguments).output().unwrap()
}

pub(crate) fn dmp_command(folder: &Path, arguments: &str) -> Command {
    let samples = workspace().join("data-samples");
    let arguments = arguments.split_whitespace().map(|a| a.replace('@', &samples.display().to_string()));
    let mut command = Command::new(PROGRAM);
    command.args(arguments).current_dir(folder);
    // What changes tables and messages.
    for name in ["COLUMNS", "NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE", "GITHUB_ACTIONS"] {
        command.env_remove(name);
    }
    command
}

/// Runs a command that must end with `code`; its output.
pub(crate) fn ends(folder: &Path, arguments: &str, code: i32) -> Output {
    let output = dmp(folder, arguments);
    assert_eq!(output.status.code(), Some(code), "{arguments}\n{}", text(&output.stderr));
    output
}

/// Runs a command that must succeed; what it prints.
pub(crate) fn done(folder: &Path, arguments: &str) -> String {
    text(&ends(folder, arguments, 0).stdout)
}

/// Runs a command that must succeed; its JSON.
pub(crate) fn json(folder: &Path, arguments: &str) -> Value {
    json_of(&ends(folder, &format!("{arguments} --json"), 0))
}

/// The JSON that a command printed.
pub(crate) fn json_of(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{}", text(&output.stderr)))
}

/// What a command printed and where it wrote the one time that it was run.
pub(crate) struct Once {
    pub(crate) folder: PathBuf,
    pub(crate) output: Output,
}

impl Once {
    pub(crate) fn stdout(&self) -> String {
        text(&self.output.stdout)
    }

    pub(crate) fn json(&self) -> Value {
        json_of(&self.output)
    }

    /// Copies a file that the command wrote to another folder.
    pub(crate) fn copy(&self, name: &str, to: &Path) {
        std::fs::copy(self.folder.join(name), to.join(name)).unwrap();
    }
}

/// Runs a command that must succeed, once for all tests of this process, in a folder of its own.
pub(crate) fn once(arguments: &str) -> &'static Once {
    static DONE: Mutex<BTreeMap<String, &OnceLock<Once>>> = Mutex::new(BTreeMap::new());
    let cell = *DONE.lock().unwrap().entry(arguments.to_owned()).or_insert_with(|| Box::leak(Box::default()));
    cell.get_or_init(|| {
        let folder = tempfile::tempdir_in(shared()).unwrap().keep();
        let output = ends(&folder, arguments, 0);
        Once { folder, output }
    })
}

/// A folder below the target's; what earlier processes left there goes after a day.
fn shared() -> &'static Path {
    static SHARED: OnceLock<PathBuf> = OnceLock::new();
    SHARED.get_or_init(|| {
        let all = Path::new(env!("CARGO_TARGET_TMPDIR")).join("shared");
        std::fs::create_dir_all(&all).unwrap();
        for entry in all.read_dir().unwrap().flatten() {
            let age = entry.metadata().and_then(|data| data.modified()).map(|time| time.elapsed());
            if matches!(age, Ok(Ok(age)) if age > Duration::from_hours(24)) {
                let _ = std::fs::remove_dir_all(entry.path());
            }
        }
        tempfile::tempdir_in(all).unwrap().keep()
    })
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The same in one line: sentences may be in several.
pub(crate) fn unwrapped(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Asserts that a text has all the words.
pub(crate) fn has(text: &str, words: &[&str]) {
    for word in words {
        assert!(text.contains(word), "no `{word}` in\n{text}");
    }
}

/// A bad input: what to run, the exit code, and words that must stand in the one line on stderr.
pub(crate) fn refused(folder: &Path, arguments: &str, code: i32, words: &[&str]) {
    let output = ends(folder, &format!("{arguments} --quiet"), code);
    let stderr = text(&output.stderr);
    assert!(stderr.lines().count() == 1 && stderr.starts_with("error: "), "{arguments}\n{stderr}");
    has(&format!("{arguments}: {stderr}"), words);
    assert_eq!(text(&output.stdout), "", "{arguments}");
}

/// Wrong usage: the parser of arguments says in several lines what is wrong.
pub(crate) fn misused(folder: &Path, arguments: &str, words: &[&str]) {
    let output = ends(folder, arguments, 2);
    assert!(output.stdout.is_empty(), "{arguments}");
    has(&format!("{arguments}: {}", text(&output.stderr)), words);
}

/// Runs a script of the shell with `$DMP` and a disk of its own of this size mounted at `disk`; `None` where this system
/// mounts none.
pub(crate) fn on_small_disk(folder: &Path, size: &str, script: &str) -> Option<Output> {
    std::fs::create_dir(folder.join("disk")).unwrap();
    let script = format!("mount -t tmpfs -o size={size} none disk || exit 99; {script}");
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", &script]);
    let output = command.env("DMP", PROGRAM).current_dir(folder).output();
    let is_refused =
        |output: &Output| output.status.code() == Some(99) || output.stderr.starts_with(b"unshare: ");
    let output = output.ok().filter(|output| !is_refused(output));
    if output.is_none() {
        println!("skipped: this system does not let us mount a disk of our own");
    }
    output
}

pub(crate) fn write(folder: &Path, name: &str, content: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, content).unwrap();
    path
}
