//! What moves around a drive: cars that are followed, that overtake or are met, a bus beside, people on the pavements.

use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::parts::shape::Shape;
use crate::parts::solid::{Hit, Solid, Surface};
use crate::parts::street::{LANE_M, car};
use crate::random::Random;
use crate::ways::Drive;

/// Something that keeps near the sensor all the way. Places are along the drive's own line, from the sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Companion {
    /// A car in the same lane, so far ahead, metres.
    Ahead(f64),
    /// A car ahead that stands for three seconds, goes on at twice the speed for three, and so on.
    StopAndGo,
    /// Cars that overtake, one every 20 s.
    Overtaking,
    /// A row of cars in the opposite lane, one every 14 m.
    Oncoming,
    /// A bus to the left that falls back and comes up again.
    Bus,
    /// People on both pavements, one every 2.5 m.
    Crowd,
}

/// Middle of the opposite lane and of the pavements, metres to the left of the sensor's lane.
const OPPOSITE_M: f64 = 2.0 * LANE_M;
const PAVEMENT_M: f64 = 4.2;
/// Others are made this far ahead and behind, metres.
const AROUND_M: f64 = 80.0;
const WALK_M_S: f64 = 1.3;

/// What a companion is made of at `time_s` of a drive.
pub(crate) fn solids(companions: &[Companion], drive: &Drive<'_>, time_s: f64) -> Vec<Solid> {
    let mut around = Around { drive, here_m: drive.path_m(time_s), solids: Vec::new() };
    for companion in companions {
        match *companion {
            Companion::Ahead(metres) => around.add_car(metres, 0.0, 1.0),
            Companion::StopAndGo => {
                // It stands, and the drive comes nearer: from 8 m to where it was before.
                let (round, share) = (libm::floor(time_s / 6.0), time_s / 6.0 - libm::floor(time_s / 6.0));
                let [from_m, to_m] = [0.0, 1.0].map(|later| drive.path_m(6.0 * (round + later)));
                let at_m = from_m + (to_m - from_m) * (2.0 * share).min(1.0) + 8.0;
                around.add_car(at_m - around.here_m, 0.0, 1.0);
            }
            Companion::Overtaking => {
                around.add_car((4.0 * time_s).rem_euclid(AROUND_M) - AROUND_M / 2.0, OPPOSITE_M, 1.0);
            }
            Companion::Oncoming => around.add_row(14.0, -7.0 * time_s, |around, ahead_m, _| {
                around.add_car(ahead_m, OPPOSITE_M, -1.0);
            }),
            Companion::Bus => around.add_bus(15.0 * libm::sin(TAU * time_s / 30.0)),
            Companion::Crowd => {
                for walk_m_s in [WALK_M_S, -WALK_M_S] {
                    around.add_row(5.0, walk_m_s * time_s, |around, ahead_m, number| {
                        let mut random = Random::new(number, &[b'w'.into(), u64::from(walk_m_s > 0.0)]);
                        let side_m = PAVEMENT_M + random.between(0.0, 1.2);
                        let left_m = if random.chance(0.5) { side_m + LANE_M } else { LANE_M - side_m };
                        around.add_person(ahead_m + random.between(0.0, 4.0), left_m);
                    });
                }
            }
        }
    }
    around.solids
}

/// The nearer of a hit and what the ray meets of some solids.
pub(crate) fn nearer(
    hit: Option<Hit>,
    solids: &[Solid],
    origin: Vector3<f64>,
    direction: Vector3<f64>,
) -> Option<Hit> {
    let mut first = hit;
    for solid in solids {
        let far_m = first.map_or(f64::INFINITY, |hit| hit.range_m);
        if let Some(entry) = solid.shape.entry(origin, direction).filter(|entry| entry.range_m < far_m) {
            first = Some(Hit::of(&entry, direction, solid.reflectivity, solid.surface));
        }
    }
    first
}

struct Around<'a> {
    drive: &'a Drive<'a>,
    /// The place of the sensor along its line, metres.
    here_m: f64,
    solids: Vec<Solid>,
}

