//! The search for acceptable candidates finds what a plain one does; what has no score is reported.

use std::collections::BTreeSet;

use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use dmp_sim::LoopKind;

use super::*;
use crate::map::{LoopMap, MapOptions, MapScores, Placed};
use crate::tests::{DRIVE, chain};
use crate::{Kernel, Keyframes, OptimiseOptions, optimise};

fn map() -> LoopMap {
    DRIVE.map_at(DRIVE.graph.poses(), MapOptions { rays_per_keyframe: 400, ..MapOptions::default() })
}

fn ranked_m2(score: &MapScores) -> f64 {
    score.ranked_m2().unwrap()
}

/// The score of poses, and what candidates on them change, by a map that is made for this alone.
fn scores(map: &LoopMap, at: &[Isometry3<f64>], with: &[Vec<Isometry3<f64>>]) -> (f64, Vec<MapScores>) {
    let placed = Placed::new(map, at.to_vec()).unwrap();
    let changes = with.iter().map(|poses| placed.moved_to(poses, true).unwrap()).collect();
    (ranked_m2(&placed.score().unwrap()), changes)
}

/// The rule: by the whole interval of the change, and alone of the best so far, no worse than a tenth more as root mean
/// square.
fn is_worse(score: &MapScores, best: f64) -> bool {
    let most = 1.1 * 1.1 * best - best;
    score.change.unwrap().interval.unwrap().high_m2 > most || ranked_m2(score) - best > most
}

/// The plain greedy: tries all that remain on the graph as it is, and takes or refuses the one with the lowest change. The
/// candidates that were accepted, in their order.
fn greedy(
    map: &LoopMap,
    graph: &PoseGraph,
    candidates: &[PoseEdge],
    options: &OptimiseOptions,
) -> Vec<usize> {
    let mut graph = graph.clone();
    let (mut accepted, mut extra): (Vec<usize>, Vec<PoseEdge>) = (Vec::new(), Vec::new());
    let mut remaining: Vec<usize> = (0..candidates.len()).collect();
    let mut best = f64::INFINITY;
    while !remaining.is_empty() {
        let with = |index: &usize| {
            let extra = [&extra[..], &candidates[*index..=*index]].concat();
            optimise(&graph, &extra, options).unwrap().world_from_body
        };
        let poses: Vec<_> = remaining.iter().map(with).collect();
        let (now, tried) = scores(map, graph.poses(), &poses);
        best = best.min(now);
        let change = |k: &usize| tried[*k].change.unwrap().value_m2;
        let first = (0..tried.len()).min_by(|a, b| change(a).total_cmp(&change(b))).unwrap();
        // Nothing changes when one is refused: those behind it may be looked at without trying all again, but need not.
        let index = remaining.remove(first);
        if !is_worse(&tried[first], best) {
            accepted.push(index);
            extra.push(candidates[index].clone());
            graph = graph.with_poses(poses[first].clone()).unwrap();
        }
    }
    accepted
}

fn indices_of_accepted(acceptance: &Acceptance) -> Vec<usize> {
    let accepted = acceptance.decisions.iter().filter(|one| matches!(one.verdict, Verdict::Accepted));
    accepted.map(|one| one.index).collect()
}

/// Does step by step what the decisions say, and looks whether each is what the rule says at its turn.
fn follow(
    map: &LoopMap,
    graph: &PoseGraph,
    candidates: &[PoseEdge],
    options: &OptimiseOptions,
    acceptance: &Acceptance,
) {
    let mut at = graph.clone();
    let mut extra: Vec<PoseEdge> = Vec::new();
    let mut best = f64::INFINITY;
    for decision in &acceptance.decisions {
        assert_eq!(decision.after, extra.len());
        let with = [&extra[..], &candidates[decision.index..=decision.index]].concat();
        let found = optimise(&at, &with, options).unwrap();
        let (now, tried) = scores(map, at.poses(), std::slice::from_ref(&found.world_from_body));
        best = best.min(now);
        let reported = decision.tried.as_ref().unwrap().map.as_ref().unwrap();
        assert_eq!((reported.ranked_m2(), reported.change), (Some(ranked_m2(&tried[0])), tried[0].change));
        match decision.verdict {
            Verdict::Accepted => {
                assert!(!is_worse(&tried[0], best), "{decision:?}");
                extra = with;
                at = at.with_poses(found.world_from_body).unwrap();
            }
            Verdict::Worse => assert!(is_worse(&tried[0], best), "{decision:?}"),
            Verdict::Failed(_) => panic!("{decision:?}"),
        }
    }
    assert_eq!(acceptance.graph.poses(), at.poses());
    assert_eq!(acceptance.graph.edges(), [graph.edges(), &extra].concat());
    let (score, _) = scores(map, at.poses(), &[]);
    assert_eq!(acceptance.r_near_m2, Some(score));
}

