//! Pages that the site has besides `docs/`: the help of every command, and the index of all source files.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Command;

/// Their files in `docs/`, which only the table of contents may link to.
pub(super) const GENERATED: [&str; 2] = ["docs/cli.md", "docs/files.md"];

/// The text of each of [`GENERATED`].
pub(super) fn pages(root: &Path) -> anyhow::Result<[String; 2]> {
    Ok([commands(dmp_cli::command()), files(root)?])
}

/// A section for each command, with what `--help` prints in a terminal of 100 columns.
fn commands(command: Command) -> String {
    let mut command = command.disable_help_subcommand(true).term_width(100);
    command.build();
    let mut page = "# The command `dmp`\n".to_owned();
    add_command(&mut page, &mut command);
    page
}

fn add_command(page: &mut String, command: &mut Command) {
    let name = command.get_bin_name().unwrap_or(command.get_name()).to_owned();
    let _ = write!(
        page,
        "\n## `{name}`\n\n```text\n{}\n```\n",
        command.render_long_help().to_string().trim_end()
    );
    let shown = command.get_subcommands_mut().filter(|command| !command.is_hide_set());
    shown.for_each(|command| add_command(page, command));
}

/// A section for each crate, with the first sentence of each file.
fn files(root: &Path) -> anyhow::Result<String> {
    let mut crates = folders(&root.join("crates"))?;
    crates.extend(["python", "xtask", "tests"].map(|name| root.join(name)));
    let mut page = "# All source files\n\nThe first sentence of each file.\n".to_owned();
    for folder in crates {
        let within = folder.strip_prefix(root).unwrap_or(&folder);
        let _ = write!(page, "\n## {}\n\n", within.display());
        for file in source_files(&folder)? {
            let text = fs::read_to_string(&file).with_context(|| file.display().to_string())?;
            let name = file.strip_prefix(&folder).unwrap_or(&file);
            let _ = writeln!(page, "- `{}`: {}", name.display(), first_sentence(&text));
        }
    }
    Ok(page)
}

/// What is directly in a folder, sorted.
fn entries(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let listed = fs::read_dir(folder).with_context(|| format!("{}: cannot list", folder.display()))?;
    let mut paths = listed.map(|entry| Ok(entry?.path())).collect::<anyhow::Result<Vec<PathBuf>>>()?;
    paths.sort();
    Ok(paths)
}

fn folders(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    Ok(entries(folder)?.into_iter().filter(|path| path.join("Cargo.toml").is_file()).collect())
}

/// All `.rs` files below `src` and `tests`.
fn source_files(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut open = ["src", "tests"].map(|name| folder.join(name)).to_vec();
    let mut files = Vec::new();
    while let Some(folder) = open.pop() {
        for path in if folder.is_dir() { entries(&folder)? } else { Vec::new() } {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    files.sort();
    Ok(files)
}

/// The first sentence of the `//!` header of a file.
fn first_sentence(text: &str) -> String {
    let lines = text.lines().map_while(|line| line.strip_prefix("//! "));
    let header = lines.collect::<Vec<_>>().join(" ");
    header.split_once(". ").map_or(header.clone(), |(sentence, _)| format!("{sentence}."))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_command_that_is_shown_has_its_help() {
        let hidden = Command::new("unseen").hide(true);
        let build = Command::new("build").about("Build it").arg(clap::Arg::new("log").long("log"));
        let map = Command::new("map").about("Maps").subcommand(build);
        let page = commands(Command::new("t").subcommand(map).subcommand(hidden));
        let headings: Vec<&str> = page.lines().filter(|line| line.starts_with('#')).collect();
        assert_eq!(headings, ["# The command `dmp`", "## `t`", "## `t map`", "## `t map build`"]);
        assert!(page.contains("Build it\n\nUsage: t map build [OPTIONS]") && page.contains("--log <log>"));
        assert!(!page.contains("unseen"));
        assert!(commands(dmp_cli::command()).contains("\n## `dmp map build`\n"));
    }

    #[test]
    fn every_file_has_its_first_sentence() {
        for (text, expected) in [
            ("//! One. Two.\n", "One."),
            ("//! One `a.b`\n//! more. Two.\n", "One `a.b` more."),
            ("//! One: two\n//!\n//! Three. Four.\n", "One: two"),
            ("fn main() {}\n", ""),
        ] {
            assert_eq!(first_sentence(text), expected, "{text}");
        }
        let page = files(&crate::workspace::root()).unwrap();
        assert!(page.contains("\n## xtask\n\n- `src/"), "{page}");
        assert!(
            page.contains("- `src/site/generated.rs`: Pages that the site has besides `docs/`: the help")
        );
    }
}
