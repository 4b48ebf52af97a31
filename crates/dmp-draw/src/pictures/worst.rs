//! Where a run's map is wrong: the stretches of its way whose returns it predicts worst.

use dmp_reduce::Scales;

use super::seen::{FrameScore, SeenFrame};

/// Places listed of a run.
const PLACES: usize = 10;
/// The longest stretch of way that is judged as one, metres of a drive …
const LONGEST_M: f64 = 10.0;
const SHORTEST_M: f64 = 1.0;
/// … and so much of a way that is short.
const SHARE_OF_WAY: f64 = 1.0 / 20.0;
/// Fewer predicted returns tell nothing of a stretch.
const FEWEST_RETURNS: u64 = 50;
/// From so much on, a run counts as worse at a place than another one.
const NOTABLE: f64 = 0.05;
/// Scans of one pass may be so many scored scans apart.
const GAP: usize = 3;
/// Less way than this has no direction, metres of a drive.
const NO_WAY_M: f64 = 0.1;

/// A place where a run's map is wrong.
#[derive(Debug, Clone, PartialEq)]
pub struct WorstPlace {
    /// Index of the run.
    pub run: usize,
    /// Its middle, metres in the world of the run.
    pub centre_in_world_m: [f64; 3],
    /// Scans within this belong to it, metres.
    pub radius_m: f64,
    /// Direction of the way through it, in the plane of x and y.
    pub along: [f64; 2],
    /// What the run's map predicts in the stretch that is worst.
    pub(crate) score: FrameScore,
    /// The run that is best in that stretch, and its score, where the run itself is clearly worse.
    pub(crate) best: Option<(usize, FrameScore)>,
    /// Every time that the sensor is there, the worst first.
    pub passes: Vec<Pass>,
}

impl WorstPlace {
    /// The root of the mean of min(r², τ²) at the coarser scale, over the returns of the stretch that is worst, metres.
    pub fn off_m(&self, scales: Scales) -> Option<f64> {
        self.score.rms_m(scales).map(|[_, wide_m]| wide_m)
    }

    /// By how much it is off, and whose map is better there, in a line.
    pub fn in_words(&self, names: &[&str], scales: Scales) -> String {
        let own = format!("residuals of {}", self.score.misses(scales));
        match &self.best {
            Some((best, score)) => format!("{own}; {} has {}", names[*best], score.misses(scales)),
            None if names.len() > 1 => format!("{own}; no other run is clearly better"),
            None => own,
        }
    }
}

/// Scans of a place that follow each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Pass {
    /// First and last of them: indices among the scored scans.
    pub frames: [usize; 2],
    pub(crate) score: FrameScore,
}

/// A part of the way.
struct Stretch {
    frames: Vec<usize>,
    /// Of every run.
    scores: Vec<FrameScore>,
}

/// The worst places of every run, the worst first: those where another run's map is better, by how much; then those
/// that are as bad in every run, by how bad they are. `frames` are in the order of the log.
pub fn worst_places(frames: &[SeenFrame], runs: usize, scales: Scales) -> Vec<Vec<WorstPlace>> {
    let (stretches, stretch_m) = stretches(frames, runs, scales);
    (0..runs).map(|run| worst_of_run(frames, &stretches, run, (stretch_m, scales))).collect()
}

/// How two runs compare, stretch by stretch.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Contest {
    /// The way on which the other run is clearly better, the one is, and neither is, metres.
    pub(crate) other_m: f64,
    pub(crate) one_m: f64,
    pub(crate) alike_m: f64,
    /// Scores of both where the other is better by most.
    pub(crate) worst: Option<[FrameScore; 2]>,
}

