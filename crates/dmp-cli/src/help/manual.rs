//! `dmp man`: manual pages, made from the definition that `--help` is made from.

use std::fs::File;
use std::io::{self, Read as _, Write};
use std::path::Path;

use clap::Command;
use clap_mangen::Man;
use clap_mangen::roff::{Roff, roman};

use dmp_draw::text::counted;

use super::after_help::{HelpBody, help_parts};
use crate::console::{Common, Exit, Usage, say};
use crate::files::{OutputsFolder, SavedTogether, refuse_unnamed};
use crate::options::{Asked, Out, Spec, tools};

/// What every page begins with.
const PAGE: &[u8] = b".TH \"dmp";

pub(crate) static SPEC: Spec = Spec {
    name: "man",
    about: "Print the manual page of a command, or write those of all",
    more: "Pages are in the format of man(7), which `man -l` shows; packages install them in share/man/man1.",
    after: "Examples:\n  \
            dmp man score | man -l -\n  \
            dmp man -o ~/.local/share/man/man1",
    options: &[&[&tools::COMMAND, &tools::PAGES]],
    run,
    ..Spec::EMPTY
};

fn run(asked: &Asked, common: &Common, out: &mut Out<'_>) -> anyhow::Result<Exit> {
    // Help on help is no page of its own.
    let mut root = asked.program().disable_help_subcommand(true);
    root.build();
    let Some(folder) = &asked.get(&tools::PAGES) else {
        page(find(&root, &asked.all(&tools::COMMAND))?, out)?;
        return Ok(Exit::Done);
    };
    let _made = OutputsFolder::make(folder)?;
    let mut left = vec![&root];
    let (mut files, mut pages) = (SavedTogether::default(), 0);
    while let Some(command) = left.pop() {
        let path = folder.join(Man::new(command.clone()).get_filename());
        if !is_page(&path) {
            refuse_unnamed(&path)?;
        }
        files.add(&path, |file| page(command, file))?;
        pages += 1;
        left.extend(command.get_subcommands().filter(|command| !command.is_hide_set()));
    }
    files.commit()?;
    if !common.quiet {
        say!(common.host, "{}: {}", folder.display(), counted(pages, "page"));
    }
    Ok(Exit::Done)
}

/// Whether there is a page of another version: that one is replaced.
fn is_page(path: &Path) -> bool {
    let mut start = [0; PAGE.len()];
    path.is_file()
        && File::open(path).is_ok_and(|mut file| file.read_exact(&mut start).is_ok())
        && start == *PAGE
}

/// The command of these words below `root`.
fn find<'a>(root: &'a Command, words: &[String]) -> Result<&'a Command, Usage> {
    let mut command = root;
    for word in words {
        command = command.find_subcommand(word).ok_or_else(|| {
            let name = command.get_bin_name().unwrap_or(command.get_name());
            let known: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            Usage(match known.as_slice() {
                [] => format!("`{name}` has no commands of its own, and so no `{word}`"),
                known => format!("`{name}` has no command `{word}`; it has {}", known.join(", ")),
            })
        })?;
    }
    Ok(command)
}

/// Writes the page of a command that was built.
fn page(command: &Command, out: &mut dyn Write) -> io::Result<()> {
    let version = command.get_version().unwrap_or_default();
    let name = command.get_display_name().unwrap_or(command.get_name());
    // No date: the page is the same whenever it is made. (`Man` drops an empty one, and the next argument takes its
    // place.)
    writeln!(out, ".TH \"{name}\" 1 \"\" \"dmp {version}\" \"dmp\"")?;
    let man = Man::new(command.clone());
    man.render_name_section(out)?;
    man.render_synopsis_section(out)?;
    man.render_description_section(out)?;
    if command.get_subcommands().any(|command| !command.is_hide_set()) {
        man.render_subcommands_section(out)?;
    }
    man.render_options_section(out)?;
    let mut rest = Roff::default();
    if let Some(after_help) = command.get_after_long_help().or(command.get_after_help()) {
        below_options(&mut rest, &after_help.to_string());
    }
    if name != "dmp" {
        rest.control("SH", ["SEE ALSO"]);
        rest.text([roman("dmp(1)")]);
    }
    rest.to_writer(out)
}

/// Examples as they are to be typed, exit codes where manuals have them.
fn below_options(roff: &mut Roff, after_help: &str) {
    for part in help_parts(after_help) {
        let title = match part.title {
            "" => "NOTES".to_owned(),
            "Example" => "EXAMPLES".to_owned(),
            "Exit codes" => "EXIT STATUS".to_owned(),
            title => title.to_uppercase(),
        };
        roff.control("SH", [title.as_str()]);
        match part.body {
            HelpBody::Text(text) => {
                roff.text([roman(text)]);
            }
            HelpBody::Lines(lines) => {
                roff.control("nf", []);
                for line in lines {
                    roff.text([roman(line)]);
                }
                roff.control("fi", []);
            }
        }
    }
}
