//! `--view`: the page in the browser, or a line that nothing opens it.

#![cfg(unix)]

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Output;

use crate::common::{dmp, dmp_command, text, write};

/// A program of a folder that does this.
fn program(folder: &Path, name: &str, does: &str) {
    let path = write(folder, name, &format!("#!/bin/sh\n{does}\n"));
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

/// The command with this `PATH`, which has nothing else, and this `BROWSER`.
fn with(folder: &Path, arguments: &str, path: &str, browser: Option<&str>) -> Output {
    let mut command = dmp_command(folder, arguments);
    // As a new process it would begin again, which needs no PATH.
    command.env("PATH", folder.join(path)).env_remove("BROWSER");
    if let Some(browser) = browser {
        command.env("BROWSER", browser);
    }
    command.output().unwrap()
}

#[test]
fn pages_are_opened_by_what_the_user_or_the_system_opens_them_with() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    for name in ["bin", "none"] {
        fs::create_dir(path.join(name)).unwrap();
    }
    let seen = path.join("seen.txt");
    let tell = |who: &str| format!("echo {who} \"$@\" >> '{}'", seen.display());
    program(&path.join("bin"), "xdg-open", &tell("system"));
    program(path, "mine", &tell("mine"));
    program(path, "broken", "exit 3");
    let result = dmp(path, "score @/town.mcap -t @/truth.tum --every 10 --json --quiet");
    assert_eq!(result.status.code(), Some(0), "{}", text(&result.stderr));
    fs::write(path.join("a.json"), &result.stdout).unwrap();
    let page = path.canonicalize().unwrap().join("page.html").display().to_string();
    let (mine, broken) = (path.join("mine").display().to_string(), path.join("broken").display().to_string());
    let compare = "compare a.json --report page.html --view --quiet";
    let both = format!("{broken}:{mine} --new %s now");
    for (arguments, browser, expected) in [
        (compare, None, "system PAGE"),
        (compare, Some(mine.as_str()), "mine PAGE"),
        (compare, Some(both.as_str()), "mine --new PAGE now"),
        (compare, Some(broken.as_str()), "system PAGE"),
        (
            "score @/town.mcap -t @/truth.tum --every 10 --report page.html --view --quiet",
            None,
            "system PAGE",
        ),
        ("truth ape @/truth.tum @/drift.tum --plot page.html --view --quiet", None, "system PAGE"),
    ] {
        let output = with(path, arguments, "bin", browser);
        assert_eq!((output.status.code(), text(&output.stderr).as_str()), (Some(0), ""), "{arguments}");
        let told = fs::read_to_string(&seen).unwrap().replace(&page, "PAGE");
        assert_eq!(told.trim(), expected, "{arguments} with {browser:?}");
        fs::remove_file(&seen).unwrap();
    }

    // Nothing opens it: a line, and all else is as it would be.
    for browser in [None, Some("/no/such/browser"), Some(broken.as_str())] {
        let output = with(path, compare, "none", browser);
        assert_eq!(output.status.code(), Some(0));
        let said = text(&output.stderr);
        assert!(
            said.starts_with("note: page.html: nothing here opens it") && said.lines().count() == 1,
            "{said}"
        );
    }
    let gated = with(path, &format!("{compare} --fail-above miss=0.01%"), "none", None);
    assert_eq!(gated.status.code(), Some(4), "{}", text(&gated.stderr));
    assert!(text(&gated.stderr).contains("nothing here opens it"));
}

#[test]
fn there_must_be_a_page() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, option) in [
        ("score a.mcap -t a.tum --view", "--report <FILE>"),
        ("compare a.json --view", "--report <FILE>"),
        ("suite a.toml --view", "--report <FILE>"),
        ("truth ape a.tum b.tum --view", "--plot <FILE>"),
    ] {
        let output = dmp(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments}");
        assert!(text(&output.stderr).contains(option), "{arguments}: {}", text(&output.stderr));
    }
}
