//! Which camera took the images, and how far one unit of theirs is.

use super::camera_numbers::{CameraNumbers, distortion_of};
use super::found::Layout;
use crate::decimal::shorten;
use crate::text::read_text;
use crate::{LogError, LogOptions, LogSetting, PlaceInFile, shown_path};
use dmp_sensor::{Distortion, PinholeCamera};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// Largest `camera.json` that is read.
const MAX_BYTES: u64 = 1 << 16;
/// The size of image that the usual cameras are for.
const USUAL_SIZE_PX: [u32; 2] = [640, 480];

/// What an intrinsic matrix must be.
const COLUMNS: &str = "nine numbers column by column, [fx, 0, 0, 0, fy, 0, cx, cy, 1]";

/// What a `camera.json` says.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CameraFile {
    pub(super) path: PathBuf,
    pub(super) size_px: [u32; 2],
    numbers: CameraNumbers,
    units_per_m: Option<f64>,
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

/// Whether a number can be units per metre.
pub(crate) fn is_scale(units_per_m: f64) -> bool {
    units_per_m.is_finite() && units_per_m > 0.0
}

/// The camera and the units per metre of a log of images of `size_px`: as the options say, else as the file beside
/// the images does, else as the layout usually has them. Notes say which.
pub(super) fn choose(
    folder: &Path,
    layout: Layout,
    size_px: [u32; 2],
    file: Option<&CameraFile>,
    options: &LogOptions,
    notes: &mut Vec<String>,
) -> Result<(PinholeCamera, f64), LogError> {
    let [width, height] = size_px;
    let of_file = |what: &CameraFile| shown_path(&what.path);
    let (numbers, whence) = match (options.camera, file, layout.usual_camera()) {
        (Some(given), _, _) => (given, "as given".to_owned()),
        (None, Some(file), _) => (file.numbers, format!("from {}", of_file(file))),
        (None, None, Some(focal_px)) if size_px == USUAL_SIZE_PX => {
            (CameraNumbers::without_lens(focal_px), format!("guessed: usual for {}", layout.words()))
        }
        (None, None, _) => {
            let problem = format!(
                "images of {width} x {height} pixels and no camera.json: say which camera they are from,"
            );
            let form = "FX,FY,CX,CY[,K1,K2,P1,P2[,K3]]";
            return Err(LogError::missing(folder, problem, LogSetting::Camera, form));
        }
    };
    let CameraNumbers { focal_px, centre_px, distortion } = numbers;
    let camera = PinholeCamera::new(size_px, focal_px, centre_px, distortion).map_err(|e| match file {
        Some(file) if options.camera.is_none() => {
            LogError::malformed(&file.path, PlaceInFile::WholeFile, e.to_string())
        }
        _ => LogError::setting(folder, LogSetting::Camera, numbers, format!("makes no camera: {e}")),
    })?;
    notes.push(format!("camera of {width} x {height} pixels, {}, {whence}", in_words(&numbers)));
    let scale_of_file = file.and_then(|file| Some((file.units_per_m?, file)));
    let (units_per_m, whence) = match (options.depth_units_per_m, scale_of_file, layout.usual_units_per_m()) {
        (Some(given), _, _) => (given, "as given".to_owned()),
        (None, Some((units, file)), _) => (units, format!("from {}", of_file(file))),
        (None, None, Some(usual)) => (usual, format!("guessed: usual for {}", layout.words())),
        (None, None, None) => {
            let problem = "nothing says what a unit of depth is: say how many are a metre,";
            return Err(LogError::missing(folder, problem, LogSetting::DepthUnits, "UNITS"));
        }
    };
    if !is_scale(units_per_m) {
        let problem = "makes no sense: it must be units per metre, more than 0";
        return Err(LogError::setting(folder, LogSetting::DepthUnits, units_per_m, problem));
    }
    notes.push(format!("{units_per_m} units of depth a metre, {whence}"));
    Ok((camera, units_per_m))
}

fn in_words(numbers: &CameraNumbers) -> String {
    let ([fx, fy], [cx, cy]) = (numbers.focal_px, numbers.centre_px);
    let lens = if numbers.distortion == Distortion::NONE { "without" } else { "with" };
    format!("fx {fx}, fy {fy}, cx {cx}, cy {cy}, {lens} distortion")
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
