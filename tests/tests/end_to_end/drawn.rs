//! Scores of a draw of the returns.

use std::collections::BTreeMap;
use std::sync::Mutex;

use dmp::{CastReturns, Config, FrameOrder, Report, Residuals, Run, ScoredReturns, Sink, Watch, evaluate};

use crate::common::{SMALL_CHUNK, comparable, drift, open, plain, runs_of, score, small_town, write_chunks};

/// The residuals of every return that is cast, by scan, time and place.
#[derive(Default)]
struct Returns(Mutex<BTreeMap<(usize, i64, [u64; 3]), Vec<Residuals>>>);

impl Sink for Returns {
    fn returns_scored(&self, scored: &ScoredReturns<'_>) {
        let mut all = self.0.lock().unwrap();
        let runs: Vec<_> = scored.runs.iter().flatten().collect();
        for (index, &offset_ns) in scored.offsets_ns.iter().enumerate() {
            let residuals = runs.iter().map(|run| run.residuals[index]).collect();
            let place = runs[0].rays[index].endpoint_in_world().map(f64::to_bits);
            assert!(all.insert((scored.frame, offset_ns, place), residuals).is_none());
        }
    }
}

fn returns_of(
    log: &std::path::Path,
    runs: &[Run],
    config: &Config,
) -> (Report, BTreeMap<(usize, i64, [u64; 3]), Vec<Residuals>>) {
    let returns = Returns::default();
    let report = evaluate(open(log).as_ref(), runs, config, Watch::sink(&returns)).unwrap();
    (report, returns.0.into_inner().unwrap())
}

/// The oracle: of all residuals those of one of three consecutive returns, the same for every order and number of threads.
#[test]
fn a_draw_has_the_residuals_of_all_returns_in_the_same_map() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("town.mcap");
    let (scans, truth) = small_town(40, 180);
    write_chunks(&path, &scans, SMALL_CHUNK);
    let runs = runs_of(&truth, &[("drift", drift(1.0))]);
    let (whole, all) = returns_of(&path, &runs, &plain());
    let third = |seed| Config { returns: CastReturns::OneIn(3), seed, ..plain() };
    let (report, drawn) = returns_of(&path, &runs, &third(0));
    assert!(drawn.iter().all(|(key, residuals)| all[key] == *residuals));
    // Of each three consecutive ones, used or not, one is drawn.
    let used = (all.len() / 3) as f64;
    assert!((drawn.len() as f64 / used - 1.0).abs() < 0.05, "{} of {}", drawn.len(), all.len());
    let sum_m2: f64 = drawn.values().filter_map(|runs| runs[0].first_m).map(|m| m * m).sum();
    assert!((report.runs[0].dmp_sum_m2 / sum_m2 - 1.0).abs() < 1e-6);

    let [inputs, of_all] = [&report.inputs, &whole.inputs];
    assert_eq!((inputs.returns_used, report.sampling.returns_one_in), (drawn.len() as u64, 3));
    let mut dropped = inputs.dropped.0.clone();
    let not_drawn = dropped.insert("not_drawn".to_owned(), 0).unwrap();
    assert_eq!((not_drawn + inputs.returns_used, &dropped), (of_all.returns_used, &of_all.dropped.0));
    assert_eq!(report.runs[0].map.surfels, whole.runs[0].map.surfels);

    let shuffled = Config { threads: 3, order: FrameOrder::Shuffled(2), memory_bytes: 32 << 20, ..third(0) };
    assert_eq!(comparable(&score(&path, &runs, &shuffled)), comparable(&report));
    let other = returns_of(&path, &runs, &third(1)).1;
    assert!(!other.keys().eq(drawn.keys()));
}
