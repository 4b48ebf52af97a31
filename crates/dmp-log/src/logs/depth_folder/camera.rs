//! Which camera took the images, and how far one unit of theirs is.

use super::found::Layout;
use crate::file::{read_text, shorten};
use crate::{LogError, PlaceInFile, shown_path};
use dmp_sensor::{Distortion, PinholeCamera};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Largest `camera.json` that is read.
const MAX_BYTES: u64 = 1 << 16;
/// The size of image that the usual cameras are for.
const USUAL_SIZE_PX: [u32; 2] = [640, 480];

/// What an intrinsic matrix must be.
const COLUMNS: &str = "nine numbers column by column, [fx, 0, 0, 0, fy, 0, cx, cy, 1]";

/// The numbers of a pinhole camera, but for the size of its images.
#[derive(Debug, Clone, Copy, PartialEq)]
struct CameraNumbers {
    focal_px: [f64; 2],
    centre_px: [f64; 2],
    distortion: Distortion,
}

/// What a `camera.json` says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CameraFile {
    pub(super) path: PathBuf,
    pub(super) size_px: [u32; 2],
    numbers: CameraNumbers,
    pub(super) units_per_m: Option<f64>,
}

impl CameraFile {
    pub(super) fn read(path: PathBuf) -> Result<Self, LogError> {
        let bytes = read_text(&path, "camera", MAX_BYTES)?;
        match parse(&bytes) {
            Ok((size_px, numbers, units_per_m)) => Ok(Self { path, size_px, numbers, units_per_m }),
            Err(problem) => Err(LogError::malformed(&path, PlaceInFile::WholeFile, problem)),
        }
    }
}

/// The size of the images, the numbers, and perhaps units a metre.
fn parse(bytes: &[u8]) -> Result<([u32; 2], CameraNumbers, Option<f64>), String> {
    let value: Value = serde_json::from_slice(bytes).map_err(|e| format!("no JSON: {e}"))?;
    let lacks = |key: &str, what: &str| match value.get(key) {
        None => format!("no `{key}`: {what}"),
        Some(found) => format!("`{key}` is {}: it must be {what}", shorten(&found.to_string())),
    };
    let pixels = |key: &str| {
        let pixels = value.get(key).and_then(Value::as_u64).and_then(|px| u32::try_from(px).ok());
        pixels.filter(|px| *px > 0).ok_or_else(|| lacks(key, "pixels, a whole number"))
    };
    let list =
        |key: &str| value.get(key)?.as_array()?.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>();
    let size_px = [pixels("width")?, pixels("height")?];
    let matrix = list("intrinsic_matrix").ok_or_else(|| lacks("intrinsic_matrix", COLUMNS))?;
    let (focal_px, centre_px) = match matrix.as_slice() {
        #[expect(clippy::float_cmp, reason = "what is written is exact")]
        &[fx, a, b, c, fy, d, cx, cy, e] if [a, b, c, d] == [0.0; 4] && e == 1.0 => ([fx, fy], [cx, cy]),
        _ => return Err(lacks("intrinsic_matrix", COLUMNS)),
    };
    let distortion = match value.get("distortion") {
        None | Some(Value::Null) => Distortion::NONE,
        Some(_) => list("distortion")
            .and_then(|numbers| distortion_of(&numbers))
            .ok_or_else(|| lacks("distortion", "[k1, k2, p1, p2, k3]"))?,
    };
    let units_per_m = match value.get("depth_scale") {
        None | Some(Value::Null) => None,
        Some(scale) => {
            let units = scale.as_f64().filter(|units| is_scale(*units));
            Some(units.ok_or_else(|| lacks("depth_scale", "units per metre, more than 0"))?)
        }
    };
    Ok((size_px, CameraNumbers { focal_px, centre_px, distortion }, units_per_m))
}

/// The distortion of k1, k2, p1, p2 and perhaps k3.
fn distortion_of(numbers: &[f64]) -> Option<Distortion> {
    let (k1, k2, p1, p2, k3) = match *numbers {
        [k1, k2, p1, p2] => (k1, k2, p1, p2, 0.0),
        [k1, k2, p1, p2, k3] => (k1, k2, p1, p2, k3),
        _ => return None,
    };
    Some(Distortion { radial: [k1, k2, k3], tangential: [p1, p2] })
}