/// Of each run, where its map is clearly better than that of the run `one`; where either predicts too little, nothing.
pub(crate) fn contests(frames: &[SeenFrame], runs: usize, one: usize, scales: Scales) -> Vec<Contest> {
    let (stretches, stretch_m) = stretches(frames, runs, scales);
    let of_run = |other: usize| {
        let mut contest = Contest::default();
        let mut most = NOTABLE;
        for scores in stretches.iter().map(|stretch| [stretch.scores[one], stretch.scores[other]]) {
            if scores.iter().any(|score| score.predicted < FEWEST_RETURNS) {
                continue;
            }
            match scores[0].wrongness() - scores[1].wrongness() {
                lead if lead > NOTABLE => {
                    contest.other_m += stretch_m;
                    if lead > most {
                        (most, contest.worst) = (lead, Some(scores));
                    }
                }
                lead if lead < -NOTABLE => contest.one_m += stretch_m,
                _ => contest.alike_m += stretch_m,
            }
        }
        contest
    };
    (0..runs).map(of_run).collect()
}

/// The way cut into equal stretches, and how long one is, metres.
fn stretches(frames: &[SeenFrame], runs: usize, scales: Scales) -> (Vec<Stretch>, f64) {
    let travel_m = travel_m(frames, runs);
    let way_m = travel_m.last().copied().unwrap_or(0.0);
    // Equally long, so that none is a rest of a few scans.
    let [shortest_m, longest_m] = [SHORTEST_M, LONGEST_M].map(|m| scales.lengths().metre_m * m);
    let stretches = (way_m / (SHARE_OF_WAY * way_m).clamp(shortest_m, longest_m)).round().max(1.0);
    let stretch_m = (way_m / stretches).max(shortest_m);
    let mut of_way: Vec<Stretch> = Vec::new();
    let mut at = f64::NAN;
    for (index, (frame, travelled_m)) in frames.iter().zip(&travel_m).enumerate() {
        let number = (travelled_m / stretch_m).floor().min(stretches - 1.0);
        if number != at {
            at = number;
            of_way.push(Stretch { frames: Vec::new(), scores: vec![FrameScore::default(); runs] });
        }
        let Some(stretch) = of_way.last_mut() else { continue };
        stretch.frames.push(index);
        for (sum, score) in stretch.scores.iter_mut().zip(&frame.scores) {
            sum.add(score);
        }
    }
    (of_way, stretch_m)
}

/// The way to each scan: from one to the next the median of the runs, as the drive is cut into segments.
pub(crate) fn travel_m(frames: &[SeenFrame], runs: usize) -> Vec<f64> {
    let mut travelled_m = 0.0;
    let mut travel_m = Vec::with_capacity(frames.len());
    for (k, frame) in frames.iter().enumerate() {
        if let Some(before) = k.checked_sub(1).map(|before| &frames[before]) {
            let step =
                |run: usize| distance_m(before.position_in_world_m[run], frame.position_in_world_m[run]);
            let mut steps: Vec<f64> = (0..runs).map(step).collect();
            steps.sort_by(f64::total_cmp);
            travelled_m += match steps.as_slice() {
                [] => 0.0,
                steps => f64::midpoint(steps[(runs - 1) / 2], steps[runs / 2]),
            };
        }
        travel_m.push(travelled_m);
    }
    travel_m
}

fn worst_of_run(
    frames: &[SeenFrame],
    stretches: &[Stretch],
    run: usize,
    (stretch_m, scales): (f64, Scales),
) -> Vec<WorstPlace> {
    let position = |frame: usize| frames[frame].position_in_world_m[run];
    let mut ranked: Vec<(bool, f64, Option<usize>, &Stretch)> = Vec::new();
    for stretch in stretches.iter().filter(|stretch| stretch.scores[run].predicted >= FEWEST_RETURNS) {
        let own = stretch.scores[run].wrongness();
        let others = stretch
            .scores
            .iter()
            .enumerate()
            .filter(|(other, score)| *other != run && score.predicted >= FEWEST_RETURNS);
        let best = others.map(|(other, score)| (other, score.wrongness())).min_by(|a, b| a.1.total_cmp(&b.1));
        match best.filter(|(_, best)| own - best > NOTABLE) {
            Some((other, best)) => ranked.push((true, own - best, Some(other), stretch)),
            None => ranked.push((false, own, None, stretch)),
        }
    }
    ranked.sort_by(|a, b| (b.0, b.1).partial_cmp(&(a.0, a.1)).unwrap_or(std::cmp::Ordering::Equal));
    let mut places: Vec<WorstPlace> = Vec::new();
    for (_, _, best, stretch) in ranked {
        let is_listed = |frame: &usize| {
            places.iter().any(|place| distance_m(position(*frame), place.centre_in_world_m) < 2.0 * stretch_m)
        };
        if stretch.frames.iter().any(is_listed) {
            continue;
        }
        places.push(place(frames, stretch, (run, best), (stretch_m, scales)));
        if places.len() == PLACES {
            break;
        }
    }
    places
}

