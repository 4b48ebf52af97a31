//! What the command prints: messages to standard error, results to standard output.

use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::thread;
use std::time::Duration;

use dmp_log::printable;
use serde::Serialize;

use super::terminal::Tone;

/// Results go out in pieces of at least so many bytes: their parts are a word each.
const HELD_BYTES: usize = 1 << 16;
/// Most characters of a message: names have up to 65,535 each.
const MOST_SAID: usize = 4000;
/// How long to wait before writing again to what is full.
const FULL_FOR: Duration = Duration::from_millis(5);
/// Text that logs of GitHub, Azure and `TeamCity` execute as commands anywhere in a line.
const COMMANDS: [&str; 3] = ["##[", "##vso[", "##teamcity["];

/// Prints a line to standard error, as `eprintln!` does, or passes it to the program that runs the command. It ignores errors:
/// scores do not depend on whether somebody reads the notes. Text from files cannot leave its line nor command a terminal or a CI
/// server.
macro_rules! say {
    ($host:expr, $($argument:tt)*) => { $host.line(format_args!($($argument)*)) };
}
pub(crate) use say;

/// Writes a line of results, as `writeln!` does. Text from files cannot leave it.
macro_rules! tell {
    ($out:expr, $($argument:tt)*) => { $crate::console::say::result($out, format_args!($($argument)*)) };
}
pub(crate) use tell;

/// A line on standard error of this process; see [`say!`].
pub(crate) fn line(text: fmt::Arguments<'_>) {
    command(&as_line(text));
}

/// A text as one line, shortened where it is very long.
pub(crate) fn as_line(text: fmt::Arguments<'_>) -> String {
    let said = without_commands(&printable(&text.to_string()));
    match said.char_indices().nth(MOST_SAID) {
        Some((end, _)) => format!("{}… ({} bytes)", &said[..end], said.len()),
        None => said,
    }
}

/// Prints a line that is to command a CI server.
pub(crate) fn command(text: &str) {
    let line = format!("{}\n", printable(text));
    // Where standard error is closed or full, nobody reads it.
    let _ = write_waiting(&mut io::stderr().lock(), line.as_bytes());
}

/// See [`tell!`].
pub(crate) fn result(out: &mut impl Write, text: fmt::Arguments<'_>) -> io::Result<()> {
    writeln!(out, "{}", printable(&text.to_string()))
}

/// Writes a result as JSON, and a line end.
pub(crate) fn json(out: &mut impl Write, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, value)?;
    writeln!(out)
}

/// Results cannot be written.
pub(crate) fn of_results(error: &io::Error) -> io::Error {
    io::Error::new(error.kind(), format!("standard output: cannot write: {error}"))
}

/// Results on their way out, in whole lines: of what is not printable, ends of lines and tabs pass, and tones where they are
/// seen; all else is written as JSON would, and so is the first character of what commands a CI server.
#[derive(Debug)]
pub(crate) struct Printed<W: Write> {
    out: W,
    held: Vec<u8>,
    /// Whether the reader sees colours.
    pub(crate) has_colour: bool,
}

impl<W: Write> Printed<W> {
    pub(crate) fn new(out: W) -> Self {
        Self { out, held: Vec::new(), has_colour: false }
    }

    /// What is not printable is written out, but for tones.
    fn show(&self, shown: &str, text: &mut String) {
        let mut rest = shown;
        while let Some(at) = rest.find('\x1b').filter(|_| self.has_colour) {
            let tone = Tone::command_at(&rest[at..]);
            text.push_str(&printable(&rest[..at]));
            let end = at + tone.unwrap_or(1);
            text.push_str(&if tone.is_some() { rest[at..end].into() } else { printable(&rest[at..end]) });
            rest = &rest[end..];
        }
        text.push_str(&printable(rest));
    }

    /// Writes what is held up to a byte. What cannot be written is lost.
    fn let_go(&mut self, end: usize) -> io::Result<()> {
        let rest = self.held.split_off(end);
        let bytes = std::mem::replace(&mut self.held, rest);
        let mut text = String::with_capacity(bytes.len());
        for line in String::from_utf8_lossy(&bytes).split_inclusive('\n') {
            for cell in without_commands(line).split_inclusive(['\n', '\t']) {
                let shown = cell.trim_end_matches(['\n', '\t']);
                self.show(shown, &mut text);
                text.push_str(&cell[shown.len()..]);
            }
        }
        write_waiting(&mut self.out, text.as_bytes()).map_err(|error| {
            self.held.clear();
            of_results(&error)
        })
    }
}

