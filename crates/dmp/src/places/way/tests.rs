use super::*;

/// A path through these points, a scan every metre.
fn through(corners: &[[f64; 2]]) -> Vec<[f64; 3]> {
    let mut places = Vec::new();
    for leg in corners.windows(2) {
        let length_m = (leg[1][0] - leg[0][0]).hypot(leg[1][1] - leg[0][1]);
        for k in 0..length_m as usize {
            let part = k as f64 / length_m;
            let at = |c: usize| leg[0][c] + part * (leg[1][c] - leg[0][c]);
            places.push([at(0), at(1), 0.0]);
        }
    }
    places
}

fn way(of_runs: &[Vec<[f64; 3]>], in_a_group: u32) -> Way {
    let scans = of_runs[0].len();
    let groups = (0..scans as u32).map(|scan| scan / in_a_group).collect();
    Way::of((0..scans).map(|scan| scan as f64).collect(), of_runs.to_vec(), groups, 12.0)
}

/// Twice round a block of 100 m by 60 m, and on for 200 m.
fn twice_round() -> Vec<[f64; 3]> {
    let round = [[0.0, 0.0], [100.0, 0.0], [100.0, 60.0], [0.0, 60.0]];
    let corners = [&round[..], &round[..], &[[0.0, 0.0], [-200.0, 0.0]]].concat();
    through(&corners)
}

fn shifted(places: &[[f64; 3]], by: impl Fn(usize) -> [f64; 3]) -> Vec<[f64; 3]> {
    let shift = |(k, place): (usize, &[f64; 3])| std::array::from_fn(|c| place[c] + by(k)[c]);
    places.iter().enumerate().map(shift).collect()
}

#[test]
fn every_scan_is_in_one_place_and_later_passes_join() {
    let truth = twice_round();
    // In a world of its own, and off by up to a metre.
    let drifting = shifted(&truth, |k| [5000.0 + 0.001 * k as f64, -7.0, 0.0]);
    for runs in [vec![truth.clone()], vec![truth.clone(), drifting]] {
        let way = way(&runs, 1);
        let places = way.places();
        let mut scans: Vec<usize> = places.iter().flat_map(|place| place.scans.clone()).collect();
        scans.sort_unstable();
        assert!(scans.iter().copied().eq(0..truth.len()));
        // 320 m round and 200 m on: the second round adds almost no places.
        assert!((50..=58).contains(&places.len()), "{}", places.len());
        let twice = places.iter().filter(|place| place.scans.len() > 15).count();
        assert!(twice >= 25, "{twice}");
        for place in &places {
            let [x, y, _] = truth[place.centre];
            for &scan in &place.scans {
                assert!((truth[scan][0] - x).hypot(truth[scan][1] - y) <= 10.0, "{place:?}");
            }
        }
    }
}

#[test]
fn a_run_that_lost_its_way_does_not_make_places_of_others() {
    let truth = twice_round();
    let collapsed = vec![[0.0; 3]; truth.len()];
    let (alone, both) = (way(std::slice::from_ref(&truth), 1), way(&[truth.clone(), collapsed], 1));
    assert_eq!(alone.places(), both.places());
    let place = &both.places()[20];
    let scans = both.scans_of(place);
    // It puts every scan there: not all are read, but all scored ones are.
    assert!(scans.read.len() <= MAX_SCANS && scans.scored.iter().all(|scan| scans.read.contains(scan)));
    assert!(scans.read.len() > alone.scans_of(place).read.len());
}

#[test]
fn a_run_that_lost_its_way_leaves_the_others_their_scans() {
    let truth = through(&[[0.0, 0.0], [3000.0, 0.0], [3000.0, 2000.0]]);
    let collapsed = vec![[0.0; 3]; truth.len()];
    let (alone, both) =
        (way(std::slice::from_ref(&truth), 1), way(&[truth.clone(), collapsed.clone(), collapsed], 1));
    for place in both.places().iter().step_by(37) {
        let (of_one, of_all) = (alone.scans_of(place), both.scans_of(place));
        assert!(of_all.cut && of_all.read.len() <= MAX_SCANS + of_one.read.len());
        assert!(of_one.read.iter().all(|scan| of_all.read.contains(scan)), "{place:?}");
        assert!(of_one.scored.is_subset(&of_all.scored));
    }
}

