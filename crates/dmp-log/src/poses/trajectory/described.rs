//! What the numbers of a line look like: for files whose columns have no names.

use nalgebra::{Matrix3, Vector4};

use crate::file::shorten;

/// A quaternion is this near to unit length, a matrix this near to a rotation.
const NEAR: f64 = 0.1;
/// A first column that is whole and smaller counts frames: no second of our days has so few.
const MOST_FRAMES: f64 = 1e8;

/// The numbers of a line; `None` where something is none.
pub(super) fn numbers_of(columns: &[&str]) -> Option<Vec<f64>> {
    columns.iter().map(|column| column.parse().ok().filter(|number: &f64| number.is_finite())).collect()
}

/// How far four numbers are from the length of a rotation's quaternion.
fn norm(quaternion: &[f64]) -> f64 {
    Vector4::from_iterator(quaternion.iter().copied()).norm()
}

/// Whether four numbers may be a quaternion; one of zeros stands for none.
pub(super) fn may_be_quaternion(quaternion: &[f64]) -> bool {
    let norm = norm(quaternion);
    norm == 0.0 || (norm - 1.0).abs() <= NEAR
}

/// Whether the numbers from `at` on begin with the rows of `[R t]`.
pub(super) fn has_matrix(numbers: &[f64], at: usize) -> bool {
    let Some(&[a, b, c, _, d, e, f, _, g, h, i, _]) = numbers.get(at..).and_then(|rest| rest.first_chunk())
    else {
        return false;
    };
    let matrix = Matrix3::new(a, b, c, d, e, f, g, h, i);
    (matrix.transpose() * matrix - Matrix3::identity()).amax() <= NEAR && matrix.determinant() > 0.0
}

/// Whether a first column counts frames rather than time.
pub(super) fn is_frame(number: f64) -> bool {
    number.fract() == 0.0 && (0.0..MOST_FRAMES).contains(&number)
}

/// Whether a line has numbers with decimal commas.
pub(super) fn has_decimal_commas(line: &str) -> bool {
    let is_one = |word: &&str| {
        let digits = |text: &str| !text.is_empty() && text.bytes().all(|c| c.is_ascii_digit());
        word.trim_start_matches('-')
            .split_once(',')
            .is_some_and(|(whole, part)| digits(whole) && digits(part))
    };
    let words: Vec<&str> =
        line.split(|c: char| c.is_whitespace() || c == ';').filter(|word| !word.is_empty()).collect();
    let count = words.iter().filter(|word| is_one(word)).count();
    !line.contains('.') && count >= 3 && 2 * count >= words.len()
}

/// Whether a line is one of COLMAP's `images.txt`: a number, a quaternion w x y z, a place, a camera, the name of an image.
fn is_colmap(columns: &[&str]) -> bool {
    let [id, qw, qx, qy, qz, _, _, _, camera, name] = columns else { return false };
    let is_whole = |word: &&&str| word.parse::<u64>().is_ok();
    let quaternion = numbers_of(&[qw, qx, qy, qz]);
    [id, camera].iter().all(is_whole)
        && name.parse::<f64>().is_err()
        && quaternion.is_some_and(|quaternion| may_be_quaternion(&quaternion))
}

/// What a line holds, in words, so that its columns can be named.
pub(super) fn described(columns: &[&str]) -> String {
    let count = columns.len();
    if is_colmap(columns) {
        return "a line of COLMAP's images.txt: camera_from_world by image, without stamps".to_owned();
    }
    // A pose that is not known is NaN in some.
    let numbers: Option<Vec<f64>> = columns.iter().map(|column| column.parse().ok()).collect();
    let Some(numbers) = numbers else {
        let first = shorten(columns.first().copied().unwrap_or_default());
        return format!("{count} columns starting with `{first}`, not all of them numbers");
    };
    let mut said = Vec::new();
    if let Some(first) = numbers.first() {
        said.push(if is_frame(*first) {
            "column 1 is a whole number".to_owned()
        } else {
            format!("column 1 is {first}")
        });
    }
    let quaternion =
        (1..count.saturating_sub(3)).find(|&at| (norm(&numbers[at..at + 4]) - 1.0).abs() <= 0.01);
    match (quaternion, [0, 1].into_iter().find(|&at| has_matrix(&numbers, at))) {
        (_, Some(at)) => {
            said.push(format!("columns {} to {} hold a rotation and a place, row by row", at + 1, at + 12));
        }
        (Some(at), None) => {
            said.push(format!("columns {} to {} have the length of a quaternion, 1", at + 1, at + 4));
        }
        (None, None) => {
            if let Some(last) = count.checked_sub(4).filter(|last| *last > 0) {
                said.push(format!(
                    "columns {} to {count} have length {:.4}: no quaternion",
                    last + 1,
                    norm(&numbers[last..])
                ));
            }
            let angles = &numbers[count.saturating_sub(3)..];
            if (6..=7).contains(&count) && angles.iter().all(|angle| angle.abs() <= 360.0) {
                said.push(
                    "the last three may be Euler angles, which are not read: write quaternions".to_owned(),
                );
            }
            if numbers.iter().any(|number| number.is_nan()) {
                said.push("some are NaN".to_owned());
            }
        }
    }
    format!("{count} columns of numbers: {}", said.join("; "))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(line: &str) -> String {
        described(&line.split([' ', ',']).collect::<Vec<_>>())
    }

    #[test]
    fn lines_are_described_by_their_values() {
        for (line, word) in [
            // TIERS: a row number before TUM's columns.
            ("17 1700000000.5 1 2 3 0 0 0.6 0.8", "columns 6 to 9 have the length of a quaternion"),
            // NCLT: angles.
            ("1328456140000000,1.5,2.5,0.1,0.01,-0.02,3.1", "may be Euler angles"),
            ("1326030975726043,nan,nan,nan,nan,nan,nan", "some are NaN"),
            ("1 0.8 0 0 0.6 1 2 3 1 left/1.png", "COLMAP's images.txt"),
            // MulRan: a matrix behind the stamp.
            (
                "1564718964045 1 0 0 353000 0 1 0 4025000 0 0 1 20",
                "columns 2 to 13 hold a rotation and a place",
            ),
            // Check points: a name, east, north, height.
            ("P1 353000.5 4025000.25 20.5", "4 columns starting with `P1`, not all of them numbers"),
            (
                "1700000000.5 353000.5 4025000.25 20.5 0 0 0 353064",
                "columns 5 to 8 have length 353064.0000: no quaternion",
            ),
        ] {
            assert!(of(line).contains(word), "{line}: {}", of(line));
        }
    }

    #[test]
    fn decimal_commas_are_no_separators() {
        assert!(has_decimal_commas("1699999999,98 0,5 -1,25 0,0 0,0 0,0 0,0 1,0"));
        assert!(has_decimal_commas("VERTEX_SE3:QUAT 0 0,5 -1,25 0,0 0,0 0,0 0,0 1,0"));
        assert!(has_decimal_commas("1699999999,98;0,5;-1,25;0,0;0,0;0,0;0,0;1,0"));
        assert!(!has_decimal_commas("1403636580838555648,4.6,-1.7,0.7,0.5,-0.1,-0.8,-0.1"));
        assert!(!has_decimal_commas("1403636580838555648,4,1,0,0,0,0,1"));
        assert!(!has_decimal_commas("1, 2, 3, 4"));
    }
}
