//! The failures that were found: told once each, with their files kept.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Of failures that look alike, so many are kept.
const KEPT: u64 = 2;

#[derive(Debug)]
pub(crate) struct Found {
    keep: PathBuf,
    /// What tells them apart, how often each was found, and how it is repeated.
    by_sign: BTreeMap<String, (u64, String)>,
}

impl Found {
    pub(crate) fn new(keep: &Path) -> Self {
        Self { keep: keep.to_owned(), by_sign: BTreeMap::new() }
    }

    /// How many there are that differ.
    pub(crate) fn len(&self) -> usize {
        self.by_sign.len()
    }

    /// Counts a failure by its sign; where it is to be kept, as one that is new: in which folder.
    pub(crate) fn add(&mut self, sign: String, again: &str, name: &str) -> Option<PathBuf> {
        let (times, _) = self.by_sign.entry(sign).or_insert_with(|| (0, again.to_owned()));
        *times += 1;
        let name: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
        (*times <= KEPT).then(|| self.keep.join(name))
    }

    /// All of them, a line each.
    pub(crate) fn told(&self) -> String {
        let mut text = String::new();
        for (sign, (times, again)) in &self.by_sign {
            let _ = writeln!(text, "{times} x {sign}\n    {again}");
        }
        text
    }
}
