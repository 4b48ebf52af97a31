//! The value of `--extrinsic`.

use std::path::PathBuf;
use std::str::FromStr;

use dmp_sensor::Isometry3;

use super::values;

/// The extrinsic as it is asked for.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Extrinsic {
    /// Found by looking.
    Auto,
    Identity,
    Given(Isometry3<f64>),
    /// KITTI's: of this file, or of the `calib.txt` beside trajectory or log.
    Calib(Option<PathBuf>),
    /// From the frame of the trajectory's body to the scans' frame, by the log's static frames.
    Frame(String),
}

impl FromStr for Extrinsic {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text.split_once(':') {
            None if text == "auto" => Self::Auto,
            None if text == "identity" => Self::Identity,
            None if text == "calib" => Self::Calib(None),
            Some(("calib", file)) if !file.is_empty() => Self::Calib(Some(file.into())),
            Some(("frame", name)) if !name.is_empty() => Self::Frame(name.into()),
            _ => Self::Given(values::transform(text)?),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::named::Named;

    #[test]
    fn extrinsics_are_words_numbers_files_and_frames() {
        let cases = [
            ("auto", Extrinsic::Auto),
            ("identity", Extrinsic::Identity),
            ("calib", Extrinsic::Calib(None)),
            ("calib:a/calib.txt", Extrinsic::Calib(Some("a/calib.txt".into()))),
            ("frame:base_link", Extrinsic::Frame("base_link".into())),
            ("1,0,0,0,0,0,1", Extrinsic::Given(Isometry3::translation(1.0, 0.0, 0.0))),
        ];
        for (text, extrinsic) in cases {
            let of_all: Named<Extrinsic> = text.parse().unwrap();
            assert_eq!(of_all.parts(), (None, text.to_owned(), &extrinsic));
            let of_one: Named<Extrinsic> = format!("run a={text}").parse().unwrap();
            assert_eq!(of_one.parts(), (Some("run a"), text.to_owned(), &extrinsic));
        }
        let file: Named<Extrinsic> = "calib:a=b.txt".parse().unwrap();
        assert_eq!((file.parts().0, file.parts().2), (None, &Extrinsic::Calib(Some("a=b.txt".into()))));
        for text in ["", "frame:", "calib:", "Auto", "1,2,3", "a=", "=identity", "0,0,0,0,0,0,0"] {
            assert!(text.parse::<Named<Extrinsic>>().is_err(), "{text}");
        }
    }
}
