//! In which unit a LAS file's coordinates are, by its records of coordinate systems: `GeoTIFF` keys (LAS 1.4
//! R15 and the OGC `GeoTIFF` standard 1.1) and well-known text.

use super::las_crs::CrsRecord;
use super::las_header::LasHeader;
use super::wkt::{self, Axes};
use crate::geometry::unit::LengthUnit;
use crate::{ParseError, PlaceInFile};

/// Coordinates beyond this are no degrees, whatever a file says.
const MOST_DEGREES: f64 = 360.0;
/// Units differ by less than this where they are the same: texts have their factors to ten digits.
const SAME_UNIT: f64 = 1e-9;

const GEO_KEYS: u16 = 34_735;
const GEO_DOUBLES: u16 = 34_736;
const WKT: u16 = 2112;

/// What brings a file's coordinates to metres, and what is to be said of it.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ToMetres {
    pub(crate) scale: [f64; 3],
    pub(crate) note: Option<String>,
}

/// What one kind of record says.
struct Found {
    ground: Axes,
    height_m: Option<f64>,
    /// Where it is from, or why it is not known.
    source: String,
}

/// What the file itself says of its unit.
pub(crate) fn of(header: &LasHeader) -> Result<ToMetres, ParseError> {
    let mut found: Vec<Found> =
        [from_keys(&header.crs), from_wkt(&header.crs)].into_iter().flatten().collect();
    if header.says_wkt {
        found.reverse();
    }
    let known = found.iter().position(|found| found.ground != Axes::Unknown);
    let Some(first) = found.get(known.unwrap_or(0)) else {
        return Ok(ToMetres { scale: [1.0; 3], note: None });
    };
    let ground_m = match first.ground {
        Axes::Length(unit_m) => unit_m,
        Axes::Angles if header.extent.is_some_and(|most| most <= MOST_DEGREES) => {
            let problem = format!(
                "the coordinates are longitude and latitude by {}: project them to metres first",
                first.source
            );
            return Err(ParseError::new(PlaceInFile::WholeFile, problem));
        }
        Axes::Angles => {
            let note = format!(
                "coordinates in degrees by {}, but too large for degrees: taken as metres",
                first.source
            );
            return Ok(ToMetres { scale: [1.0; 3], note: Some(note) });
        }
        Axes::Unknown => {
            let note = format!("unit not known ({}): taken as metres", first.source);
            return Ok(ToMetres { scale: [1.0; 3], note: Some(note) });
        }
    };
    let height_m = first.height_m.unwrap_or(ground_m);
    let mut notes = Vec::new();
    if ground_m != 1.0 || height_m != 1.0 {
        let heights = match first.height_m {
            None => ", heights too".to_owned(),
            Some(height_m) if height_m == ground_m => ", heights too".to_owned(),
            Some(height_m) => format!(", heights in {}", name_of(height_m)),
        };
        notes.push(format!("in {}{heights} by {}: brought to metres", name_of(ground_m), first.source));
    }
    let differs = |other: &&Found| !matches!(other.ground, Axes::Unknown) && other.ground != first.ground;
    if let Some(other) = found.iter().find(differs) {
        notes.push(format!("{} says otherwise", other.source));
    }
    let note = (!notes.is_empty()).then(|| notes.join("; "));
    Ok(ToMetres { scale: [ground_m, ground_m, height_m], note })
}

fn name_of(unit_m: f64) -> String {
    let known = LengthUnit::ALL.into_iter().find(|unit| unit.metres() == unit_m);
    known.map_or(format!("units of {unit_m} m"), |unit| unit.name().to_owned())
}

/// The unit meant by a factor of ten digits.
fn exact(unit_m: f64) -> f64 {
    let meant = LengthUnit::ALL.into_iter().map(LengthUnit::metres);
    meant.into_iter().find(|m| (m / unit_m - 1.0).abs() < SAME_UNIT).unwrap_or(unit_m)
}

fn record(crs: &[CrsRecord], id: u16) -> Option<&[u8]> {
    crs.iter().find(|record| record.id == id).map(|record| record.data.as_slice())
}

