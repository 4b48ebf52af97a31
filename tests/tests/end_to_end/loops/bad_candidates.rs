//! What is wrong with graphs, candidates, times and labels is named, skipped and counted.

use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use serde_json::Value;

use super::{average_precision, chain, ranked, write_candidates, write_graph};
use crate::common::{done, ends, has, misused, once, refused, text, write};

/// A square of four sides of ten metres, a vertex each, that comes back to where it began.
fn square() -> Vec<Isometry3<f64>> {
    let corner = |k: i32| {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(k % 4);
        Isometry3::new(
            [[0.0, 10.0, 10.0, 0.0][k as usize % 4], [0.0, 0.0, 10.0, 10.0][k as usize % 4], 0.0].into(),
            [0.0, 0.0, turn].into(),
        )
    };
    (0..6).map(corner).collect()
}

fn edge(from: i64, to: i64) -> PoseEdge {
    let poses = square();
    let from_from_to = poses[from as usize].inv_mul(&poses[to as usize]);
    PoseEdge { from, to, from_from_to, information: PoseGraph::information_of(0.1, 0.01) }
}

#[test]
fn candidates_that_cannot_be_tried_are_named_and_counted() {
    let folder = tempfile::tempdir().unwrap();
    write_graph(&folder.path().join("graph.g2o"), &chain(&square(), (0.1, 0.01)));
    write_candidates(folder.path(), "c", &[(edge(0, 4), true), (edge(1, 5), true)]);
    let mut lines = std::fs::read_to_string(folder.path().join("c.g2o")).unwrap();
    let unit = "1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1";
    for edge in ["0 77 0 0 0", "2 5 nan 0 0", "5 1 0 0 0", "2 3 0 0 0"] {
        lines += &["EDGE_SE3:QUAT ", edge, " 0 0 0 1 ", unit, "\n"].concat();
    }
    lines.push_str("EDGE_SE3:QUAT 0 5 0 0 0 0 0 0 1 -1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1\n");
    write(folder.path(), "c.g2o", &lines);
    let result = ranked(folder.path(), "graph.g2o --candidates c.g2o --truth c.csv", 3);
    assert_eq!(result["candidates"].as_array().unwrap().len(), 2);
    let why: Vec<(i64, &str)> = result["skipped"]
        .as_array()
        .unwrap()
        .iter()
        .map(|one| (one["to"].as_i64().unwrap_or(-1), one["why"].as_str().unwrap()))
        .collect();
    let expected = [(77, "77"), (5, "nan"), (1, "line 2"), (3, "already"), (5, "positive definite")];
    assert_eq!(why.len(), expected.len(), "{why:?}");
    for ((to, why), (wanted, word)) in why.iter().zip(expected) {
        assert!(*to == wanted && why.contains(word), "{why} is to have {word}");
    }
    let output = ends(folder.path(), "loops graph.g2o --candidates c.g2o", 3);
    has(&text(&output.stdout), &["skipped: 5 candidates", "line 3 (0 to 77)"]);
    has(&text(&output.stderr), &["c.g2o: line 3: skipped"]);

    // None at all is no ranking.
    write(folder.path(), "none.g2o", &format!("EDGE_SE3:QUAT 0 77 0 0 0 0 0 0 1 {unit}\n"));
    refused(folder.path(), "loops graph.g2o --candidates none.g2o", 1, &["none.g2o", "none of 1 candidate"]);
}

/// Of four true ones two are accepted, one leads to no vertex and one out of all numbers: those are missed, by the ranking and
/// by what is accepted.
#[test]
fn true_candidates_without_a_score_count_as_missed() {
    let folder = tempfile::tempdir().unwrap();
    write_graph(&folder.path().join("graph.g2o"), &chain(&square(), (0.1, 0.01)));
    let to_nowhere = PoseEdge { to: 77, ..edge(0, 4) };
    let endless = PoseEdge { from_from_to: Isometry3::translation(1e200, 0.0, 0.0), ..edge(2, 5) };
    // The pair of another one is no further loop.
    let again = edge(5, 1);
    let candidates = [edge(0, 4), to_nowhere, endless, edge(1, 5), again].map(|edge| (edge, true));
    write_candidates(folder.path(), "c", &candidates);
    let result = ranked(folder.path(), "graph.g2o --candidates c.g2o --truth c.csv --accept", 3);
    assert_eq!(result["skipped"].as_array().unwrap().len(), 3, "{result:#}");
    let (accepted, truth) = (&result["accepted"], &result["truth"]);
    assert_eq!((&accepted["accepted"], &accepted["precision"]), (&2.into(), &1.0.into()));
    assert_eq!((&truth["true_candidates"], average_precision(&result)), (&4.into(), 0.5));
    assert_eq!(accepted["recall"], 0.5);
}

