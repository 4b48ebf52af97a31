//! Damage to files: one list for the fuzz target, for `cargo xtask attack` and for the quick test of `dmp-log`.
//!
//! A [`Form`] is how a file is built. Damage that keeps the form passes the first checks of a reader and meets what is
//! behind them. Every draw comes from a [`Random`], so that a try is repeated by its numbers.

mod bytes;
mod cdr;
mod field;
mod json;
mod las;
pub(crate) mod mcap;
mod others;
mod png;
mod random;
mod sqlite;
mod store;
mod text;

pub(crate) use others::others;
pub(crate) use random::Random;

/// How a file is built.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Form {
    /// Nothing is known of it.
    Bytes,
    /// Words in lines.
    Text,
    Json,
    Mcap,
    /// One message in CDR.
    Message,
    /// rosbag2 in `SQLite`.
    Sqlite,
    /// A head in text, bytes behind it: PCD, PLY, npy.
    Headed,
    Las,
    Png,
    /// A map of the format `.dmpmap`.
    Store,
}

/// Damages a file; returns whether its checksums cover all that was done. `other` is a file to take parts from.
pub(crate) fn damage(form: Form, file: &mut Vec<u8>, other: &[u8], random: &mut Random) -> bool {
    let mut is_guarded = true;
    // One damage shows its cause best; several meet what is behind the first check.
    for _ in 0..*random.pick(&[1, 1, 1, 2, 3, 6]) {
        if random.below(3) < 2 && damage_in_form(form, file, other, random) {
            is_guarded = false;
        } else {
            bytes::damage(file, other, random);
        }
    }
    is_guarded
}

/// One damage that keeps the form; false where the file does not have it.
fn damage_in_form(form: Form, file: &mut Vec<u8>, other: &[u8], random: &mut Random) -> bool {
    match form {
        Form::Bytes => false,
        Form::Json if random.below(3) < 2 => json::damage(file, random),
        Form::Text | Form::Json => text::damage(file, random),
        Form::Mcap => mcap::damage(file, random),
        Form::Message => cdr::damage(file, random),
        Form::Sqlite => sqlite::damage(file, random).is_some(),
        Form::Headed => text::damage_headed(file, other, random),
        Form::Las => las::damage(file, random).is_some(),
        Form::Png => png::damage(file, random),
        Form::Store => store::damage(file, random).is_some(),
    }
}

/// Damage to the parts of a file: one is dropped, doubled, repeated or moved, or all before or behind it are lost. Files stay
/// small whatever is done to them.
fn damage_parts<T: Clone>(parts: &mut Vec<T>, bytes_of: impl Fn(&T) -> usize, random: &mut Random) {
    let (one, other) = (random.below(parts.len()), random.below(parts.len()));
    let Some(part) = parts.get(one).cloned() else { return };
    match random.below(8) {
        0 | 1 => drop(parts.remove(one)),
        2 => parts.swap(one, other),
        3 => parts.insert(other, part),
        4 => {
            let times = (*random.pick(&[2, 200, 5000])).min((1 << 22) / bytes_of(&part).max(1));
            parts.splice(other..other, vec![part; times]);
        }
        5 => parts.reverse(),
        6 => parts.truncate(one),
        _ => drop(parts.drain(..one)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMS: [Form; 10] = [
        Form::Bytes,
        Form::Text,
        Form::Json,
        Form::Mcap,
        Form::Message,
        Form::Sqlite,
        Form::Headed,
        Form::Las,
        Form::Png,
        Form::Store,
    ];

    /// What has a form, what has none of it and what is short: a damaged file can be damaged again.
    #[test]
    fn any_file_can_be_damaged_in_any_form() {
        let message = mcap::Record { op: mcap::MESSAGE, body: vec![0; 60] };
        let footer = mcap::Record { op: mcap::FOOTER, body: vec![1; 20] };
        let files: [&[u8]; 8] = [
            b"",
            b"\n",
            b"1 2\n3 4\n",
            br#"{"a": [1, 2], "b": {"c": 3}}"#,
            b"ply\nend_header\n\x00\x01\x02",
            b"\x89PNG\r\n\x1a\n\0\0\0\x01IHDR\x07\0\0\0\0",
            &[7; 400],
            &mcap::file_of(&[message, footer]),
        ];
        for form in FORMS {
            for (number, file) in files.iter().enumerate() {
                let tries = if form == Form::Sqlite { 5 } else { 200 };
                for attempt in 0..tries {
                    let mut random = Random::of(&[form as u64, number as u64, attempt]);
                    let mut file = file.to_vec();
                    for _ in 0..3 {
                        damage(form, &mut file, &[1, 2, 3], &mut random);
                        file.truncate(1 << 20);
                    }
                }
            }
        }
    }
}
