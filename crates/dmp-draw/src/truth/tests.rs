use super::{TruthPlots, TruthPose, TruthRun, TruthStats, truth_picture};

/// One run of ten poses, ever further off.
pub(crate) fn plots() -> TruthPlots {
    let pose = |k: u32| {
        let at = f64::from(k);
        TruthPose {
            at: 0.1 * at,
            way_m: at,
            positions_m: [[at, 2.0, 0.1], [at, 2.0 + 0.1 * at, 0.1]],
            roll_pitch_yaw_deg: [[0.0, 1.0, 10.0 * at], [0.0, 1.0, 10.0 * at + 1.0]],
        }
    };
    let errors: Vec<(usize, f64)> = (0..10).map(|k| (k, 0.1 * k as f64)).collect();
    let stats = TruthStats {
        rmse: 0.534,
        mean: 0.45,
        median: 0.45,
        std: 0.287,
        min: 0.0,
        max: errors[9].1,
        sse: 2.85,
    };
    TruthPlots {
        metric: "APE".into(),
        title: "APE w.r.t. translation part (m)\n(not aligned)".into(),
        reference: "truth.tum".into(),
        unit: "m".into(),
        has_stamps: true,
        runs: vec![TruthRun { name: "kiss".into(), poses: (0..10).map(pose).collect(), errors, stats }],
        notes: vec!["a note".into()],
        dmp_version: "0".into(),
    }
}

#[test]
fn a_picture_has_every_run_beside_the_other() {
    let mut plots = plots();
    let one = truth_picture(&plots);
    let mut other = plots.runs[0].clone();
    other.name = "<lio>".into();
    plots.runs.push(other);
    let two = truth_picture(&plots);
    assert!(one.starts_with("<svg xmlns=") && two.trim_end().ends_with("</svg>"));
    assert_eq!((one.matches("<svg ").count(), two.matches("<svg ").count()), (11, 21));
    assert!(two.contains(">&lt;lio&gt;</text>") && !two.contains("var(--"));
    assert!(two.contains(">0.534000</text>"));
    assert_eq!(two, truth_picture(&plots));
}

#[test]
fn the_top_of_the_colours_leaves_out_the_largest_fiftieth() {
    let mut plots = plots();
    assert_eq!(plots.top(), 0.9);
    plots.runs[0].errors = (0..100).map(|k| (0, f64::from(k))).collect();
    assert_eq!(plots.top(), 98.0);
    for (factor, top) in [(0.01, 98.0), (1000.0, 98.0)] {
        let mut other = plots.runs[0].clone();
        other.errors.iter_mut().for_each(|error| error.1 *= factor);
        plots.runs.push(other);
        assert_eq!(plots.top(), top, "that of the run in the middle");
    }
    plots.runs.clear();
    assert_eq!(plots.top(), 0.0);
}
