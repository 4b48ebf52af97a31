//! Values with units on the command line.

/// A length in metres: `0.03`, `0.03m`, `3cm`, `30mm`.
pub(crate) fn length_m(text: &str) -> Result<f64, String> {
    let units = [("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)];
    quantity(text, &units, Some(1.0)).ok_or_else(|| format!("`{text}` is no length: try 0.03, 3cm or 30mm"))
}

/// An angle in radians: `0.1deg`, `2mrad`, `0.002rad`. The unit must be given.
pub(crate) fn angle_rad(text: &str) -> Result<f64, String> {
    let units = [("deg", std::f64::consts::PI / 180.0), ("mrad", 1e-3), ("rad", 1.0)];
    quantity(text, &units, None).ok_or_else(|| format!("`{text}` is no angle: try 0.1deg or 2mrad"))
}

/// Noise of place and rotation, `0.03,0.1deg`; the second may be left out.
pub(crate) fn noise(text: &str) -> Result<(f64, f64), String> {
    match text.split_once(',') {
        Some((length, angle)) => Ok((length_m(length.trim())?, angle_rad(angle.trim())?)),
        None => Ok((length_m(text)?, 0.0)),
    }
}

/// Standard deviations of place and rotation, `1cm,1mrad`, both above 0.
pub(crate) fn errors(text: &str) -> Result<(f64, f64), String> {
    let both = text.split_once(',').ok_or_else(|| format!("`{text}` are no errors: try 1cm,1mrad"))?;
    let errors = (length_m(both.0.trim())?, angle_rad(both.1.trim())?);
    let are_positive = errors.0 > 0.0 && errors.1 > 0.0;
    if are_positive { Ok(errors) } else { Err(format!("`{text}` must both be above 0: try 1cm,1mrad")) }
}

/// Two elevations in degrees, lowest first: `-15,15`. In radians.
pub(crate) fn elevations_rad(text: &str) -> Result<[f64; 2], String> {
    let bad = || format!("`{text}` are no two elevations in degrees: try -15,15");
    let (low, high) = text.split_once(',').ok_or_else(bad)?;
    let degrees = |text: &str| quantity(text.trim(), &[("deg", 1.0)], Some(1.0)).ok_or_else(bad);
    Ok([degrees(low)?.to_radians(), degrees(high)?.to_radians()])
}

/// A time in nanoseconds: `0.1`, `0.1s`, `100ms`.
pub(crate) fn interval_ns(text: &str) -> Result<i64, String> {
    let seconds = quantity(text, &[("ms", 1e-3), ("s", 1.0)], Some(1.0)).filter(|s| (1e-9..1e6).contains(s));
    Ok((seconds.ok_or_else(|| format!("`{text}` is no time: try 0.1s or 100ms"))? * 1e9).round() as i64)
}

/// Two runs by their names; `None`: all of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Pair(pub(crate) Option<(String, String)>);

/// Nothing, or two names.
pub(crate) fn pair(text: &str) -> Result<Pair, String> {
    if text.is_empty() {
        return Ok(Pair(None));
    }
    match text.split_once(',').filter(|(a, b)| !a.is_empty() && !b.is_empty() && !b.contains(',')) {
        Some((a, b)) => Ok(Pair(Some((a.to_owned(), b.to_owned())))),
        None => Err("the names of two runs with a comma between them are expected".to_owned()),
    }
}

/// A finite number with one of the units, the longer names first, or with none where that has a meaning.
fn quantity(text: &str, units: &[(&str, f64)], without: Option<f64>) -> Option<f64> {
    let with_unit = units.iter().find_map(|&(name, factor)| Some((text.strip_suffix(name)?, factor)));
    let (number, factor) = with_unit.or(without.map(|factor| (text, factor)))?;
    let value = number.trim_end().parse::<f64>().ok()? * factor;
    value.is_finite().then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_understood() {
        assert_eq!(noise("0.03,0.1deg"), Ok((0.03, 0.1 * std::f64::consts::PI / 180.0)));
        assert_eq!(noise("3cm, 2mrad"), Ok((0.03, 0.002)));
        assert_eq!(noise("0.5"), Ok((0.5, 0.0)));
        assert_eq!(errors("1cm,1mrad"), Ok((0.01, 0.001)));
        assert_eq!(length_m("-30mm"), Ok(-0.03));
        assert_eq!(elevations_rad("-90,90"), Ok([-std::f64::consts::FRAC_PI_2, std::f64::consts::FRAC_PI_2]));
        assert_eq!(interval_ns("100ms"), Ok(100_000_000));
        assert_eq!(interval_ns("0.5"), Ok(500_000_000));
    }

    #[test]
    fn nonsense_is_refused_with_an_example() {
        for text in ["0.03,0.1", "0.03,deg", "x", "", "inf", "nan,0.1deg", "0.1,0.1m"] {
            assert!(noise(text).is_err_and(|e| e.contains("try")), "{text}");
        }
        assert!(interval_ns("-1s").is_err() && interval_ns("1e99").is_err() && interval_ns("1min").is_err());
        assert!(elevations_rad("15").is_err());
        for text in ["1cm", "0,1mrad", "1cm,-1deg", "1cm,1"] {
            assert!(errors(text).is_err_and(|e| e.contains("try")), "{text}");
        }
    }

    #[test]
    fn a_pair_is_two_names() {
        assert_eq!(pair("a,b"), Ok(Pair(Some(("a".to_owned(), "b".to_owned())))));
        assert_eq!(pair(""), Ok(Pair(None)));
        assert!(["a", "a,b,c", ",b", "a,"].into_iter().all(|text| pair(text).is_err()));
    }
}
