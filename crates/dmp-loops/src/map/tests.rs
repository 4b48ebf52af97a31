//! A map whose patches moved has the scores of one that is made anew.

use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use dmp_sim::LoopKind;

use super::sums::LOOPS;
use super::{LoopMap, MapOptions, MapScores, Placed};
use crate::tests::DRIVE;
use crate::{OptimiseOptions, optimise};

/// A map that is made anew, all of it.
fn cast_anew<'a>(map: &'a LoopMap, world_from_body: &[Isometry3<f64>]) -> Placed<'a> {
    Placed::new(map, world_from_body.to_vec()).unwrap()
}

/// The score of a map whose patches moved, which is the same by one thread and by all.
fn moved_to(placed: &Placed<'_>, world_from_body: &[Isometry3<f64>]) -> MapScores {
    let [one, all] = [false, true].map(|by_all| placed.moved_to(world_from_body, by_all).unwrap());
    assert_eq!(one, all);
    one
}

/// What loops are ranked by, square metres.
fn ranked_m2(score: &MapScores) -> f64 {
    score.ranked_m2().unwrap()
}

/// The poses with a candidate of each kind, and with a loop at the drive's end, which leaves most of it as it was.
fn with_loops() -> Vec<(&'static str, Vec<Isometry3<f64>>)> {
    let poses = DRIVE.graph.poses();
    let last = poses.len() - 1;
    let at_the_end = PoseEdge {
        from: last as i64 - 8,
        to: last as i64,
        from_from_to: poses[last - 8].inv_mul(&poses[last]) * Isometry3::translation(1.0, 0.0, 0.0),
        information: PoseGraph::information_of(0.02, 0.01),
    };
    let with = |(what, edge): (&'static str, &PoseEdge)| {
        let extra = std::slice::from_ref(edge);
        let found = optimise(&DRIVE.graph, extra, &OptimiseOptions::default()).unwrap();
        assert!(found.converged);
        (what, found.world_from_body)
    };
    let kinds = [("true", LoopKind::True), ("near", LoopKind::Near), ("false", LoopKind::False)];
    let of_kinds = kinds.map(|(what, kind)| (what, DRIVE.first(kind)));
    of_kinds.into_iter().chain([("at the end", &at_the_end)]).map(with).collect()
}

#[test]
fn a_map_whose_patches_moved_is_that_made_anew() {
    let everything =
        DRIVE.map_at(DRIVE.graph.poses(), MapOptions { moved_m: Some(0.0), ..MapOptions::default() });
    let map = DRIVE.map_at(DRIVE.graph.poses(), MapOptions::default());
    assert_eq!((map.rays(), map.voxel_m()), (everything.rays(), everything.voxel_m()));
    let before = cast_anew(&map, DRIVE.graph.poses());
    let before_everything = cast_anew(&everything, DRIVE.graph.poses());
    let score_before = ranked_m2(&before.score().unwrap());
    let mut spared = 0.0;
    for (what, poses) in with_loops() {
        let anew = cast_anew(&everything, &poses).score().unwrap();
        let moved = moved_to(&before_everything, &poses);
        assert_eq!(moved.r_near_m2, anew.r_near_m2, "{what}");
        assert_eq!(moved.cast_share, 1.0);
        let change = ranked_m2(&anew) - score_before;
        assert!(change.abs() > 0.002 * score_before, "{what} changes next to nothing: {change}");

        let quick = moved_to(&before, &poses);
        assert!((ranked_m2(&quick) / ranked_m2(&anew) - 1.0).abs() < 0.01, "{what}");
        // The change is over the rays that both predict, so that it is not quite the difference.
        let [of_all, quick_change] = [&moved, &quick].map(|score| score.change.unwrap().value_m2);
        assert!((quick_change - of_all).abs() < 0.01 * score_before, "{what}: {quick_change} {of_all}");
        assert_eq!(of_all > 0.0, change > 0.0, "{what}: {of_all} {change}");
        spared += 1.0 - quick.cast_share;
    }
    assert!(spared > 0.1, "nothing was left as it was");
}

#[test]
fn where_nothing_moved_nothing_is_cast() {
    let map = DRIVE.map_at(DRIVE.graph.poses(), MapOptions::default());
    let placed = cast_anew(&map, DRIVE.graph.poses());
    let score = placed.score().unwrap();
    let turn = Isometry3::new([7.3, -4.1, 2.2].into(), [0.05, -0.03, 0.6].into());
    let rigidly: Vec<_> = DRIVE.graph.poses().iter().map(|pose| turn * pose).collect();
    for poses in [DRIVE.graph.poses(), &rigidly] {
        let moved = moved_to(&placed, poses);
        assert_eq!((moved.cast_share, moved.r_near_m2), (0.0, score.r_near_m2));
        let change = moved.change.unwrap();
        assert_eq!((change.value_m2, change.returns), (0.0, score.r_near_m2[LOOPS].1.unwrap().returns));
        let interval = change.interval.unwrap();
        assert_eq!((interval.low_m2, interval.high_m2), (0.0, 0.0));
    }
    // One patch that moved is seen by those around it alone.
    let mut one = DRIVE.graph.poses().to_vec();
    let middle = one.len() / 2;
    one[middle].translation.vector.x += 0.5;
    let moved = moved_to(&placed, &one);
    assert!(moved.cast_share > 0.0 && moved.cast_share < 0.9, "{}", moved.cast_share);
    assert!(moved.change.unwrap().value_m2 != 0.0);
}

#[test]
fn far_from_the_origin_a_map_is_worth_the_same() {
    let map = DRIVE.map_at(DRIVE.graph.poses(), MapOptions::default());
    assert_eq!(map.voxel_m(), 0.5);
    let shifted = |shift_m: [f64; 3]| -> Vec<_> {
        let shift = Isometry3::translation(shift_m[0], shift_m[1], shift_m[2]);
        DRIVE.graph.poses().iter().map(|pose| shift * pose).collect()
    };
    let worth_m2 =
        |map: &LoopMap, poses: &[Isometry3<f64>]| ranked_m2(&cast_anew(map, poses).score().unwrap());
    let here_m2 = worth_m2(&map, DRIVE.graph.poses());
    for part_m in [[0.0; 3], [0.17, -0.31, 0.22]] {
        let near_m2 = worth_m2(&map, &shifted(part_m));
        // A whole number of voxels: those of the map fall as they do here.
        let far = shifted([5e5 + part_m[0], 4e6 + part_m[1], 100.0 + part_m[2]]);
        let map_there = DRIVE.map_at(&far, MapOptions::default());
        assert_eq!((map_there.rays(), map_there.counts()), (map.rays(), map.counts()));
        // Made there, and made here and brought there.
        for map in [&map_there, &map] {
            let off = worth_m2(map, &far) / near_m2 - 1.0;
            assert!(off.abs() < 1e-6, "{off} with {part_m:?}");
        }
        // Where they fall differently, so few returns give somewhat different surfels.
        let off = near_m2 / here_m2 - 1.0;
        assert!(off.abs() < 0.03, "{off} with {part_m:?}");
    }
}
