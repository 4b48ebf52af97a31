//! Files of the user's that are read.

use std::fs::File;
use std::io;
use std::path::Path;

/// Opens a file that is read more than once, or not from its start to its end.
///
/// # Errors
/// When it cannot be opened, and where it is a pipe: opening one may block for ever, and a pipe cannot be read twice.
pub fn open_input(path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    if std::os::unix::fs::FileTypeExt::is_fifo(&std::fs::metadata(path)?.file_type()) {
        let problem = "it is a pipe, which can be read only once: save what comes out of it to a file first";
        return Err(io::Error::new(io::ErrorKind::Unsupported, problem));
    }
    File::open(path)
}
