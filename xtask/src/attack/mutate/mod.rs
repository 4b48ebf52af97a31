//! Damages files as their form allows.

mod bytes;
mod cdr;
mod headed;
mod json;
mod las;
mod mcap;
mod png;
mod sqlite;
mod store;
mod text;

use crate::trials::{Form, Random};

/// Damages a file; whether checksums guard against all that was done. `other` is a file to take parts from.
pub(super) fn damage(form: Form, file: &mut Vec<u8>, other: &[u8], random: &mut Random) -> bool {
    let mut is_guarded = true;
    // One damage is the most telling; several meet what stands behind the first check.
    let times = *random.pick(&[1, 1, 1, 2, 3, 6]);
    for _ in 0..times {
        let by_form = random.below(3) < 2;
        let done = by_form
            && match form {
                Form::Bytes => false,
                Form::Text => {
                    text::damage(file, random);
                    true
                }
                Form::Json => {
                    if random.once_in(3) {
                        text::damage(file, random);
                        true
                    } else {
                        json::damage(file, random)
                    }
                }
                Form::Mcap => mcap::damage(file, random),
                Form::Sqlite => sqlite::damage(file, random),
                Form::Headed => {
                    headed::damage(file, other, random);
                    true
                }
                Form::Las => las::damage(file, random),
                Form::Png => png::damage(file, random),
                Form::Store => store::damage(file, random),
            };
        if done {
            is_guarded = false;
        } else {
            bytes::damage(file, other, random);
        }
    }
    is_guarded
}