#[test]
fn the_lazy_search_accepts_what_the_plain_one_does() {
    let (map, options, candidates) = (map(), OptimiseOptions::default(), DRIVE.edges());
    let ranker = Ranker::new(DRIVE.graph.clone(), options.clone(), Scorer::patches(&map), &()).unwrap();
    let ranking = ranker.rank(&candidates, &()).unwrap();
    assert_eq!((ranking.ranked.len(), ranking.failed.len()), (candidates.len(), 0));
    let acceptance = ranker.accept(&candidates, &ranking, &()).unwrap();
    let decided: BTreeSet<usize> = acceptance.decisions.iter().map(|one| one.index).collect();
    assert_eq!((decided.len(), acceptance.decisions.len()), (candidates.len(), candidates.len()));
    follow(&map, &DRIVE.graph, &candidates, &options, &acceptance);

    let wanted = greedy(&map, &DRIVE.graph, &candidates, &options);
    let accepted = indices_of_accepted(&acceptance);
    assert!(accepted.len() > 1 && accepted.len() < candidates.len());
    let sets = [&accepted, &wanted].map(|list| list.iter().copied().collect::<BTreeSet<_>>());
    assert_eq!(sets[0], sets[1]);
}

/// Loops that the graph has already go under the kernel, accepted ones do not.
#[test]
fn accepted_loops_have_no_kernel() {
    let options = OptimiseOptions { loop_kernel: Some(Kernel::Cauchy(0.1)), ..OptimiseOptions::default() };
    let of_kind = |kind: LoopKind| DRIVE.candidates.iter().filter(move |one| one.kind == kind);
    let [own, right] = [0, 1].map(|k| of_kind(LoopKind::True).nth(k).unwrap().edge.clone());
    let graph = DRIVE.graph.with_edge(own).unwrap();
    let (graph, _) = optimised(&graph, &options).unwrap();
    let candidates =
        [right.clone(), DRIVE.first(LoopKind::False).clone(), DRIVE.first(LoopKind::Near).clone()];
    let map = map();
    let ranker = Ranker::new(graph.clone(), options.clone(), Scorer::patches(&map), &()).unwrap();
    let ranking = ranker.rank(&candidates, &()).unwrap();
    let acceptance = ranker.accept(&candidates, &ranking, &()).unwrap();
    follow(&map, &graph, &candidates, &options, &acceptance);
    assert_eq!(indices_of_accepted(&acceptance), [0]);
    // Under the kernel it would be heard less.
    let (heard_less, _) = optimised(&graph.with_edge(right).unwrap(), &options).unwrap();
    let apart = acceptance.graph.poses().iter().zip(heard_less.poses());
    let apart_m = apart.map(|(a, b)| (a.translation.vector - b.translation.vector).norm());
    let most_m = apart_m.fold(0.0, f64::max);
    assert!(most_m > 1e-3, "{most_m}");
}

#[test]
fn threads_change_nothing() {
    let (map, candidates) = (map(), DRIVE.edges());
    let in_so_many = |threads: usize, scorer: fn(&LoopMap) -> Scorer<'_>| {
        let work = || {
            let options = OptimiseOptions::default();
            let ranker = Ranker::new(DRIVE.graph.clone(), options, scorer(&map), &()).unwrap();
            let without = ranker.without().clone();
            let ranking = ranker.rank(&candidates, &()).unwrap();
            let accepted = ranker.accept(&candidates, &ranking, &()).unwrap();
            // Numbers are written so that they are read back to the same bits.
            format!("{without:?}\n{ranking:?}\n{accepted:?}")
        };
        in_threads(threads, work).unwrap()
    };
    let scorers: [fn(&LoopMap) -> Scorer<'_>; 2] = [|map| Scorer::patches(map), |_| Scorer::graph()];
    for scorer in scorers {
        assert_eq!(in_so_many(1, scorer), in_so_many(2, scorer));
    }
}

fn straight(count: usize) -> Vec<Isometry3<f64>> {
    (0..count).map(|k| Isometry3::translation(k as f64, 0.0, 0.0)).collect()
}

fn edge(from: i64, to: i64, length_m: f64, sigma_m: f64) -> PoseEdge {
    let information = PoseGraph::information_of(sigma_m, 0.01);
    PoseEdge { from, to, from_from_to: Isometry3::translation(length_m, 0.0, 0.0), information }
}