#[test]
fn a_candidate_that_throws_poses_out_of_the_world_has_no_score() {
    let folder = tempfile::tempdir().unwrap();
    let made = once("simulate town -o drive --scans 60 --azimuth-steps 60 --instant");
    let drive = made.folder.join("drive");
    let truth = crate::common::trajectory(&made.folder.join("drive.truth.tum"));
    let poses: Vec<_> = truth.poses().iter().copied().step_by(2).take(60).collect();
    write_graph(&folder.path().join("graph.g2o"), &chain(&poses, (0.05, 0.005)));
    let of = |from: usize, to: usize, off_m: f64| PoseEdge {
        from: from as i64,
        to: to as i64,
        from_from_to: poses[from].inv_mul(&poses[to]) * Isometry3::translation(off_m, 0.0, 0.0),
        information: PoseGraph::information_of(0.01, 0.001),
    };
    let candidates =
        [(of(0, 50, 0.0), true), (of(0, 55, 1e9), false), (of(3, 40, 30.0), false), (of(5, 45, 3e6), false)];
    write_candidates(folder.path(), "c", &candidates);
    let arguments = format!("graph.g2o --candidates c.g2o --truth c.csv --log {}", drive.display());
    let result = ranked(folder.path(), &arguments, 3);
    let ends = |list: &str| -> Vec<i64> {
        result[list].as_array().unwrap().iter().map(|one| one["to"].as_i64().unwrap()).collect()
    };
    assert_eq!(ends("candidates")[0], 50, "{result:#}");
    assert!(ends("skipped").contains(&55), "{result:#}");
}

#[test]
fn what_does_not_belong_together_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    write_graph(&at.join("graph.g2o"), &chain(&square(), (0.1, 0.01)));
    write_candidates(at, "c", &[(edge(0, 4), true)]);
    done(at, "simulate town -o drive --scans 9 --azimuth-steps 30");
    let with = |rest: &str| format!("loops graph.g2o --candidates c.g2o {rest}");
    for (name, content) in [
        ("parts.g2o", "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n"),
        ("labels.csv", "0,4,perhaps\n"),
        ("t.txt", "1\n2\n3\n"),
        ("far.txt", "1\n2\n3\n4\n5\n6\n"),
        ("other.csv", "0,4,false\n1,2,true\n"),
    ] {
        write(at, name, content);
    }
    refused(at, "loops parts.g2o --candidates c.g2o", 1, &["parts.g2o", "2 parts"]);
    for (rest, code, words) in [
        ("--truth labels.csv", 1, &["labels.csv", "line 1", "perhaps"][..]),
        ("--log drive", 2, &["9 scans", "6 vertices"]),
        ("--log drive --keyframes t.txt", 1, &["t.txt", "3 stamps", "6 vertices"]),
        ("--log drive --keyframes far.txt", 1, &["graph", "scans"]),
        ("--accept --save-graph graph.g2o", 2, &["graph.g2o", "place of the input"]),
        ("--log drive --rays 0", 2, &["rays"]),
    ] {
        refused(at, &with(rest), code, words);
    }
    for (rest, word) in [
        ("--step-error 1cm", "1cm,1mrad"),
        ("--loop-kernel huber", "huber:1.5"),
        ("--save-graph x.g2o", "--accept"),
        ("--rays 100", "--log <LOG>"),
        ("--log drive --direct --accept", "--accept"),
    ] {
        misused(at, &with(rest), &[word]);
    }
    // A label for no candidate and a candidate without one are no mistakes, and without a true one there is no precision.
    let result = ranked(at, "graph.g2o --candidates c.g2o --truth other.csv", 0);
    assert_eq!(result["truth"], Value::Null);
    has(result["truth_withheld"].as_str().unwrap(), &["none of the 1 items is true"]);
}