#[test]
fn the_middle_of_a_place_is_one_of_its_scans() {
    // Steps of 20 m, of 6 m, and a gap of 500 m.
    let mut along_m: Vec<f64> = (0..20).map(|k| 20.0 * f64::from(k)).collect();
    along_m.extend((1..50).map(|k| 380.0 + 6.0 * f64::from(k)));
    along_m.extend((1..100).map(|k| 1174.0 + f64::from(k)));
    let places_m = along_m.iter().map(|&m| [m, 0.0, 0.0]).collect();
    let groups = (0..along_m.len() as u32).collect();
    let way = Way::of(along_m.clone(), vec![places_m], groups, 12.0);
    for place in way.places() {
        assert!(place.scans.contains(&place.centre), "{place:?}");
        let [first, last] = [place.scans[0], *place.scans.last().unwrap()].map(|scan| along_m[scan]);
        assert!(last - first < LENGTH_M);
        let scans = way.scans_of(&place);
        let near = |scan: &usize| (along_m[*scan] - along_m[place.centre]).abs() <= 35.0;
        assert!(scans.read.iter().all(near), "{place:?}");
    }
}

#[test]
fn longer_segments_are_looked_at_from_further_away() {
    let truth = through(&[[0.0, 0.0], [400.0, 0.0]]);
    let scans = truth.len();
    let of = |segment_m| {
        let along_m = (0..scans).map(|scan| scan as f64).collect();
        Way::of(along_m, vec![truth.clone()], (0..scans as u32).collect(), segment_m)
    };
    assert_eq!([of(12.0), of(4.0), of(50.0)].map(|way| way.radius_m()), [35.0, 35.0, 111.0]);
    let place = of(50.0).places()[20].clone();
    let read = of(50.0).scans_of(&place).read;
    assert!(read.last().unwrap() - read[0] > 200);
}

#[test]
fn what_is_read_is_what_any_run_has_near_in_steps() {
    let truth = twice_round();
    let bent = shifted(&truth, |k| [0.0, if k > 400 { 30.0 } else { 0.0 }, 0.0]);
    for in_a_group in [1, 2, 5] {
        let way = way(&[truth.clone(), bent.clone()], in_a_group);
        for place in way.places() {
            let scans = way.scans_of(&place);
            assert!(!scans.cut && scans.read.windows(2).all(|pair| pair[0] < pair[1]));
            assert!(!scans.scored.is_empty());
            assert!(scans.scored.iter().all(|scan| place.scans.contains(scan) && scans.read.contains(scan)));
            let near = |scan: usize| {
                [&truth, &bent].iter().any(|run| distance(run[scan], run[place.centre]) <= way.radius_m())
            };
            for &scan in &scans.read {
                assert!(near(scan) || place.scans.contains(&scan), "{scan} at {place:?}");
            }
            // No near stretch of the path is missing.
            for scan in (0..truth.len()).filter(|&scan| near(scan)) {
                let beside = scans.read.iter().any(|&read| read.abs_diff(scan) <= MOST_LEFT_OUT_M as usize);
                assert!(beside, "{scan} at {place:?}");
            }
            // And none is read much more densely than the steps require.
            assert!(scans.read.len() <= (0..truth.len()).filter(|&scan| near(scan)).count() / 2 + 12);
        }
    }
}

#[test]
fn a_way_that_never_comes_back_has_no_place_twice() {
    let way = way(&[through(&[[0.0, 0.0], [300.0, 0.0], [300.0, 200.0]])], 1);
    let places = way.places();
    assert_eq!(places.len(), 50);
    assert!(places.iter().all(|place| place.scans.len() == 10));
}

#[test]
fn where_the_sensor_stands_one_scan_is_enough() {
    let mut along_m: Vec<f64> = (0..100).map(f64::from).collect();
    along_m.splice(50..50, std::iter::repeat_n(50.0, 600));
    let places = along_m.iter().map(|&m| [m, 0.0, 0.0]).collect();
    let groups = (0..along_m.len() as u32).collect();
    let way = Way::of(along_m, vec![places], groups, 12.0);
    let standing = way.places().into_iter().find(|place| place.scans.len() > 500).unwrap();
    assert!(way.scans_of(&standing).read.len() <= 20 && way.scans_of(&standing).scored.len() <= 4);
}