/// The place around a stretch, with all passes.
fn place(
    frames: &[SeenFrame],
    stretch: &Stretch,
    (run, best): (usize, Option<usize>),
    (stretch_m, scales): (f64, Scales),
) -> WorstPlace {
    let position = |frame: usize| frames[frame].position_in_world_m[run];
    // Where the sensor was, not the mean: in a run that jumps, that would be near none of its scans.
    let centre_in_world_m = position(stretch.frames[stretch.frames.len() / 2]);
    let radius_m = 1.5 * stretch_m;
    let mut passes: Vec<Pass> = Vec::new();
    for (index, frame) in frames.iter().enumerate() {
        if distance_m(position(index), centre_in_world_m) > radius_m {
            continue;
        }
        match passes.last_mut().filter(|pass| index - pass.frames[1] <= GAP) {
            Some(pass) => {
                pass.frames[1] = index;
                pass.score.add(&frame.scores[run]);
            }
            None => passes.push(Pass { frames: [index, index], score: frame.scores[run] }),
        }
    }
    passes.sort_by(|a, b| b.score.wrongness().total_cmp(&a.score.wrongness()));
    let ends = [stretch.frames.first(), stretch.frames.last()]
        .map(|frame| frame.map_or(centre_in_world_m, |f| position(*f)));
    let way = [ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]];
    let length_m = (way[0] * way[0] + way[1] * way[1]).sqrt();
    let along =
        if length_m > NO_WAY_M * scales.lengths().metre_m { way.map(|m| m / length_m) } else { [1.0, 0.0] };
    let best = best.map(|run| (run, stretch.scores[run]));
    WorstPlace { run, centre_in_world_m, radius_m, along, score: stretch.scores[run], best, passes }
}

