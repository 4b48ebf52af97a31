//! Well-known text of coordinate systems (OGC 01-009 and ISO 19162): as much of it as says in which units
//! coordinates are.

use std::str::FromStr;

use thiserror::Error;

/// Brackets within brackets up to which a text is read; true ones have about six.
const MAX_DEPTH: usize = 32;

/// What a coordinate system says of its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Axes {
    /// Lengths, in a unit of so many metres.
    Length(f64),
    /// Longitude and latitude.
    Angles,
    /// Nothing that was understood.
    Unknown,
}

/// The axes along the ground and the unit of heights, metres, where there is one of their own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WktUnits {
    pub(super) ground: Axes,
    pub(super) height_m: Option<f64>,
}

/// `KEYWORD[a, b, ...]`, its brackets and its other words and texts.
#[derive(Debug, Default)]
struct Node<'a> {
    keyword: &'a str,
    nodes: Vec<Node<'a>>,
    words: Vec<&'a str>,
}

/// A coordinate system for a cloud that is written: its axes are in metres.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MetricCrs(String);

/// Why a text is no [`MetricCrs`].
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum CrsError {
    /// It is neither.
    #[error("give EPSG:CODE, as EPSG:32632, or a well-known text, as PROJCS[...]")]
    Neither,
    /// The code is not known.
    #[error("EPSG:{0} is not known: give its well-known text")]
    UnknownCode(u16),
    /// The axes are angles, or in another unit.
    #[error("its axes must be in metres, as those of UTM zones are: coordinates are written in metres")]
    NotMetres,
}

impl MetricCrs {
    /// The well-known text.
    pub fn wkt(&self) -> &str {
        &self.0
    }
}

/// `EPSG:32632`, or a well-known text.
impl FromStr for MetricCrs {
    type Err = CrsError;

    fn from_str(text: &str) -> Result<Self, CrsError> {
        let (name, code) = text.split_once(':').unwrap_or_default();
        let wkt = match code.parse() {
            Ok(code) if name.eq_ignore_ascii_case("EPSG") => {
                crs_definitions::from_code(code).ok_or(CrsError::UnknownCode(code))?.wkt
            }
            _ => text,
        };
        let is_metre = |unit_m: f64| (unit_m - 1.0).abs() < 1e-9;
        match units_of(wkt).ok_or(CrsError::Neither)? {
            WktUnits { ground: Axes::Length(unit_m), height_m }
                if is_metre(unit_m) && height_m.is_none_or(is_metre) =>
            {
                Ok(Self(wkt.to_owned()))
            }
            _ => Err(CrsError::NotMetres),
        }
    }
}

/// The units in a text; `None` where it is no well-known text.
pub(super) fn units_of(text: &str) -> Option<WktUnits> {
    let (root, _) = node(text.trim_matches(|c: char| c == '\0' || c.is_whitespace()), 0)?;
    let height_m = root.find(&["VERT_CS", "VERTCRS", "VERTICALCRS"]).and_then(Node::unit_m);
    let ground = if let Some(projected) = root.find(&["PROJCS", "PROJCRS", "PROJECTEDCRS"]) {
        projected.unit_m().map_or(Axes::Unknown, Axes::Length)
    } else if let Some(metric) = root.find(&["GEOCCS", "LOCAL_CS", "ENGCRS", "ENGINEERINGCRS"]) {
        metric.unit_m().map_or(Axes::Unknown, Axes::Length)
    } else if let Some(geodetic) =
        root.find(&["GEOGCS", "GEOGCRS", "GEOGRAPHICCRS", "GEODCRS", "GEODETICCRS"])
    {
        // Earth-centred ones share a keyword with those in degrees.
        let cartesian = geodetic.find(&["CS"]).is_some_and(|cs| cs.has_word("Cartesian"));
        match geodetic.unit_m().filter(|_| cartesian) {
            Some(unit_m) => Axes::Length(unit_m),
            None => Axes::Angles,
        }
    } else {
        Axes::Unknown
    };
    Some(WktUnits { ground, height_m })
}

impl Node<'_> {
    fn is(&self, keywords: &[&str]) -> bool {
        keywords.iter().any(|keyword| self.keyword.eq_ignore_ascii_case(keyword))
    }

    fn has_word(&self, word: &str) -> bool {
        self.words.iter().any(|found| found.eq_ignore_ascii_case(word))
    }

    /// The first of these keywords, this one or deeper.
    fn find(&self, keywords: &[&str]) -> Option<&Self> {
        if self.is(keywords) { Some(self) } else { self.nodes.iter().find_map(|node| node.find(keywords)) }
    }

    /// Its own unit, else that of its axes: a factor above zero.
    fn unit_m(&self) -> Option<f64> {
        let of = |node: &Self| {
            let mut units = node.nodes.iter().filter(|node| node.is(&["UNIT", "LENGTHUNIT"]));
            let factor = units.next_back()?.words.get(1)?.parse::<f64>().ok();
            factor.filter(|factor| factor.is_finite() && *factor > 0.0)
        };
        of(self).or_else(|| self.nodes.iter().filter(|node| node.is(&["AXIS"])).find_map(of))
    }
}

