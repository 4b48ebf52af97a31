//! What was left out as the vehicle, with the three fields that say it in the JSON.

use serde::{Deserialize, Serialize};

/// Where the vehicle that carries the sensor is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub enum Ego {
    /// Detected in a sample of scans.
    Auto,
    /// Not in view.
    None,
    /// A box in the sensor frame, smallest and largest corner in millimetres.
    BoxMm([i64; 3], [i64; 3]),
}

/// What was left out as the vehicle that carries the sensor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "Fields", into = "Fields")]
pub struct EgoReport {
    /// What was known of it.
    pub known: Ego,
    /// Cells of 0.1 m found on it.
    pub cells: usize,
}

impl EgoReport {
    /// What was known of it, as the JSON has it: `auto`, `none` or `box`.
    pub fn name(&self) -> &'static str {
        match self.known {
            Ego::Auto => "auto",
            Ego::None => "none",
            Ego::BoxMm(..) => "box",
        }
    }

    /// The box given for it, smallest and largest corner, metres; `None` where none was.
    pub fn box_m(&self) -> Option<[[f64; 3]; 2]> {
        match self.known {
            Ego::BoxMm(min, max) => Some([min, max].map(|corner| corner.map(|mm| mm as f64 / 1e3))),
            Ego::Auto | Ego::None => None,
        }
    }
}

/// The vehicle in the JSON.
#[derive(Serialize, Deserialize)]
struct Fields {
    ego: String,
    ego_cells: usize,
    ego_box_m: Option<[[f64; 3]; 2]>,
}

impl From<EgoReport> for Fields {
    fn from(ego: EgoReport) -> Self {
        Self { ego: ego.name().to_owned(), ego_cells: ego.cells, ego_box_m: ego.box_m() }
    }
}

impl TryFrom<Fields> for EgoReport {
    type Error = String;

    fn try_from(Fields { ego, ego_cells: cells, ego_box_m }: Fields) -> Result<Self, String> {
        let known = match (ego.as_str(), ego_box_m) {
            ("auto", None) => Ego::Auto,
            ("none", None) => Ego::None,
            ("box", Some(corners)) => {
                let [min, max] = corners.map(|corner| corner.map(|m| (1e3 * m).round() as i64));
                Ego::BoxMm(min, max)
            }
            _ => {
                return Err(format!("config.ego is `{ego}`, which is not known beside its config.ego_box_m"));
            }
        };
        Ok(Self { known, cells })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_vehicle_comes_back() {
        for (known, cells, json) in [
            (Ego::Auto, 7, r#"{"ego":"auto","ego_cells":7,"ego_box_m":null}"#),
            (Ego::None, 0, r#"{"ego":"none","ego_cells":0,"ego_box_m":null}"#),
            (
                Ego::BoxMm([-1235, -1000, -2000], [1000, 1, 501]),
                0,
                r#"{"ego":"box","ego_cells":0,"ego_box_m":[[-1.235,-1.0,-2.0],[1.0,0.001,0.501]]}"#,
            ),
        ] {
            let ego = EgoReport { known, cells };
            assert_eq!(serde_json::to_string(&ego).unwrap(), json);
            assert_eq!(serde_json::from_str::<EgoReport>(json).unwrap(), ego);
        }
        for json in [
            r#"{"ego":"cat","ego_cells":0,"ego_box_m":null}"#,
            r#"{"ego":"box","ego_cells":0,"ego_box_m":null}"#,
            r#"{"ego":"auto","ego_cells":0,"ego_box_m":[[0.0,0.0,0.0],[1.0,1.0,1.0]]}"#,
        ] {
            let error = serde_json::from_str::<EgoReport>(json).unwrap_err().to_string();
            assert!(error.starts_with("config.ego is `"), "{error}");
        }
    }
}
