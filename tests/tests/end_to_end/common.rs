//! What several tests need: small logs on disk, real data, reports to compare.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use dmp::{Config, Report, Run, evaluate};
use dmp_log::{LogOptions, McapScanWriter, McapWriterOptions, ScanLog, open_log};
use dmp_sensor::{Scan, Trajectory};
use dmp_sim::{LidarOptions, Noise, Recording, RecordingOptions, Route, SlamErrors};

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

/// A simulated drive with a revisit: its scans and its truth, one pose each 50 ms.
pub(crate) fn small_town(scans: usize, azimuth_steps: usize) -> (Vec<Scan>, Trajectory) {
    let lidar = LidarOptions { azimuth_steps, rate_hz: 2.0, ..LidarOptions::with_beams(16) };
    recorded(&RecordingOptions { seed: 4, scans, route: Route::Loop, speed_m_s: 6.0, traffic: 2, lidar })
}

/// The scans and the truth of a recording, one pose each 50 ms.
pub(crate) fn recorded(options: &RecordingOptions) -> (Vec<Scan>, Trajectory) {
    let town = options.town().unwrap();
    let recording = Recording::new(&town, options).unwrap();
    (recording.scans().collect(), recording.drive().trajectory(20.0).unwrap())
}

pub(crate) fn write_mcap(path: &Path, scans: &[Scan]) {
    let mut writer = McapScanWriter::create(path, &McapWriterOptions::default()).unwrap();
    scans.iter().for_each(|scan| writer.write_scan(scan).unwrap());
    writer.finish().unwrap();
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

pub(crate) fn score(log: &Path, runs: &[Run], config: &Config) -> Report {
    evaluate(open(log).as_ref(), runs, config, ()).unwrap()
}

/// A report as JSON without what may differ from run to run.
pub(crate) fn comparable(report: &Report) -> serde_json::Value {
    let mut json = serde_json::to_value(report).unwrap();
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
    let mut command = Command::new(env!("CARGO_BIN_EXE_dmp-under-test"));
    command.args(arguments).current_dir(folder);
    // What changes tables.
    for name in ["COLUMNS", "NO_COLOR", "CLICOLOR", "CLICOLOR_FORCE"] {
        command.env_remove(name);
    }
    command
}

pub(crate) fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// The same in one line: sentences may be in several.
pub(crate) fn unwrapped(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// A bad input: what to run, the exit code, and words that must stand in the one line on stderr.
pub(crate) fn refused(folder: &Path, arguments: &str, code: i32, words: &[&str]) {
    let output = dmp(folder, &format!("{arguments} --quiet"));
    let stderr = text(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{arguments}\n{stderr}");
    let lines: Vec<&str> = stderr.lines().collect();
    assert!(lines.len() == 1 && lines[0].starts_with("error: "), "{arguments}\n{stderr}");
    for word in words {
        assert!(lines[0].contains(word), "{arguments}: no `{word}` in\n{stderr}");
    }
    assert_eq!(text(&output.stdout), "", "{arguments}");
}

pub(crate) fn write(folder: &Path, name: &str, content: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, content).unwrap();
    path
}
