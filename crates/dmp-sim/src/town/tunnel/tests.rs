//! In a tunnel, every place along it is the same to rays, and a drive there and back stays clear of the walls.

use super::HEIGHT_M;
use crate::random::Random;
use crate::town::{Scenery, Town, TownOptions};
use crate::{LidarOptions, Recording, RecordingOptions, Route, SimError};
use nalgebra::Vector3;

fn options(route: Route) -> RecordingOptions {
    let lidar = LidarOptions { azimuth_steps: 120, rate_hz: 5.0, ..LidarOptions::with_beams(16) };
    RecordingOptions { seed: 3, scans: 300, route, speed_m_s: 6.0, traffic: 0, lidar }
}

#[test]
fn no_shift_along_it_changes_what_rays_meet() {
    let town = options(Route::Straight).town_of(Scenery::Tunnel).unwrap();
    let mut random = Random::new(7, &[]);
    let middle = Vector3::new(90.0, town.options().block_m[1] - 1.7, 1.9);
    let (mut met, mut beyond) = (0, 0);
    for _ in 0..4000 {
        let direction = Vector3::from_fn(|_, _| random.normal()).component_mul(&Vector3::new(4.0, 1.0, 1.0));
        let direction = direction.normalize();
        let at = middle + Vector3::y() * random.between(-3.0, 3.0);
        let shift = Vector3::x() * random.between(-100.0, 100.0);
        let [here, there] = [at, at + shift].map(|at| town.cast(at, direction, 0.0));
        match (here, there) {
            (Some(here), Some(there)) => {
                assert!((here.range_m - there.range_m).abs() < 1e-9, "{here:?} {there:?}");
                assert_eq!(here.surface, there.surface);
                met += 1;
            }
            (None, None) => beyond += 1,
            other => panic!("{direction:?}, {shift:?}: {other:?}"),
        }
    }
    assert!(met > 3900 && beyond < 100, "{met} {beyond}");
    // Along it nothing is met, however far a sensor sees.
    assert_eq!(town.cast(middle, Vector3::x(), 0.0), None);
    assert_eq!(town.cast(middle, Vector3::z(), 0.0).unwrap().range_m, HEIGHT_M - 1.9);
}

#[test]
fn nothing_else_goes_through_a_tunnel() {
    for route in [Route::Loop, Route::OutAndBack, Route::OneWay] {
        let options = options(route);
        let town = options.town_of(Scenery::Tunnel).unwrap();
        assert_eq!(Recording::new(&town, &options).err(), Some(SimError::OtherPlace { route }));
    }
    let busy = RecordingOptions { traffic: 1, ..options(Route::Straight) };
    assert!(matches!(busy.town_of(Scenery::Tunnel), Err(SimError::OutOfRange { .. })));
    let tunnel = TownOptions::of(Scenery::Tunnel).unwrap();
    for options in [TownOptions { relief_m: 1.0, ..tunnel.clone() }, TownOptions { blocks: [3, 1], ..tunnel }]
    {
        assert!(matches!(Town::new(options), Err(SimError::OutOfRange { .. })));
    }
}
