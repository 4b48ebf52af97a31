//! What the command says: messages to standard error, results to standard output.

use std::fmt;
use std::io::{self, Write};

use dmp_log::{is_printable, printable};

/// Prints a line to standard error, as `eprintln!` does, and goes on where nobody listens: scores do not depend on whether
/// somebody reads the notes. Text from files cannot leave its line nor command a terminal.
macro_rules! say {
    ($($argument:tt)*) => { $crate::say::line(format_args!($($argument)*)) };
}
pub(crate) use say;

/// See [`say!`].
pub(crate) fn line(text: fmt::Arguments<'_>) {
    let text = text.to_string();
    // Where standard error is closed or full there is nobody to tell.
    let _ = writeln!(io::stderr().lock(), "{}", printable(&text));
}

/// Results on their way out: of what is not printable, ends of lines and tabs pass, all else is written as JSON would.
pub(crate) struct Printed<W>(pub(crate) W);

impl<W: Write> Write for Printed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        // Beginnings of all characters that are not printable.
        let doubtful = |&byte: &u8| {
            byte < 0x20 && !b"\n\t".contains(&byte) || [0x7f, 0xc2, 0xd8, 0xe2, 0xef].contains(&byte)
        };
        if !bytes.iter().any(doubtful) {
            return self.0.write(bytes);
        }
        let Ok(text) = std::str::from_utf8(bytes) else {
            return self.0.write(bytes);
        };
        let passes = |c: char| is_printable(c) || c == '\n' || c == '\t';
        for part in text.split_inclusive(|c| !passes(c)) {
            match part.chars().next_back().filter(|&c| !passes(c)) {
                Some(c) => {
                    self.0.write_all(&part.as_bytes()[..part.len() - c.len_utf8()])?;
                    self.0.write_all(printable(c.encode_utf8(&mut [0; 4])).as_bytes())?;
                }
                None => self.0.write_all(part.as_bytes())?,
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_commands_a_terminal_is_written_out() {
        let mut out = Printed(Vec::new());
        write!(out, "a\tµ – b\n\u{1b}[2J\u{9b}c\u{202e}\r\u{7f}é").unwrap();
        assert_eq!(String::from_utf8(out.0).unwrap(), "a\tµ – b\n\\u001b[2J\\u009bc\\u202e\\u000d\\u007fé");
    }
}
