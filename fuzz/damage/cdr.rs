//! Damage to a `sensor_msgs/PointCloud2` in CDR, field by field; to other messages where such numbers mostly are.

use super::Random;
use super::field::{Field, Kind, number};

struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    kind: Kind,
    fields: Vec<Field>,
}

impl Reader<'_> {
    /// The next number. CDR aligns it to its width, counted from behind the four bytes of the head.
    fn number(&mut self, width: usize) -> Option<usize> {
        let at = 4 + (self.at - 4).next_multiple_of(width);
        let mut bytes = self.bytes.get(at..at + width)?.to_vec();
        if self.kind == Kind::Big {
            bytes.reverse();
        }
        self.fields.push(Field { at, width, kind: self.kind });
        self.at = at + width;
        number(&bytes, 0, width)
    }

    /// Numbers by their widths; `s` is a text behind its length.
    fn skip(&mut self, layout: &str) -> Option<()> {
        for letter in layout.bytes() {
            if letter == b's' {
                let length = self.number(4)?;
                self.at = self.at.checked_add(length).filter(|&end| end <= self.bytes.len())?;
            } else {
                self.number(usize::from(letter - b'0'))?;
            }
        }
        Some(())
    }
}

/// The numbers of a cloud, and where its points begin.
fn cloud(bytes: &[u8]) -> Option<(Vec<Field>, usize)> {
    let kind = match bytes.get(..4)? {
        [0, 0, ..] => Kind::Big,
        [0, 1, ..] => Kind::Little,
        _ => return None,
    };
    let mut reader = Reader { bytes, at: 4, kind, fields: Vec::new() };
    // Stamp, frame, height, width.
    reader.skip("44s44")?;
    let fields = reader.number(4).filter(|fields| (1..100).contains(fields))?;
    // Name, offset, type, count of each.
    (0..fields).try_for_each(|_| reader.skip("s414"))?;
    // Order of bytes, lengths of a point and of a row, points.
    reader.skip("144")?;
    let length = reader.number(4)?;
    (reader.at.checked_add(length)? <= bytes.len()).then_some((reader.fields, reader.at))
}

/// One damage.
pub(super) fn damage(message: &mut Vec<u8>, random: &mut Random) -> bool {
    let Some((fields, points)) = cloud(message) else {
        let at = random.below(message.len()) / 4 * 4;
        let odd = [Field::float(at + 4, 8), Field::little(at, 1), Field::little(at, 4), Field::little(at, 8)];
        random.pick(&odd).spoil(message, random);
        return true;
    };
    match random.below(8) {
        0..=4 => random.pick(&fields).spoil(message, random),
        5 => {
            // Odd coordinates, or times, of some points.
            for _ in 0..=random.below(40) {
                let at = points + random.below(message.len() - points) / 4 * 4;
                Field::float(at, 4).spoil(message, random);
            }
        }
        6 => {
            // The same value in all points, as times that say nothing.
            let (at, step) = (points + random.below(16) / 4 * 4, *random.pick(&[4, 16, 22]));
            let value = message.get(at..at + 4).map_or([0; 4].to_vec(), <[u8]>::to_vec);
            for at in (at..message.len().saturating_sub(4)).step_by(step) {
                message[at..at + 4].copy_from_slice(&value);
            }
        }
        _ => message.truncate(random.below(message.len() + 1)),
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_a_cloud_are_found() {
        let words = |words: &[u32]| words.iter().flat_map(|word| word.to_le_bytes()).collect::<Vec<_>>();
        // A frame `a` and a field `x` at 0, of type 7, once: two bytes each brought to a multiple of four.
        let parts: [&[u8]; 7] = [
            &[0, 1, 0, 0],
            &words(&[1, 2, 2]),
            b"a\0\0\0",
            &words(&[1, 1, 1, 2]),
            b"x\0\0\0",
            &words(&[0, 7, 1, 0, 4, 4, 4]),
            &[0, 0, 128, 63, 1],
        ];
        let message = parts.concat();
        let (fields, points) = cloud(&message).unwrap();
        assert_eq!((fields.len(), points), (14, message.len() - 5));
        assert!((0..message.len() - 1).all(|length| cloud(&message[..length]).is_none()));
    }
}
