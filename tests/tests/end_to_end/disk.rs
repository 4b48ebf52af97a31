//! Disks that are too small, or full: told of beforehand, and gone on from after room is made.

use std::fs;
use std::process::Command;

use crate::resume::{scores, town_command};

#[test]
fn a_full_disk_ends_it_and_room_lets_it_go_on() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = town_command(folder.path());
    let expected = scores(&command.output().unwrap().stdout);
    // A little disk of our own, where the system lets us make one.
    let disk = folder.path().join("disk");
    fs::create_dir(&disk).unwrap();
    let dmp = env!("CARGO_BIN_EXE_dmp-under-test");
    let score = format!(
        "{dmp} score town.mcap -t truth.tum -t drift.tum --work disk --json --memory 32MiB --checkpoint 0.01"
    );
    let script = format!(
        "mount -t tmpfs -o size=6m none disk || exit 99; \
         {score} >/dev/null 2>first.txt; echo $? >first.code; \
         mount -o remount,size=200m disk || exit 99; {score} --resume 2>second.txt"
    );
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &script])
        .current_dir(folder.path())
        .output();
    let output = match output {
        Ok(output) if output.status.code() != Some(99) && folder.path().join("first.code").exists() => output,
        _ => {
            println!("skipped: this system does not let us mount a disk of our own");
            return;
        }
    };
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let first = read("first.txt");
    assert_eq!(read("first.code").trim(), "1", "{first}");
    assert!(first.contains("No space left on device") && first.contains("--resume"), "{first}");
    assert!(read("second.txt").contains("goes on from"), "{}", read("second.txt"));
    assert_eq!(scores(&output.stdout), expected);
}

#[test]
fn a_disk_that_is_too_small_is_told_of_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let _ = town_command(folder.path());
    fs::create_dir(folder.path().join("disk")).unwrap();
    let dmp = env!("CARGO_BIN_EXE_dmp-under-test");
    let build = "map build town.mcap -t truth.tum -o whole.dmpmap --quiet".split_whitespace();
    assert!(Command::new(dmp).args(build).current_dir(folder.path()).status().unwrap().success());
    let little = fs::metadata(folder.path().join("whole.dmpmap")).unwrap().len() * 8 / 10;
    // Without any room, and with a little less than the map takes.
    let script = format!(
        "mount -t tmpfs -o size=64k none disk || exit 99; head -c 65536 /dev/zero >disk/full; \
         {dmp} score town.mcap -t truth.tum --work disk >/dev/null 2>none.txt; echo $? >none.code; \
         rm -r disk/*; mount -o remount,size={little} disk || exit 99; \
         {dmp} map build town.mcap -t truth.tum --work disk -o disk/map.dmpmap 2>little.txt; ls -A disk >left.txt"
    );
    let output = Command::new("unshare")
        .args(["--map-root-user", "--mount", "sh", "-c", &script])
        .current_dir(folder.path())
        .output();
    match output {
        Ok(output) if output.status.code() != Some(99) && folder.path().join("left.txt").exists() => {}
        _ => {
            println!("skipped: this system does not let us mount a disk of our own");
            return;
        }
    }
    let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
    let none = read("none.txt");
    assert_eq!(read("none.code").trim(), "1", "{none}");
    let told = none.lines().find(|line| line.starts_with("error: disk: about ")).unwrap_or_default();
    assert!(told.contains("0 KiB are free") && told.contains("--work"), "{none}");
    assert!(read("little.txt").contains("the disk may run full"), "{}", read("little.txt"));
}
