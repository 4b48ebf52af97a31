//! The page: a section for each command, its options by their headings.

use std::fmt::{self, Write as _};

use clap::{Arg, Command};
use dmp_cli::{HelpBody, help_parts};

use super::markdown::sentences;

/// What stands at the top.
const HEAD: &str = "\
<!-- Made by `cargo xtask cli-docs` from what `--help` is made from. Change the help, not this page. -->

# The command `dmp`

Results go to standard output, everything else to standard error. `dmp COMMAND --help` says what stands here;
`dmp man` writes it as manual pages, `dmp completions` as what a shell needs to complete it.
";

/// Columns of a terminal, should any text depend on them: the same wherever the page is made.
const WIDTH: usize = 100;

/// The whole page.
pub(super) fn page(command: Command) -> String {
    // Help on help is no section of its own.
    let mut root = command.disable_help_subcommand(true).term_width(WIDTH);
    root.build();
    let mut page = HEAD.to_owned();
    page.push('\n');
    // Writing to a string cannot fail.
    let _ = contents(&mut page, &root, 0).and_then(|()| whole(&mut page, &root));
    page
}

/// The name as it is typed, `dmp map build`.
fn name(command: &Command) -> &str {
    command.get_bin_name().unwrap_or(command.get_name())
}

fn shown(command: &Command) -> impl Iterator<Item = &Command> {
    command.get_subcommands().filter(|command| !command.is_hide_set())
}

/// A line for each command, with a link to its section.
fn contents(page: &mut String, command: &Command, depth: usize) -> fmt::Result {
    for command in shown(command) {
        let about = command.get_about().map(ToString::to_string).unwrap_or_default();
        let (name, indent) = (name(command), "  ".repeat(depth));
        writeln!(page, "{indent}- [`{name}`](#{}): {}", name.replace(' ', "-"), sentences(&about))?;
        contents(page, command, depth + 1)?;
    }
    Ok(())
}

/// What every command understands, then each command.
fn whole(page: &mut String, root: &Command) -> fmt::Result {
    writeln!(page, "\n## Every command\n")?;
    let common = root.get_arguments().filter(|option| is_common(option) && !option.is_hide_set());
    common.into_iter().try_for_each(|option| argument(page, option))?;
    below_options(page, root)?;
    shown(root).try_for_each(|command| section(page, command))
}

fn is_common(argument: &Arg) -> bool {
    argument.is_global_set() || ["help", "version"].contains(&argument.get_id().as_str())
}

/// The section of a command, and those of its own commands.
fn section(page: &mut String, command: &Command) -> fmt::Result {
    writeln!(page, "\n## {}", name(command))?;
    let about = command.get_long_about().or(command.get_about());
    if let Some(about) = about {
        writeln!(page, "\n{}", sentences(&about.to_string()))?;
    }
    if command.has_subcommands() {
        writeln!(page)?;
        for command in shown(command) {
            let name = name(command);
            writeln!(page, "- [`{name}`](#{})", name.replace(' ', "-"))?;
        }
        return shown(command).try_for_each(|command| section(page, command));
    }
    let usage = command.clone().render_usage().to_string();
    let usage = usage.strip_prefix("Usage:").unwrap_or(&usage).lines().map(str::trim).collect::<Vec<_>>();
    writeln!(page, "\n```text\n{}\n```", usage.join("\n"))?;
    let own: Vec<&Arg> =
        command.get_arguments().filter(|argument| !argument.is_hide_set() && !is_common(argument)).collect();
    for heading in headings(&own) {
        let of_heading = own.iter().filter(|argument| heading_of(argument) == heading);
        writeln!(page, "\n**{heading}**\n")?;
        of_heading.into_iter().try_for_each(|of_heading| argument(page, of_heading))?;
    }
    below_options(page, command)
}

/// Where an argument stands in the help.
fn heading_of(argument: &Arg) -> &str {
    match argument.get_help_heading() {
        Some(heading) => heading,
        None if argument.is_positional() => "Arguments",
        None => "Options",
    }
}

/// The headings in the order of `--help`: arguments, options, then as they come.
fn headings<'a>(arguments: &[&'a Arg]) -> Vec<&'a str> {
    let mut headings: Vec<&str> = Vec::new();
    for argument in arguments {
        let heading = heading_of(argument);
        if !headings.contains(&heading) {
            headings.push(heading);
        }
    }
    headings.sort_by_key(|&heading| match heading {
        "Arguments" => 0,
        "Options" => 1,
        _ => 2,
    });
    headings
}

