//! Where text for people is read: how wide its lines are, and whether it has colour.

use std::io::{self, Write};

use anstream::{AutoStream, ColorChoice};
use anstyle::{AnsiColor, Style};
use dmp_draw::text::wrapped;
use dmp_log::printable;
use terminal_size::terminal_size_of;

/// Columns of what is no terminal: the same wherever it goes.
const PIPED: usize = 80;
/// Narrower lines have no room for tables, wider ones are hard to read.
const WIDTHS: [usize; 2] = [40, 140];

/// Where text for people is read.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Terminal {
    pub(crate) width: usize,
    pub(crate) has_colour: bool,
}

impl Default for Terminal {
    fn default() -> Self {
        Self { width: PIPED, has_colour: false }
    }
}

/// What the colour of a text says. It never says more than the words do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Tone {
    /// What stands out.
    Strong,
    /// Better, passed.
    Good,
    /// Worse, failed.
    Bad,
    /// Open, or to be looked at.
    Open,
}

impl Tone {
    fn style(self) -> Style {
        match self {
            Self::Strong => Style::new().bold(),
            Self::Good => AnsiColor::Green.on_default(),
            Self::Bad => AnsiColor::Red.on_default(),
            Self::Open => AnsiColor::Yellow.on_default(),
        }
    }

    /// How much of a text, at its beginning, commands a terminal to begin a tone or to end it; nothing else is let through.
    pub(crate) fn command_at(text: &str) -> Option<usize> {
        const COMMANDS: [&str; 5] = ["\x1b[0m", "\x1b[1m", "\x1b[31m", "\x1b[32m", "\x1b[33m"];
        COMMANDS.iter().find(|&&command| text.starts_with(command)).map(|command| command.len())
    }
}

impl Terminal {
    /// Standard output of this process. `COLUMNS` overrides the terminal's own width; `NO_COLOR` and `CLICOLOR_FORCE` decide on
    /// colour before the terminal does.
    pub(crate) fn of_stdout() -> Self {
        let stdout = io::stdout();
        let has_colour = AutoStream::choice(&stdout) != ColorChoice::Never;
        let asked = std::env::var("COLUMNS")
            .ok()
            .and_then(|columns| columns.parse().ok())
            .filter(|&columns| columns > 0);
        let width = asked.or_else(|| terminal_size_of(stdout).map(|(width, _)| usize::from(width.0)));
        let [narrowest, widest] = WIDTHS;
        Self { width: width.unwrap_or(PIPED).clamp(narrowest, widest), has_colour }
    }

    /// A text without control characters, in a tone.
    pub(crate) fn painted(self, tone: Tone, text: &str) -> String {
        if !self.has_colour {
            return text.to_owned();
        }
        let style = tone.style();
        format!("{style}{text}{style:#}")
    }

    /// Writes a text in lines that fit, the first behind `lead`, the others as far to the right. Text from files cannot leave
    /// them.
    pub(crate) fn tell(self, out: &mut impl Write, lead: &str, text: &str) -> io::Result<()> {
        self.lines(lead, text).iter().try_for_each(|line| writeln!(out, "{line}"))
    }

    /// The same in a tone.
    pub(crate) fn tell_in(self, out: &mut impl Write, tone: Tone, text: &str) -> io::Result<()> {
        self.lines("", text).iter().try_for_each(|line| writeln!(out, "{}", self.painted(tone, line)))
    }

    /// The same behind a word in a tone.
    pub(crate) fn tell_item(
        self,
        out: &mut impl Write,
        (tone, word): (Tone, &str),
        text: &str,
    ) -> io::Result<()> {
        let lines = self.lines(&format!("  {word}  "), text);
        let begin = lines.first().map(|line| line.replacen(word, &self.painted(tone, word), 1));
        begin.iter().chain(lines.iter().skip(1)).try_for_each(|line| writeln!(out, "{line}"))
    }

    fn lines(self, lead: &str, text: &str) -> Vec<String> {
        wrapped(&printable(text), lead, self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_tone_is_let_through() {
        let terminal = Terminal { has_colour: true, ..Terminal::default() };
        for tone in [Tone::Strong, Tone::Good, Tone::Bad, Tone::Open] {
            let painted = terminal.painted(tone, "x");
            let begin = Tone::command_at(&painted).unwrap();
            assert_eq!(&painted[begin..=begin], "x");
            assert_eq!(Tone::command_at(&painted[begin + 1..]), Some(painted.len() - begin - 1));
            assert_eq!(Terminal::default().painted(tone, "x"), "x");
        }
        assert_eq!(Tone::command_at("\x1b[2J"), None);
        assert_eq!(Tone::command_at("\x1b[8m"), None);
    }

    #[test]
    fn lines_of_foreign_text_stay_lines() {
        let mut out = Vec::new();
        Terminal::default().tell(&mut out, "– ", &"a\x1b[0m\n".repeat(20)).unwrap();
        let text = String::from_utf8(out).unwrap();
        assert!(text.lines().count() > 2 && text.lines().all(|line| line.chars().count() <= 80), "{text}");
        assert!(!text.contains('\x1b'));
    }
}
