//! How amounts are written for people.

use std::fmt::Display;

/// A number that is whole, with commas between the thousands; any other as it is. For amounts: what is looked up in a file, as a
/// line, an offset, an id or a stamp, is printed as the file has it.
///
/// ```
/// use dmp_lengths::thousands;
///
/// assert_eq!(thousands(1_234_567), "1,234,567");
/// assert_eq!([thousands(-1000), thousands(999), thousands("0.12345")], ["-1,000", "999", "0.12345"]);
/// ```
pub fn thousands(number: impl Display + Copy) -> String {
    let number = number.to_string();
    let plain = number.trim_start_matches('-');
    if !plain.bytes().all(|byte| byte.is_ascii_digit()) {
        return number;
    }
    let mut text = number[..number.len() - plain.len()].to_owned();
    for (k, digit) in plain.chars().enumerate() {
        if k > 0 && (plain.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
