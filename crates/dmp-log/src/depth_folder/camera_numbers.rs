//! The numbers of a pinhole camera, and their text.

use crate::decimal::shorten;
use dmp_sensor::Distortion;
use std::fmt;
use std::str::FromStr;

/// The numbers of a pinhole camera, but for the size of its images.
///
/// As text (`FromStr`, `Display`): `FX,FY,CX,CY`, pixels, and perhaps `,K1,K2,P1,P2` or `,K1,K2,P1,P2,K3`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct CameraNumbers {
    /// fx and fy, pixels.
    pub focal_px: [f64; 2],
    /// cx and cy, pixels.
    pub centre_px: [f64; 2],
    /// What the lens does to a place in the image.
    pub distortion: Distortion,
}

impl CameraNumbers {
    pub(super) const fn without_lens(focal_px: [f64; 2]) -> Self {
        Self { focal_px, centre_px: [319.5, 239.5], distortion: Distortion::NONE }
    }
}

impl fmt::Display for CameraNumbers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([fx, fy], [cx, cy]) = (self.focal_px, self.centre_px);
        write!(f, "{fx},{fy},{cx},{cy}")?;
        if self.distortion != Distortion::NONE {
            let ([k1, k2, k3], [p1, p2]) = (self.distortion.radial, self.distortion.tangential);
            write!(f, ",{k1},{k2},{p1},{p2},{k3}")?;
        }
        Ok(())
    }
}

impl FromStr for CameraNumbers {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("`{}` is not FX,FY,CX,CY or FX,FY,CX,CY,K1,K2,P1,P2[,K3], numbers", shorten(text));
        let number = |word: &str| word.trim().parse::<f64>().ok().filter(|number| number.is_finite());
        let numbers: Vec<f64> = text.split(',').map(number).collect::<Option<_>>().ok_or_else(wrong)?;
        let [fx, fy, cx, cy, lens @ ..] = numbers.as_slice() else { return Err(wrong()) };
        let distortion = match lens {
            [] => Distortion::NONE,
            lens => distortion_of(lens).ok_or_else(wrong)?,
        };
        if *fx == 0.0 || *fy == 0.0 {
            return Err(format!("`{}` has a focal length of 0", shorten(text)));
        }
        Ok(Self { focal_px: [*fx, *fy], centre_px: [*cx, *cy], distortion })
    }
}

/// Of k1, k2, p1, p2 and perhaps k3.
pub(super) fn distortion_of(numbers: &[f64]) -> Option<Distortion> {
    let (&[k1, k2, p1, p2], k3) = (numbers.get(..4)?, numbers.get(4)) else { return None };
    (numbers.len() <= 5)
        .then_some(Distortion { radial: [k1, k2, k3.copied().unwrap_or(0.0)], tangential: [p1, p2] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_are_written() {
        let numbers: CameraNumbers = "481.2,-480.0,319.5,239.5".parse().unwrap();
        assert_eq!((numbers.focal_px, numbers.distortion), ([481.2, -480.0], Distortion::NONE));
        let lens: CameraNumbers =
            "517.3, 516.5, 318.6, 255.3, 0.2624,-0.9531,-0.0054,0.0026,1.1633".parse().unwrap();
        let distortion = Distortion { radial: [0.2624, -0.9531, 1.1633], tangential: [-0.0054, 0.0026] };
        assert_eq!(lens.distortion, distortion);
        for numbers in [numbers, lens] {
            assert_eq!(numbers.to_string().parse(), Ok(numbers));
        }
        assert_eq!("1,1,0,0,0.1,0,0,0".parse::<CameraNumbers>().unwrap().distortion.radial, [0.1, 0.0, 0.0]);
        for text in
            ["", "525", "525,525,319.5", "525,525,319.5,x", "1,2,3,4,5", "1,2,3,4,5,6,7,8,9,10", "nan,1,1,1"]
        {
            assert!(text.parse::<CameraNumbers>().unwrap_err().contains("is not FX,FY,CX,CY"), "{text}");
        }
        assert!("0,525,1,1".parse::<CameraNumbers>().unwrap_err().contains("focal length of 0"));
    }
}
