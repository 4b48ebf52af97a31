//! Selects the places to score.

use dmp_report::PlacesReport;
use dmp_runs::{EvaluateError, ScoredPlace};

use super::draw::{FEW_PLACES, draw};
use super::scans::DriveScans;
use super::survey;
use super::way::{LENGTH_M, PlaceScans, SPACING_M, Way};

/// With fewer places a sample is pointless.
const FEWEST_PLACES: usize = 4;

/// The places to score.
pub(super) struct Places {
    /// The number of places, and how many of them are passed more than once.
    pub(super) total: usize,
    revisited_total: usize,
    /// The drawn places, and the scans to read for each.
    pub(super) drawn: Vec<(ScoredPlace, PlaceScans)>,
    /// For every place the number in the log of its middle scan.
    pub(super) middles: Vec<usize>,
    /// Approximate number of bytes of the log read in total, including the index.
    pub(super) bytes: u64,
}

impl Places {
    pub(super) fn choose(
        drive_scans: &DriveScans<'_>,
        way: &Way,
        seed: u64,
        share: f64,
    ) -> Result<Self, EvaluateError> {
        let places = way.places();
        let (outline, drive) = (drive_scans.outline(), drive_scans.drive());
        if places.len() < FEWEST_PLACES {
            let travel_m = drive.travel_m();
            return Err(EvaluateError::NoPlaces { travel_m, places: places.len() });
        }
        let mut scans: Vec<PlaceScans> = places.iter().map(|place| way.scans_of(place)).collect();
        let bytes: Vec<u64> = scans.iter().map(|place| drive_scans.bytes_of(&place.read)).collect();
        let asked = (share * outline.bytes() as f64) as u64;
        let read = outline.own_bytes_read().unwrap_or(0) + survey::bytes(outline);
        // The whole log covers all places, though most scans are read for several of them.
        let budget_bytes = if share < 1.0 { asked.saturating_sub(read) } else { u64::MAX };
        let revisited: Vec<bool> = places.iter().map(|place| drive_scans.is_revisit(place.centre)).collect();
        let numbers = draw(&bytes, &revisited, budget_bytes, seed);
        let drawn_bytes = numbers.iter().map(|&number| bytes[number]).sum::<u64>();
        Ok(Self {
            total: places.len(),
            bytes: read + drawn_bytes,
            revisited_total: revisited.iter().filter(|&&revisited| revisited).count(),
            middles: places.iter().map(|place| drive.frames[place.centre].number).collect(),
            drawn: numbers
                .into_iter()
                .map(|number| {
                    let is_revisited = revisited[number];
                    let place = ScoredPlace { number, of: places.len(), is_revisited };
                    (place, std::mem::take(&mut scans[number]))
                })
                .collect(),
        })
    }

    pub(super) fn report(
        &self,
        way: &Way,
        share: f64,
        scans_read: u64,
        bytes_read: Option<u64>,
    ) -> PlacesReport {
        PlacesReport {
            drawn: self.drawn.len() as u64,
            total: self.total as u64,
            revisited: self.drawn.iter().filter(|(place, _)| place.is_revisited).count() as u64,
            revisited_total: self.revisited_total as u64,
            cut: self.drawn.iter().filter(|(_, scans)| scans.cut).count() as u64,
            length_m: LENGTH_M,
            radius_m: way.radius_m(),
            spacing_m: SPACING_M,
            scans_read,
            are_fewest: self.drawn.len() <= FEW_PLACES,
            share_asked: share,
            bytes_read,
        }
    }
}