fn from_wkt(crs: &[CrsRecord]) -> Option<Found> {
    let text = String::from_utf8_lossy(record(crs, WKT)?);
    let found = |ground, height_m, source: &str| Some(Found { ground, height_m, source: source.to_owned() });
    match wkt::units_of(&text) {
        Some(units) => {
            let ground = match units.ground {
                Axes::Length(unit_m) => Axes::Length(exact(unit_m)),
                other => other,
            };
            let source = if ground == Axes::Unknown {
                "the well-known text in record 2112 names no unit"
            } else {
                "its well-known text"
            };
            found(ground, units.height_m.map(exact), source)
        }
        None => found(Axes::Unknown, None, "the well-known text in record 2112 cannot be read"),
    }
}

fn from_keys(crs: &[CrsRecord]) -> Option<Found> {
    let words: Vec<u16> = record(crs, GEO_KEYS)?
        .chunks_exact(2)
        .filter_map(|pair| pair.first_chunk().map(|pair| u16::from_le_bytes(*pair)))
        .collect();
    // Four words of head, the last of them the count, then four for each key.
    let count = usize::from(*words.get(3)?);
    let keys: Vec<[u16; 4]> =
        words.chunks_exact(4).skip(1).take(count).filter_map(|key| key.first_chunk().copied()).collect();
    let key = |id: u16| keys.iter().find(|key| key[0] == id && key[1] == 0).map(|key| key[3]);
    let double = |id: u16| {
        let at = keys.iter().find(|key| key[0] == id && key[1] == GEO_DOUBLES)?[3];
        let bytes = record(crs, GEO_DOUBLES)?.get(8 * usize::from(at)..)?.first_chunk()?;
        Some(f64::from_le_bytes(*bytes)).filter(|m| m.is_finite() && *m > 0.0)
    };
    let height_m = match (key(4099), key(4096)) {
        (Some(code), _) => unit_of(code, || double(4099)),
        // NAVD88 in metres, in US survey feet, in feet.
        (None, Some(5703)) => Some(1.0),
        (None, Some(6360)) => Some(LengthUnit::UsSurveyFoot.metres()),
        (None, Some(8228)) => Some(LengthUnit::Foot.metres()),
        _ => None,
    };
    let found = |ground, source: String| Some(Found { ground, height_m, source });
    if let Some(code) = key(3076).filter(|_| key(1024) != Some(2)) {
        return match unit_of(code, || double(3077)) {
            Some(unit_m) => found(Axes::Length(exact(unit_m)), "its GeoTIFF key 3076".to_owned()),
            None => found(Axes::Unknown, format!("its GeoTIFF key 3076 names the unit EPSG:{code}")),
        };
    }
    match (key(1024), key(3072), key(2048)) {
        (Some(2), ..) | (None, None, Some(_)) => found(Axes::Angles, "its GeoTIFF keys".to_owned()),
        // Earth-centred coordinates are in metres where nothing else is said.
        (Some(3), ..) => found(Axes::Length(1.0), "its GeoTIFF key 1024".to_owned()),
        (_, Some(code), _) if is_utm(code) => found(Axes::Length(1.0), format!("EPSG:{code}")),
        (_, Some(code), _) => found(Axes::Unknown, format!("its GeoTIFF keys name EPSG:{code} and no unit")),
        _ => None,
    }
}

/// A unit by its EPSG code; `user_defined` gives that of code 32767.
fn unit_of(code: u16, user_defined: impl Fn() -> Option<f64>) -> Option<f64> {
    match code {
        9001 => Some(LengthUnit::Metre.metres()),
        9002 => Some(LengthUnit::Foot.metres()),
        9003 => Some(LengthUnit::UsSurveyFoot.metres()),
        32_767 => user_defined(),
        _ => None,
    }
}