/// Whether a number can be units per metre.
pub(crate) fn is_scale(units_per_m: f64) -> bool {
    units_per_m.is_finite() && units_per_m > 0.0
}

/// The camera and the units per metre of a log of images of `size_px`: as the file beside the images says, else as the
/// layout usually has them. Notes say which.
pub(super) fn choose(
    folder: &Path,
    layout: Layout,
    size_px: [u32; 2],
    file: Option<&CameraFile>,
    notes: &mut Vec<String>,
) -> Result<(PinholeCamera, f64), LogError> {
    let [width, height] = size_px;
    let option = |problem: String| LogError::Option { path: folder.into(), problem };
    let from_file = |file: &CameraFile| format!("from {}", shown_path(&file.path));
    let guessed = format!("guessed: usual for {}", layout.usual().words);
    let (numbers, whence) = match (file, layout.usual().focal_px) {
        (Some(file), _) => (file.numbers, from_file(file)),
        (None, Some(focal_px)) if size_px == USUAL_SIZE_PX => {
            let (centre_px, distortion) = ([319.5, 239.5], Distortion::NONE);
            (CameraNumbers { focal_px, centre_px, distortion }, guessed.clone())
        }
        (None, _) => {
            return Err(option(format!(
                "images of {width} x {height} pixels: a camera.json beside them must say which camera they are from"
            )));
        }
    };
    let CameraNumbers { focal_px, centre_px, distortion } = numbers;
    let camera = PinholeCamera::new(size_px, focal_px, centre_px, distortion).map_err(|e| {
        LogError::malformed(file.map_or(folder, |file| &file.path), PlaceInFile::WholeFile, e.to_string())
    })?;
    let ([fx, fy], [cx, cy]) = (focal_px, centre_px);
    let lens = if distortion == Distortion::NONE { "without" } else { "with" };
    notes.push(format!(
        "camera of {width} x {height} pixels, fx {fx}, fy {fy}, cx {cx}, cy {cy}, {lens} distortion, {whence}"
    ));
    let of_file = file.and_then(|file| Some((file.units_per_m?, from_file(file))));
    let of_layout = || Some((layout.usual().units_per_m?, guessed));
    let (units_per_m, whence) = of_file.or_else(of_layout).ok_or_else(|| {
        option(
            "a camera.json beside the images must say how many units of depth are a metre, as depth_scale"
                .into(),
        )
    })?;
    notes.push(format!("{units_per_m} units of depth a metre, {whence}"));
    Ok((camera, units_per_m))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_says_what_is_wrong_with_it() {
        let file = |extra: &str| {
            let matrix = r#""intrinsic_matrix":[525.5,0,0,0,524,0,319.5,239.5,1]"#;
            parse(format!(r#"{{"width":640,"height":480,{matrix}{extra}}}"#).as_bytes())
        };
        let (size_px, numbers, units) = file("").unwrap();
        assert_eq!(
            (size_px, numbers.focal_px, numbers.centre_px),
            ([640, 480], [525.5, 524.0], [319.5, 239.5])
        );
        assert_eq!((numbers.distortion, units), (Distortion::NONE, None));
        let (_, numbers, units) = file(r#","distortion":[1,2,3,4,5],"depth_scale":1000,"other":{}"#).unwrap();
        assert_eq!((numbers.distortion.radial, numbers.distortion.tangential), ([1.0, 2.0, 5.0], [3.0, 4.0]));
        assert_eq!(units, Some(1000.0));
        let row_major = r#"{"width":640,"height":480,"intrinsic_matrix":[525,0,319.5,0,525,239.5,0,0,1]}"#;
        for (text, problem) in [
            ("{", "no JSON"),
            ("[]", "no `width`"),
            (r#"{"width":640.5}"#, "`width` is 640.5"),
            (r#"{"width":4,"height":0}"#, "`height` is 0"),
            (r#"{"width":4,"height":4}"#, "no `intrinsic_matrix`"),
            (row_major, "column by column"),
        ] {
            assert!(parse(text.as_bytes()).unwrap_err().contains(problem), "{text}");
        }
        assert!(file(r#","distortion":[1,2,3]"#).unwrap_err().contains("`distortion` is [1,2,3]"));
        for scale in ["0", "-5", "\"x\""] {
            assert!(file(&format!(r#","depth_scale":{scale}"#)).unwrap_err().contains("`depth_scale` is"));
        }
    }
}
