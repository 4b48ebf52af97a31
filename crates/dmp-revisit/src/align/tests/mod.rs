//! Registration against exhaustive search, and on two visits of a simulated town.

mod bare;
mod coverage;
mod elsewhere;
mod look_alikes;
mod visits;

use dmp_map::{Lattice, PatchBuilder};
use dmp_sensor::{Isometry3, Vector3};
use proptest::prelude::*;

use self::visits::{moved, off, pyramid, turned, visits};
use crate::align::level::{NONE, Surfel};
use crate::align::{Pyramid, Refusal, align};

#[test]
fn two_visits_of_one_place_are_where_they_are() {
    for seed in 1..=3 {
        let [first, second] = visits(seed);
        let found = align(&pyramid(first), &pyramid(second), &[]).unwrap();
        let (off_m, off_rad) = off(&found, &Isometry3::identity());
        assert!(off_m < 0.005 && off_rad < 2e-4, "seed {seed}: {off_m} m, {off_rad} rad");
        let sigma_m = found.covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
        assert!(off_m < 3.0 * sigma_m && sigma_m < 0.05, "seed {seed}: {off_m} m of {sigma_m} m");
        assert!(found.overlap.iter().all(|&share| share > 0.5), "{:?}", found.overlap);
    }
}

#[test]
fn a_visit_that_is_off_is_brought_back() {
    for (seed, by) in [
        (1, turned(0.0, [0.3, -0.2, 0.05])),
        (2, turned(0.02, [1.0, 0.8, -0.3])),
        (3, turned(-0.05, [-2.0, 1.5, 0.2])),
        (4, turned(0.08, [3.0, 0.5, 0.0])),
    ] {
        let [first, second] = visits(seed);
        let found = align(&pyramid(first), &pyramid(moved(&by, &second)), &[]).unwrap();
        let (off_m, off_rad) = off(&found, &by.inverse());
        let sigma_m = found.covariance.fixed_view::<3, 3>(3, 3).trace().sqrt();
        assert!(off_m < 0.005 && off_rad < 2e-4, "seed {seed}: {off_m} m, {off_rad} rad");
        assert!(off_m < 3.0 * sigma_m, "seed {seed}: {off_m} m of {sigma_m} m");
    }
}

#[test]
fn the_best_of_several_guesses_is_gone_on_with() {
    let [first, second] = visits(5);
    let by = turned(0.03, [9.0, -4.0, 0.3]);
    let (target, source) = (pyramid(first), pyramid(moved(&by, &second)));
    let guesses: Vec<Isometry3<f64>> = [-8.0, -4.0, 0.0, 4.0, 8.0]
        .iter()
        .flat_map(|&x| [-8.0, -4.0, 0.0, 4.0, 8.0].map(|y| turned(0.0, [x, y, 0.0])))
        .collect();
    let found = align(&target, &source, &guesses).unwrap();
    let (off_m, _) = off(&found, &by.inverse());
    assert!(off_m < 0.005, "{off_m} m");
}

#[test]
fn what_is_brought_onto_what_does_not_matter() {
    let [first, second] = visits(6);
    let by = turned(0.01, [0.6, -0.4, 0.1]);
    let (target, source) = (pyramid(first), pyramid(moved(&by, &second)));
    let there = align(&target, &source, &[]).unwrap().target_from_source;
    let back = align(&source, &target, &[]).unwrap().target_from_source;
    let between = there * back;
    assert!(between.translation.vector.norm() < 0.01 && between.rotation.angle() < 1e-3, "{between}");
}

#[test]
fn visits_that_see_nothing_of_each_other_are_refused() {
    let [first, second] = visits(7);
    let far = turned(0.0, [100.0, 0.0, 0.0]);
    let error = align(&pyramid(first.clone()), &pyramid(moved(&far, &second)), &[]).unwrap_err();
    assert!(matches!(error, Refusal::LittleOverlap { .. }), "{error}");
    let guesses = [0.0, 5.0, -5.0].map(|x| turned(0.0, [x, 0.0, 0.0]));
    let error = align(&pyramid(first.clone()), &pyramid(moved(&far, &second)), &guesses).unwrap_err();
    assert!(matches!(error, Refusal::LittleOverlap { .. }), "{error}");
    let error = align(&pyramid(first.clone()), &pyramid([]), &[]).unwrap_err();
    assert!(matches!(error, Refusal::LittleOverlap { share: 0.0 }), "{error}");
    let mut other = PatchBuilder::new(Lattice::new(0.25).unwrap());
    other.add(&second).unwrap();
    let error = align(&pyramid(first), &Pyramid::new(&other), &[]).unwrap_err();
    assert!(matches!(error, Refusal::Voxels(..)), "{error}");
}

proptest! {
    #[test]
    fn the_nearest_surfel_is_the_nearest(
        points in prop::collection::vec(prop::array::uniform3(-4.0..4.0_f64), 400..1500),
        place in prop::array::uniform3(-5.0..5.0_f64), normal in prop::array::uniform3(-1.0..1.0_f64),
        reach_m in 0.1..4.0_f64,
    ) {
        // Pressed flat, so that there are surfels.
        let pyramid = pyramid(points.into_iter().map(|[x, y, z]| [x, y, z.round() + 0.02 * z]));
        let normal = Vector3::from(normal);
        prop_assume!(normal.norm() > 0.1);
        let sought = Surfel::new(place, normal.normalize().into());
        for level in &pyramid.levels {
            let nearer = |(number, surfel): (u32, &Surfel)| (surfel.distance_m2(&sought), number);
            let alike = (0..).zip(&level.surfels).filter(|(_, surfel)| surfel.is_like(&sought)).map(nearer);
            let near = alike.filter(|&(m2, _)| m2 < (reach_m * reach_m) as f32);
            let expected = near.min_by(|a, b| a.partial_cmp(b).unwrap()).map_or(NONE, |(_, number)| number);
            // Whatever was known before.
            for known in [NONE, expected, 0, level.surfels.len() as u32 / 2] {
                prop_assert_eq!(level.nearest(&sought, reach_m, known), expected);
            }
        }
    }
}