pub(crate) fn distance_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two laps of a square of 100 m a side, a scan a metre; `rms_m` of run and scan is what each map misses by.
    fn drive(runs: usize, rms_m: impl Fn(usize, usize) -> f64) -> Vec<SeenFrame> {
        let position = |k: usize| {
            let (side, at) = ((k / 100) % 4, (k % 100) as f64);
            let [x, y] = [[at, 0.0], [100.0, at], [100.0 - at, 100.0], [0.0, 100.0 - at]][side];
            [x + 4e5, y + 5e6, 2.0]
        };
        let frame = |number: usize| SeenFrame {
            number,
            stamp_ns: Some(number as i64 * 100_000_000),
            position_in_world_m: vec![position(number); runs],
            scores: (0..runs)
                .map(|run| {
                    let square_m2 = rms_m(run, number) * rms_m(run, number);
                    let parts =
                        [0.5, 2.0].map(|scale_m: f64| 1000.0 * (square_m2 / scale_m.powi(2)).min(1.0));
                    FrameScore { predicted: 1000, parts, near: (0, 0.0) }
                })
                .collect(),
        };
        (0..800).map(frame).collect()
    }
    const DRIVE: Scales = Scales::Drive;

    #[test]
    fn a_run_is_wrong_where_another_is_better() {
        // Trees that every map misses by 0.4 m, and 40 m of the second run that are 0.3 m off.
        let trees = |k: usize| if (200..240).contains(&(k % 400)) { 0.4 } else { 0.1 };
        let frames = drive(2, |run, k| if run == 1 && (520..560).contains(&k) { 0.3 } else { trees(k) });
        let places = worst_places(&frames, 2, DRIVE);
        assert_eq!(places[0].len(), 10);
        let [other, own] = contests(&frames, 2, 1, DRIVE).try_into().unwrap();
        assert_eq!([other.other_m, other.one_m, other.alike_m].map(f64::round), [40.0, 0.0, 759.0]);
        let [reference, better] = other.worst.unwrap().map(|score| score.rms_m(DRIVE).unwrap()[0]);
        assert!((reference - 0.3).abs() < 1e-9 && (better - 0.1).abs() < 1e-9, "{reference} {better}");
        assert_eq!((own.other_m, own.one_m, own.worst), (0.0, 0.0, None));
        assert_eq!(contests(&frames, 2, 0, DRIVE)[1].one_m, other.other_m);
        let first = places[1][0].clone();
        let [from, to] = first.passes[0].frames;
        assert!(from < 560 && to > 520, "{first:?}");
        assert_eq!(first.best.as_ref().map(|(run, _)| *run), Some(0));
        assert_eq!(first.passes.len(), 2, "both laps come by: {first:?}");
        assert!((first.score.rms_m(DRIVE).unwrap()[0] - 0.3).abs() < 0.05);
        assert!((first.best.unwrap().1.rms_m(DRIVE).unwrap()[0] - 0.1).abs() < 0.05);
        // The trees come behind it, and are the worst of the first run, which no run is better at.
        assert!(places[0][0].best.is_none());
        assert!((200..240).contains(&(places[0][0].passes[0].frames[0] % 400 + 15)), "{:?}", places[0][0]);
        for places in &places {
            for (k, a) in places.iter().enumerate() {
                assert!(
                    places[..k].iter().all(|b| distance_m(a.centre_in_world_m, b.centre_in_world_m) > 15.0)
                );
            }
        }
    }

    #[test]
    fn a_run_alone_is_wrong_where_it_is_worst() {
        let frames = drive(1, |_, k| if (120..160).contains(&k) { 0.4 } else { 0.1 + 1e-4 * (k % 7) as f64 });
        let places = worst_places(&frames, 1, DRIVE);
        let [from, to] = places[0][0].passes[0].frames;
        assert!((100..165).contains(&from) && (115..180).contains(&to), "{:?}", places[0][0]);
        assert!(places[0].windows(2).all(|pair| pair[0].best.is_none() && pair[1].best.is_none()));
    }

    #[test]
    fn a_run_that_jumps_has_places_all_the_same() {
        let mut frames = drive(3, |run, k| if run == 2 && (100..110).contains(&k) { 0.5 } else { 0.1 });
        for frame in frames.iter_mut().skip(105) {
            frame.position_in_world_m[2][0] += 300.0;
        }
        let places = worst_places(&frames, 3, DRIVE);
        assert!(places.iter().flatten().all(|place| !place.passes.is_empty()));
        assert!((100..110).contains(&places[2][0].passes[0].frames[0]), "{:?}", places[2][0]);
    }

    #[test]
    fn of_two_passes_the_one_off_its_own_surfels_is_found() {
        // Both laps miss each other, the second is torn loose from the scans around it.
        let mut frames = drive(1, |_, k| if (120..160).contains(&(k % 400)) { 0.4 } else { 0.1 });
        for frame in &mut frames {
            let near_m2 = if (520..560).contains(&frame.number) { 0.02 } else { 0.003 };
            frame.scores[0].near = (1000, 1000.0 * near_m2 / 0.25);
        }
        let places = worst_places(&frames, 1, DRIVE);
        let [from, to] = places[0][0].passes[0].frames;
        assert!(from >= 500 && to < 580 && places[0][0].passes.len() == 2, "{:?}", places[0][0].passes);
    }

    #[test]
    fn a_sensor_that_stands_is_in_one_place() {
        let mut frames = drive(1, |_, _| 0.2);
        frames.iter_mut().for_each(|frame| frame.position_in_world_m = vec![[1.0, 2.0, 3.0]]);
        let places = worst_places(&frames, 1, DRIVE);
        assert_eq!((places[0].len(), places[0][0].passes.len()), (1, 1));
        assert_eq!((places[0][0].centre_in_world_m, places[0][0].along), ([1.0, 2.0, 3.0], [1.0, 0.0]));
        assert!(worst_places(&[], 2, DRIVE).iter().all(Vec::is_empty));
    }
}
