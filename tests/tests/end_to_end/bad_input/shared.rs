//! Row 28: a folder for temporary files that everybody may write in.

use std::fs;
use std::os::unix::fs::{PermissionsExt as _, chown, lchown, symlink};

use super::stopping::has_checkpoint;
use super::{Town, begin, contents, names_in, report, run, scores};

/// Another user, where these tests may give files away.
const NOBODY: u32 = 65_534;

#[test]
fn row_28_what_others_put_in_a_shared_folder_is_not_touched() {
    let town = Town::new();
    let score = "score town.mcap -t truth.tum -t drift.tum";
    let expected = scores(&report(town.root(), "", score, 0));
    // Called as other rows call it.
    let shared = town.path("work");
    fs::create_dir(&shared).unwrap();
    fs::set_permissions(&shared, fs::Permissions::from_mode(0o1777)).unwrap();
    // What a killed process of this user leaves: its name is known to everybody from now on.
    let kept = (0..100).find(|_| {
        let mut child = begin(town.root(), &format!("{score} {}", super::KEEPING_WORK));
        while child.try_wait().unwrap().is_none() && !has_checkpoint(&shared) {}
        child.kill().unwrap_or_default();
        child.wait().unwrap();
        has_checkpoint(&shared)
    });
    assert!(kept.is_some(), "no kill left a checkpoint");
    let name = names_in(&shared).remove(0);
    let left = shared.join(&name);
    assert_eq!(fs::metadata(&left).unwrap().permissions().mode() & 0o777, 0o700, "nobody else looks into it");
    let stem = name.rsplit_once('-').unwrap().0;
    fs::remove_dir_all(&left).unwrap();

    // A link to a folder with a user's files of the names that are written; a pipe to wait at, and a forged checkpoint, by
    // another user, or at least where another may write.
    for name in ["lock", "0.dmpmap", "truth.dmpmap", "cast.checkpoint", "truth.fuse.checkpoint"] {
        town.write(&format!("foreign/{name}"), "foreign");
    }
    for stem in [stem, "dmp-work-x"] {
        symlink(town.path("foreign"), shared.join(format!("{stem}-000000linked"))).unwrap();
        let [pipe, forged] = ["pipe", "forged"].map(|what| format!("work/{stem}-00000000{what}"));
        fs::create_dir(town.path(&pipe)).unwrap();
        town.pipe(&format!("{pipe}/lock"));
        town.write(&format!("{forged}/cast.checkpoint"), "forged");
        for planted in [pipe, forged].map(|name| town.path(&name)) {
            fs::set_permissions(&planted, fs::Permissions::from_mode(0o777)).unwrap();
            let is_given = chown(&planted, Some(NOBODY), Some(NOBODY)).is_ok();
            println!("{}: {}", planted.display(), if is_given { "another user's" } else { "open to all" });
        }
    }
    let before = contents(town.root());
    for options in ["--work work", "--work work --resume", "--work work --memory 32MiB"] {
        assert_eq!(scores(&report(town.root(), "", &format!("{score} {options}"), 0)), expected, "{options}");
        assert!(contents(town.root()) == before, "{options}");
    }
    // A link of another user, where everybody may put one, leads nowhere.
    let link = shared.join("report.html");
    symlink(town.path("kept.html"), &link).unwrap();
    let is_given = lchown(&link, Some(NOBODY), Some(NOBODY)).is_ok();
    for mode in [0o1777, 0o777].into_iter().filter(|_| is_given) {
        fs::set_permissions(&shared, fs::Permissions::from_mode(mode)).unwrap();
        let output = run(town.root(), "", &format!("{score} --report work/report.html --quiet"));
        assert!(!output.status.success() && !town.path("kept.html").exists(), "{mode:o}");
    }
}
