//! Files as bytes and lines: counted reads, folders, numbers in text, names, damage.

pub(crate) mod columns;
mod damage;
pub(crate) mod decimal;
pub(crate) mod fingerprint;
mod folder;
pub(crate) mod pool;
pub(crate) mod printable;
mod reads;
pub(crate) mod text;

pub use columns::write_times;
pub(crate) use columns::{
    found_or, pose_of, pose_of_rows, unit_of_large_numbers, unit_of_lines, unit_since_1970, values,
};
pub use damage::Damage;
pub(crate) use damage::{DamageList, first_in_words};
pub(crate) use decimal::{ns_to_seconds, seconds_to_ns, shorten, to_ns};
pub(crate) use fingerprint::{END_BYTES, of_file, of_names};
pub(crate) use folder::{
    entries, files_where, files_with_extension, first_file, is_file, is_folder, is_hidden, stays_inside,
};
pub use printable::{is_printable, printable, shown_path};
pub(crate) use reads::{CountedFile, KnownFile, ReadCount, fill, open_sized, start_of};
pub(crate) use text::{MAX_LINE_BYTES, data_of, is_cut, is_header, lines, read_line, read_text};
