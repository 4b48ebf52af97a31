//! The examples of the library, built and run as users do.

use std::path::{Path, PathBuf};
use std::process::Command;

use crate::common::{dmp, text, workspace};

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
fn examples_say_what_they_promise() {
    let (examples, folder) = (built(), tempfile::tempdir().unwrap());
    for (example, arguments, phrases) in [
        ("score", &[][..], &[" 1 truth", "R_cv(0.5 m)", "truth is better, decided at"][..]),
        ("own_scans", &[], &["Fuse", "100 %", "better: straight"]),
        ("own_scans", &["0"], &["given up after 0 s"]),
        ("resume", &[], &["stopped", "goes on from", "the same bits as in one go"]),
        ("verdicts", &[], &["best: truth", "is any run worse than truth: true"]),
        ("cast", &[], &["surfels in", "down : "]),
        ("rank", &[], &["from best to worst", "accepted", "edges in the graph"]),
    ] {
        let told = run(&examples.join(example), folder.path(), arguments);
        for phrase in phrases {
            assert!(told.contains(phrase), "{example}: no `{phrase}` in\n{told}");
        }
    }
    let left: Vec<_> = folder.path().read_dir().unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn examples_take_files_of_ones_own() {
    let (examples, folder) = (built(), tempfile::tempdir().unwrap());
    let samples = workspace().join("data-samples");
    let [log, truth, noise] = ["town.mcap", "truth.tum", "noise.tum"].map(|name| samples.join(name));
    let [log, truth, noise] = [&log, &truth, &noise].map(|path| path.to_str().unwrap());
    let told = run(&examples.join("score"), folder.path(), &[log, truth, noise]);
    assert!(told.contains(" 2 noise") && !told.contains("drift"), "{told}");

    // What the command saves is read back.
    let saved = dmp(folder.path(), "score @/town.mcap -t one=@/truth.tum --json --quiet");
    std::fs::write(folder.path().join("one.json"), saved.stdout).unwrap();
    let told = run(&examples.join("verdicts"), folder.path(), &["one.json"]);
    assert!(told.contains("best: one"), "{told}");

    for arguments in [
        "simulate town -o drive --scans 500 --azimuth-steps 60 --seed 3",
        "simulate loops drive.truth.tum --keyframes drive/times.txt --spacing 0.9m -o loops",
    ] {
        assert!(dmp(folder.path(), arguments).status.success(), "{arguments}");
    }
    let files = ["loops/graph.g2o", "loops/candidates.g2o", "drive", "loops/keyframes.txt"];
    let told = run(&examples.join("rank"), folder.path(), &files);
    assert!(told.contains("accepted"), "{told}");
}
