//! How far along its path a body is.

use nalgebra::Vector3;

/// Lengths of the ruler that measures a path, metres of a drive. Jitter of a few decimetres does not lengthen a path that
/// is measured with the longest; it is used where a path is this many rulers long, and a shorter one where it is not.
const RULERS_M: [f64; 4] = [6.0, 3.0, 1.5, 0.75];
const RULERS: f64 = 16.0;

/// The path length up to each place, metres; scans without a place have that of the one before.
pub fn along_m(places: &[Option<Vector3<f64>>], metre_m: f64) -> Vec<f64> {
    let mut along_m = Vec::new();
    for ruler_m in RULERS_M {
        along_m = ruled_m(places, ruler_m * metre_m);
        if along_m.last().is_some_and(|&travel_m| travel_m >= RULERS * ruler_m * metre_m) {
            break;
        }
    }
    along_m
}

/// The same measured with one ruler: it is laid down where the path leaves its reach.
fn ruled_m(places: &[Option<Vector3<f64>>], ruler_m: f64) -> Vec<f64> {
    let mut end: Option<(Vector3<f64>, f64)> = None;
    let mut along_m = 0.0;
    let measure = |place: &Option<Vector3<f64>>| {
        let Some(place) = place else { return along_m };
        let &mut (from, begun_m) = end.get_or_insert((*place, 0.0));
        let apart_m = (place - from).norm();
        along_m = f64::max(along_m, begun_m + apart_m);
        if apart_m >= ruler_m {
            end = Some((*place, along_m));
        }
        along_m
    };
    places.iter().map(measure).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn way(count: usize, step_m: f64, noise_m: f64) -> Vec<Option<Vector3<f64>>> {
        let mut state = 1_u64;
        let mut noise = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            // The sum of four uniform numbers has a variance of a third.
            let uniform = |k: u32| f64::from((state >> (16 * k)) as u16) / 32_768.0 - 1.0;
            noise_m * (0..4).map(uniform).sum::<f64>() / (4.0_f64 / 3.0).sqrt()
        };
        let place = |k: usize| Some(Vector3::new(step_m * k as f64 + noise(), noise(), noise()));
        (0..count).map(place).collect()
    }

    #[test]
    fn jitter_does_not_lengthen_a_path() {
        let travel_m = |noise_m| *along_m(&way(2000, 0.8, noise_m), 1.0).last().unwrap();
        let (smooth_m, noisy_m) = (travel_m(0.0), travel_m(0.3));
        assert!((smooth_m - 1599.2).abs() < 1e-9, "{smooth_m}");
        assert!((noisy_m / smooth_m - 1.0).abs() < 0.02, "{noisy_m}");
        // Standing is no travel.
        assert!(*along_m(&way(2000, 0.0, 0.1), 1.0).last().unwrap() < 10.0);
    }

    #[test]
    fn a_path_never_gets_shorter_and_gaps_are_passed_over() {
        let mut places = way(500, 0.5, 0.1);
        (100..200).for_each(|k| places[k] = None);
        let along_m = along_m(&places, 1.0);
        assert!(along_m.is_sorted() && along_m[100..200].iter().all(|&m| m == along_m[99]));
        assert!(*along_m.last().unwrap() > 245.0);
    }
}
