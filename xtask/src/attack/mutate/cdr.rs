//! Damage to a `sensor_msgs/PointCloud2` in CDR, field by field; of other messages to its numbers of 32 bits.

use super::bytes::{set_float, set_number};
use crate::trials::Random;

/// A number of the message: its place and width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Number {
    at: usize,
    width: usize,
}

/// Where the numbers of a cloud are, and where its points begin.
#[derive(Debug)]
struct Cloud {
    numbers: Vec<Number>,
    points: usize,
    is_big: bool,
}

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    is_big: bool,
    numbers: Vec<Number>,
}

impl Reader<'_> {
    /// The next number. CDR aligns it to its width, counted from behind the four bytes of the head.
    fn number(&mut self, width: usize) -> Option<usize> {
        self.at = 4 + (self.at - 4).next_multiple_of(width);
        let mut value = [0; 8];
        let field = self.bytes.get(self.at..self.at + width)?;
        value[..width].copy_from_slice(field);
        if self.is_big {
            value[..width].reverse();
        }
        self.numbers.push(Number { at: self.at, width });
        self.at += width;
        usize::try_from(u64::from_le_bytes(value)).ok()
    }

    fn text(&mut self) -> Option<()> {
        let length = self.number(4)?;
        self.at = self.at.checked_add(length).filter(|&end| end <= self.bytes.len())?;
        Some(())
    }
}

fn read(bytes: &[u8]) -> Option<Cloud> {
    let is_big = match bytes.get(..4)? {
        [0, 0, ..] => true,
        [0, 1, ..] => false,
        _ => return None,
    };
    let mut reader = Reader { bytes, at: 4, is_big, numbers: Vec::new() };
    // Stamp, frame, height, width.
    reader.number(4)?;
    reader.number(4)?;
    reader.text()?;
    reader.number(4)?;
    reader.number(4)?;
    let fields = reader.number(4).filter(|&fields| (1..100).contains(&fields))?;
    for _ in 0..fields {
        // Name, offset, type, count.
        reader.text()?;
        reader.number(4)?;
        reader.number(1)?;
        reader.number(4)?;
    }
    // Order of bytes, lengths of a point and of a row, points.
    reader.number(1)?;
    reader.number(4)?;
    reader.number(4)?;
    let length = reader.number(4)?;
    (reader.at + length <= bytes.len()).then_some(Cloud {
        points: reader.at,
        numbers: reader.numbers,
        is_big,
    })
}

/// One damage.
pub(super) fn damage(message: &mut Vec<u8>, random: &mut Random) {
    let Some(cloud) = read(message) else {
        let at = random.below(message.len()) / 4 * 4;
        let width = *random.pick(&[1, 4, 8]);
        return if random.once_in(3) {
            set_float(message, at + 4, 8, random);
        } else {
            set_number(message, at, width, false, random);
        };
    };
    match random.below(8) {
        0..=4 => {
            let Number { at, width } = *random.pick(&cloud.numbers);
            set_number(message, at, width, cloud.is_big, random);
        }
        5 => {
            // Odd coordinates, or times, of some points.
            for _ in 0..=random.below(40) {
                let at = cloud.points + random.below(message.len() - cloud.points) / 4 * 4;
                set_float(message, at, 4, random);
            }
        }
        6 => {
            // The same value in all points, as times that say nothing.
            let (at, step) = (cloud.points + random.below(16) / 4 * 4, *random.pick(&[4, 16, 22]));
            let value =
                message.get(at..at + 4).map_or([0; 4], |value| [value[0], value[1], value[2], value[3]]);
            for at in (at..message.len().saturating_sub(4)).step_by(step) {
                message[at..at + 4].copy_from_slice(&value);
            }
        }
        _ => message.truncate(random.below(message.len() + 1)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_a_cloud_are_found() {
        let mut message = vec![0, 1, 0, 0];
        let number = |message: &mut Vec<u8>, number: u32| message.extend_from_slice(&number.to_le_bytes());
        for value in [1, 2, 2] {
            number(&mut message, value);
        }
        // A frame `a`, which two bytes bring to a multiple of four.
        message.extend_from_slice(b"a\0\0\0");
        for value in [1, 1, 1, 2] {
            number(&mut message, value);
        }
        // A field `x` at 0, of type 7, once.
        message.extend_from_slice(b"x\0\0\0");
        number(&mut message, 0);
        message.extend_from_slice(&[7, 0, 0, 0]);
        number(&mut message, 1);
        message.extend_from_slice(&[0, 0, 0, 0]);
        for value in [4, 4, 4] {
            number(&mut message, value);
        }
        message.extend_from_slice(&[0, 0, 128, 63, 1]);
        let cloud = read(&message).unwrap();
        assert_eq!(cloud.numbers.len(), 14);
        assert_eq!(cloud.points, message.len() - 5);
        let mut random = Random::of(&[4]);
        for length in 0..=message.len() {
            for _ in 0..100 {
                damage(&mut message[..length].to_vec(), &mut random);
            }
        }
    }
}
