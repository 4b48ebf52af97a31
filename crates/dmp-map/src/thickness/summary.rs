//! How thick a map is, over its flat cells.

use dmp_sensor::{Isometry3, Point3};
use serde::{Deserialize, Serialize};

use super::flat::FlatCell;

/// Fewer flat cells say nothing.
const LEAST_CELLS: usize = 30;
/// Places with two layers that are listed.
const LISTED: usize = 5;

/// How thick the flat places of a map are: RMS distances of the points of a cell (2 v wide) from its plane, metres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Thickness {
    /// Flat cells that were measured.
    pub cells: u64,
    /// Their share of the cells of the map that have enough points.
    pub share_flat: f64,
    /// Median over the cells, metres.
    pub median_m: f64,
    /// 95 % of the cells are thinner, metres.
    pub p95_m: f64,
    /// Median of the thickness within single visits, metres.
    pub within_median_m: f64,
    /// Median of the noise across the surface within single scans, metres; null if scans are too sparse to say.
    pub sensor_median_m: Option<f64>,
    /// Median number of points on a square metre of these cells.
    pub points_per_m2: f64,
    /// Surfaces that stand twice: as several visits saw them, or in a cloud without visits.
    pub layers: Layers,
}

/// How many flat cells hold two layers of one surface.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Layers {
    /// Cells that could show two layers: those seen on several visits, or of a cloud those with enough points.
    pub cells: u64,
    /// Those that do: the layers are apart by more than twice the thickness of one.
    pub doubled: u64,
    /// Median distance of the layers, metres.
    pub median_m: Option<f64>,
    /// Where they are farthest apart.
    pub places: Vec<DoubledPlace>,
}

/// A place where a surface stands twice.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DoubledPlace {
    /// Middle of the cell, metres.
    pub place_m: [f64; 3],
    /// Distance of the layers, metres.
    pub layers_m: f64,
}

impl Layers {
    /// Of cells that could show two, with the distance of those that do, else 0.
    pub(super) fn of(cells: impl Iterator<Item = DoubledPlace>) -> Self {
        let all: Vec<DoubledPlace> = cells.collect();
        let count = all.len() as u64;
        let mut places: Vec<DoubledPlace> = all.into_iter().filter(|place| place.layers_m > 0.0).collect();
        let (doubled, apart) = (places.len() as u64, sorted(places.iter().map(|place| place.layers_m)));
        places.sort_by(|a, b| b.layers_m.total_cmp(&a.layers_m));
        places.truncate(LISTED);
        Self { cells: count, doubled, median_m: quantile(&apart, 0.5), places }
    }
}

impl Thickness {
    /// The same, with places in another frame.
    #[must_use]
    pub fn posed(mut self, own_from_world: &Isometry3<f64>) -> Self {
        for doubled in &mut self.layers.places {
            doubled.place_m = (own_from_world * Point3::from(doubled.place_m)).into();
        }
        self
    }

    /// Of the flat ones among so many cells with enough points.
    pub(super) fn of(flat: &[([f64; 3], FlatCell)], dense: u64) -> Option<Self> {
        if flat.len() < LEAST_CELLS {
            return None;
        }
        let of = |value: &dyn Fn(&FlatCell) -> Option<f64>| {
            sorted(flat.iter().filter_map(|(_, cell)| value(cell)))
        };
        let thick = of(&|cell| Some(cell.thick_m));
        let sensor = of(&|cell| cell.sensor_m);
        let layers = flat
            .iter()
            .filter_map(|&(place_m, cell)| cell.layers_m.map(|layers_m| DoubledPlace { place_m, layers_m }));
        Some(Self {
            cells: flat.len() as u64,
            share_flat: flat.len() as f64 / dense as f64,
            median_m: quantile(&thick, 0.5)?,
            p95_m: quantile(&thick, 0.95)?,
            within_median_m: quantile(&of(&|cell| Some(cell.within_m)), 0.5)?,
            sensor_median_m: quantile(&sensor, 0.5).filter(|_| sensor.len() >= LEAST_CELLS),
            points_per_m2: quantile(&of(&|cell| Some(cell.points_per_m2)), 0.5)?,
            layers: Layers::of(layers),
        })
    }
}

fn sorted(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    sorted.get(((sorted.len().saturating_sub(1)) as f64 * share).round() as usize).copied()
}
