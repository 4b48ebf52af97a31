//! A score at several truncations, an object in the JSON.

use std::fmt;
use std::ops::Index;

use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// A score at several truncations τ, the largest first: an object in the JSON, whose keys are τ in metres.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ScaleScores(Vec<(f64, Option<f64>)>);

impl ScaleScores {
    /// Of pairs (τ in metres, score in m²), the largest τ first.
    pub fn new(scores: impl IntoIterator<Item = (f64, Option<f64>)>) -> Self {
        Self(scores.into_iter().collect())
    }

    /// Pairs (τ in metres, score in m²), the largest τ first.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = (f64, Option<f64>)> {
        self.0.iter().copied()
    }

    /// The `k`-th truncation, metres; `None` where there are not as many.
    pub fn scale_m(&self, k: usize) -> Option<f64> {
        Some(self.0.get(k)?.0)
    }

    /// The score at a truncation; `None` also where there is no such truncation.
    pub fn at(&self, scale_m: f64) -> Option<f64> {
        self.0.iter().find(|(at_m, _)| *at_m == scale_m)?.1
    }

    /// The same truncations without any score.
    #[must_use]
    pub fn without_scores(&self) -> Self {
        Self(self.0.iter().map(|(scale_m, _)| (*scale_m, None)).collect())
    }
}

/// The score at the `k`-th truncation, the largest first; `None` where there are not as many.
impl Index<usize> for ScaleScores {
    type Output = Option<f64>;

    fn index(&self, k: usize) -> &Option<f64> {
        self.0.get(k).map_or(&None, |(_, score)| score)
    }
}

impl Serialize for ScaleScores {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(scale_m, score)| (scale_m.to_string(), score)))
    }
}

impl<'de> Deserialize<'de> for ScaleScores {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct ByTruncation;

        impl<'de> Visitor<'de> for ByTruncation {
            type Value = ScaleScores;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("scores by truncation in metres")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<ScaleScores, A::Error> {
                let mut scores: Vec<(f64, Option<f64>)> = Vec::new();
                while let Some((key, score)) = map.next_entry::<String, Option<f64>>()? {
                    let scale_m: f64 = match key.parse() {
                        Ok(scale_m) if scale_m > 0.0 && f64::is_finite(scale_m) => scale_m,
                        _ => return Err(A::Error::custom(format!("`{key}` is no truncation in metres"))),
                    };
                    if scores.iter().any(|(there_m, _)| *there_m == scale_m) {
                        return Err(A::Error::custom(format!("the truncation `{key}` is there twice")));
                    }
                    scores.push((scale_m, score));
                }
                // The keys of an object have no order.
                scores.sort_by(|a, b| b.0.total_cmp(&a.0));
                Ok(ScaleScores(scores))
            }
        }

        deserializer.deserialize_map(ByTruncation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_are_an_object_and_come_back() {
        let scores = ScaleScores::new([(10.0, Some(2.25)), (0.5, None)]);
        let text = serde_json::to_string(&scores).unwrap();
        assert_eq!(text, r#"{"10":2.25,"0.5":null}"#);
        assert_eq!(serde_json::from_str::<ScaleScores>(&text).unwrap(), scores);
        assert_eq!(serde_json::from_str::<ScaleScores>(r#"{"0.5":null,"10":2.25}"#).unwrap(), scores);
        assert_eq!((scores[0], scores[1], scores[7]), (Some(2.25), None, None));
        assert_eq!((scores.at(10.0), scores.at(2.0), scores.scale_m(1)), (Some(2.25), None, Some(0.5)));
        for (text, problem) in [
            (r#"{"ten":1.0}"#, "`ten` is no truncation"),
            (r#"{"-2":1.0}"#, "`-2` is no truncation"),
            (r#"{"2":1.0,"2.0":1.0}"#, "`2.0` is there twice"),
        ] {
            let error = serde_json::from_str::<ScaleScores>(text).unwrap_err().to_string();
            assert!(error.contains(problem), "{error}");
        }
    }
}
