//! Row 28: a folder for temporary files that everybody may write in.
#![cfg(unix)]

use std::fs;
use std::os::unix::fs::{PermissionsExt as _, chown, symlink};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use super::{report_of, scored, scores, town};
use crate::common::dmp_command;

/// Another user, where these tests may give files away.
const NOBODY: u32 = 65_534;

#[test]
fn row_28_what_others_put_in_a_shared_folder_is_not_touched() {
    let (folder, _) = town();
    let path = folder.path();
    let score = "score town.mcap -t truth.tum -t drift.tum";
    let expected = scores(&scored(path, score, 0));
    let shared = path.join("shared");
    fs::create_dir(&shared).unwrap();
    fs::set_permissions(&shared, fs::Permissions::from_mode(0o1777)).unwrap();
    // What a killed process of this user's leaves: its name is known to everybody from now on.
    let left = killed_with_a_checkpoint(path, &format!("{score} --work shared --checkpoint 0 --json"));
    assert_eq!(fs::metadata(&left).unwrap().permissions().mode() & 0o777, 0o700, "nobody else looks into it");
    let name = left.file_name().unwrap().to_str().unwrap();
    let stem = name.rsplit_once('-').unwrap().0.to_owned();
    fs::remove_dir_all(&left).unwrap();

    // A link to a folder with a user's files of the names that are written.
    let foreign = path.join("foreign");
    fs::create_dir(&foreign).unwrap();
    for name in ["lock", "0.dmpmap", "truth.dmpmap", "cast.checkpoint", "truth.fuse.checkpoint"] {
        fs::write(foreign.join(name), b"foreign").unwrap();
    }
    let planted: Vec<PathBuf> = [stem.as_str(), "dmp-work-x"]
        .iter()
        .map(|stem| shared.join(format!("{stem}-000000linked")))
        .collect();
    planted.iter().for_each(|link| symlink(&foreign, link).unwrap());
    // A pipe to wait at, and a forged checkpoint, by another user, or at least where another may write.
    for (stem, what) in [stem.as_str(), "dmp-work-x"].iter().flat_map(|s| [(s, "pipe"), (s, "forged")]) {
        let planted = shared.join(format!("{stem}-00000000{what}"));
        fs::create_dir(&planted).unwrap();
        if what == "pipe" {
            assert!(Command::new("mkfifo").arg(planted.join("lock")).status().unwrap().success());
        } else {
            fs::write(planted.join("cast.checkpoint"), b"forged").unwrap();
        }
        fs::set_permissions(&planted, fs::Permissions::from_mode(0o777)).unwrap();
        let given = chown(&planted, Some(NOBODY), Some(NOBODY)).is_ok();
        println!("{}: {}", planted.display(), if given { "another user's" } else { "open to all" });
    }
    let before = all_files(path);
    for options in
        ["--work shared", "--work shared --resume", "--work shared --memory 32MiB --save-maps maps"]
    {
        let output = within_a_minute(dmp_command(path, &format!("{score} {options} --json --quiet")));
        assert_eq!(scores(&report_of(&output, options, 0)), expected, "{options}");
        let _ = fs::remove_dir_all(path.join("maps"));
        assert_eq!(all_files(path), before, "{options}");
    }
    // A link of another user's, where everybody may put one, leads nowhere.
    let link = shared.join("report.html");
    symlink(path.join("kept.html"), &link).unwrap();
    let given = std::os::unix::fs::lchown(&link, Some(NOBODY), Some(NOBODY)).is_ok();
    for mode in [0o1777, 0o777].into_iter().filter(|_| given) {
        fs::set_permissions(&shared, fs::Permissions::from_mode(mode)).unwrap();
        let output =
            within_a_minute(dmp_command(path, &format!("{score} --report shared/report.html --quiet")));
        assert!(!output.status.success() && !path.join("kept.html").exists(), "{mode:o}");
    }
}

/// A process that waited at a pipe would wait for ever.
fn within_a_minute(mut command: Command) -> std::process::Output {
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    for _ in 0..600 {
        if child.try_wait().unwrap().is_some() {
            return child.wait_with_output().unwrap();
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    child.kill().unwrap();
    panic!("it hangs: {command:?}");
}

/// The work folder that a killed process leaves.
fn killed_with_a_checkpoint(path: &Path, arguments: &str) -> PathBuf {
    let with_checkpoint = || {
        let has = |folder: &PathBuf| {
            let mut files = fs::read_dir(folder).into_iter().flatten().flatten();
            files.any(|file| file.path().extension().is_some_and(|e| e == "checkpoint"))
        };
        let folders = fs::read_dir(path.join("shared")).unwrap().flatten().map(|entry| entry.path());
        folders.into_iter().find(has)
    };
    for _ in 0..100 {
        let mut command = dmp_command(path, arguments);
        let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
        while child.try_wait().unwrap().is_none() && with_checkpoint().is_none() {}
        child.kill().unwrap_or_default();
        child.wait().unwrap();
        if let Some(folder) = with_checkpoint() {
            return folder;
        }
    }
    panic!("no kill left a checkpoint");
}

/// All files with what they hold, all links with where they lead.
fn all_files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let (path, kind) = entry.map(|entry| (entry.path(), entry.file_type().unwrap())).unwrap();
        if kind.is_dir() {
            found.extend(all_files(&path));
        } else if kind.is_file() {
            found.push((path.clone(), fs::read(path).unwrap()));
        } else {
            let to = fs::read_link(&path).unwrap_or_default();
            found.push((path, to.to_string_lossy().into_owned().into_bytes()));
        }
    }
    found.sort();
    found
}
