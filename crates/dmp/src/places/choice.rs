//! Selects the places to score.

use dmp_report::PlacesReport;
use dmp_runs::{EvaluateError, ScoredPlace};

use super::draw::{FEW_PLACES, draw, growing};
use super::scans::DriveScans;
use super::survey;
use super::way::{LENGTH_M, PlaceScans, SPACING_M, Way};

/// With fewer places a sample is pointless.
const FEWEST_PLACES: usize = 4;

/// Growing samples of places read up to this share of the log: reading more costs as much as a whole score.
const MOST_READ: f64 = 0.5;

/// How many places a quick score reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Quick {
    /// As many as this share of the log's bytes has room for; above 0 and up to 1.
    Share(f64),
    /// Few, and then twice as many until every pair of runs is decided, up to half of the log's bytes.
    UntilDecided,
}

/// The places to score.
pub(super) struct Places {
    /// The number of places, and how many of them are passed more than once.
    pub(super) total: usize,
    revisited_total: usize,
    /// For each look the places that it adds, and the scans to read for each.
    pub(super) looks: Vec<Vec<(ScoredPlace, PlaceScans)>>,
    /// For every place the number in the log of its middle scan.
    pub(super) middles: Vec<usize>,
    /// Approximate number of bytes of the log read for the first look, including the index.
    pub(super) bytes: u64,
}

impl Places {
    pub(super) fn choose(
        drive_scans: &DriveScans<'_>,
        way: &Way,
        seed: u64,
        quick: Quick,
    ) -> Result<Self, EvaluateError> {
        let places = way.places();
        let (outline, drive) = (drive_scans.outline(), drive_scans.drive());
        if places.len() < FEWEST_PLACES {
            let travel_m = drive.travel_m();
            return Err(EvaluateError::NoPlaces { travel_m, places: places.len() });
        }
        let mut scans: Vec<PlaceScans> = places.iter().map(|place| way.scans_of(place)).collect();
        let bytes: Vec<u64> = scans.iter().map(|place| drive_scans.bytes_of(&place.read)).collect();
        let read = outline.own_bytes_read().unwrap_or(0) + survey::bytes(outline);
        let left = |share: f64| ((share * outline.bytes() as f64) as u64).saturating_sub(read);
        let revisited: Vec<bool> = places.iter().map(|place| drive_scans.is_revisit(place.centre)).collect();
        let looks = match quick {
            // The whole log covers all places, though most scans are read for several of them.
            Quick::Share(share) => {
                let budget_bytes = if share < 1.0 { left(share) } else { u64::MAX };
                vec![draw(&bytes, &revisited, budget_bytes, seed)]
            }
            Quick::UntilDecided => growing(&bytes, &revisited, left(MOST_READ), seed),
        };
        let first_bytes = looks[0].iter().map(|&number| bytes[number]).sum::<u64>();
        let mut with_scans = |number: usize| {
            let place = ScoredPlace { number, of: places.len(), is_revisited: revisited[number] };
            (place, std::mem::take(&mut scans[number]))
        };
        let looks = looks.into_iter().map(|look| look.into_iter().map(&mut with_scans).collect()).collect();
        Ok(Self {
            total: places.len(),
            bytes: read + first_bytes,
            revisited_total: revisited.iter().filter(|&&revisited| revisited).count(),
            middles: places.iter().map(|place| drive.frames[place.centre].number).collect(),
            looks,
        })
    }

    /// The part of the report on the places, of which so many looks were scored.
    pub(super) fn report(
        &self,
        way: &Way,
        (quick, looks): (Quick, usize),
        scans_read: u64,
        bytes_read: Option<u64>,
    ) -> PlacesReport {
        let drawn: Vec<&(ScoredPlace, PlaceScans)> = self.looks[..looks].iter().flatten().collect();
        let (share_asked, looks) = match quick {
            Quick::Share(share) => (Some(share), None),
            Quick::UntilDecided => (None, Some(looks)),
        };
        PlacesReport {
            drawn: drawn.len() as u64,
            total: self.total as u64,
            revisited: drawn.iter().filter(|(place, _)| place.is_revisited).count() as u64,
            revisited_total: self.revisited_total as u64,
            cut: drawn.iter().filter(|(_, scans)| scans.cut).count() as u64,
            length_m: LENGTH_M,
            radius_m: way.radius_m(),
            spacing_m: SPACING_M,
            scans_read,
            are_fewest: drawn.len() <= FEW_PLACES,
            share_asked,
            looks,
            bytes_read,
        }
    }
}
