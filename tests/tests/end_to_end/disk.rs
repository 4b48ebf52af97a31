//! Disks that are too small or full: an error before anything is written, or no half file and the way to go on.

use std::fs;

use crate::common::{done, has, on_small_disk, sample, scores, scores_in_parts, text, town_in};

const SCORE: &str = "$DMP score town.mcap -t truth.tum -t drift.tum --trust --drift=none";

#[test]
fn a_full_disk_ends_a_score_and_room_resumes_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    town_in(path);
    let expected = scores(
        done(path, "score town.mcap -t truth.tum -t drift.tum --trust --drift=none --json").as_bytes(),
    );
    let score = format!("{SCORE} --work disk --json --memory 32MiB --resume=0.01");
    let script = format!(
        "{score} >/dev/null 2>first.txt; echo $? >first.code; mount -o remount,size=200m disk || exit 99; \
         {score}"
    );
    let Some(output) = on_small_disk(path, "6m", &script) else { return };
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    assert_eq!(read("first.code").trim(), "1", "{}", read("first.txt"));
    has(&read("first.txt"), &["No space left on device", "--resume"]);
    assert_eq!(scores(&output.stdout), expected);
}

#[test]
fn a_disk_that_is_too_small_is_reported_before_anything_is_written() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    town_in(path);
    done(path, "map build town.mcap -t truth.tum -o whole.dmpmap --quiet");
    let little = fs::metadata(path.join("whole.dmpmap")).unwrap().len() * 14 / 10;
    // Without any room, and with a little less than the map takes twice: as fused, and without what moved.
    let script = format!(
        "head -c 65536 /dev/zero >disk/full; {SCORE} --work disk >/dev/null 2>none.txt; echo $? >none.code; \
         rm -r disk/*; mount -o remount,size={little} disk || exit 99; \
         $DMP map build town.mcap -t truth.tum --work disk -o disk/map.dmpmap 2>little.txt; ls -A disk >left.txt"
    );
    if on_small_disk(path, "64k", &script).is_none() {
        return;
    }
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    assert_eq!(read("none.code").trim(), "1", "{}", read("none.txt"));
    has(&read("none.txt"), &["error: disk: about ", "0 KiB are free", "--work"]);
    has(&read("little.txt"), &["the disk may run full"]);
}

/// What an option writes may fail: the scores are printed, the file is not half there, and the exit code is 5.
#[test]
fn an_output_that_finds_the_disk_full_costs_no_scores() {
    let (town, truth) = (sample("town.mcap"), sample("truth.tum"));
    let score =
        format!("$DMP score {} -t {} --trust --drift=none --json --quiet", town.display(), truth.display());
    for (option, file) in [("--residuals", "out.ply"), ("--scene", "out.mcap")] {
        let folder = tempfile::tempdir().unwrap();
        let script = format!(
            "{score} --every 5 {option} disk/{file} --work . >out.json 2>out.txt; echo $? >out.code; ls -A disk >left.txt"
        );
        if on_small_disk(folder.path(), "200k", &script).is_none() {
            return;
        }
        let read = |name: &str| fs::read_to_string(folder.path().join(name)).unwrap();
        let stderr = read("out.txt");
        assert_eq!((read("out.code").trim(), read("left.txt").as_str()), ("5", ""), "{stderr}");
        has(&stderr, &[&format!("disk/{file}: cannot write"), "No space left"]);
        assert_eq!(scores(read("out.json").as_bytes())["runs"][0]["name"], "truth");
    }
}

#[test]
fn a_full_work_folder_leaves_no_part_half_done() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path();
    town_in(path);
    let expected = scores_in_parts(
        done(path, "score town.mcap -t truth.tum -t drift.tum --trust --drift=none --json").as_bytes(),
    );
    let script = "D=\"$DMP -q\"; $D shard plan town.mcap -t truth.tum -t drift.tum --trust --drift=none -o disk/work >/dev/null || exit 2; \
         $D shard fuse disk/work --part 1/2 2>first.txt || $D shard fuse disk/work --part 2/2 2>first.txt; echo $? >first.code; \
         ls -A disk/work >left.txt; mount -o remount,size=200m disk || exit 99; \
         for i in 1 2; do $D shard fuse disk/work --part $i/2 || exit 3; done; \
         for stage in merge cast; do $D shard $stage disk/work --part 1/1 || exit 3; done; \
         $D shard reduce disk/work --json";
    let Some(output) = on_small_disk(path, "320k", script) else { return };
    let read = |name: &str| fs::read_to_string(path.join(name)).unwrap();
    has(&read("first.txt"), &["No space left on device"]);
    assert_eq!(read("first.code").trim(), "1");
    assert!(read("left.txt").lines().all(|name| !name.contains("dmp-tmp")), "{}", read("left.txt"));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(scores_in_parts(&output.stdout), expected);
}