/// An item for an argument or an option: how it is written, what it does, what it may be.
fn argument(page: &mut String, argument: &Arg) -> fmt::Result {
    let short = argument.get_short().map_or(String::new(), |short| format!("-{short}, "));
    // As in `--help`: with its value, the brackets say what may be left out.
    let help = argument.get_long_help().or(argument.get_help()).map(ToString::to_string).unwrap_or_default();
    let help = help.replace('\n', " ");
    // A default that is no value stands in the words.
    let (help, default) = match help.strip_suffix(']').and_then(|help| help.rsplit_once(" [default: ")) {
        Some((help, default)) => (help, Some(format!("Default: {}.", sentences(default)))),
        None => (help.as_str(), None),
    };
    let mut told = vec![sentences(help)];
    if let Some(last) = told.last_mut().filter(|help| !help.is_empty() && !help.ends_with('.')) {
        last.push('.');
    }
    told.extend(default);
    let defaults = argument.get_default_values();
    if !argument.is_hide_default_value_set() && argument.get_action().takes_values() && !defaults.is_empty() {
        let values: Vec<String> = defaults.iter().map(|value| format!("`{}`", value.display())).collect();
        told.push(format!("Default: {}.", values.join(", ")));
    }
    let values = argument.get_possible_values();
    let values = values.iter().filter(|value| !value.is_hide_set() && argument.get_action().takes_values());
    let (explained, plain): (Vec<_>, Vec<_>) = values.partition(|value| value.get_help().is_some());
    if !plain.is_empty() {
        let names: Vec<String> = plain.iter().map(|value| format!("`{}`", value.get_name())).collect();
        told.push(format!("One of {}.", names.join(", ")));
    }
    told.retain(|sentence| !sentence.is_empty());
    writeln!(page, "- `{short}{argument}`\\\n  {}", told.join(" "))?;
    for value in explained {
        let help = value.get_help().map(ToString::to_string).unwrap_or_default();
        writeln!(page, "  - `{}`: {}", value.get_name(), sentences(&help))?;
    }
    Ok(())
}

/// Examples and exit codes.
fn below_options(page: &mut String, command: &Command) -> fmt::Result {
    let after_help = command.get_after_long_help().or(command.get_after_help()).map(ToString::to_string).unwrap_or_default();
    for part in help_parts(&after_help).iter().filter(|_| !after_help.is_empty()) {
        if !part.title.is_empty() {
            writeln!(page, "\n**{}**", part.title)?;
        }
        match &part.body {
            HelpBody::Lines(lines) => writeln!(page, "\n```sh\n{}\n```", lines.join("\n"))?,
            HelpBody::Text(text) => writeln!(page, "\n{}", sentences(text))?,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::builder::PossibleValue;
    use clap::{ArgAction, value_parser};

    /// A command with one of everything.
    fn command() -> Command {
        let kinds = [PossibleValue::new("a").help("The *first*"), PossibleValue::new("b").hide(true)];
        let build = Command::new("build")
            .about("Build it")
            .long_about("Build it\n\nFrom <this>.")
            .arg(Arg::new("log").value_name("LOG").required(true).help("The log"))
            .arg(
                Arg::new("size")
                    .short('s')
                    .long("size")
                    .value_name("M")
                    .default_value("auto")
                    .help("Size, of --kind"),
            )
            .arg(Arg::new("kind").long("kind").value_parser(kinds).help("Which").help_heading("Output"))
            .arg(Arg::new("n").long("n").value_parser(["1", "2"]).default_value("1").hide_default_value(true))
            .arg(
                Arg::new("pair")
                    .long("pair")
                    .value_name("A,B")
                    .num_args(0..=1)
                    .require_equals(true)
                    .help("Two."),
            )
            .arg(
                Arg::new("none")
                    .long("none")
                    .action(ArgAction::SetTrue)
                    .help("Not\nany [default: all, or `b`]"),
            )
            .arg(Arg::new("hidden").long("hidden").hide(true).value_parser(value_parser!(u8)))
            .after_help("Examples:\n  t map build x\n\nExit codes: 0 done");
        let map = Command::new("map").about("Maps").subcommand_required(true).subcommand(build);
        let quiet = Arg::new("quiet").long("quiet").global(true).action(ArgAction::SetTrue).help("Less");
        let unseen = Command::new("unseen").hide(true);
        Command::new("t")
            .version("1")
            .arg(quiet)
            .subcommand(map)
            .subcommand(unseen)
            .after_help("Exit codes: 0")
    }

    #[test]
    fn a_page_has_everything_that_help_has() {
        let expected = "
- [`t map`](#t-map): Maps
  - [`t map build`](#t-map-build): Build it

## Every command

- `--quiet`\\
  Less.
- `-h, --help`\\
  Print help.
- `-V, --version`\\
  Print version.

**Exit codes**

0

## t map

Maps

- [`t map build`](#t-map-build)

## t map build

Build it

From \\<this\\>.

```text
t map build [OPTIONS] <LOG>
```

**Arguments**

- `<LOG>`\\
  The log.

**Options**

- `-s, --size <M>`\\
  Size, of `--kind`. Default: `auto`.
- `--n <n>`\\
  One of `1`, `2`.
- `--pair[=<A,B>]`\\
  Two.
- `--none`\\
  Not any. Default: all, or `b`.

**Output**

- `--kind <kind>`\\
  Which.
  - `a`: The \\*first\\*

**Examples**

```sh
t map build x
```

**Exit codes**

0 done
";
        assert_eq!(page(command()), format!("{HEAD}{expected}"));
    }

    #[test]
    fn every_option_and_command_of_dmp_is_on_the_page() {
        fn look(page: &str, command: &Command) {
            let shown = command.get_arguments().filter(|argument| !argument.is_hide_set());
            for argument in shown.filter_map(Arg::get_long) {
                assert!(page.contains(&format!("--{argument}")), "{argument} of {}", name(command));
            }
            for command in command.get_subcommands().filter(|command| command.get_name() != "help") {
                assert!(page.contains(&format!("\n## {}\n", name(command))), "{}", name(command));
                look(page, command);
            }
        }
        let mut root = dmp_cli::command();
        root.build();
        let page = page(dmp_cli::command());
        look(&page, &root);
        assert!(page.len() > 10_000, "{page}");
    }
}
