//! Which loop candidates are true: a list of lines.

use super::record::id_of;
use super::undirected;
use crate::file::{is_header, lines, read_text, shorten};
use crate::{LogError, ParseError, PlaceInFile};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::path::Path;

/// Largest list that is read: tens of millions of candidates.
const MAX_BYTES: u64 = 1 << 30;
/// Columns of a line: two vertices and the label.
const COLUMNS: usize = 3;

/// Which loops are true, as somebody knows who made or looked at them.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LoopLabels {
    /// By the two vertices, the smaller id first: whether they see the same place as the candidate says. At
    /// least one.
    pub labels: BTreeMap<(i64, i64), bool>,
    /// Lines that say again what was said; they count once.
    pub repeated: usize,
}

impl LoopLabels {
    /// The label of a candidate between two vertices, in either direction.
    pub fn of(&self, from: i64, to: i64) -> Option<bool> {
        self.labels.get(&undirected(from, to)).copied()
    }
}

/// Parses labels of loop candidates: lines of `from to label`, with commas or blanks between them. The label is
/// `true`, `yes` or `1`, or `false`, `no` or `0`, in any case; more columns are passed over. A direction means
/// nothing. The first line may have names of columns instead of ids.
///
/// # Errors
/// In the first line that is no text, has fewer columns, ids that are no whole numbers, one id twice or another
/// word for a label, or contradicts an earlier line; and where there is no label.
pub fn parse_loop_labels(bytes: &[u8]) -> Result<LoopLabels, ParseError> {
    let mut seen: BTreeMap<(i64, i64), (PlaceInFile, bool)> = BTreeMap::new();
    let mut repeated = 0;
    for (index, line) in lines(bytes).enumerate() {
        let (place, columns) = line?;
        if index == 0 && is_header(&columns) {
            continue;
        }
        let (from, to, label) = labelled(place, &columns)?;
        match seen.entry(undirected(from, to)) {
            Entry::Vacant(vacant) => {
                vacant.insert((place, label));
            }
            Entry::Occupied(there) => {
                let (first, other) = *there.get();
                if other != label {
                    let problem =
                        format!("the loop between {from} and {to} is {label}, in {first} it is {other}");
                    return Err(ParseError::new(place, problem));
                }
                repeated += 1;
            }
        }
    }
    if seen.is_empty() {
        return Err(ParseError::new(PlaceInFile::WholeFile, "no labels: no line of `from to label`"));
    }
    let labels = seen.into_iter().map(|(pair, (_, label))| (pair, label)).collect();
    Ok(LoopLabels { labels, repeated })
}

/// Reads labels of loop candidates, as [`parse_loop_labels`].
///
/// # Errors
/// As [`parse_loop_labels`], and when the file cannot be read.
pub fn read_loop_labels(path: &Path) -> Result<LoopLabels, LogError> {
    let bytes = read_text(path, "list of loop labels", MAX_BYTES)?;
    parse_loop_labels(&bytes).map_err(|e| e.in_file(path))
}

fn labelled(place: PlaceInFile, columns: &[&str]) -> Result<(i64, i64, bool), ParseError> {
    let (Some(word), true) = (columns.get(COLUMNS - 1), columns.len() >= COLUMNS) else {
        let problem =
            format!("{} columns, expected {COLUMNS} (from to label): is the line cut?", columns.len());
        return Err(ParseError::new(place, problem));
    };
    let (from, to) = (id_of(place, columns, 0)?, id_of(place, columns, 1)?);
    if from == to {
        return Err(ParseError::new(place, format!("a loop from the vertex {from} to itself")));
    }
    let label = match word.to_ascii_lowercase().as_str() {
        "true" | "yes" | "1" => true,
        "false" | "no" | "0" => false,
        _ => {
            let problem = format!("the label `{}` is none of true, yes, 1, false, no, 0", shorten(word));
            return Err(ParseError::new(place, problem));
        }
    };
    Ok((from, to, label))
}