impl Around<'_> {
    /// Whatever `add` makes, at `step_m` from each other along the line, moved by `moved_m`, with its number.
    fn add_row(&mut self, step_m: f64, moved_m: f64, add: impl Fn(&mut Self, f64, u64)) {
        let first = libm::ceil((self.here_m - AROUND_M - moved_m) / step_m);
        for k in 0..=(2.0 * AROUND_M / step_m) as u64 {
            let number = first + k as f64;
            add(self, number * step_m + moved_m - self.here_m, number as i64 as u64);
        }
    }

    fn add_car(&mut self, ahead_m: f64, left_m: f64, way: f64) {
        let (middle, yaw_rad) = self.drive.beside_line(self.here_m + ahead_m, left_m);
        let turned_rad = if way < 0.0 { TAU / 2.0 } else { 0.0 };
        self.solids.extend(car(middle, yaw_rad + turned_rad, 0.3, Surface::MovingCar));
    }

    fn add_bus(&mut self, ahead_m: f64) {
        let (middle, yaw_rad) = self.drive.beside_line(self.here_m + ahead_m, OPPOSITE_M);
        let (sin_yaw, cos_yaw) = libm::sincos(yaw_rad);
        let centre = middle + Vector3::new(0.0, 0.0, 1.75);
        let shape = Shape::Box { centre, half: Vector3::new(6.0, 1.25, 1.4), cos_yaw, sin_yaw };
        self.solids.push(Solid { shape, reflectivity: 0.4, surface: Surface::MovingCar });
    }

    fn add_person(&mut self, ahead_m: f64, left_m: f64) {
        let (foot, _) = self.drive.beside_line(self.here_m + ahead_m, left_m);
        let shape = Shape::Cylinder { foot, radius_m: 0.25, height_m: 1.7 };
        self.solids.push(Solid { shape, reflectivity: 0.3, surface: Surface::Person });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::town::{Town, TownOptions};
    use crate::ways::DriveOptions;

    #[test]
    fn each_is_where_it_says() {
        let town = Town::new(TownOptions { relief_m: 0.0, ..TownOptions::default() }).unwrap();
        let drive = Drive::new(&town, DriveOptions::default()).unwrap();
        let time_s = 4.0;
        let pose = drive.world_from_body_at(drive.options().start_ns + 4_000_000_000);
        let (origin, ahead) = (pose.translation.vector, pose.rotation * Vector3::x());
        let level = Vector3::new(ahead.x, ahead.y, 0.0).normalize();
        let left = Vector3::new(-level.y, level.x, 0.0);
        // From 0.6 m above the ground: the body of a car.
        let origin = Vector3::new(origin.x, origin.y, 0.6);
        let seen = |companion, direction| {
            nearer(None, &solids(&[companion], &drive, time_s), origin, direction).map(|hit| hit.range_m)
        };
        let back_m = seen(Companion::Ahead(15.0), level).unwrap();
        assert!((back_m - (15.0 - 2.15)).abs() < 0.3, "{back_m}");
        assert_eq!(seen(Companion::Ahead(15.0), -level), None);
        // At the start the bus is beside, after 4 s it is 11 m ahead.
        let start = drive.world_from_body_at(drive.options().start_ns);
        let (at, to_left) = (start.translation.vector, start.rotation * Vector3::y());
        let beside = nearer(None, &solids(&[Companion::Bus], &drive, 0.0), at, to_left).unwrap();
        assert!((beside.range_m - (OPPOSITE_M - 1.25)).abs() < 0.5, "{beside:?}");
        assert!(beside.surface.is_moving() && seen(Companion::Bus, left).is_none());
        let row = solids(&[Companion::Oncoming], &drive, time_s);
        assert_eq!(row.len(), 2 * 12);
        assert!(
            solids(&[Companion::Crowd], &drive, time_s).iter().all(|solid| solid.surface == Surface::Person)
        );
        // The car that stops and goes is as far as it was after each round.
        let gap = |time_s| {
            let (middle, _) = drive.beside_line(drive.path_m(time_s) + 8.0, 0.0);
            let Shape::Box { centre, .. } = solids(&[Companion::StopAndGo], &drive, time_s)[0].shape else {
                unreachable!()
            };
            (centre - middle).xy().norm()
        };
        assert!(gap(12.0) < 1e-6 && gap(15.0) > 8.0, "{} {}", gap(12.0), gap(15.0));
    }
}
