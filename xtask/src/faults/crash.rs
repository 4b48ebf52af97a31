//! What a loss of power may leave: of what was written and never brought to disk, any part.
//!
//! A file has on disk what it had when it was last synced; of what was written since, any of the writes. A folder has the
//! names that it had when it was last synced; of what was done to them since, what came first (file systems with a journal
//! keep that order). A file without its last name is found under the name that it had before.

use std::collections::BTreeMap;
use std::fs::{self, OpenOptions};
use std::os::unix::fs::{FileExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};

use super::journal::Operation;
use crate::trials::{Random, paths};

/// What is lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Loss {
    /// The process was killed, the machine runs on.
    Nothing,
    /// What was written and not synced; names stay.
    Data,
    /// Half of those writes, drawn; of each folder, some of the last changes of names.
    Some,
    /// Changes of names in folders that were not synced.
    Names,
    Everything,
}

impl Loss {
    pub(super) const ALL: [Self; 5] = [Self::Nothing, Self::Data, Self::Some, Self::Names, Self::Everything];
}

/// What is not on disk for sure.
#[derive(Debug, Default)]
struct Unsynced<'a> {
    files: BTreeMap<u64, Pending>,
    /// In order, each with the folder that holds it.
    names: Vec<(PathBuf, &'a Operation)>,
}

/// A file's length when it was last synced, and what was written since.
#[derive(Debug, Default)]
struct Pending {
    length: u64,
    writes: Vec<(u64, u64)>,
}

impl<'a> Unsynced<'a> {
    fn of(operations: &'a [Operation]) -> Self {
        let mut state = Self::default();
        for operation in operations.iter().filter(|operation| operation.reached_the_disk()) {
            let Operation { name, inode, offset, length, path, .. } = operation;
            match name.as_str() {
                "make" if *offset == 1 => {
                    // The number may have been another file's.
                    state.files.insert(*inode, Pending::default());
                    state.name(path, operation);
                }
                "make" | "open" => {
                    state.files.entry(*inode).or_insert(Pending { length: *length, writes: Vec::new() });
                }
                "write" => {
                    state.files.entry(*inode).or_default().writes.push((*offset, *length));
                }
                "cut" => {
                    let pending = state.files.entry(*inode).or_default();
                    pending.length = pending.length.min(*length);
                }
                "sync" => {
                    state.files.insert(*inode, Pending { length: *length, writes: Vec::new() });
                    state.names.retain(|(folder, _)| folder != path);
                }
                "rename" => state.name(&operation.to, operation),
                "unlink" | "mkdir" | "rmdir" => state.name(path, operation),
                _ => {}
            }
        }
        state
    }

    fn name(&mut self, path: &Path, operation: &'a Operation) {
        self.names.push((path.parent().unwrap_or(path).to_owned(), operation));
    }
}

impl Operation {
    fn reached_the_disk(&self) -> bool {
        !matches!(self.fault, Some(super::journal::Fault::Error(_)))
    }
}

/// Takes from the files below a folder what is lost.
pub(super) fn lose(
    loss: Loss,
    operations: &[Operation],
    under: &Path,
    random: &mut Random,
) -> std::io::Result<()> {
    let Unsynced { files, names } = Unsynced::of(operations);
    // How many of the last changes of each folder are lost.
    let mut lost: BTreeMap<&Path, usize> = BTreeMap::new();
    for (folder, _) in &names {
        *lost.entry(folder).or_default() += 1;
    }
    for n in lost.values_mut() {
        *n = match loss {
            Loss::Nothing | Loss::Data => 0,
            Loss::Some => random.below(*n + 1),
            Loss::Names | Loss::Everything => *n,
        };
    }
    for (folder, operation) in names.iter().rev() {
        if let Some(n) = lost.get_mut(folder.as_path()).filter(|n| **n > 0) {
            *n -= 1;
            undo(operation);
        }
    }
    if matches!(loss, Loss::Nothing | Loss::Names) {
        return Ok(());
    }
    for path in paths(under) {
        let path = under.join(path);
        let found = fs::symlink_metadata(&path)?;
        let Some(pending) = files.get(&found.ino()).filter(|_| found.is_file()) else { continue };
        let is_lost = |random: &mut Random| loss != Loss::Some || random.once_in(2);
        let (mut end, mut holes) = (pending.length, Vec::new());
        for &(offset, length) in &pending.writes {
            if is_lost(random) {
                holes.push((offset, length));
            } else {
                end = end.max(offset + length);
            }
        }
        let file = OpenOptions::new().write(true).open(&path)?;
        let end = end.min(found.len());
        file.set_len(end)?;
        for (offset, length) in holes {
            let length = length.min(end.saturating_sub(offset));
            file.write_all_at(&vec![0; length as usize], offset)?;
        }
    }
    Ok(())
}

/// Takes a change of a name back, as far as what came before it still allows.
fn undo(operation: &Operation) {
    let Operation { name, path, to, link, .. } = operation;
    let _ = match name.as_str() {
        "make" => fs::remove_file(path),
        "mkdir" => fs::remove_dir_all(path),
        "rmdir" => fs::create_dir(path),
        "unlink" => link.as_ref().map_or(Ok(()), |link| fs::rename(link, path)),
        _ => {
            // Where the folder it came from is gone, so is the file.
            let back = fs::rename(to, path).or_else(|_| fs::remove_file(to));
            link.as_ref().map_or(back, |link| fs::rename(link, to))
        }
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    fn operation(name: &str, inode: u64, offset: u64, length: u64, path: &Path) -> Operation {
        Operation { name: name.into(), inode, offset, length, path: path.to_owned(), ..Operation::default() }
    }

    /// A file that is written, synced or not, and renamed over another.
    fn left(loss: Loss, syncs_file: bool, syncs_folder: bool) -> Vec<(String, Vec<u8>)> {
        let place = tempfile::tempdir().unwrap();
        let (under, link) = (place.path().join("in"), place.path().join("1"));
        fs::create_dir(&under).unwrap();
        let (new, target) = (under.join(".x"), under.join("x"));
        fs::write(&link, b"old").unwrap();
        fs::write(&target, b"new").unwrap();
        let inode = fs::metadata(&target).unwrap().ino();
        let mut operations =
            vec![operation("make", inode, 1, 0, &new), operation("write", inode, 0, 3, &new)];
        if syncs_file {
            operations.push(operation("sync", inode, 0, 3, &new));
        }
        operations.push(Operation { to: target, link: Some(link), ..operation("rename", 0, 0, 0, &new) });
        if syncs_folder {
            operations.push(operation("sync", 1, 0, 0, &under));
        }
        lose(loss, &operations, &under, &mut Random::of(&[1])).unwrap();
        let mut found: Vec<_> = paths(&under);
        found.sort();
        found.into_iter().map(|path| (path.clone(), fs::read(under.join(path)).unwrap())).collect()
    }

    #[test]
    fn what_is_synced_stays_and_the_rest_goes() {
        let x = |bytes: &[u8]| vec![("x".to_owned(), bytes.to_vec())];
        assert_eq!(left(Loss::Everything, true, true), x(b"new"));
        // The order that keeps neither: a name without content.
        assert_eq!(left(Loss::Data, false, true), x(b""));
        assert_eq!(left(Loss::Data, true, false), x(b"new"));
        assert_eq!(left(Loss::Names, true, false), x(b"old"));
        assert_eq!(left(Loss::Everything, false, false), x(b"old"));
        assert_eq!(left(Loss::Nothing, false, false), x(b"new"));
    }
}