/// Reads a keyword with its brackets; also gives what comes behind them.
fn node(text: &str, depth: usize) -> Option<(Node<'_>, &str)> {
    if depth > MAX_DEPTH {
        return None;
    }
    let open = text.find(['[', '('])?;
    let keyword = text.get(..open)?.trim();
    if keyword.is_empty() || !keyword.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') {
        return None;
    }
    let mut node_here = Node { keyword, ..Node::default() };
    let mut rest = text.get(open + 1..)?;
    loop {
        rest = rest.trim_start();
        match rest.chars().next()? {
            ']' | ')' => return Some((node_here, rest.get(1..)?)),
            ',' => rest = rest.get(1..)?,
            '"' => {
                // Two quotation marks within a text are one; which is of no matter here.
                let end = 1 + rest.get(1..)?.find('"')?;
                node_here.words.push(rest.get(1..end)?);
                rest = rest.get(end + 1..)?;
            }
            _ => {
                let end = rest.find([',', '[', '(', ']', ')', '"'])?;
                if rest.get(end..)?.starts_with(['[', '(']) {
                    let (child, behind) = node(rest, depth + 1)?;
                    node_here.nodes.push(child);
                    rest = behind;
                } else {
                    node_here.words.push(rest.get(..end)?.trim());
                    rest = rest.get(end..)?;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GEOGCS: &str = r#"GEOGCS["NAD83",DATUM["d",SPHEROID["GRS 1980",6378137,298.257]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]]"#;

    fn units(text: &str) -> Option<(Axes, Option<f64>)> {
        units_of(text).map(|units| (units.ground, units.height_m))
    }

    #[test]
    fn the_unit_of_the_projection_is_taken_not_that_of_the_angles() {
        let feet = format!(
            r#"PROJCS["p",{GEOGCS},PROJECTION["Lambert_Conformal_Conic_2SP"],PARAMETER["false_easting",1312335.958],UNIT["foot",0.3048,AUTHORITY["EPSG","9002"]],AXIS["X",EAST]]"#
        );
        assert_eq!(units(&feet), Some((Axes::Length(0.3048), None)));
        let compound = format!(
            "COMPD_CS[\"c\",\n{feet},\nVERT_CS[\"NAVD88\",VERT_DATUM[\"d\",2005],UNIT[\"US survey foot\",0.304800609601219]]]\0"
        );
        assert_eq!(units(&compound), Some((Axes::Length(0.3048), Some(0.304_800_609_601_219))));
        assert_eq!(units(GEOGCS), Some((Axes::Angles, None)));
        assert_eq!(units(r#"LOCAL_CS["l",UNIT["metre",1]]"#), Some((Axes::Length(1.0), None)));
    }

    #[test]
    fn the_newer_texts_are_understood() {
        let projected = r#"PROJCRS["p",BASEGEOGCRS["WGS 84",DATUM["d",ELLIPSOID["WGS 84",6378137,298.25,LENGTHUNIT["metre",1]]]],CONVERSION["c",METHOD["Transverse Mercator"],PARAMETER["Latitude of natural origin",0,ANGLEUNIT["degree",0.01745]]],CS[Cartesian,2],AXIS["easting (X)",east,ORDER[1],LENGTHUNIT["US survey foot",0.3048006096]],AXIS["northing (Y)",north,ORDER[2],LENGTHUNIT["US survey foot",0.3048006096]],ID["EPSG",2992]]"#;
        let vertical = r#"VERTCRS["v",VDATUM["d"],CS[vertical,1],AXIS["up",up,LENGTHUNIT["metre",1]]]"#;
        let compound = format!(r#"COMPOUNDCRS["c",{projected},{vertical}]"#);
        assert_eq!(units(&compound), Some((Axes::Length(0.304_800_609_6), Some(1.0))));
        let geodetic = |cs: &str| {
            format!(r#"GEODCRS["WGS 84",DATUM["d"],CS[{cs},3],AXIS["x",geocentricX],LENGTHUNIT["metre",1]]"#)
        };
        assert_eq!(units(&geodetic("Cartesian")), Some((Axes::Length(1.0), None)));
        assert_eq!(units(&geodetic("ellipsoidal")), Some((Axes::Angles, None)));
    }

    #[test]
    fn a_written_cloud_has_metres() {
        let utm: MetricCrs = "epsg:32632".parse().unwrap();
        assert!(utm.wkt().starts_with("PROJCS[\"WGS 84 / UTM zone 32N\""), "{}", utm.wkt());
        assert_eq!(utm.wkt().parse(), Ok(utm.clone()));
        let why = |text: &str| text.parse::<MetricCrs>().unwrap_err();
        assert_eq!(why("EPSG:1"), CrsError::UnknownCode(1));
        // In degrees, and in feet.
        assert_eq!([why("EPSG:4326"), why("EPSG:2227")], [CrsError::NotMetres, CrsError::NotMetres]);
        for text in ["", "EPSG:", "EPSG:99999", "32632", "utm 32", "+proj=utm +zone=32"] {
            assert_eq!(why(text), CrsError::Neither, "{text}");
        }
    }

    #[test]
    fn what_is_no_such_text_is_nothing() {
        let deep = "A[".repeat(100_000);
        let cut = r#"PROJCS["p",UNIT["foot",0.3048"#;
        for text in ["", "metre", "[]", "PROJCS[", "PROJCS[\"p", cut, &deep, "Ü[1]", "A B[1]"] {
            assert_eq!(units(text), None, "{}", text.get(..20).unwrap_or(text));
        }
        for text in
            [r#"PROJCS["p"]"#, r#"PROJCS["p",UNIT["foot",-1]]"#, r#"PROJCS["p",UNIT["foot"]]"#, "A[1]"]
        {
            assert_eq!(units(text), Some((Axes::Unknown, None)), "{text}");
        }
    }
}
