//! Units of length.

/// Metres of a US survey foot: 1200/3937 by its definition.
const US_SURVEY_FOOT_M: f64 = 1200.0 / 3937.0;

/// The units in which maps are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[non_exhaustive]
pub enum LengthUnit {
    /// The metre.
    Metre,
    /// The international foot, 0.3048 m.
    Foot,
    /// The US survey foot, 1200/3937 m.
    UsSurveyFoot,
}

impl LengthUnit {
    pub(crate) const ALL: [Self; 3] = [Self::Metre, Self::Foot, Self::UsSurveyFoot];

    /// One of it in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::Metre => 1.0,
            Self::Foot => 0.3048,
            Self::UsSurveyFoot => US_SURVEY_FOOT_M,
        }
    }

    /// Several of it, for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Metre => "metres",
            Self::Foot => "feet",
            Self::UsSurveyFoot => "US survey feet",
        }
    }
}
