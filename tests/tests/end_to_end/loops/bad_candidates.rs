//! What is wrong with graphs, candidates, times and labels is named, skipped and counted.

use dmp_sensor::{Isometry3, PoseEdge, PoseGraph};
use serde_json::Value;

use super::{average_precision, chain, ranked, write_candidates, write_graph};
use crate::common::{dmp, refused, text, write};

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
    // A person reads the same.
    let output = dmp(folder.path(), "loops graph.g2o --candidates c.g2o");
    assert_eq!(output.status.code(), Some(3));
    let (table, notes) = (text(&output.stdout), text(&output.stderr));
    assert!(table.contains("skipped: 5 candidates") && table.contains("line 3 (0 to 77)"), "{table}");
    assert!(notes.contains("c.g2o: line 3: skipped"), "{notes}");

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
    let output = dmp(folder.path(), "simulate town -o drive --scans 60 --azimuth-steps 60 --instant");
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let truth = dmp_log::read_trajectory(&folder.path().join("drive.truth.tum")).unwrap().trajectory;
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
    let result = ranked(folder.path(), "graph.g2o --candidates c.g2o --truth c.csv --log drive", 3);
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
    let with = |rest: &str| format!("loops graph.g2o --candidates c.g2o {rest}");
    let poses = "VERTEX_SE3:QUAT 0 0 0 0 0 0 0 1\nVERTEX_SE3:QUAT 1 1 0 0 0 0 0 1\n";
    write(at, "parts.g2o", poses);
    refused(at, "loops parts.g2o --candidates c.g2o", 1, &["parts.g2o", "2 parts"]);
    write(at, "labels.csv", "0,4,perhaps\n");
    refused(at, &with("--truth labels.csv"), 1, &["labels.csv", "line 1", "perhaps"]);
    let output = dmp(at, "simulate town -o drive --scans 9 --azimuth-steps 30");
    assert_eq!(output.status.code(), Some(0));
    refused(at, &with("--log drive"), 2, &["9 scans", "6 vertices"]);
    write(at, "t.txt", "1\n2\n3\n");
    refused(at, &with("--log drive --keyframes t.txt"), 1, &["t.txt", "3 stamps", "6 vertices"]);
    write(at, "far.txt", "1\n2\n3\n4\n5\n6\n");
    refused(at, &with("--log drive --keyframes far.txt"), 1, &["graph", "scans"]);
    refused(at, &with("--accept --save-graph graph.g2o"), 2, &["graph.g2o", "place of the input"]);
    refused(at, &with("--log drive --rays 0"), 2, &["rays"]);
    let wrong = [
        ("--step-error 1cm", "1cm,1mrad"),
        ("--loop-kernel huber", "huber:1.5"),
        ("--save-graph x.g2o", "--accept"),
        ("--rays 100", "--log <LOG>"),
        ("--log drive --direct --accept", "--accept"),
    ];
    for (arguments, word) in wrong {
        let output = dmp(at, &with(arguments));
        let told = text(&output.stderr);
        assert!(output.status.code() == Some(2) && told.contains(word), "{arguments}: {told}");
    }

    // A label for no candidate and a candidate without one are no mistakes; nothing true is told.
    write(at, "other.csv", "0,4,false\n1,2,true\n");
    let result = ranked(at, "graph.g2o --candidates c.g2o --truth other.csv", 0);
    assert_eq!(result["truth"], Value::Null);
    assert!(result["truth_withheld"].as_str().unwrap().contains("none of the 1 items is true"), "{result:#}");
    let output = dmp(at, &with("--truth other.csv"));
    let told = text(&output.stderr);
    assert!(told.contains("other.csv: 1 label of no candidate that can be tried"), "{told}");
}