/// On a straight chain of n steps with the variance s² a loop with l² and an error d costs d² / (n s² + l²), of which
/// its own share is l² / (n s² + l²), and moves its end by n s² / (n s² + l²) of d.
#[test]
fn without_a_map_a_loop_costs_what_it_is_off_by() {
    let (step_m, loop_m) = (0.05, 0.1);
    let graph = chain(&straight(31), &PoseGraph::information_of(step_m, 0.01));
    let loops = [(5, 25, 8.0), (0, 30, 0.2), (10, 20, 0.3), (3, 24, 0.0)];
    let candidates = loops.map(|(from, to, off_m)| edge(from, to, (to - from) as f64 + off_m, loop_m));
    let ranker = Ranker::new(graph.clone(), OptimiseOptions::default(), Scorer::graph(), &()).unwrap();
    assert_eq!(ranker.without().map, None);
    assert!(ranker.without().chi2 < 1e-20);
    let ranking = ranker.rank(&candidates, &()).unwrap();
    let order: Vec<usize> = ranking.ranked.iter().map(|tried| tried.index).collect();
    assert_eq!((order, ranking.failed.len()), (vec![3, 1, 2, 0], 0));
    for tried in &ranking.ranked {
        let (from, to, off_m) = loops[tried.index];
        let of_steps = (to - from) as f64 * step_m * step_m;
        let all = of_steps + loop_m * loop_m;
        let near = |found: f64, wanted: f64| (found - wanted).abs() <= 1e-7 * (wanted + 1e-3);
        assert!(near(tried.chi2_change, off_m * off_m / all), "{tried:?}");
        assert!(near(tried.own_chi2, off_m * off_m * loop_m * loop_m / (all * all)), "{tried:?}");
        assert!(near(tried.largest_move_m, off_m * of_steps / all), "{tried:?}");
        assert!(tried.largest_turn_rad < 1e-7 && tried.score() == tried.chi2_change, "{tried:?}");
        assert!(off_m == 0.0 || tried.moved_most >= to, "{tried:?}");
    }
    // 8 m for 21 steps is more than one right loop in a hundred.
    let acceptance = ranker.accept(&candidates, &ranking, &()).unwrap();
    let verdicts: Vec<bool> =
        acceptance.decisions.iter().map(|one| matches!(one.verdict, Verdict::Accepted)).collect();
    assert_eq!(verdicts, [true, true, true, false]);
    assert_eq!(acceptance.decisions[3].index, 0);
    assert_eq!((acceptance.graph.edges().len(), acceptance.r_near_m2), (33, None));
}

/// Where steps are weak, a loop may be believed that is as long as the earth is round twice.
#[test]
fn a_loop_that_leads_out_of_the_world_has_no_score() {
    let log: &dyn dmp_log::ScanLog = &DRIVE.log;
    let (count, options) = (40, OptimiseOptions::default());
    let dmp_log::FrameInfo { stamp_ns: first_ns, .. } = log.frames()[0];
    let period_ns = log.summary().period_ns.unwrap();
    let last_ns = log.summary().span_ns.unwrap().1;
    let every_ns = (last_ns - first_ns.unwrap()) / (count as i64 - 1) + period_ns / 2;
    let times: Vec<i64> = (0..count as i64).map(|k| first_ns.unwrap() + k * every_ns).collect();
    let poses: Vec<_> = DRIVE.graph.poses().iter().copied().take(count).collect();
    let graph = chain(&poses, &(PoseGraph::unit_information() * 1e-4));
    let keyframes = Keyframes::of(&graph, Some(&times), log, 0).unwrap();
    let config = dmp::Config { max_time_gap_ns: Some(10 * every_ns), ..DRIVE.config.clone() };
    let map_options = MapOptions { rays_per_keyframe: 100, ..MapOptions::default() };
    let map = LoopMap::new(log, &keyframes, graph.poses(), &config, map_options, &()).unwrap();
    let candidate = |to: usize, off_m: [f64; 3]| {
        let off = Isometry3::translation(off_m[0], off_m[1], off_m[2]);
        let from_from_to = poses[0].inv_mul(&poses[to]) * off;
        PoseEdge { from: 0, to: to as i64, from_from_to, information: PoseGraph::unit_information() }
    };
    let candidates =
        [candidate(1, [0.0, 9.9e7, 0.0]), candidate(12, [0.0; 3]), candidate(1, [9.9e7, 0.0, 0.0])];
    for scorer in [Scorer::patches(&map), Scorer::log(log, &keyframes, &config)] {
        let ranker = Ranker::new(graph.clone(), options.clone(), scorer, &()).unwrap();
        let ranking = ranker.rank(&candidates, &()).unwrap();
        assert_eq!(ranking.ranked.iter().map(|tried| tried.index).collect::<Vec<_>>(), [1]);
        let failed: Vec<_> = ranking.failed.iter().map(|failed| (failed.index, &failed.fault)).collect();
        assert!(
            matches!(failed[..], [(0, TryFault::OutOfWorld(_)), (2, TryFault::OutOfWorld(_))]),
            "{failed:?}"
        );
        assert!(failed[0].1.to_string().starts_with("with it "), "{}", failed[0].1);
    }
    // Without a map there is no world to leave.
    let ranker = Ranker::new(graph, options, Scorer::graph(), &()).unwrap();
    assert_eq!(ranker.rank(&candidates, &()).unwrap().failed.len(), 0);
}