/// Universal transverse Mercator on WGS 84, ETRS89 and NAD83, which is in metres.
fn is_utm(code: u16) -> bool {
    matches!(code, 32_601..=32_660 | 32_701..=32_760 | 25_828..=25_838 | 26_901..=26_923)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys(keys: &[[u16; 4]]) -> CrsRecord {
        let head = [[1, 1, 0, keys.len() as u16]];
        let data = head.iter().chain(keys).flatten().flat_map(|word| word.to_le_bytes()).collect();
        CrsRecord { id: GEO_KEYS, data }
    }

    fn wkt(text: &str) -> CrsRecord {
        CrsRecord { id: WKT, data: text.as_bytes().to_vec() }
    }

    fn header(crs: Vec<CrsRecord>) -> LasHeader {
        LasHeader { crs, extent: Some(6e5), ..LasHeader::default() }
    }

    fn to_metres(crs: Vec<CrsRecord>) -> ([f64; 3], String) {
        let found = of(&header(crs)).unwrap();
        (found.scale, found.note.unwrap_or_default())
    }

    const US_M: f64 = 1200.0 / 3937.0;

    #[test]
    fn geotiff_keys_name_the_unit() {
        let projected = [1024, 0, 1, 1];
        let unit = |code| [3076, 0, 1, code];
        assert_eq!(to_metres(vec![]), ([1.0; 3], String::new()));
        assert_eq!(to_metres(vec![keys(&[projected, unit(9001)])]), ([1.0; 3], String::new()));
        let (scale, note) = to_metres(vec![keys(&[projected, unit(9002)])]);
        assert_eq!(scale, [0.3048; 3]);
        assert_eq!(note, "in feet, heights too by its GeoTIFF key 3076: brought to metres");
        let (scale, note) = to_metres(vec![keys(&[projected, unit(9003), [4099, 0, 1, 9001]])]);
        assert_eq!(scale, [US_M, US_M, 1.0]);
        assert!(note.contains("in US survey feet, heights in metres"), "{note}");
        assert_eq!(
            to_metres(vec![keys(&[projected, unit(9003), [4096, 0, 1, 8228]])]).0,
            [US_M, US_M, 0.3048]
        );
        let own = [keys(&[projected, unit(32_767), [3077, GEO_DOUBLES, 1, 1]]), doubles(&[7.0, 0.9144])];
        let (scale, note) = to_metres(own.to_vec());
        assert_eq!(scale, [0.9144; 3]);
        assert!(note.contains("units of 0.9144 m"), "{note}");
    }

    fn doubles(values: &[f64]) -> CrsRecord {
        CrsRecord { id: GEO_DOUBLES, data: values.iter().flat_map(|value| value.to_le_bytes()).collect() }
    }

    #[test]
    fn what_is_not_known_is_said() {
        let named = |code| keys(&[[1024, 0, 1, 1], [3072, 0, 1, code]]);
        let (scale, note) = to_metres(vec![named(2992)]);
        assert_eq!(scale, [1.0; 3]);
        assert!(note.contains("EPSG:2992 and no unit"), "{note}");
        assert_eq!(to_metres(vec![named(32_631)]), ([1.0; 3], String::new()));
        assert!(to_metres(vec![keys(&[[3076, 0, 1, 9005]])]).1.contains("EPSG:9005"));
        assert!(to_metres(vec![wkt("nonsense")]).1.contains("cannot be read"));
        // A count of keys beyond the record's end.
        let mut cut = keys(&[[3076, 0, 1, 9002]]);
        cut.data[6] = 200;
        assert_eq!(to_metres(vec![cut]).0, [0.3048; 3]);
        // A text beside keys that say nothing.
        let (scale, note) = to_metres(vec![named(2992), wkt(r#"PROJCS["p",UNIT["foot",0.3048006096]]"#)]);
        assert_eq!(scale, [US_M; 3]);
        assert!(note.contains("by its well-known text"), "{note}");
    }

    #[test]
    fn of_two_that_differ_the_header_says_which_counts() {
        let crs = vec![keys(&[[3076, 0, 1, 9002]]), wkt(r#"PROJCS["p",UNIT["metre",1]]"#)];
        let (scale, note) = to_metres(crs.clone());
        assert_eq!(scale, [0.3048; 3]);
        assert!(note.ends_with("its well-known text says otherwise"), "{note}");
        let found = of(&LasHeader { says_wkt: true, ..header(crs) }).unwrap();
        assert_eq!(found.scale, [1.0; 3]);
        assert_eq!(found.note.as_deref(), Some("its GeoTIFF key 3076 says otherwise"));
    }

    #[test]
    fn degrees_are_refused_unless_they_cannot_be() {
        for crs in
            [keys(&[[1024, 0, 1, 2], [2048, 0, 1, 4326]]), wkt(r#"GEOGCS["WGS 84",UNIT["degree",0.01745]]"#)]
        {
            let degrees = LasHeader { extent: Some(120.5), ..header(vec![crs.clone()]) };
            let error = of(&degrees).unwrap_err().to_string();
            assert!(error.contains("longitude and latitude"), "{error}");
            let (scale, note) = to_metres(vec![crs]);
            assert_eq!(scale, [1.0; 3]);
            assert!(note.contains("too large for degrees"), "{note}");
        }
        assert_eq!(to_metres(vec![keys(&[[1024, 0, 1, 3], [2048, 0, 1, 4326]])]), ([1.0; 3], String::new()));
    }
}
