//! What the layer wrote down: every operation of a command, in order.

use std::path::{Path, PathBuf};

use anyhow::Context as _;

/// An operation that was done, or that was made to fail.
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub(super) struct Operation {
    pub(super) number: u64,
    pub(super) name: String,
    pub(super) inode: u64,
    /// Of `make`: 1 where it made a name, 2 where it cut a file.
    pub(super) offset: u64,
    pub(super) length: u64,
    /// The system's number of the error, or that half was done.
    pub(super) fault: Option<Fault>,
    pub(super) path: PathBuf,
    /// Where something was renamed to.
    pub(super) to: PathBuf,
    /// Another name of the file that lost this one.
    pub(super) link: Option<PathBuf>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Fault {
    Half,
    Error(i32),
}

impl Fault {
    /// What the system says of it; nothing where that is no failure: what was not done is asked for again.
    pub(super) fn reason(self) -> Option<String> {
        // An interrupted call.
        const EINTR: i32 = 4;
        match self {
            Self::Half | Self::Error(EINTR) => None,
            Self::Error(number) => {
                let text = std::io::Error::from_raw_os_error(number).to_string();
                Some(text.split(" (os").next().unwrap_or_default().to_owned())
            }
        }
    }
}

/// Operations from a file; none where there is no such file.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<Operation>> {
    match std::fs::read_to_string(path) {
        Ok(text) => {
            text.lines().map(|line| parse(line).with_context(|| format!("no operation: {line}"))).collect()
        }
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(error.into()),
    }
}

fn parse(line: &str) -> Option<Operation> {
    let fields: Vec<&str> = line.split('\t').collect();
    let number = |at: usize| fields.get(at)?.parse::<i64>().ok();
    let path = |at: usize| fields.get(at).map(PathBuf::from).unwrap_or_default();
    let name = (*fields.get(1)?).to_owned();
    // Behind the path: of a rename the new path and the link, of a removal the link.
    let link = if name == "rename" { path(8) } else { path(7) };
    Some(Operation {
        number: number(0)? as u64,
        inode: number(2)? as u64,
        offset: number(3)?.max(0) as u64,
        length: number(4)?.max(0) as u64,
        fault: match number(5)? {
            0 => None,
            -1 => Some(Fault::Half),
            error => Some(Fault::Error(error as i32)),
        },
        path: path(6),
        to: if name == "rename" { path(7) } else { PathBuf::new() },
        link: Some(link).filter(|link| link.is_absolute()),
        name,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_are_operations() {
        let operation = parse("7\trename\t0\t0\t0\t0\t/a/.x\t/a/x\t/keep/1").unwrap();
        assert_eq!((operation.number, operation.name.as_str()), (7, "rename"));
        assert_eq!((operation.to, operation.link), ("/a/x".into(), Some("/keep/1".into())));
        let operation = parse("8\twrite\t12\t100\t50\t28\t/a/x\t").unwrap();
        assert_eq!((operation.inode, operation.offset, operation.length), (12, 100, 50));
        assert_eq!(operation.fault.and_then(Fault::reason).as_deref(), Some("No space left on device"));
        assert!(parse("8\twrite\t12\t100\t50\t-1\t/a/x\t").unwrap().fault.unwrap().reason().is_none());
        assert!(parse("8\twrite").is_none());
    }
}
