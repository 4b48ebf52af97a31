//! The examples of the library, built and run as users do.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{TWO, has, once, sample, text, workspace};

/// Builds all examples as `cargo test --workspace` does, so that nothing is left to do after that, and gives the folder
/// they lie in. Tests of this package alone would not have built them, or leave older ones.
fn built() -> PathBuf {
    // This program is in TARGET/PROFILE/deps.
    let program = std::env::current_exe().unwrap();
    let folder = program.ancestors().nth(2).unwrap();
    let profile = if folder.ends_with("release") { "release" } else { "test" };
    let mut cargo = Command::new(env!("CARGO"));
    cargo.args(["build", "--quiet", "--locked", "--workspace", "--examples", "--profile", profile]);
    let output = cargo.current_dir(workspace()).output().unwrap();
    assert!(output.status.success(), "{cargo:?}\n{}", text(&output.stderr));
    folder.join("examples")
}

/// Runs an example in `folder`; what it prints.
fn run(example: &Path, folder: &Path, arguments: &[&str]) -> String {
    let mut command = Command::new(example);
    // What is left behind would be seen there.
    command.args(arguments).current_dir(folder).env("TMPDIR", folder);
    let output = command.output().unwrap_or_else(|error| panic!("{}: {error}", example.display()));
    let (stdout, stderr) = (text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{}\n{stdout}{stderr}", example.display());
    stdout
}

#[test]
fn examples_print_what_they_promise() {
    let (examples, folder) = (built(), tempfile::tempdir().unwrap());
    for (example, arguments, phrases) in [
        ("score", &[][..], &[" 1 truth", "R_cv(0.5 m)", "truth is better, decided at"][..]),
        ("own_scans", &[], &["Fuse", "100 %", "better: straight"]),
        ("own_scans", &["0"], &["given up after 0 s"]),
        ("resume", &[], &["stopped", "the same bits as in one go"]),
        ("verdicts", &[], &["best: truth", "is any run worse than truth: true"]),
        ("cast", &[], &["surfels in", "down : "]),
        ("rank", &[], &["from best to worst", "edges in the graph"]),
    ] {
        has(&run(&examples.join(example), folder.path(), arguments), phrases);
    }
    assert_eq!(folder.path().read_dir().unwrap().count(), 0, "nothing is left behind");

    // Files of one's own, and what the command saves.
    let [log, truth, noise] =
        ["town.mcap", "truth.tum", "noise.tum"].map(|name| sample(name).display().to_string());
    has(&run(&examples.join("score"), folder.path(), &[&log, &truth, &noise]), &[" 2 noise"]);
    let saved = folder.path().join("saved.json");
    std::fs::write(&saved, &once(&format!("{TWO} --json --quiet")).output.stdout).unwrap();
    has(&run(&examples.join("verdicts"), folder.path(), &[saved.to_str().unwrap()]), &["best: truth"]);
}
