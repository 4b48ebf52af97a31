//! What the tests of the command share.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// A folder of this test with a short log, its true trajectory and a noisy one.
pub(crate) fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // It may be there from an earlier run.
    let _ = std::fs::remove_dir_all(&folder);
    std::fs::create_dir_all(&folder).unwrap();
    let made = dmp(&folder, "simulate town -o town.mcap --truth truth.tum --scans 40 --azimuth-steps 200");
    assert!(made.status.success(), "{made:?}");
    let made = dmp(&folder, "simulate errors truth.tum --noise 5cm,0.2deg -o noise.tum");
    assert!(made.status.success(), "{made:?}");
    folder
}

pub(crate) fn dmp(folder: &Path, arguments: &str) -> Output {
    let arguments = arguments.split_whitespace();
    Command::new(env!("CARGO_BIN_EXE_dmp")).args(arguments).current_dir(folder).output().unwrap()
}

pub(crate) fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

pub(crate) fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

pub(crate) fn json(output: &Output) -> Value {
    serde_json::from_slice(&output.stdout).unwrap()
}