impl<W: Write> Write for Printed<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.held.extend_from_slice(bytes);
        if self.held.len() >= HELD_BYTES && bytes.contains(&b'\n') {
            let end = self.held.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
            self.let_go(end)?;
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.let_go(self.held.len())
    }
}

/// Whether something in it, wherever it stands in a line, commands a CI server.
pub(crate) fn commands_anywhere(text: &str) -> bool {
    COMMANDS.iter().any(|command| text.contains(command))
}

/// A line in which nothing is a command to a CI server: `::` at its beginning is none where it is written `\u003a:`.
fn without_commands(line: &str) -> String {
    let shown = line.trim_start();
    let blanks = &line[..line.len() - shown.len()];
    let mut text = match shown.strip_prefix("::") {
        Some(rest) => format!(r"{blanks}\u003a:{rest}"),
        None => line.to_owned(),
    };
    for command in COMMANDS {
        if text.contains(command) {
            text = text.replace(command, &format!(r"\u0023{}", &command[1..]));
        }
    }
    text
}

/// Writes all bytes, and waits where the other end is full.
fn write_waiting(out: &mut impl Write, mut bytes: &[u8]) -> io::Result<()> {
    while !bytes.is_empty() {
        match out.write(bytes) {
            Ok(0) => return Err(ErrorKind::WriteZero.into()),
            Ok(count) => bytes = &bytes[count..],
            Err(error) => wait_if_full(error)?,
        }
    }
    while let Err(error) = out.flush() {
        wait_if_full(error)?;
    }
    Ok(())
}

fn wait_if_full(error: io::Error) -> io::Result<()> {
    match error.kind() {
        ErrorKind::WouldBlock => thread::sleep(FULL_FOR),
        ErrorKind::Interrupted => {}
        _ => return Err(error),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn printed(text: &str) -> String {
        printed_in(text, false)
    }

    fn printed_in(text: &str, has_colour: bool) -> String {
        let mut out = Printed { has_colour, ..Printed::new(Vec::new()) };
        // In pieces, as tables and JSON come.
        text.chars().for_each(|c| write!(out, "{c}").unwrap());
        out.flush().unwrap();
        String::from_utf8(out.out).unwrap()
    }

    #[test]
    fn what_commands_a_terminal_is_written_out() {
        let text = "a\tµ – b\n\u{1b}[2J\u{9b}c\u{202e}\r\u{7f}é\u{e0041}\n\n\t";
        assert_eq!(printed(text), "a\tµ – b\n\\u001b[2J\\u009bc\\u202e\\u000d\\u007fé\\udb40\\udc41\n\n\t");
    }

    #[test]
    fn tones_pass_where_they_are_seen() {
        let text = "a \u{1b}[1mb\u{1b}[0m \u{1b}[2J\u{1b}\n";
        assert_eq!(printed_in(text, true), "a \u{1b}[1mb\u{1b}[0m \\u001b[2J\\u001b\n");
        assert_eq!(printed(text), "a \\u001b[1mb\\u001b[0m \\u001b[2J\\u001b\n");
    }

    #[test]
    fn what_commands_a_ci_server_is_written_out() {
        let text = "::a::b\n \u{3000}\t::c\n:: d\n##[e] ##vso[f] # ## ::\n#compdef\n";
        let expected =
            "\\u003a:a::b\n \u{3000}\t\\u003a:c\n\\u003a: d\n\\u0023#[e] \\u0023#vso[f] # ## ::\n#compdef\n";
        assert_eq!(printed(text), expected);
        assert_eq!(without_commands("a\\n::b"), "a\\n::b");
    }

    #[test]
    fn many_small_pieces_are_few_writes() {
        struct Counting(usize, usize);
        impl Write for Counting {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                self.0 += 1;
                self.1 += bytes.len();
                // Taken in part, and not at all now and then.
                if self.0.is_multiple_of(3) { Err(ErrorKind::WouldBlock.into()) } else { Ok(bytes.len()) }
            }

            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let mut out = Printed::new(Counting(0, 0));
        (0..100_000).for_each(|k| writeln!(out, "{k:>9}").unwrap());
        out.flush().unwrap();
        assert!(out.out.0 < 30, "{}", out.out.0);
    }
}
